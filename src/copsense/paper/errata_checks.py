"""The numbers behind the errata: each check lays a printed statement beside what holds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.paper.comparison import (
    Discrepancy,
    angle_at,
    relative_difference,
    sampled,
    sampled_angles,
    with_kappa,
)
from copsense.paper.criteria import solve_four_bar
from copsense.paper.family import solve_four_bar_member
from copsense.paper.four_bar import FourBar
from copsense.paper.lexicographic import (
    minimise_in_order,
    tangential_norm,
    torque_norm,
    wrench_norm,
)
from copsense.paper.linkage import Hand, Linkage, wrench_balance
from copsense.paper.printed import PRINTED_FORMS

RELATIVE = "largest relative difference"
_S_MINUS, _S_PLUS = Hand.LEFT_AT_MINUS_X, Hand.LEFT_AT_PLUS_X


def printed(four_bar: FourBar, equation: str) -> Float[np.ndarray, "n ..."]:
    """A printed form at the sampled angles."""
    form = PRINTED_FORMS[equation]
    return np.array([form.evaluate(four_bar, xi) for xi in sampled_angles(four_bar)])


def sensor_frame(four_bar: FourBar) -> Discrepancy:
    """Eq. (10) in a frame above the sole: its tangential force then moves the CoP."""

    def worst(height: float) -> float:
        wrenches = sampled(four_bar, "minimum-torque", "wrenches", _S_MINUS)
        fx, fy, mz = np.moveaxis(wrenches, -1, 0)
        # about a point `height` above: m_z' = m_z + height f_x
        return relative_difference((mz + height * fx) / fy, mz / fy)

    return Discrepancy(
        f"{RELATIVE} of the CoP read in a frame 0.05 m above the sole, criterion 2",
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
        as_printed = max(as_printed, np.abs(-G - actuation).max() / scale)
        corrected = max(corrected, np.abs(G - actuation - contact).max() / scale)
    return Discrepancy(
        "largest residual of the equation at rest, in parts of the largest gravity term",
        float(as_printed),
        "- dL/dq, and J'f on the right",
        float(corrected),
    )


def point_masses(four_bar: FourBar) -> Discrepancy:
    """Eq. (9) needs M^-1; at equilibrium any SPD matrix does the same."""
    linkage, rng, worst, missing = Linkage(four_bar), np.random.default_rng(0), 0.0, 0
    for xi in sampled_angles(four_bar):
        solution = solve_four_bar(four_bar, xi, "minimum-torque")
        missing = 7 - int(np.linalg.matrix_rank(linkage.mass_matrix(xi), tol=1e-9 * four_bar.mass))
        J, root = linkage.jacobian(xi), rng.normal(size=(7, 7))
        A = root @ root.T + np.eye(7)
        load = linkage.gravity(xi) - np.concatenate([np.zeros(3), solution.torques])
        # f = (J A J')^-1 J A (G - B tau), Eq. (9) with A for M^-1
        f = np.linalg.solve(J @ A @ J.T, J @ A @ load)
        worst = max(worst, relative_difference(f, solution.wrenches.ravel()))
    return Discrepancy(
        "as printed: rank that M lacks of 7; then: relative difference of f with random SPD matrices",
        float(missing),
        "any SPD matrix in place of M^-1, at equilibrium",
        worst,
    )


def handedness(four_bar: FourBar) -> Discrepancy:
    """The forms in S+, each at the mass ratio its numbers stand for, read in S- and in S+."""

    def worst(hand: Hand) -> list[float]:
        numbers = []
        for equation, criterion, quantity in (
            ("(16)", "minimum-wrench", "sensitivity"),
            ("(17)", "minimum-torque", "wrenches"),
            ("(31)", "minimum-torque", "wrenches"),
        ):
            kappa = PRINTED_FORMS[equation].kappa
            judged = four_bar if kappa is None else with_kappa(four_bar, float(kappa))
            holds = sampled(judged, criterion, quantity, hand)
            columns = int(quantity == "wrenches")
            numbers.append(relative_difference(printed(judged, equation), holds, columns=columns))
        linkage, angles = Linkage(four_bar, hand), sampled_angles(four_bar)
        M = np.array([linkage.mass_matrix(xi)[:3, 3:] for xi in angles])
        J = np.array([linkage.jacobian(xi)[:3] for xi in angles])
        numbers.append(relative_difference(printed(four_bar, "(13)"), M))
        numbers.append(relative_difference(printed(four_bar, "J_CL"), J))
        # Eq. (29): Delta_1, Delta_2 are f_L minus half the weight
        f_L = sampled(four_bar, "minimum-torque", "wrenches", hand)[:, 0, :2]
        Delta = f_L - four_bar.weight * np.array([0.0, 0.5])
        numbers.append(relative_difference(printed(four_bar, "(29)"), Delta))
        return numbers

    return Discrepancy(
        f"{RELATIVE}: the least of the six forms with left at -x; then: the largest with left at +x",
        min(worst(_S_MINUS)),
        "left foot at +x, each form at its own kappa",
        max(worst(_S_PLUS)),
    )


def right_jacobian(four_bar: FourBar) -> Discrepancy:
    """J_CR against the linkage's own, as printed and with the sign of l c3 changed."""
    linkage = Linkage(four_bar, _S_PLUS)
    J = np.array([linkage.jacobian(xi)[3:] for xi in sampled_angles(four_bar)])
    given = printed(four_bar, "J_CR")
    corrected = given.copy()
    corrected[:, 1, 2] = -four_bar.rod_length - given[:, 1, 2]  # -d/2 - l c3
    return Discrepancy(
        RELATIVE,
        relative_difference(given, J),
        "-d/2 - l c3",
        relative_difference(corrected, J),
    )


def against(
    equation: str, criterion: str, quantity: str, kappa: float | None, hypothesis: str
) -> tuple[str, str, str, float | None, str]:
    """Name the arguments of `form_check`, for the table."""
    return equation, criterion, quantity, kappa, hypothesis


def form_check(
    four_bar: FourBar, equation: str, criterion: str, quantity: str, kappa: float, hypothesis: str
) -> Discrepancy:
    """A printed form at the linkage's own mass ratio, and at the one that its numbers stand for."""
    hand, columns = PRINTED_FORMS[equation].hand, int(quantity == "wrenches")

    def worst(judged: FourBar) -> float:
        holds = sampled(judged, criterion, quantity, hand)
        return relative_difference(printed(judged, equation), holds, columns=columns)

    return Discrepancy(RELATIVE, worst(four_bar), hypothesis, worst(with_kappa(four_bar, kappa)))


def wrong_hand(four_bar: FourBar) -> Discrepancy:
    """Eq. (17) read with left at -x, as Eq. (15) is, and with left at +x at kappa = 3/4."""
    judged = with_kappa(four_bar, 0.75)
    given = printed(judged, "(17)")
    worst = {
        hand: relative_difference(
            given, sampled(judged, "minimum-torque", "wrenches", hand), columns=1
        )
        for hand in Hand
    }
    return Discrepancy(
        f"{RELATIVE} at kappa = 3/4, left at -x as in Eq. (15)",
        worst[_S_MINUS],
        "kappa = 3/4, left at +x",
        worst[_S_PLUS],
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


def redundancy_wrenches(
    four_bar: FourBar, xi: float, Delta: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "2 3"]:
    """f_L and f_R of [Romano2016] Eq. (24) in the plane, left at +x [N, N m]."""
    X = wrench_balance(Linkage(four_bar, _S_PLUS).com_to_feet(xi))
    half = np.array([0.0, four_bar.weight / 2, 0.0])
    f_L = np.linalg.solve(X[:, :3], half + Delta)
    f_R = np.linalg.solve(X[:, 3:], half - Delta)
    return np.array([f_L, f_R])


def third_row(four_bar: FourBar) -> Discrepancy:
    """Eq. (24) with Eq. (29)'s two rows and nothing below, and with the third row m g d / 4."""
    holds = sampled(four_bar, "minimum-torque", "wrenches", _S_PLUS)

    def worst(third: float) -> float:
        given = [
            redundancy_wrenches(four_bar, xi, np.append(Delta, third))
            for xi, Delta in zip(sampled_angles(four_bar), printed(four_bar, "(29)"), strict=True)
        ]
        return relative_difference(np.array(given), holds, columns=1)

    return Discrepancy(
        f"{RELATIVE} of the wrenches with no third row",
        worst(0.0),
        "third row (m g / 2) d / 2",
        worst(four_bar.weight * four_bar.rod_length / 4),
    )


def left_arm(four_bar: FourBar) -> Discrepancy:
    """Eq. (32) with rho in SCoP_L as printed, and with lambda."""
    holds, given = sampled(four_bar, "minimum-torque", "cop", _S_PLUS), printed(four_bar, "(32)")
    corrected = given.copy()
    for row, xi in zip(corrected, sampled_angles(four_bar), strict=True):
        D1, D2 = PRINTED_FORMS["(29)"].evaluate(four_bar, xi) / four_bar.weight
        (lam1, lam2), _ = Linkage(four_bar, _S_PLUS).com_to_feet(xi)
        row[0] = (-lam1 / 2 + lam2 * D1 - lam1 * D2 + four_bar.rod_length / 4) / (1 / 2 + D2)
    return Discrepancy(
        RELATIVE,
        relative_difference(given, holds),
        "lambda in SCoP_L",
        relative_difference(corrected, holds),
    )


def halved_twice(four_bar: FourBar) -> Discrepancy:
    """Eq. (33) against what holds, and against its supposed origin."""
    judged = with_kappa(four_bar, 0.6)
    origin = []
    for xi in sampled_angles(judged):
        half = np.append(PRINTED_FORMS["(29)"].evaluate(judged, xi) / 2, 0.0)
        half[2] = judged.weight * judged.rod_length / 4
        wrenches = redundancy_wrenches(judged, xi, half)
        origin.append(wrenches[:, 2] / wrenches[:, 1])
    holds = sampled(four_bar, "minimum-torque", "cop", _S_PLUS)
    return Discrepancy(
        RELATIVE,
        relative_difference(printed(four_bar, "(33)"), holds),
        "Delta_1 and Delta_2 halved once more in Eq. (31), and kappa = 3/5",
        relative_difference(printed(judged, "(33)"), np.array(origin)),
    )


def derived(four_bar: FourBar, equation: str) -> Float[np.ndarray, "n 2"]:
    """d/dxi of a printed form, by central differences of fourth order [1/rad]."""
    evaluate, step = PRINTED_FORMS[equation].evaluate, 1e-3

    def slope(xi: float) -> Float[np.ndarray, "2"]:
        near = evaluate(four_bar, xi + step) - evaluate(four_bar, xi - step)
        far = evaluate(four_bar, xi + 2 * step) - evaluate(four_bar, xi - 2 * step)
        return np.asarray((8 * near - far) / (12 * step))

    return np.array([slope(xi) for xi in sampled_angles(four_bar)])


def printed_torque_sensitivity(four_bar: FourBar) -> Discrepancy:
    """Eq. (18) against what holds, and against the derivative of Eq. (33)."""
    given = printed(four_bar, "(18)")
    return Discrepancy(
        RELATIVE,
        relative_difference(given, sampled(four_bar, "minimum-torque", "sensitivity", _S_PLUS)),
        "Eq. (33) differentiated (numerically)",
        relative_difference(given, derived(four_bar, "(33)")),
    )


def tie_break(four_bar: FourBar) -> Discrepancy:
    """Lemma 3's CoPs with the torque tie-break and with the wrench tie-break, against Lemma 1's."""
    linkage, holds = Linkage(four_bar), sampled(four_bar, "minimum-wrench", "cop", _S_MINUS)
    by_torque, by_wrench = [], []
    for xi in sampled_angles(four_bar):
        first = tangential_norm()
        by_torque.append(minimise_in_order(linkage, xi, [first, torque_norm(linkage, xi)]).cop())
        by_wrench.append(minimise_in_order(linkage, xi, [first, wrench_norm()]).cop())
    return Discrepancy(
        f"{RELATIVE} of the CoPs, ties broken by the torque norm",
        relative_difference(np.array(by_torque), holds),
        "ties broken by the wrench norm, feet at equal height",
        relative_difference(np.array(by_wrench), holds),
    )


def load_over_a_foot(four_bar: FourBar) -> Discrepancy:
    """The text's f_y = m g with the CoM over a foot, under criterion 2 and for share 1."""
    xi = angle_at(four_bar, 0.499999999 * four_bar.rod_length)  # at a = 1 the other foot is bare

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
    return math.pi / 2 - angle_at(four_bar, four_bar.rod_length)


def divergence(four_bar: FourBar) -> Discrepancy:
    """The text's 14 degrees against criterion 2's pole, and with the rod that would put it there."""
    claimed = PRINTED_FORMS["14 deg"].evaluate(four_bar, math.pi / 2)[1]
    rod = four_bar.kappa * four_bar.leg_length * math.sin(claimed)
    fitted = pole(replace(four_bar, rod_length=rod))
    return Discrepancy(
        RELATIVE,
        abs(claimed - pole(four_bar)) / pole(four_bar),
        f"d/l = {rod / four_bar.leg_length:.4f}",
        abs(claimed - fitted) / fitted,
    )
