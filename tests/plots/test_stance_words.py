"""What a picture of a stance says of its contacts can be read."""

from itertools import combinations

import copsense


def test_words_of_point_feet_near_each_other_do_not_meet():
    stance = copsense.load_stance("solo12")
    narrow = {
        f"{side}_FOOT:y": 0.07 if side[1] == "L" else -0.07 for side in ("FL", "FR", "HL", "HR")
    }
    figure = copsense.analyse(stance, at=narrow).plot()
    figure.canvas.draw()
    drawn = [[t for t in ax.texts if "of the weight" in t.get_text()] for ax in figure.axes]
    assert sorted(map(len, drawn))[-2:] == [4, 4]  # of each criterion
    for words in drawn:
        boxes = [t.get_window_extent() for t in words]
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
