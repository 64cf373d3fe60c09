"""Legs that are all but straight stand in closed loop, and are named where they do not."""

import numpy as np
import pytest
from support.walkers import BIPED, FULL, PITCH_ONLY, bent, walker, with_toes

import copsense
from copsense.freedom import straight_note
from copsense.simulation import Scenario

TORQUE = copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0))


def on_toes(knee):
    contacts = [*BIPED, "l_toes", "r_toes"]
    text = with_toes(walker(trunk=(0.02, 0.0, 0.2)), length=0.06, inertia=0.02)
    return copsense.load_stance(text, contacts=contacts, contact_at="sole", posture=bent(knee))


@pytest.mark.parametrize("limits", [None, copsense.Limits(friction=0.5)])
def test_feet_with_toes_under_straight_legs_stand_still(limits):
    """With a knee's sine in the denominator, rounding had asked for all of its torque."""
    stance = on_toes(0.0)
    assert np.abs(stance.robot.joint_position(stance.q, "l_knee")) < np.radians(0.3)
    run = copsense.balance(stance, TORQUE, Scenario(0.4), limits=limits)
    assert run.end.kind == "completed"
    assert run.attrs["likely_cause"] == ""
    at_rest = np.abs(copsense.solve_equilibrium(stance, TORQUE).torques).max()
    assert run.torque_peak < 1.5 * at_rest + 1.0


@pytest.mark.parametrize("knee", [1e-3, 0.4])
@pytest.mark.parametrize("joints", [FULL, PITCH_ONLY])
def test_limbs_that_are_all_but_straight_are_named_with_the_joints_to_bend(joints, knee):
    stance = copsense.load_stance(
        walker(joints), contacts=BIPED, contact_at="sole", posture=bent(knee)
    )
    if knee > 0.1:
        assert straight_note(stance) == ""
        return
    said = straight_note(stance)
    assert said.startswith("the limbs of l_foot and r_foot are all but straight")
    assert "Bend l_knee and r_knee (--posture, posture=)" in said
