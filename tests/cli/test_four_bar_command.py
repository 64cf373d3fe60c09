"""``copsense four-bar`` answers."""

import numpy as np
import pytest
from support.commands import copsense


@pytest.mark.parametrize(
    "criterion", ["minimum-wrench", "minimum-torque", "weighted-torque", "minimum-tangential"]
)
def test_four_bar_answers_in_json(criterion):
    answer = copsense("four-bar", "--xi", "1.5rad", "--criterion", criterion, "--json").json
    assert list(answer["wrenches"]) == list(answer["sensitivity"]) == ["left", "right"]
    assert list(answer["torques"]) == ["hipL", "ankleL", "hipR", "ankleR"]
    assert list(answer["cop"]) == ["left", "right"]
    assert len(answer["com"]) == 2
    fx, fy, _ = np.sum([answer["wrenches"]["left"], answer["wrenches"]["right"]], axis=0)
    assert fx == pytest.approx(0.0, abs=1e-9)
    assert fy == pytest.approx(33 * 9.81)
