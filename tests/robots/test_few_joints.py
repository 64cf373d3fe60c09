"""Legs of fewer than six joints stand; what their feet hold is said, and the joint they lack."""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense as command
from support.walkers import BIPED, FULL, NO_ANKLE_ROLL, PITCH_ONLY, bent, walker

import copsense
from copsense.batch import PostureChart
from copsense.errors import InsufficientContactsError, UnreachablePostureError
from copsense.freedom import freedom_notes, held_com_axes, missing_joints
from copsense.posture import retract, solve_posture
from copsense.robots import StandingWarning

WRENCH = copsense.minimum_wrench(1.0)
TORQUE = copsense.minimum_torque(tie_break=WRENCH)


def stand(joints, knee=0.8, **more):
    return copsense.load_stance(
        walker(joints, **more), contacts=BIPED, contact_at="sole", posture=bent(knee)
    )


@pytest.fixture(scope="module")
def five():
    return stand(NO_ANKLE_ROLL)


def test_legs_without_ankle_roll_stand_and_lack_a_roll(five):
    for place in five.placements:
        assert place.translation[2] == pytest.approx(0.0, abs=1e-12)
        assert place.rotation == pytest.approx(np.eye(3), abs=1e-12)
    assert five.com[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    (clause,) = missing_joints(five)
    assert clause == (
        "the limbs of l_foot and r_foot have 5 joints each where 6 place it freely, none about "
        "x (roll)"
    )
    assert "11 of 12 directions" in freedom_notes(five)[0]
    assert "hold the CoM's y fast" in freedom_notes(five)[0]


def test_legs_of_six_joints_lack_nothing():
    full = stand(FULL)
    assert missing_joints(full) == freedom_notes(full) == ()
    assert full.false_motions.shape == (full.robot.model.nv, 0)
    assert held_com_axes(full) == ()


def test_contacts_that_nearly_repeat_each_other_are_doubted():
    without_yaw = stand(FULL[1:])
    aside = solve_posture(without_yaw, com=(None, 0.02, None)).stance
    (note,) = freedom_notes(aside)
    assert note.startswith("The contacts all but repeat what they hold themselves")
    assert note.endswith("none about z (yaw).")


@pytest.mark.parametrize("coordinate", ["com_x", "com_y"])
def test_postures_near_those_where_contacts_repeat_each_other_are_found(coordinate):
    """Without hip yaw, a row that is said twice upright says something of its own beside it."""
    aside = stand(FULL[1:], 0.1, trunk=(0.0, 0.01, 0.2))
    path = copsense.path.com_sweep(aside, coordinate, -0.016, 0.016, 9)
    assert not path.failures
    axis = "xyz".index(coordinate[-1])
    for (stance, tangent), value in zip(path, path.values, strict=True):
        assert stance.com[axis] == pytest.approx(value, abs=1e-12)
        for here, start in zip(stance.placements, aside.placements, strict=True):
            assert here.homogeneous == pytest.approx(start.homogeneous, abs=2e-12)
        assert stance.constraints @ tangent == pytest.approx(np.zeros(12), abs=1e-6)
        assert (stance.com_jacobian @ tangent)[axis] == pytest.approx(1.0, abs=1e-6)


def test_what_legs_without_ankle_roll_leave_are_the_planar_motions_of_the_trunk(five):
    assert five.rank == 11
    assert held_com_axes(five) == (1,)
    base = five.admissible_motions[:6]
    assert np.linalg.matrix_rank(base, tol=1e-9) == 3
    assert np.abs(base[[1, 3, 5]]).max() < 1e-9  # sideways, roll, yaw


def test_a_false_motion_cannot_be_followed_and_every_other_can(five):
    step = 1e-3
    for motion in five.false_motions.T:
        assert np.abs(five.jacobian @ motion).max() < 1e-9
        gone = pin.difference(five.robot.model, five.q, retract(five, step * motion).q)
        assert abs(motion @ gone) < 1e-2 * step
    for motion in five.admissible_motions.T:
        gone = pin.difference(five.robot.model, five.q, retract(five, step * motion).q)
        assert motion @ gone == pytest.approx(step, rel=1e-2)


@pytest.mark.parametrize("knee", [0.0, 0.8, 1.4])
@pytest.mark.parametrize("criterion", [WRENCH, TORQUE], ids=["wrench", "torque"])
def test_sensitivities_are_finite_differences_along_what_is_left(knee, criterion):
    stance = stand(NO_ANKLE_ROLL, knee)
    copsense.check_sensitivity(stance, criterion)
    found = copsense.cop_sensitivity(stance, criterion)
    assert found.com_gain[:, :, 1] == pytest.approx(np.zeros((2, 2)), abs=1e-9)


@pytest.mark.parametrize("aside", [1e-6, 2e-3, -1e-2])
@pytest.mark.parametrize("joints", [NO_ANKLE_ROLL, PITCH_ONLY], ids=["five", "three"])
def test_a_com_that_the_legs_cannot_move_sideways_stays_and_is_said(joints, aside):
    leg = sum(1.2 if name in ("hip", "knee") else 0.1 for name, _ in joints[:-1]) + 0.6
    total = 12.0 + 2 * leg
    own = 12.0 * aside / total
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        stance = stand(joints, trunk=(0.0, aside, 0.2))
    assert stance.robot.mass == pytest.approx(total)
    assert stance.com[0] == pytest.approx(0.0, abs=1e-9)
    assert stance.com[1] == pytest.approx(own, abs=1e-9)
    equilibrium = copsense.solve_equilibrium(stance, WRENCH)
    assert copsense.cop.total_center_of_pressure(equilibrium)[1] == pytest.approx(own, abs=1e-9)
    said = [str(note.message) for note in notes if note.category is StandingWarning]
    if abs(own) > 1e-6:
        assert len(said) == 1
        assert f"y by {own * 1e3:+.3g} mm" in said[0]
        assert "about x (roll)" in said[0]
    else:
        assert not said


def test_what_is_requested_of_a_held_com_has_no_tangent(five):
    posture = copsense.solve_posture(five, com=(0.01, float(five.com[1]), None))
    assert posture.stance.com[0] == pytest.approx(0.01, abs=1e-12)
    step = 1e-5
    ahead, behind = (
        copsense.solve_posture(five, com=(0.01 + s, float(five.com[1]), None)).stance.q
        for s in (step, -step)
    )
    numeric = pin.difference(five.robot.model, behind, ahead) / (2 * step)
    assert posture.tangents[:, 0] == pytest.approx(numeric, abs=1e-5)
    assert not posture.tangents[:, 1].any()


def test_a_com_out_of_reach_names_the_joint_that_is_missing(five, tmp_path):
    with pytest.raises(UnreachablePostureError, match=r"have 5 joints.*none about x \(roll\)"):
        copsense.solve_posture(five, com=(None, 0.03, None))
    path = tmp_path / "walker.urdf"
    path.write_text(walker(NO_ANKLE_ROLL), encoding="utf-8")
    feet = [word for foot in BIPED for word in ("--contact", foot)]
    bend = [w for j, a in bent().items() for w in ("--posture", f"{j}={a}rad")]
    words = ("analyse", path, *feet, "--contact-at", "sole", *bend, "--criterion", "minimum-wrench")
    assert "none about x (roll)" in command(*words, "--com-y", "0.03").error
    answer = command(*words)
    assert answer.code == 0
    assert "hold the CoM's y fast" in answer.err


def test_two_points_are_told_that_they_carry_no_moment():
    points = [copsense.Contact(foot, "point") for foot in BIPED]
    for aside in (0.0, 0.002):
        text = walker(PITCH_ONLY, trunk=(0.0, aside, 0.2))
        with pytest.raises(InsufficientContactsError, match="no moment about the line"):
            copsense.load_stance(text, contacts=points, posture=bent())


def test_a_chart_says_what_holds_the_com_fast(five):
    found = PostureChart(five, ["com_x", "com_y"], compiled=False).solve([[0.0, 0.0], [0.0, 0.01]])
    assert found.reasons[0] == ""
    assert found.reasons[1].startswith(
        "unreachable: the contacts hold the CoM's y fast: the limbs of"
    )
    assert "none about x (roll)" in found.reasons[1]
