"""What the kernel does not cover is answered by the reference, and callers see no difference."""

import importlib.util

import numpy as np
import pytest
from support.grounds import off_centre
from support.stances import postures, served

import copsense
from copsense.batch import BatchKernel, evaluate_batch
from copsense.criterion import PreloadTerm, TorqueTerm

TORQUE = copsense.minimum_torque()


def reference_answer(stance, q, criterion):
    try:
        return copsense.cop_sensitivity(stance.at(q), criterion), ""
    except copsense.CopsenseError as error:
        return None, str(error)


def same_as_reference(stance, q, criteria):
    found = evaluate_batch(stance, q, criteria)
    for i, row in enumerate(q):
        for j, criterion in enumerate(criteria):
            reference, reason = reference_answer(stance, row, criterion)
            if reference is None:
                assert found.reasons[i, j] == reason
                assert np.all(np.isnan(found.gradient[i, j]))
                assert np.all(np.isnan(found.wrenches[i, j]))
                continue
            assert (i, j) not in found.reasons
            np.testing.assert_allclose(
                found.wrenches[i, j], reference.equilibrium.wrenches, rtol=1e-12
            )
            np.testing.assert_allclose(found.gradient[i, j], reference.gradient, rtol=0, atol=1e-12)
            np.testing.assert_allclose(found.com_gain[i, j], reference.com_gain, rtol=0, atol=1e-11)
    return found


def test_other_criteria_are_answered_by_the_reference(case):
    stance = case("icub")

    def policy(q):
        return copsense.solve_equilibrium(stance.at(q), TORQUE).wrenches

    n = len(stance.robot.torque_names)
    criteria = [
        TORQUE,
        copsense.weighted_torque("inverse inertia", name="inertia"),
        copsense.minimum_tangential(TORQUE),
        copsense.weighted_torque(np.eye(n) + 0.5 / n, name="coupled"),
        copsense.Criterion("preload", (TorqueTerm(), PreloadTerm(np.full((2, 6), 0.01)))),
        policy,
    ]
    kernel = BatchKernel(stance, criteria)
    assert not kernel.fallback_reason
    assert kernel.by_reference == {
        "inertia": "its torque weights follow the inertia",
        "minimum-tangential": "its weights leave wrenches to a tie-break",
        "coupled": "its torque weights couple joints between the contacts with others",
        "preload": "it has a preload that no wrench weights bear",
        "policy": "it is a policy",
    }
    found = same_as_reference(stance, postures(stance, 2), criteria)
    assert found.criteria == ("minimum-torque", *kernel.by_reference)
    alone = BatchKernel(stance, criteria[1:])
    assert "inertia: its torque weights follow the inertia; " in alone.fallback_reason


def test_planar_robots_are_answered_by_the_reference(stance_of):
    stance = stance_of("four_bar")
    assert BatchKernel(stance, [copsense.minimum_wrench(1.0)]).fallback_reason
    same_as_reference(stance, np.array([off_centre(stance).q]), [copsense.minimum_wrench(1.0)])


def redundant(name, stance):
    """A stance whose contacts can pull on each other without a joint feeling it."""
    if name == "heel and toe":
        offsets = {"heel": -0.04, "toe": 0.09}
        return stance.with_contacts(
            copsense.Contact(c.frame, name=f"{c.frame} {part}", offset=(x, 0.0, 0.0))
            for c in stance.contacts
            for part, x in offsets.items()
        )
    kept = [
        j
        for j in stance.robot.joint_names
        if not j.endswith(("hip_yaw", "hip_roll", "ankle_roll", "ankle_pitch"))
    ]
    robot = stance.robot.keeping(kept)
    q = robot.configuration({j: stance.robot.joint_position(stance.q, j) for j in kept})
    q[:7] = stance.q[:7]
    return copsense.Stance(robot, q, stance.contacts)


@pytest.mark.parametrize("name", ["heel and toe", "legs of two joints"])
def test_contacts_without_rank_are_left_to_the_reference(icub, name):
    # Undetermined wrenches are said so, not invented; the minimum wrench and a tie-break stand.
    wrench = copsense.minimum_wrench(1.0)
    tied = copsense.minimum_torque(tie_break=wrench, name="tied")
    stance = redundant(name, icub)
    assert stance.rank < len(stance.component_index)
    assert not BatchKernel(stance, [wrench, TORQUE, tied]).fallback_reason
    found = same_as_reference(stance, np.array([stance.q, stance.q]), [wrench, TORQUE, tied])
    assert set(found.reasons) == {(0, 1), (1, 1)}


def test_exactly_straight_knees_are_the_references(icub):
    q = straight_leg(icub, 0.0)
    same_as_reference(icub.at(q), np.array([q]), [copsense.minimum_wrench(1.0), TORQUE])


@pytest.mark.parametrize("angle", [1e-4, 1e-3])
def test_nearly_straight_knees_are_answered_by_the_kernel(icub, angle):
    q = straight_leg(icub, angle)
    stance = icub.at(q)
    kernel = BatchKernel(stance, [TORQUE], gains=False)
    kernel.evaluate(q[None])
    single = kernel.one(q)
    assert not kernel._single.doubtful.any()
    reference = copsense.cop_sensitivity(stance, TORQUE)
    scale = np.abs(reference.gradient).max()
    assert np.abs(single.gradient[0, 0] - reference.gradient).max() < 1e-9 * scale


def straight_leg(stance, angle):
    """A leg whose hip, knee and ankle axes are parallel, stretched to a knee angle."""
    q = stance.q.copy()
    for side in "lr":
        for joint, value in (
            ("hip_pitch", 0.1),
            ("knee", -angle),
            ("ankle_pitch", -0.1),
            ("hip_roll", 0.0),
            ("hip_yaw", 0.0),
            ("ankle_roll", 0.0),
        ):
            at = stance.robot.model.joints[stance.robot.joint_id(f"{side}_{joint}")].idx_q
            q[at] = value
    return q


def test_a_contact_off_its_plane_is_a_failed_row(case):
    stance = case("talos on slopes")
    q = postures(stance, 3)
    q[1, 2] += 1e-5  # the whole robot, 10 micrometres up
    found = same_as_reference(stance, q, [TORQUE])
    assert list(found.reasons) == [(1, 0)]
    assert "not on its plane" in found.reasons[1, 0]


def test_an_unloaded_contact_is_a_failed_row(icub):
    # Under the minimum wrench both feet share the weight by where the CoM is: put it where one
    # foot's share is none, by a bisection along the lateral direction.
    wrench = copsense.minimum_wrench(0.05)
    Z = icub.admissible_motions
    kernel = BatchKernel(icub, [wrench], gains=False)
    gradient = copsense.cop_sensitivity(icub, wrench)
    direction = Z @ (Z.T @ gradient.com_motions[:, 1])
    low, high = 0.0, 0.13

    def share(s):
        return float(
            kernel.evaluate(copsense.posture.retract(icub, s * direction).q[None]).load_share[
                0, 0, 1
            ]
        )

    start = share(low)
    assert start * share(high) < 0
    for _ in range(60):
        middle = (low + high) / 2
        value = share(middle)
        if np.isnan(value):
            break
        low, high = (middle, high) if value * start > 0 else (low, middle)
    found = kernel.evaluate(copsense.posture.retract(icub, (low + high) / 2 * direction).q[None])
    assert "no normal force" in found.reasons[0, 0]


def test_one_contact_is_said_in_the_singular(icub):
    kernel = BatchKernel(icub.with_contacts(icub.contacts[:1]), [TORQUE])
    assert kernel.fallback_reason == "there is 1 contact"


def test_without_numba_the_clear_path_answers_all(case, monkeypatch):
    stance = case("icub")
    q = postures(stance, 2)
    fast = evaluate_batch(stance, q, served(stance))
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "numba" else find(name)
    )
    kernel = BatchKernel(stance, served(stance))
    assert "copsense[fast]" in kernel.fallback_reason
    reference = kernel.evaluate(q)
    np.testing.assert_allclose(reference.gradient, fast.gradient, rtol=0, atol=1e-11)
    np.testing.assert_allclose(kernel.one(q[0]).torques[0], fast.torques[0], rtol=0, atol=1e-10)
