"""With the reference's acceleration a controller commands the equilibrium in motion."""

import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense import Load
from copsense.controllers import BalancingController, Observation, Sine, Target, lateral_reference
from copsense.timed_path import TimedPath

TORQUE = copsense.minimum_torque()


def instant_and_target(stance):
    path = copsense.lateral_sweep(stance, -0.02, 0.02, 21)
    there = TimedPath(path, Sine(0.012, 0.5)).at(0.3).stance
    v, a = there.motion.velocity, there.motion.acceleration
    model = stance.robot.model
    data = model.createData()
    pin.centerOfMass(model, data, there.q, v, a)
    com = (np.array(each[0]) for each in (data.com, data.vcom, data.acom))
    return there, Target(*com, there.q, v, a)


@pytest.mark.parametrize("loaded", [False, True], ids=["plain", "driven"])
def test_on_the_reference_it_is_the_equilibrium_in_motion(icub, loaded):
    stance = icub.with_loads([Load("r_hand", (4.0, -3.0, -12.0))]) if loaded else icub
    there, target = instant_and_target(stance)
    exact = copsense.solve_equilibrium(there, TORQUE)
    off = []
    for feedforward in (True, False):
        controller = BalancingController(stance, TORQUE, feedforward=feedforward)
        seen = Observation(0.3, there.q, target.velocity, target, np.zeros((2, 6)))
        command = controller(seen)
        off.append(np.abs(command.wrenches - exact.wrenches).max())
        if feedforward:
            np.testing.assert_allclose(command.torques, exact.torques, atol=1e-6)
    assert off[0] < 1e-6
    assert off[1] > 0.5  # N: what the paper's controller does not know


def test_the_reference_says_how_its_velocity_changes(icub):
    reference, step = lateral_reference(icub, Sine(0.012, 0.5)), 1e-5
    before, now, after = (reference.at(0.31 + s * step) for s in (-1, 0, 1))
    change = (after.velocity - before.velocity) / (2 * step)
    np.testing.assert_allclose(now.acceleration, change, atol=1e-6)
    assert np.abs(now.acceleration).max() > 0.1
