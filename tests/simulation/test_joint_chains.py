"""Several joints of one link are simulated as one body: between them there is no mass."""

import numpy as np
import pytest
from support.mjcf import FOOT, walker

import copsense
from copsense.simulation import MujocoSimulator, Scenario

HIPS = (
    "<joint name='{side}_hip_yaw' axis='0 0 1' pos='0 0 .02'/>"
    "<joint name='{side}_hip_roll' axis='1 .1 0' ref='3' pos='.01 0 0'/>"
)


@pytest.fixture(scope="module")
def stance():
    text = walker(foot=FOOT)
    for side in "lr":
        text = text.replace(f"<joint name='{side}_hip_roll' axis='1 0 0'/>", HIPS.format(side=side))
    bent = {
        f"{s}_{j}": a for s in "lr" for j, a in {"hip": -0.4, "knee": 0.8, "ankle": -0.4}.items()
    }
    return copsense.load_stance(
        text, contacts=["l_foot", "r_foot"], contact_at="sole", posture=bent
    )


def test_both_engines_agree_on_a_robot_with_several_joints_in_a_link(stance):
    """The simulator compares mass matrix, bias and centre of mass with Pinocchio's as it starts."""
    massless = [i for i in stance.robot.model.inertias if not i.mass]
    assert len(massless) > 5  # the world, and what is between joints
    simulator = MujocoSimulator(stance)
    assert np.abs(simulator.reset().q - stance.q).max() < 1e-12


def test_it_balances_as_the_statics_say(stance):
    """With the bound that holds for the iCub at rest, `test_at_rest`."""
    recording = copsense.balance(stance, copsense.minimum_torque(), Scenario(duration=0.3))
    static = copsense.solve_equilibrium(stance, copsense.minimum_torque())
    assert recording.completed
    last = recording.isel(time=-1)
    assert np.abs(last["wrench"].values - static.wrenches).max() < 0.002 * stance.robot.weight
