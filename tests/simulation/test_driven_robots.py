"""Rods, couplings, springs, transmissions and loads in closed loop: as the statics say."""

import mujoco
import numpy as np
import pytest
from controllers.test_driven_controller import CASES
from statics.test_driven_statics import LOADS, rods
from support.driven_robots import everything, hand_in_hand, rod_biped_model, rod_drives, standing

import copsense
from copsense import Load, Robot, Stance
from copsense.closures import Closures
from copsense.controllers import BalancingController, Ramp, Sine
from copsense.errors import EngineMismatchError, InvalidInputError
from copsense.path import lateral_posture
from copsense.plots import plot_rollout, render_figure
from copsense.simulation import (
    ModelError,
    MujocoSimulator,
    PhysicsSettings,
    Push,
    Recording,
    Scenario,
    balance,
    mujoco_drives,
    rollout,
)
from copsense.simulation.mujoco_model import build_model
from copsense.simulation.quasi_static import quasi_static
from copsense.sway_levers import sway_levers

C1, C2 = copsense.minimum_wrench(0.5), copsense.minimum_torque()
# Of the weight, in N and Nm: what a contact's normal force may be off after 0.12 s, while the soles
# still settle by micrometres. The undriven robots of `test_at_rest` are as far off.
SETTLED = 1e-3
CLOSED = 2e-6  # m, rad: how far loops are open, soft as the engine has them


AT_REST = ["pinned rods", "five bars", "sprung ankles", "all at once", "hand in hand"]


@pytest.mark.parametrize("name", AT_REST)
def test_at_rest_forces_and_torques_are_the_statics(name):
    stance = hand_in_hand() if name == "hand in hand" else CASES[name]()
    static = copsense.solve_equilibrium(stance, C2)
    recording = rollout(MujocoSimulator(stance), BalancingController(stance, C2), Scenario(0.12))
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    last, weight = recording.isel(time=-1), stance.robot.weight
    assert np.abs(last["wrench"].values - static.wrenches).max() < SETTLED * weight
    assert np.abs(last["torque"].values - static.torques).max() < SETTLED * weight
    assert np.abs(last["com"].values - stance.com)[:2].max() < 2e-5
    if stance.closures is not None:
        assert np.abs(Closures(stance.robot, last["configuration"].values).error).max() < CLOSED


def test_what_is_left_is_the_softness_of_the_engines_constraints():
    """A hundred times stiffer, a hundred times less acceleration under the statics' torques."""
    stance = CASES["five bars"]()
    found, left = copsense.solve_equilibrium(stance, C2), []
    for softness in (1.0, 1e-2, 1e-4):
        simulator = MujocoSimulator(stance)
        model, data = simulator._model, simulator._data
        model.body_invweight0[:] *= softness
        model.dof_invweight0[:] *= softness
        model.pair_solref[:, 0] = 100.0  # balls that start pressed in by 1 um are let in peace
        model.opt.tolerance = 0.0
        data.qfrc_applied[simulator._joints] = simulator._drive.on_joints(found.torques)
        mujoco.mj_forward(model, data)
        left.append(float(np.abs(data.qacc[6:]).max()))
    # docs/balancing.md names them.
    assert left == pytest.approx([163.0, 1.8, 0.022], rel=0.05)


def test_a_sway_is_followed_and_its_torques_are_named_by_their_motors(tmp_path):
    stance = CASES["all at once"]()
    recording = balance(stance, C2, Scenario(0.3, Sine(0.003, 1.0)))
    assert recording.completed
    assert recording.tip is None
    assert recording.tracking_peak < 2e-4
    assert recording["torque"].dims == ("time", "motor")
    assert tuple(recording.labels("motor")) == stance.robot.torque_names
    assert tuple(recording.labels("joint")) == stance.robot.joint_names
    recording.save(tmp_path / "sway.nc")
    again = Recording.load(tmp_path / "sway.nc")
    assert again.torque_norm == recording.torque_norm > 0
    assert render_figure(plot_rollout(again), ".png")


def test_a_joint_that_hangs_is_brought_to_rest_by_the_motors_that_reach_it():
    stance = CASES["all at once"]()
    pushed = Scenario(0.5, pushes=(Push((1.0, 0.0, 0.0), 0.05, 0.05, "hand"),))
    recording = rollout(MujocoSimulator(stance), BalancingController(stance, C2), pushed)
    assert recording.completed
    speed = np.abs(recording["joint_velocity"].sel(joint="forearm"))
    soon, later = (float(speed.sel(time=slice(a, a + 0.2)).max()) for a in (0.1, 0.3))
    assert later < 0.7 * soon  # undamped it keeps 99 % of it


def test_a_slow_lean_tips_where_the_statics_say():
    robot = Robot.from_model(rod_biped_model(), drives=rod_drives())
    loads = [Load("hand", (0.0, 3.0, -15.0), name="bag"), LOADS[2]]
    stance = standing(robot, 0.005).with_loads(loads)
    recording = balance(stance, C2, Scenario(2.2, Ramp(0.03, 0.015)), until="tip")
    predicted = float(recording.attrs["static_excursion"])
    assert 0.005 < predicted < 0.03
    assert recording.attrs["static_contact"] == recording.tip.contact
    assert abs(recording.tip_travel - predicted) < 1.5e-3


BROKEN = {
    "springs": ("springs", lambda model: model.jnt_stiffness.__imul__(1.001)),
    "loads": ("loads", lambda model: model.site_pos.__iadd__(1e-5)),
    "loops and couplings": ("loops", lambda model: model.eq_data.__imul__(1.001)),
}


@pytest.mark.parametrize("what", BROKEN)
def test_an_engine_that_differs_is_rejected_before_the_run(what, monkeypatch):
    stance = standing(everything(), 0.01)
    stance = copsense.solve_posture(
        stance.with_loads(LOADS), com=(stance.com[0], 0.01, None)
    ).stance

    def build(*arguments, **options):
        model = build_model(*arguments, **options)
        BROKEN[what][1](model)
        return model

    MujocoSimulator(stance)
    monkeypatch.setattr("copsense.simulation.mujoco_simulator.build_model", build)
    with pytest.raises(EngineMismatchError, match=what):
        MujocoSimulator(stance)


def test_sensors_are_rejected_where_a_rod_pulls_at_the_foot_itself():
    MujocoSimulator(rods("pin"), wrenches="sensors")
    stance = rods("pin").with_loads([Load("l_foot", (0.0, 0.0, -5.0))])
    with pytest.raises(InvalidInputError, match="'l_foot' beside the ground"):
        MujocoSimulator(stance, wrenches="sensors")


def test_a_robot_that_differs_from_its_model_keeps_drives_and_loads():
    stance = CASES["all at once"]()
    other = ModelError(0.05, {"hand": 0.2}).applied(stance)
    assert other.loads == stance.loads
    assert other.robot.torque_names == stance.robot.torque_names
    assert MujocoSimulator(stance, PhysicsSettings()).altered(other).stance is other


def test_a_rope_pulls_where_the_hand_has_gone():
    stance = CASES["loads"]()
    simulator = MujocoSimulator(stance)
    snapshot = simulator.step(copsense.solve_equilibrium(stance, C2).torques)
    drive, data = simulator._drive, simulator._data
    assert isinstance(drive, mujoco_drives.DriveForces)
    drive.apply_loads()
    moved = stance.at(snapshot.q, check=False)
    force = data.xfrc_applied[:, :3].sum(axis=0)
    assert np.abs(force - moved.applied.wrenches[:, :3].sum(axis=0)).max() < 1e-9
    assert np.abs(moved.applied.wrenches - stance.applied.wrenches).max() > 1e-6


def test_loads_follow_their_links_between_two_commands_too():
    stance = CASES["loads"]()
    one, many = MujocoSimulator(stance), MujocoSimulator(stance)
    limp = np.zeros(len(stance.robot.torque_names))
    for _ in range(8):
        stepped = one.step(limp)
    repeated = many.repeat(limp, 8)
    assert repeated.time == stepped.time
    np.testing.assert_array_equal(repeated.q, stepped.q)
    np.testing.assert_array_equal(repeated.wrenches, stepped.wrenches)


def under_the_feet(stance):
    """Where on the feet's plane the ground's whole force acts (2,) [m]."""
    found = copsense.solve_equilibrium(stance, C1).world_wrenches
    x, y = np.array([place.translation[:2] for place in stance.placements]).T
    fz = found[:, 2]
    return np.array([(x * fz - found[:, 4]).sum(), (y * fz + found[:, 3]).sum()]) / fz.sum()


def test_what_is_too_fast_for_statics_counts_what_the_loads_leave_to_the_ground():
    stance = standing(Robot.from_model(rod_biped_model(rods=False)))
    stance = stance.with_loads([Load("hand", (4.0, 0.0, 90.0))])  # a rope that lifts
    signal = Sine(0.01, 0.7)
    start, tangent = lateral_posture(stance, float(stance.com[1]))
    found = quasi_static(start, tangent, signal)
    still = np.zeros(stance.robot.model.nv)
    moving = start.moving(still, tangent * signal.peak_acceleration)
    there, here = map(under_the_feet, (moving, start))
    assert np.linalg.norm(there - here) == pytest.approx(found.excess, rel=1e-3)


def test_a_controller_of_other_motors_is_rejected():
    stance = rods("pin")
    more = (*rod_drives().motors, "l_ankle_pitch")
    other = stance.robot.with_drives(copsense.Drives(motors=more, loops=rod_drives().loops))
    controller = BalancingController(Stance(other, stance.q, stance.contacts), C2)
    with pytest.raises(InvalidInputError, match="Use the same drives"):
        rollout(MujocoSimulator(stance), controller, Scenario(0.01))


def test_what_hangs_is_left_behind_by_a_sway_and_its_levers_are_not_known():
    stance = CASES["all at once"]()
    start, tangent = lateral_posture(stance, float(stance.com[1]))
    net, *each = sway_levers(copsense.solve_equilibrium(start, C2), tangent)
    assert 0.1 < net.lever < 1.0
    assert all(np.isnan(lever.lever) for lever in each)
    held = rods("pin")
    start, tangent = lateral_posture(held, float(held.com[1]))
    levers = sway_levers(copsense.solve_equilibrium(start, C2), tangent)
    assert np.isfinite([lever.lever for lever in levers]).all()
