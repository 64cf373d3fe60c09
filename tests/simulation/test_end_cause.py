"""A robot that tips or falls says why, and the remedy; one that stands says nothing of it."""

import numpy as np
import pytest
from support.commands import copsense as command
from support.standing import C1, C2, icub
from support.walkers import BIPED, FULL, NO_ANKLE_ROLL, PITCH_ONLY, bent, walker

import copsense
from copsense.controllers import Ramp, Sine
from copsense.simulation import Motors, Push, Scenario

NARROW = [
    copsense.Contact(f"{side}_sole", polygon=copsense.rectangle((-0.05, 0.1), (-0.01, 0.01)))
    for side in "lr"
]
PUSH = Push((0.0, 300.0, 0.0), start=0.02, duration=0.1)


@pytest.mark.parametrize(
    ("scenario", "says", "remedy"),
    [
        (Scenario(1.0, Ramp(0.02, 0.02)), "statics predict it: r_sole tips at ", "(--reference)"),
        (Scenario(0.5, Sine(0.02, 1.0)), "it moves too fast: ", "a slower sway"),
        (Scenario(0.5, pushes=(PUSH,)), "before it there was a push. ", "Run it without"),
        (
            Scenario(0.5, pushes=(PUSH,), motors=Motors(delay=2e-3)),
            "before it there were a push and delay of the motors. ",
            "Run it without",
        ),
    ],
    ids=["too far", "too fast", "pushed", "pushed with delay"],
)
def test_what_made_it_tip_is_said_with_the_remedy(scenario, says, remedy):
    stance = copsense.load_stance("icub", contacts=NARROW)
    run = copsense.balance(stance, C1, scenario, until="tip")
    assert run.tip is not None
    cause = run.attrs["likely_cause"]
    assert cause.startswith(says)
    assert remedy in cause
    assert run.to_dict()["likely_cause"] == cause
    assert cause in repr(run)


def test_a_push_after_the_tip_is_not_its_cause():
    stance = copsense.load_stance("icub", contacts=NARROW)
    scenario = Scenario(1.0, Ramp(0.02, 0.02), pushes=(Push((0.0, 5.0, 0.0), start=0.9),))
    run = copsense.balance(stance, C1, scenario, until="tip")
    assert run.tip.time < 0.9
    assert run.attrs["likely_cause"].startswith("statics predict it")


def test_torques_of_ones_own_are_the_cause_where_statics_keep_all_in_place():
    run = copsense.balance(icub(), C2, Scenario(2.0), controller=lambda _: np.zeros(23))
    assert not run.completed
    assert run.attrs["likely_cause"].startswith("nothing but the torques of your controller")


def test_straight_legs_are_the_cause_and_bent_ones_stand(tmp_path):
    path = tmp_path / "walker.urdf"
    path.write_text(walker(PITCH_ONLY), encoding="utf-8")
    words = ["balance", path, "--contact-at", "sole", "--duration", 1]
    for foot in BIPED:
        words += ["--contact", foot]
    fell = command(*words)
    assert "a contact tipped" in fell.out
    assert "likely cause: the limbs of l_foot and r_foot are all but straight" in fell.out
    assert "Bend l_knee and r_knee" in fell.out
    for joint, at in bent(0.4).items():
        words += ["--posture", f"{joint}={at}rad"]
    stood = command(*words)
    assert stood.code == 0, stood.out
    assert "likely cause" not in stood.out


def five_joints(joints, knee, aside):
    return copsense.load_stance(
        walker(joints, trunk=(0.0, aside, 0.2)),
        contacts=BIPED,
        contact_at="sole",
        posture=bent(knee),
    )


def test_feet_that_all_but_repeat_each_other_are_the_cause_and_minimum_wrench_stands():
    """Without hip yaw minimum torque saves 0.02 Nm by a yaw moment of 12 kNm between the feet."""
    stance = five_joints(FULL[1:], 0.8, 0.01)
    fell = copsense.balance(stance, C2, Scenario(0.3))
    assert fell.end.kind == "fall"
    cause = fell.attrs["likely_cause"]
    assert cause.startswith("contacts that all but repeat each other: the limbs of l_foot and")
    assert "none about z (yaw)" in cause
    assert "--criterion minimum-wrench" in cause
    assert not any("limits=Limits()" in note for note in fell.notes)
    assert copsense.balance(stance, C1, Scenario(0.3)).tip is None


@pytest.mark.filterwarnings("ignore::copsense.robots.StandingWarning")
@pytest.mark.parametrize(
    ("joints", "knee", "aside"),
    [(FULL[1:], 0.8, 0.0), (FULL[1:], 0.1, 0.0), (NO_ANKLE_ROLL, 0.1, 0.01)],
    ids=["load jumps aside", "no posture aside", "forces felt within rounding"],
)
def test_legs_of_five_joints_hold_still_where_they_cannot_sway(joints, knee, aside):
    run = copsense.balance(five_joints(joints, knee, aside), C2, Scenario(0.1))
    assert run.completed
    assert run.tip is None
    assert any("leaves forces undetermined" in note for note in run.notes)
