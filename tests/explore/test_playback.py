"""A recording or a sweep plays: each row with the numbers of its posture, and what was measured."""

import numpy as np
import pytest

import copsense
from copsense.errors import InvalidInputError
from copsense.explore import State
from copsense.explore.playback import Playback, PlayedModel, frame_rows
from copsense.simulation import Scenario


@pytest.fixture(scope="module")
def run(icub, tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run.nc"
    copsense.balance(icub, copsense.minimum_torque(), Scenario(0.05)).save(path)
    return path


@pytest.fixture(scope="module")
def swept(stance_of, tmp_path_factory):
    path = tmp_path_factory.mktemp("sweeps") / "sweep.nc"
    stance = stance_of("four_bar")
    far = copsense.lateral_sweep(stance, -0.02, 3.0, 4)  # the last ones are out of reach
    copsense.sweep(far, [copsense.minimum_torque()]).save(path)
    return path


def test_a_row_of_a_recording_has_the_numbers_of_its_posture(icub, run):
    playback = Playback.load(run, icub)
    model = PlayedModel(icub, playback, ["icub"])
    model.row = len(playback) - 1
    view = model.view(State(("icub",)), 3)
    assert view.row == model.row
    np.testing.assert_array_equal(view.q, playback.configurations[-1])
    measured = model.measured(model.row)
    assert measured.shape == (2, 3)
    cop = playback.measured[-1][0]
    here = icub.at(playback.configurations[-1]).placements[0]
    np.testing.assert_allclose(here.actInv(measured[0])[:2], cop, atol=1e-12)
    command, python = model.code(view.state)
    assert command == f"# row {len(playback) - 1} of {run}"
    found = {}
    exec(python.replace("print(analysis)", ""), found)
    for said in view.criteria:
        told = found["analysis"].sensitivities[said.name]
        np.testing.assert_allclose(said.cop, told.cop, rtol=0, atol=1e-9)


def test_margins_are_drawn_over_time(icub, run):
    model = PlayedModel(icub, Playback.load(run, icub), ["icub"])
    state = State(("icub",), overlays=frozenset({"curve"}))
    view = model.add_curve(model.view(state))
    assert view.curve_y[0] == model.playback.values[0]
    now = [each.margin.min() for each in view.criteria]
    np.testing.assert_allclose(view.curve_margin[:, 0], now, atol=1e-9)


def test_a_sweep_plays_without_the_postures_that_it_did_not_reach(stance_of, swept):
    playback = Playback.load(swept, stance_of("four_bar"))
    assert playback.axis == "com_y"
    assert playback.measured is None
    assert len(playback) < 4
    assert len(playback.rows) == len(playback)
    rows, seconds = frame_rows(playback)
    assert (rows[0], rows[-1]) == (0, len(playback) - 1)
    assert seconds * (len(rows) - 1) == pytest.approx(5.0)


def test_a_recording_goes_at_its_own_speed(icub, run):
    playback = Playback.load(run, icub)
    rows, seconds = frame_rows(playback)
    assert seconds * (len(rows) - 1) == pytest.approx(np.ptp(playback.values))
    assert seconds <= 1 / 25


def test_a_file_of_another_robot_or_of_none_is_rejected(icub, swept, tmp_path):
    with pytest.raises(InvalidInputError, match="of another stance: its robot is 'four_bar'"):
        Playback.load(swept, icub)
    with pytest.raises(InvalidInputError, match="missing"):
        Playback.load(tmp_path / "missing.nc", icub)
