"""A simulated robot under minimum torque: its log says so, in motion and not at rest."""

import numpy as np
import pytest
from support.commands import copsense as command

from copsense.logs import compare_log, read_log
from copsense.logs.log_motion import stand_on_feet


@pytest.fixture(scope="module")
def found(sway_file, icub):
    return compare_log(read_log(sway_file), icub, skip=0.4, postures=200)


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


def test_base_on_points_alone(stance_of):
    """Solo stands on four points: joints alone give back how it stood, to where and which way."""
    solo = stance_of("solo12")
    q = np.tile(solo.q, (3, 1))
    q[:, :7] = (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)
    found = solo.at(stand_on_feet(solo.robot, solo.contacts, q)[1])
    np.testing.assert_allclose(found.com[2], solo.com[2], atol=1e-9)
    assert np.ptp([p.translation[2] for p in found.placements]) < 1e-9


def test_the_command_draws_and_writes_its_mapping(sway_file, tmp_path):
    options = ("--robot", "icub", "--postures", 40, "--skip", "0.4s")
    picture, mapping = tmp_path / "log.png", tmp_path / "map.toml"
    done = command("log", sway_file, *options, "--plot", picture, "--save-map", mapping)
    assert done.code == 0, done.err
    assert "minimum-torque, in motion" in done.out
    assert picture.stat().st_size > 10_000
    again = command("log", sway_file, *options, "--map", mapping, "--json").json
    first = command("log", sway_file, *options, "--json").json
    assert again["slopes"] == first["slopes"]


def test_nothing_is_found_wrong(found):
    assert found.findings == ()


def test_words_and_data(found):
    assert "minimum-torque, in motion" in str(found)
    answer = found.to_dict()
    assert answer["sway"]["frequency"] == pytest.approx(1.0, abs=0.01)
