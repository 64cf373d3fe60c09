"""Numbers behind the errata that are statements: each laid beside the statics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import (
    Discrepancy,
    relative_difference,
    sampled,
    sampled_angles,
)
from copsense.paper.closed_form.family import solve_four_bar_member
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar
from copsense.paper.closed_form.lexicographic import (
    minimise_in_order,
    tangential_norm,
    torque_norm,
    wrench_norm,
)
from copsense.paper.closed_form.linkage import Hand, Linkage
from copsense.paper.closed_form.printed import PRINTED_FORMS

_RELATIVE = "largest relative difference"
_OWN = Hand.LEFT_AT_MINUS_X


def sensor_frame(four_bar: FourBar) -> Discrepancy:
    """Eq. (10) in a frame above the sole: its tangential force then moves the CoP."""

    def worst(height: float) -> float:
        wrenches = sampled(four_bar, "minimum-torque", "wrenches", _OWN)
        fx, fy, mz = np.moveaxis(wrenches, -1, 0)
        # about a point `height` above: m_z' = m_z + height f_x
        return relative_difference((mz + height * fx) / fy, mz / fy)

    return Discrepancy(
        f"{_RELATIVE} of the CoP read in a frame 0.05 m above the sole, criterion 2",
        worst(0.05),
        "origin on the contact plane",
        worst(0.0),
    )


def lagrange(four_bar: FourBar) -> Discrepancy:
    """Eq. (12) at rest, where dL/dq = -dV/dq = -G, against the statics of criterion 2."""
    linkage, as_printed, corrected = Linkage(four_bar), 0.0, 0.0
    for xi in sampled_angles(four_bar):
        solution = solve_four_bar(four_bar, xi, "minimum-torque")
        G, actuation = linkage.gravity(xi), np.concatenate([np.zeros(3), solution.torques])
        contact = linkage.jacobian(xi).T @ solution.wrenches.ravel()
        scale = np.abs(G).max()
        as_printed = max(as_printed, float(np.abs(-G - actuation).max() / scale))
        corrected = max(corrected, float(np.abs(G - actuation - contact).max() / scale))
    return Discrepancy(
        "largest residual of the equation at rest, in parts of the largest gravity term",
        as_printed,
        "- dL/dq, and J'f on the right",
        corrected,
    )


def point_masses(four_bar: FourBar) -> Discrepancy:
    """Eq. (9) needs M^-1; at equilibrium any SPD matrix does the same."""
    linkage, rng, worst, missing = Linkage(four_bar), np.random.default_rng(0), 0.0, 0
    for xi in sampled_angles(four_bar):
        solution = solve_four_bar(four_bar, xi, "minimum-torque")
        M = linkage.mass_matrix(xi)
        missing = max(missing, 7 - int(np.linalg.matrix_rank(M, tol=1e-9 * np.abs(M).max())))
        J, root = linkage.jacobian(xi), rng.normal(size=(7, 7))
        A = root @ root.T + np.eye(7)
        load = linkage.gravity(xi) - np.concatenate([np.zeros(3), solution.torques])
        # f = (J A J')^-1 J A (G - B tau), Eq. (9) with A for M^-1
        f = np.linalg.solve(J @ A @ J.T, J @ A @ load)
        worst = max(worst, relative_difference(f, solution.wrenches.ravel()))
    return Discrepancy(
        "rank that M lacks of 7; then: relative difference of f with random SPD matrices",
        float(missing),
        "any SPD matrix in place of M^-1, at equilibrium",
        worst,
    )


def column_rank(four_bar: FourBar) -> Discrepancy:
    """A^+ A = 1 for Eq. (25)'s A, on a 12 x 23 robot and on the four-bar's 6 x 4."""

    def defect(A: Float[np.ndarray, "k n"]) -> float:
        return float(np.linalg.norm(np.linalg.pinv(A) @ A - np.eye(A.shape[1]), 2))

    linkage = Linkage(four_bar)
    own = max(defect(linkage.jacobian(xi)[:, 3:]) for xi in sampled_angles(four_bar))
    return Discrepancy(
        "norm of A^+ A - 1 for a random 12 x 23 A; then: for the four-bar's J_j",
        defect(np.random.default_rng(0).normal(size=(12, 23))),
        "full column rank",
        own,
    )


def tie_break(four_bar: FourBar) -> Discrepancy:
    """Lemma 3's CoPs with the torque tie-break and with the wrench tie-break, against Lemma 1's."""
    linkage, holds = Linkage(four_bar), sampled(four_bar, "minimum-wrench", "cop", _OWN)
    by_torque, by_wrench = [], []
    for xi in sampled_angles(four_bar):
        first = tangential_norm()
        by_torque.append(minimise_in_order(linkage, xi, [first, torque_norm(linkage, xi)]).cop())
        by_wrench.append(minimise_in_order(linkage, xi, [first, wrench_norm()]).cop())
    return Discrepancy(
        f"{_RELATIVE} of the CoPs, ties broken by the torque norm",
        relative_difference(np.array(by_torque), holds),
        "ties broken by the wrench norm, feet at equal height",
        relative_difference(np.array(by_wrench), holds),
    )


def load_over_a_foot(four_bar: FourBar) -> Discrepancy:
    """The text's f_y = m g with the CoM over a foot, under criterion 2 and for share 1."""
    # A hair short of the foot: with a = 1 the other foot would be bare, which is an error.
    xi = four_bar.angle_at((0.5 - 1e-10) * four_bar.rod_length)

    def worst(share: float) -> float:
        load = solve_four_bar_member(four_bar, xi, share).wrenches[1, 1] / four_bar.weight
        return float(abs(1.0 - load) / load)

    return Discrepancy(
        "relative difference of m g from the loaded foot's vertical force",
        worst(solve_four_bar(four_bar, xi, "minimum-torque").share),
        "share 1: all of the CoM's moment carried by load transfer",
        worst(1.0),
    )


def pole(four_bar: FourBar) -> float:
    """Delta xi [rad] at which criterion 2 unloads a foot: sin(Delta xi) = d / (kappa l)."""
    # a u = d/2 with a = 1/2
    return math.pi / 2 - four_bar.angle_at(four_bar.rod_length)


def divergence(four_bar: FourBar) -> Discrepancy:
    """The text's 14 degrees against criterion 2's pole, and with the rod that puts it there."""
    claimed = float(PRINTED_FORMS["14 deg"].evaluate(four_bar, math.pi / 2)[1])
    rod = four_bar.kappa * four_bar.leg_length * math.sin(claimed)
    fitted = pole(replace(four_bar, rod_length=rod))
    return Discrepancy(
        _RELATIVE,
        abs(claimed - pole(four_bar)) / pole(four_bar),
        f"d/l = {rod / four_bar.leg_length:.4f}",
        abs(claimed - fitted) / fitted,
    )
