"""Gravity, Jacobians, CoM and mass matrix are those of two engines that share nothing with ours."""

import numpy as np
import pinocchio as pin
import pytest
from support.differences import relative
from support.engines import IdyntreeRobot, MujocoRobot

import copsense

RELATIVE = 1e-10


def random_configurations(stance, count):
    """Any base pose, joints within a radian of the posture."""
    rng = np.random.default_rng(42)
    model = stance.robot.model
    for _ in range(count):
        displacement = rng.uniform(-1.0, 1.0, model.nv)
        displacement[:6] *= 3.0
        yield pin.integrate(model, stance.q, displacement)


@pytest.mark.parametrize("engine", [MujocoRobot, IdyntreeRobot])
@pytest.mark.parametrize("name", ["icub", "iCubGenova02", "talos", "g1", "solo12"])
def test_engines_agree_on_random_configurations(stance_of, name, engine):
    stance = stance_of(name)
    # The model's own frames, whole: six rows each.
    frames = [contact.frame for contact in stance.contacts]
    stance = stance.with_contacts([copsense.Contact(frame) for frame in frames])
    other = engine(stance.robot)
    for q in random_configurations(stance, 10):
        here = stance.at(q)
        other.move(q)
        assert relative(here.gravity, other.gravity) < RELATIVE
        assert relative(here.mass_matrix, other.mass_matrix) < RELATIVE
        assert relative(here.com, other.com) < RELATIVE
        jacobians = np.vstack([other.jacobian(frame) for frame in frames])
        assert relative(here.jacobian, jacobians) < RELATIVE


@pytest.mark.parametrize("engine", [MujocoRobot, IdyntreeRobot])
def test_wrenches_and_torques_balance_gravity_in_the_other_engine(lateral_path, engine):
    other = engine(lateral_path.stances[0].robot)
    for stance in lateral_path.stances[::3]:
        other.move(stance.q)
        J = np.vstack([other.jacobian(contact.frame) for contact in stance.contacts])
        for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
            found = copsense.solve_equilibrium(stance, criterion)
            balance = other.gravity - J.T @ found.forces
            balance[6:] -= found.torques
            assert np.abs(balance).max() < RELATIVE * stance.robot.weight
