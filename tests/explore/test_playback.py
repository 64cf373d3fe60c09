"""Recordings, sweeps, logs and postures play: each row with its numbers, at rest and in motion."""

from dataclasses import replace

import numpy as np
import pytest
from support import log_files
from support.results import small_log

import copsense
from copsense.controllers.target import Sine
from copsense.errors import InvalidInputError
from copsense.explore import State
from copsense.explore.export import least_margins, played_views
from copsense.explore.playback import frame_rows, load_run, recording_run, sweep_run
from copsense.explore.played_model import PlayedModel
from copsense.logs import compare_log
from copsense.logs.aligned_log import align_log
from copsense.posture_run import PostureRun
from copsense.simulation import Recording, Scenario

STATE = State(("icub",))


@pytest.fixture(scope="module")
def recording(icub):
    """A sway that is too fast for statics."""
    scenario = Scenario(0.8, reference=Sine(0.01, 1.0), control_period=4e-3)
    return copsense.balance(icub, copsense.minimum_torque(), scenario)


@pytest.fixture(scope="module")
def file(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run.nc"
    recording.save(path)
    return path


@pytest.fixture(scope="module")
def swept(stance_of, tmp_path_factory):
    path = tmp_path_factory.mktemp("sweeps") / "sweep.nc"
    stance = stance_of("four_bar")
    far = copsense.lateral_sweep(stance, -0.02, 3.0, 4)  # the last ones are out of reach
    copsense.sweep(far, [copsense.minimum_torque()]).save(path)
    return path


def test_a_row_of_a_recording_has_the_numbers_of_its_posture(icub, file, recording):
    run = load_run(file, icub)
    model = PlayedModel(run, ["icub"])
    model.row = len(run) - 1
    view = model.view(STATE, 3)
    assert view.row == model.row
    np.testing.assert_array_equal(view.q, recording["configuration"].values[-1])
    for k, place in enumerate(icub.at(view.q).placements):
        own = place.actInv(view.measured[k])
        np.testing.assert_allclose(own[:2], recording["cop"].values[-1, k], atol=1e-12)
    command, python = model.code(view.state)
    assert command == f"# row {len(run) - 1} of {file}"
    found = {}
    exec(python.replace("print(analysis)", ""), found)
    for said in view.criteria:
        told = found["analysis"].sensitivities[said.name]
        np.testing.assert_allclose(said.cop, told.cop, rtol=0, atol=1e-9)


def test_in_motion_a_criterion_says_what_was_measured_where_at_rest_it_does_not(icub, recording):
    """Physics holds the prediction with inertia against the controller of the same criterion."""
    run = recording_run(recording, icub)
    model = PlayedModel(run)
    rows = [r for r in range(0, len(run), 10) if 0.25 < run.values[r] < 0.7]
    views = played_views(model, STATE, rows)
    torque = [view["minimum-torque"] for view in views]
    measured = np.array([view.measured for view in views])
    moving = np.array([each.moving_cop_world for each in torque])
    still = np.array([each.cop_world for each in torque])
    off, off_at_rest = (np.abs(found - measured)[..., 1].max() for found in (moving, still))
    assert off < 1.5e-3
    assert off_at_rest > 5 * off
    margins = least_margins(run, views)
    assert list(margins) == [
        *(f"minimum-wrench, {how}" for how in ("at rest", "in motion")),
        *(f"minimum-torque, {how}" for how in ("at rest", "in motion")),
        "measured",
    ]
    assert margins["minimum-torque, in motion"][0] == pytest.approx(margins["measured"][0], abs=off)
    lines = views[0].motion_lines
    assert [line.partition(":")[0] for line in lines] == [
        "minimum-wrench, in motion",
        "minimum-torque, in motion",
        "measured",
    ]


def test_after_a_tip_nothing_is_said_of_the_motion(icub, recording):
    words = {"tip_kind": "tip", "tip_contact": "l_sole", "tip_reason": "it tips", "tip_time": 0.4}
    run = recording_run(recording.with_attributes(**words), icub)
    assert run.moving(int(np.searchsorted(run.values, 0.3))) is not None
    assert run.moving(int(np.searchsorted(run.values, 0.5))) is None
    short = Recording(recording.to_xarray().isel(time=slice(0, 4)))
    assert recording_run(short, icub).velocities is None


def test_a_log_plays_with_the_numbers_of_its_comparison(icub):
    log = small_log(icub)
    comparison = compare_log(log, icub, [copsense.minimum_torque()], skip=0.0)
    run = align_log(log, icub).run(log)
    np.testing.assert_array_equal(run.configurations, comparison.run.configurations)
    model = PlayedModel(comparison.run, criteria=[copsense.minimum_torque()])
    rest, motion = (comparison.of("minimum-torque", inertia=i) for i in (False, True))
    for m in (0, 7, len(run) - 1):
        (view,) = played_views(model, STATE, [m])
        (said,) = view.criteria
        np.testing.assert_allclose(said.cop, rest.cops[m], rtol=0, atol=1e-9)
        np.testing.assert_allclose(said.moving_cop, motion.cops[m], rtol=0, atol=1e-9)
        np.testing.assert_allclose(said.wrenches, rest.wrenches[m], rtol=0, atol=1e-7)


def test_a_file_of_a_log_plays(icub, recording, tmp_path):
    log_files.write_csv(tmp_path / "run.csv", log_files.of_recording(recording))
    run = load_run(tmp_path / "run.csv", icub)
    assert run.axis == "time"
    assert run.source == str(tmp_path / "run.csv")
    assert run.measured is not None
    found = {}
    exec(PlayedModel(run, ["icub"]).code(STATE)[1].replace("print(analysis)", ""), found)
    np.testing.assert_array_equal(found["run"].configurations, run.configurations)


def test_postures_of_ones_own_play(icub):
    path = copsense.lateral_sweep(icub, -0.02, 0.02, 3)
    run = PostureRun.of_stances(path.stances, path.values, "com_y", "m", "my search")
    model = PlayedModel(run)
    views = played_views(model, STATE, [0, 2, 0])
    np.testing.assert_array_equal(views[1].q, path.stances[2].q)
    assert views[2] is views[0]
    assert views[0]["minimum-torque"].moving_cop is None
    assert views[0].motion_lines == ()
    assert model.code(STATE)[0] == "# row 0 of my search"
    assert "PostureRun of yours" in model.code(STATE)[1]


@pytest.mark.parametrize(
    ("stances", "values", "said"),
    [
        ([], None, "at least one"),
        (["icub", "four_bar"], None, "differ in their robot"),
        (["icub", "icub"], [1.0], "the values of a run has shape"),
    ],
)
def test_what_is_no_run_is_said(stance_of, stances, values, said):
    with pytest.raises(InvalidInputError, match=said):
        PostureRun.of_stances([stance_of(name) for name in stances], values)


def test_margins_are_drawn_over_time(icub, file):
    model = PlayedModel(load_run(file, icub), ["icub"])
    state = replace(STATE, overlays=frozenset({"curve"}))
    view = model.add_curve(model.view(state))
    assert view.curve_y[0] == model.run.values[0]
    now = [each.margin.min() for each in view.criteria]
    np.testing.assert_allclose(view.curve_margin[:, 0], now, atol=1e-9)


def test_a_sweep_plays_without_the_postures_that_it_did_not_reach(stance_of, swept):
    run = load_run(swept, stance_of("four_bar"))
    assert run.axis == "com_y"
    assert run.measured is None
    assert len(run) < 4
    assert len(run.rows) == len(run)
    rows, seconds = frame_rows(run)
    assert (rows[0], rows[-1]) == (0, len(run) - 1)
    assert seconds * (len(rows) - 1) == pytest.approx(5.0)


def test_a_recording_goes_at_its_own_speed(icub, file):
    run = load_run(file, icub)
    rows, seconds = frame_rows(run)
    assert seconds * (len(rows) - 1) == pytest.approx(np.ptp(run.values))
    assert seconds <= 1 / 25


def test_a_file_of_another_robot_or_of_none_is_rejected(icub, swept, tmp_path):
    with pytest.raises(InvalidInputError, match="of another stance: its robot is 'four_bar'"):
        load_run(swept, icub)
    with pytest.raises(InvalidInputError, match="missing"):
        load_run(tmp_path / "missing.nc", icub)
    for name in ("missing.csv", "\0", "x" * 400):
        with pytest.raises(InvalidInputError, match=r"no file at .* a sweep .* own log"):
            load_run(name, icub)
    with pytest.raises(InvalidInputError, match="a mapping is of a robot's log"):
        load_run(swept, icub, "map.toml")
    sweep = copsense.Sweep.load(swept)
    with pytest.raises(InvalidInputError, match="the sweep is of another stance"):
        sweep_run(sweep, icub)
