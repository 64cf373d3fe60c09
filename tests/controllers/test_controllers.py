"""Any controller, given as a function of the configuration, has the sensitivity of what it does."""

import numpy as np
import pytest
from support.grounds import off_centre, on_tilted_planes

import copsense

RELATIVE = 1e-7
WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


def wrench_controller(stance):
    """Minimum wrench, written again: the pseudo-inverse of the balance about the base."""

    def controller(q):
        here = stance.at(q)
        return np.linalg.pinv(here.jacobian[:, :6].T) @ here.gravity[:6]

    return controller


def torque_controller(stance):
    """Minimum torque, written again: least squares over the wrenches' internal directions."""

    def controller(q):
        here = stance.at(q)
        J, G = here.jacobian, here.gravity
        f = np.linalg.pinv(J[:, :6].T) @ G[:6]
        internal = np.linalg.svd(J[:, :6].T)[2][6:].T
        tau = G[6:] - J[:, 6:].T @ f
        f = f + internal @ np.linalg.lstsq(J[:, 6:].T @ internal, tau)[0]
        return here.unstack(f)

    return controller


def projected_gravity(stance):
    """Static torques alone: tau = Z_j (Z_j' Z_j)^-1 Z' G."""

    def controller(q):
        here = stance.at(q)
        Z = here.admissible_motions
        return Z[6:] @ np.linalg.solve(Z[6:].T @ Z[6:], Z.T @ here.gravity)

    return controller


def assert_same(policy, criterion, stance):
    given = copsense.cop_sensitivity(stance, policy)
    exact = copsense.cop_sensitivity(stance, criterion)
    for what in ("cop", "gradient", "wrench_derivative", "torque_derivative", "com_gain"):
        a, b = getattr(given, what), getattr(exact, what)
        assert np.abs(a - b).max() < RELATIVE * np.abs(b).max(), what
    a, b = given.equilibrium, exact.equilibrium
    assert np.abs(a.wrenches - b.wrenches).max() < 1e-9 * stance.robot.weight
    assert np.abs(a.torques - b.torques).max() < 1e-9 * stance.robot.weight
    assert a.residual() < 1e-9 * stance.robot.weight


@pytest.mark.parametrize(
    ("controller", "criterion"),
    [(wrench_controller, WRENCH), (torque_controller, TORQUE)],
    ids=["wrench", "torque"],
)
def test_a_policy_that_does_what_a_criterion_asks_has_its_sensitivity(
    posture, controller, criterion
):
    assert_same(controller(posture), criterion, posture)


def test_the_same_holds_on_tilted_planes(icub):
    stance = off_centre(on_tilted_planes(icub, tilt=0.15, step=0.03))
    assert_same(torque_controller(stance), TORQUE, stance)


def test_torques_alone_determine_wrenches_and_sensitivity(posture):
    # Torques that hold the robot up leave the two feet one way to push.
    policy = copsense.statics.wrench_policy(projected_gravity(posture), posture)
    assert_same(policy, TORQUE, posture)


def test_a_controllers_own_torques_give_back_its_wrenches(posture):
    for criterion in (WRENCH, TORQUE, copsense.minimum_tangential(TORQUE)):

        def torques(q, criterion=criterion):
            return copsense.solve_equilibrium(posture.at(q), criterion).torques

        policy = copsense.statics.wrench_policy(torques, posture)
        found = copsense.solve_equilibrium(posture, criterion)
        np.testing.assert_allclose(policy(posture.q), found.wrenches, rtol=0, atol=1e-9)


def test_a_policy_that_does_not_balance_is_rejected(posture):
    with pytest.raises(copsense.CopsenseError, match="do not balance"):
        copsense.cop_sensitivity(posture, lambda q: 0.9 * wrench_controller(posture)(q))


def test_a_stiff_ankle_controller_is_no_criterion_and_still_balances(posture):
    # A share of the load set by hand, the rest by the balance: CoPs move with the share's rule.
    def controller(q):
        here = posture.at(q)
        left, right = (place.translation[1] for place in here.placements)
        share = (here.com[1] - right) / (left - right)
        wanted = np.zeros((2, 6))
        wanted[:, 2] = here.robot.weight * np.array([share, 1 - share])
        return copsense.solve_equilibrium(
            here, copsense.criterion.reference_wrench(wanted, 1e-3)
        ).wrenches

    found = copsense.cop_sensitivity(posture, controller)
    # All of the CoM's sideways travel goes into the loads: the CoPs hardly move.
    rate = 1 / 0.14
    np.testing.assert_allclose(found.load_gain[:, 1], [rate, -rate], rtol=1e-3)
    assert np.abs(found.com_gain[:, 1, 1]).max() < 1e-3
