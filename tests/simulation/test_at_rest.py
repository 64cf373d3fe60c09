"""A robot that is asked to stand stands as the static analysis says."""

import numpy as np
import pytest
from support.standing import C1, C2, icub, second_at_rest, simulator

import copsense
from copsense.controllers import BalancingController, Sine
from copsense.simulation import MujocoSimulator, PhysicsSettings, Push, Scenario, rollout

MIXED = copsense.mixed((C1, 1e-2), (C2, 1.0))
WEIGHTED = copsense.weighted_torque("inverse inertia")
SHORT = copsense.minimum_wrench(0.07, name="short")


@pytest.mark.parametrize("criterion", [C1, C2, MIXED, WEIGHTED, SHORT], ids=lambda c: c.name)
def test_the_controller_at_rest_is_the_static_equilibrium(criterion):
    # No physics: the very torques and wrenches, to rounding.
    stance = icub()
    static = copsense.solve_equilibrium(stance, criterion)
    command = at_rest(stance, BalancingController(stance, criterion))
    weight = stance.robot.weight
    assert np.abs(command.wrenches - static.wrenches).max() < 1e-9 * weight
    assert np.abs(command.torques - static.torques).max() < 1e-9 * weight


def test_a_tie_break_decides_in_the_controller_too():
    criterion = copsense.minimum_tangential(C2)
    static = copsense.solve_equilibrium(icub(), criterion)
    command = at_rest(icub(), BalancingController(icub(), criterion))
    assert np.abs(command.wrenches - static.wrenches).max() < 1e-8 * icub().robot.weight


@pytest.mark.parametrize("criterion", [C1, C2], ids=lambda c: c.name)
def test_the_closed_loop_at_rest_has_the_static_wrenches(criterion):
    stance = icub()
    recording = second_at_rest(criterion)
    static = copsense.solve_equilibrium(stance, criterion)
    last = recording.isel(time=-1)
    assert recording.attrs["end_kind"] == "completed"
    off = np.abs(last["wrench"].values - static.wrenches).max()
    assert off < 0.002 * stance.robot.weight
    # Measured CoP = commanded CoP.
    assert np.abs(last["cop"] - last["cop_command"]).max() < 1e-6
    # Nothing disturbs, nothing moves: the CoM sinks with the contacts, and no more.
    drift = np.abs(recording["com"] - stance.com).max("time").values
    assert drift[:2].max() < 1e-6
    assert drift[2] < 5e-5
    assert np.abs(last["joint_velocity"]).max() < 1e-3


@pytest.mark.parametrize("limits", [None, copsense.Limits(friction=0.5, cop_margin=0.002)])
def test_one_foot_has_no_choice_and_stands(limits):
    stance = copsense.load_stance("icub", contacts=["l_sole"])
    controller = BalancingController(stance, C2, limits=limits)
    # With limits the push is more than the sole can take at once: the rate yields.
    push = Push((0.0, 5.0 if limits is None else 20.0, 0.0), 0.1, 0.1)
    recording = rollout(MujocoSimulator(stance), controller, Scenario(1.0, pushes=(push,)))
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    assert float(recording["margin"].min()) > 1e-3
    static = copsense.solve_equilibrium(stance, C2).wrenches
    command = at_rest(stance, controller)
    assert np.abs(command.wrenches - static).max() < 1e-8 * stance.robot.weight


def test_light_feet_are_held_from_the_first_step():
    # The reference starts at full speed; an ankle of the G1 has next to no inertia of its own.
    stance = copsense.load_stance("g1")
    simulator, controller = MujocoSimulator(stance), BalancingController(stance, C2)
    recording = rollout(simulator, controller, Scenario(0.05, Sine(0.02, 0.2)), record_period=1e-3)
    assert recording["wrench"].sel(component="fz").values[0].min() > 0.2 * stance.robot.weight
    assert np.degrees(recording["tilt"].max()) < 0.1


def test_wrenches_are_the_engines_own():
    # The sum over contacts, against Newton: at rest it carries the weight.
    stance = icub()
    total = second_at_rest(C2)["wrench"].isel(time=-1).sel(component="fz").sum()
    assert float(total) == pytest.approx(stance.robot.weight, rel=1e-3)


def test_the_same_run_twice_is_the_same_to_the_last_bit():
    stance = icub()
    first, second = (
        rollout(simulator(), BalancingController(stance, C2), Scenario(0.1)) for _ in range(2)
    )
    assert first.equals(second)


def test_a_finer_time_step_changes_little():
    stance = icub()
    fine = MujocoSimulator(stance, PhysicsSettings(time_step=5e-4))
    recording = rollout(fine, BalancingController(stance, C2), Scenario(0.5))
    assert recording.attrs["end_kind"] == "completed"
    static = copsense.solve_equilibrium(stance, C2)
    off = np.abs(recording["wrench"].values[-1] - static.wrenches).max()
    assert off < 0.002 * stance.robot.weight


@pytest.mark.parametrize("name", ["talos", "g1", "solo12", "anymal_c"])
def test_other_robots_stand(name):
    stance = copsense.load_stance(name)
    criterion = copsense.minimum_torque(tie_break=C1)
    recording = rollout(
        MujocoSimulator(stance), BalancingController(stance, criterion), Scenario(0.5)
    )
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    static = copsense.solve_equilibrium(stance, criterion)
    off = np.abs(recording["wrench"].values[-1] - static.wrenches).max()
    assert off < 0.002 * stance.robot.weight


def at_rest(stance, controller):
    from copsense.controllers import Hold, Observation, lateral_reference

    v = np.zeros(stance.robot.model.nv)
    target = lateral_reference(stance, Hold()).at(0.0)
    none = np.zeros((len(stance.contacts), 6))
    return controller(Observation(0.0, stance.q, v, target, none))
