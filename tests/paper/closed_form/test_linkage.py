from __future__ import annotations

import numpy as np
import pytest
from support import planar_statics as statics

from copsense.errors import InvalidInputError
from copsense.paper.closed_form import FourBar, Hand
from copsense.paper.closed_form.lexicographic import (
    minimise_in_order,
    tangential_norm,
    torque_norm,
    wrench_norm,
)
from copsense.paper.closed_form.linkage import Linkage, wrench_balance

XI = 1.37


def motion(four_bar, xi):
    """d chi / d xi of [Romano2016] Eq. (14)."""
    l = four_bar.leg_length
    return np.array([-l * np.sin(xi), l * np.cos(xi), 0, 1, -1, 1, -1])


@pytest.mark.parametrize("hand", Hand)
def test_the_standing_motion_keeps_the_feet_and_lifts_the_weight(hand):
    four_bar = FourBar(leg_mass=5.0, body_mass=21.0)
    linkage = Linkage(four_bar, hand)
    np.testing.assert_allclose(linkage.jacobian(XI) @ motion(four_bar, XI), 0, atol=1e-15)
    rise = four_bar.kappa * four_bar.weight * four_bar.leg_length * np.cos(XI)
    assert linkage.gravity(XI) @ motion(four_bar, XI) == pytest.approx(rise)


@pytest.mark.parametrize("hand", Hand)
def test_the_jacobian_is_the_central_difference_of_the_feet(hand):
    linkage, step = Linkage(FourBar(), hand), 1e-6
    q = linkage.standing(XI)
    slopes = [
        (linkage.feet(q + step * e) - linkage.feet(q - step * e)) / (2 * step) for e in np.eye(7)
    ]
    np.testing.assert_allclose(linkage.jacobian(XI), np.transpose(slopes), atol=1e-9)


def test_the_mass_matrix_moves_the_whole_mass_and_lacks_the_feet():
    four_bar = FourBar()
    M = Linkage(four_bar).mass_matrix(XI)
    np.testing.assert_allclose(M[:2, :2], four_bar.mass * np.eye(2))
    np.testing.assert_allclose(M, M.T)
    np.testing.assert_array_equal(M[[4, 6]], 0)
    assert np.linalg.matrix_rank(M) == 5


def test_left_is_where_the_hand_says():
    four_bar = FourBar()
    minus = Linkage(four_bar, Hand.LEFT_AT_MINUS_X).com_to_feet(XI)
    plus = Linkage(four_bar, Hand.LEFT_AT_PLUS_X).com_to_feet(XI)
    np.testing.assert_allclose(minus, plus[::-1])
    np.testing.assert_allclose(minus[1] - minus[0], [four_bar.rod_length, 0])


def test_the_balance_takes_moments_about_the_com():
    X = wrench_balance(np.array([[-1.0, -2.0], [3.0, -2.0]]))
    np.testing.assert_array_equal(X @ [1, 0, 0, 0, 0, 0], [1, 0, 2])
    np.testing.assert_array_equal(X @ [0, 0, 0, 0, 1, 0], [0, 1, 3])
    np.testing.assert_array_equal(X @ [0, 0, 5, 0, 0, 7], [0, 0, 12])


def test_minimising_one_objective_is_the_independent_minimum():
    four_bar = FourBar(leg_mass=7.0, body_mass=11.0)
    linkage = Linkage(four_bar)
    for objective, weights in (
        (wrench_norm(0.7), statics.wrench_weights(0.7)),
        (torque_norm(linkage, XI), statics.torque_weights()),
    ):
        found = minimise_in_order(linkage, XI, [objective])
        z = statics.minimise(four_bar, XI, weights).real
        np.testing.assert_allclose(found.wrenches.ravel(), z[:6], atol=1e-9)
        assert found.freedom == (0,)


def test_tangential_forces_leave_a_plane_of_minimisers_that_the_tie_break_decides():
    four_bar = FourBar()
    linkage = Linkage(four_bar)
    alone = minimise_in_order(linkage, XI, [tangential_norm()])
    assert alone.freedom == (2,)
    np.testing.assert_allclose(alone.wrenches[:, 0], 0, atol=1e-10)

    for tie_break, weights in (
        (wrench_norm(), statics.wrench_weights(1.0)),
        (torque_norm(linkage, XI), statics.torque_weights()),
    ):
        found = minimise_in_order(linkage, XI, [tangential_norm(), tie_break])
        z = statics.minimise(four_bar, XI, weights, no_tangential=True).real
        np.testing.assert_allclose(found.wrenches.ravel(), z[:6], atol=1e-9)
        assert found.freedom == (2, 0)


def test_lemma_3_holds_with_the_wrench_tie_break_on_level_feet_only():
    linkage = Linkage(FourBar())
    orders = [[tangential_norm(), wrench_norm()], [wrench_norm()]]
    level = [minimise_in_order(linkage, XI, order).cop() for order in orders]
    np.testing.assert_allclose(level[0], level[1], rtol=1e-12)
    raised = [
        minimise_in_order(linkage, XI, order, right_foot_raised=0.1).wrenches for order in orders
    ]
    assert np.abs(raised[0][:, 0]).max() < 1e-10 < 0.1 < np.abs(raised[1][:, 0]).max()
    by_torque = minimise_in_order(linkage, XI, [tangential_norm(), torque_norm(linkage, XI)])
    assert np.abs(by_torque.cop() - level[1]).max() > 0.01


def test_no_objective_is_rejected():
    with pytest.raises(InvalidInputError, match="objectives"):
        minimise_in_order(Linkage(FourBar()), XI, [])
