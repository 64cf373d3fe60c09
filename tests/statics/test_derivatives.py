"""Analytic derivatives are the finite differences, for every criterion, along every motion."""

import numpy as np
import pytest
from support.differences import along, derivative_errors, largest_error
from support.loads import CRITERIA, criteria, random_spd

import copsense

RELATIVE = 1e-7


@pytest.fixture(scope="module")
def posture(lateral_path):
    """A posture of no symmetry, off the centre."""
    stance = lateral_path.stances[11]
    coordinates = 0.15 * np.random.default_rng(0).standard_normal(17)
    return copsense.posture.retract(stance, stance.admissible_motions @ coordinates)


@pytest.mark.parametrize("name", CRITERIA)
def test_sensitivity_is_the_finite_difference(posture, name):
    errors = derivative_errors(posture, criteria(posture)[name])
    assert max(errors.values()) < RELATIVE, errors


@pytest.mark.parametrize("name", ["minimum wrench", "minimum torque", "mixed"])
def test_sensitivity_is_the_finite_difference_where_the_robot_is_symmetric(icub, name):
    errors = derivative_errors(icub, criteria(icub)[name])
    assert max(errors.values()) < RELATIVE, errors


def heel_and_toe(stance):
    """Two surfaces under each foot: twelve directions of the wrenches that no motion can feel."""
    contacts = [
        copsense.Contact(c.frame, name=f"{c.frame} {part}", offset=(x, 0.0, 0.0))
        for c in stance.contacts
        for part, x in (("heel", -0.04), ("toe", 0.09))
    ]
    return stance.with_contacts(contacts)


TIE_BREAKS = {
    "minimum wrench": copsense.minimum_wrench(0.3),
    "uneven wrench weights": copsense.Criterion(
        "uneven",
        (copsense.WrenchTerm(random_spd(24, 7), reference=np.tile([0, 0, 90.0, 0, 0, 0], (4, 1))),),
    ),
}


@pytest.mark.parametrize("tie_break", TIE_BREAKS)
@pytest.mark.parametrize(
    "torque",
    [
        copsense.minimum_torque(),
        copsense.weighted_torque(random_spd(23, 4)),
        copsense.weighted_torque("inverse inertia"),
    ],
    ids=["torque", "full torque", "inverse inertia"],
)
def test_sensitivity_is_the_finite_difference_where_contacts_are_redundant(
    posture, torque, tie_break
):
    stance = heel_and_toe(posture)
    assert stance.rank == 12
    criterion = copsense.Criterion("tied", torque.terms, TIE_BREAKS[tie_break])
    errors = derivative_errors(stance, criterion)
    assert max(errors.values()) < RELATIVE, errors


def test_tie_break_leaves_the_torques_of_the_first_criterion(posture):
    free = copsense.solve_equilibrium(posture, copsense.minimum_torque())
    tied = copsense.solve_equilibrium(
        heel_and_toe(posture), copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0))
    )
    np.testing.assert_allclose(tied.torques, free.torques, rtol=0, atol=1e-10)


def test_statics_derivatives_are_finite_differences_at_fixed_forces_and_velocities(posture):
    # A = d(G - J'f)/dq and D = d(J v)/dq, the two that every sensitivity is made of.
    rng = np.random.default_rng(3)
    Z = posture.admissible_motions
    f, v = 100 * rng.standard_normal(12), rng.standard_normal(29)
    balance = along(posture, lambda s: s.gravity - s.jacobian.T @ f, Z)
    assert largest_error(posture.balance_derivative(f) @ Z, balance) < RELATIVE
    motion = along(posture, lambda s: s.jacobian @ v, Z)
    assert largest_error(posture.motion_derivative(v) @ Z, motion) < RELATIVE
    inertia = along(posture, lambda s: s.mass_matrix @ v, Z)
    assert largest_error(posture.inertia_derivative(v) @ Z, inertia) < RELATIVE


def test_check_sensitivity_agrees_and_can_disagree(posture):
    criterion = copsense.minimum_torque()
    copsense.check_sensitivity(posture, criterion)
    with pytest.raises(copsense.CopsenseError, match="finite differences"):
        copsense.check_sensitivity(posture, criterion, tolerance=1e-15)
    copsense.check_sensitivity(posture, criterion, step=0.1)  # by a tenth of it
