"""Identities between wrenches, torques, gains and the centre of mass (theory: sensitivity)."""

import numpy as np
import pytest
from support.differences import along, largest_error
from support.grounds import off_centre
from support.loads import CRITERIA, criteria

import copsense

EXACT = 1e-9


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


@pytest.mark.parametrize("name", CRITERIA)
def test_cops_and_loads_together_follow_the_com(posture, name):
    # On flat ground the CoM is over sum w_k (x_k + p_k), so its derivative is the identity:
    # sum_k [w_k Gamma_k + (x_k + p_k) grad w_k] = 1.
    found = copsense.cop_sensitivity(posture, criteria(posture)[name])
    total, gradient = np.zeros(2), np.zeros((2, 2))
    for k, place in enumerate(posture.placements):
        R = place.rotation[:2, :2]
        w = found.equilibrium.wrenches[k, 2] / posture.robot.weight
        where = place.translation[:2] + R @ found.cop[k]
        total += w * where
        gradient += w * R @ found.com_gain[k] + np.outer(where, found.load_gain[k])
    np.testing.assert_allclose(total, posture.com[:2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(gradient, np.eye(2), rtol=0, atol=EXACT)


def test_minimum_wrench_depends_on_the_com_alone(posture):
    found = copsense.cop_sensitivity(posture, copsense.minimum_wrench(1.0))
    singular = np.linalg.svd(found.matrix.reshape(4, -1))[1]
    assert singular[1] > 1e-2
    assert singular[2] < 1e-12
    # What the CoM does not feel, the CoPs do not.
    horizontal = posture.com_jacobian[:2] @ found.basis
    gains = found.com_gain.reshape(4, 2)
    np.testing.assert_allclose(found.matrix.reshape(4, -1), gains @ horizontal, rtol=0, atol=EXACT)


def test_minimum_torque_depends_on_more_than_the_com(posture):
    found = copsense.cop_sensitivity(posture, copsense.minimum_torque())
    assert np.linalg.matrix_rank(found.matrix.reshape(4, -1), tol=1e-3) == 4


def test_minimum_torques_are_the_projection_of_gravity_on_the_motions(lateral_path):
    # tau = Z_j (Z_j' Z_j)^-1 Z' G, whatever the wrenches.
    for stance in lateral_path.stances[::2]:
        Z, G = stance.admissible_motions, stance.gravity
        Zj = Z[6:]
        tau = Zj @ np.linalg.solve(Zj.T @ Zj, Z.T @ G)
        found = copsense.solve_equilibrium(stance, copsense.minimum_torque())
        np.testing.assert_allclose(found.torques, tau, rtol=0, atol=1e-10 * np.abs(tau).max())


def test_minimum_torques_are_themselves_a_motion_of_the_joints(lateral_path):
    for stance in lateral_path.stances[::2]:
        tau = copsense.solve_equilibrium(stance, copsense.minimum_torque()).torques
        motion = np.linalg.lstsq(stance.admissible_motions[6:], tau)[0]
        left = tau - stance.admissible_motions[6:] @ motion
        assert np.abs(left).max() < 1e-10 * np.abs(tau).max()


@pytest.mark.parametrize("name", CRITERIA)
def test_torques_of_every_criterion_do_gravitys_work(posture, name):
    # Along any motion that leaves the contacts at rest, the wrenches do none: Z' (G - B tau) = 0.
    found = copsense.solve_equilibrium(posture, criteria(posture)[name])
    Z = posture.admissible_motions
    work = Z.T @ posture.gravity
    np.testing.assert_allclose(
        Z[6:].T @ found.torques, work, rtol=0, atol=1e-10 * np.abs(work).max()
    )


def test_tangential_with_the_wrench_tie_break_is_the_minimum_wrench_on_level_ground(posture):
    # Lemma 3 of [Romano2016], with the tie-break that it needs.
    wrench = copsense.minimum_wrench(0.8)
    given = copsense.solve_equilibrium(posture, copsense.minimum_tangential(wrench))
    expected = copsense.solve_equilibrium(posture, wrench)
    np.testing.assert_allclose(given.wrenches, expected.wrenches, rtol=0, atol=1e-9)
    other = copsense.minimum_tangential(copsense.minimum_torque())
    other = copsense.solve_equilibrium(posture, other)
    assert np.abs(other.wrenches - expected.wrenches).max() > 1.0


def test_com_gain_is_the_rate_of_the_cops_along_the_motion_of_least_energy(posture):
    found = copsense.cop_sensitivity(posture, copsense.minimum_torque())
    motions = found.com_motions
    assert np.abs(posture.jacobian @ motions).max() < 1e-12
    np.testing.assert_allclose(
        along(posture, lambda s: s.com[:2], motions), np.eye(2), rtol=0, atol=1e-9
    )

    def cops(stance):
        equilibrium = copsense.solve_equilibrium(stance, copsense.minimum_torque())
        return copsense.cop.contact_cops(equilibrium)

    assert largest_error(found.com_gain, along(posture, cops, motions)) < 1e-7
    # Any other motion with the same CoM has more kinetic energy.
    M, Z = posture.mass_matrix, posture.admissible_motions
    still = np.linalg.svd(posture.com_jacobian[:2] @ Z)[2][2:].T
    rng = np.random.default_rng(4)
    for v in motions.T:
        other = v + Z @ still @ rng.standard_normal(15)
        assert v @ M @ v < other @ M @ other


def test_worst_case_gain_bounds_every_motion_and_is_reached(posture):
    found = copsense.cop_sensitivity(posture, copsense.minimum_torque())
    M, m = posture.mass_matrix, posture.robot.mass
    rng = np.random.default_rng(6)
    for k, bound in enumerate(found.worst_case_gain):
        # The speed of the CoP, per sqrt(2 energy / mass), over random and the steepest motions.
        energy = found.basis.T @ M @ found.basis
        steepest = np.linalg.solve(energy, found.matrix[k].T)
        angles = np.linspace(0, np.pi, 721)
        motions = np.hstack(
            [rng.standard_normal((17, 200)), steepest @ [np.cos(angles), np.sin(angles)]]
        )
        speed = np.linalg.norm(found.matrix[k] @ motions, axis=0)
        gains = speed * np.sqrt(m / np.einsum("ip,ij,jp->p", motions, energy, motions))
        assert gains.max() <= bound * (1 + 1e-12)
        assert gains.max() == pytest.approx(bound, rel=1e-4)
