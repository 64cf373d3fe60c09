"""A simulated robot under minimum torque: its log says so, in motion and not at rest."""

import numpy as np
import pytest

from copsense.logs import compare_log, read_log


@pytest.fixture(scope="module")
def found(sway_file, icub):
    return compare_log(read_log(sway_file), icub, skip=0.4)


def test_load_moves_as_minimum_torque_says_in_motion(found):
    load = {source: slope.value for source, slope in found.slopes["load"].items()}
    assert load["measured"] == pytest.approx(load["minimum-torque, in motion"], rel=0.02)
    assert load["minimum-torque, at rest"] < 0.4 * load["measured"]
    assert load["minimum-wrench, in motion"] < 0.1 * load["measured"]


def test_cops_and_torques_lie_on_minimum_torque_in_motion(found):
    errors = {s.name: found.errors(s) for s in found.statics}
    best = errors.pop("minimum-torque, in motion")
    assert best["cop"] < 0.3e-3
    assert best["torque"] < 0.1
    for other in errors.values():
        assert other["cop"] > 10 * best["cop"]
        assert other["torque"] > 3 * best["torque"]


def test_base_from_the_feet_is_the_true_one(found, sway_file, icub):
    recorded = compare_log(read_log(sway_file), icub, skip=0.4, base="recorded", postures=50)
    row = [np.flatnonzero(np.isclose(found.times, t))[0] for t in recorded.times]
    # Both worlds differ by where they begin.
    own, true = found.com[row] - found.com[row[0]], recorded.com - recorded.com[0]
    np.testing.assert_allclose(own, true, atol=2e-4)


def test_nothing_is_found_wrong(found):
    assert found.findings == ()


def test_figure_and_words(found):
    figure = found.plot()
    assert len(figure.axes) == 4
    assert "minimum-torque, in motion" in str(found)
    answer = found.to_dict()
    assert answer["sway"]["frequency"] == pytest.approx(1.0, abs=0.01)
