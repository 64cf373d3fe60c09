"""Numbers behind the errata that are formulas: each laid beside the closed form."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import (
    Discrepancy,
    relative_difference,
    sampled,
    sampled_angles,
)
from copsense.paper.closed_form.linkage import Hand, Linkage, wrench_balance
from copsense.paper.closed_form.printed import PRINTED_FORMS

_RELATIVE = "largest relative difference"
_S_MINUS, _S_PLUS = Hand.LEFT_AT_MINUS_X, Hand.LEFT_AT_PLUS_X


def printed(four_bar: FourBar, equation: str) -> Float[np.ndarray, "n ..."]:
    """A printed form at the sampled angles."""
    form = PRINTED_FORMS[equation]
    return np.array([form.evaluate(four_bar, xi) for xi in sampled_angles(four_bar)])


def derived(four_bar: FourBar, equation: str) -> Float[np.ndarray, "n 2"]:
    """d/dxi of a printed form, by central differences of fourth order [1/rad]."""
    evaluate, step = PRINTED_FORMS[equation].evaluate, 1e-3

    def slope(xi: float) -> Float[np.ndarray, "2"]:
        near = evaluate(four_bar, xi + step) - evaluate(four_bar, xi - step)
        far = evaluate(four_bar, xi + 2 * step) - evaluate(four_bar, xi - 2 * step)
        return np.asarray((8 * near - far) / (12 * step))

    return np.array([slope(xi) for xi in sampled_angles(four_bar)])


def form_difference(
    four_bar: FourBar, equation: str, criterion: str, quantity: str, hand: Hand | None = None
) -> float:
    """Largest relative difference of a printed form from the closed form.

    Args:
        four_bar: the linkage, at whose own mass ratio the closed form is taken.
        equation: a key of PRINTED_FORMS.
        criterion: whose solution the form claims to be.
        quantity: the attribute of FourBarSolution that it claims to be.
        hand: where "left" is; the form's own by default.
    """
    holds = sampled(four_bar, criterion, quantity, hand or PRINTED_FORMS[equation].hand)
    columns = int(quantity == "wrenches")
    return relative_difference(printed(four_bar, equation), holds, columns=columns)


def at_printed_kappa(four_bar: FourBar, equation: str) -> FourBar:
    """The linkage with the mass ratio that the form's numbers stand for, if they hide one."""
    kappa = PRINTED_FORMS[equation].kappa
    return four_bar if kappa is None else four_bar.with_kappa(float(kappa))


def form_check(
    four_bar: FourBar, *, equation: str, criterion: str, quantity: str, hypothesis: str
) -> Discrepancy:
    """A printed form at the linkage's own mass ratio, and at the one its numbers stand for."""
    judged = at_printed_kappa(four_bar, equation)
    return Discrepancy(
        _RELATIVE,
        form_difference(four_bar, equation, criterion, quantity),
        hypothesis,
        form_difference(judged, equation, criterion, quantity),
    )


def handedness(four_bar: FourBar) -> Discrepancy:
    """The forms in S+, each at the mass ratio its numbers stand for, read in S- and in S+."""

    def differences(hand: Hand) -> list[float]:
        numbers = [
            form_difference(
                at_printed_kappa(four_bar, equation), equation, criterion, quantity, hand
            )
            for equation, criterion, quantity in (
                ("(16)", "minimum-wrench", "sensitivity"),
                ("(17)", "minimum-torque", "wrenches"),
                ("(31)", "minimum-torque", "wrenches"),
            )
        ]
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
        f"{_RELATIVE}: the least of six forms with left at -x; then: the largest with left at +x",
        min(differences(_S_MINUS)),
        "left foot at +x, each form at its own kappa",
        max(differences(_S_PLUS)),
    )


def wrong_hand(four_bar: FourBar) -> Discrepancy:
    """Eq. (17) read with left at -x, as Eq. (15) is, and with left at +x, at kappa = 3/4."""
    judged = at_printed_kappa(four_bar, "(17)")
    return Discrepancy(
        f"{_RELATIVE} at kappa = 3/4, left at -x as in Eq. (15)",
        form_difference(judged, "(17)", "minimum-torque", "wrenches", _S_MINUS),
        "kappa = 3/4, left at +x",
        form_difference(judged, "(17)", "minimum-torque", "wrenches", _S_PLUS),
    )


def right_jacobian(four_bar: FourBar) -> Discrepancy:
    """J_CR against the linkage's own, as printed and with the sign of l c3 changed."""
    linkage = Linkage(four_bar, _S_PLUS)
    J = np.array([linkage.jacobian(xi)[3:] for xi in sampled_angles(four_bar)])
    given = printed(four_bar, "J_CR")
    corrected = given.copy()
    corrected[:, 1, 2] = -four_bar.rod_length - given[:, 1, 2]  # -d/2 - l c3
    return Discrepancy(
        _RELATIVE,
        relative_difference(given, J),
        "-d/2 - l c3",
        relative_difference(corrected, J),
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
        f"{_RELATIVE} of the wrenches with no third row",
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
        _RELATIVE,
        relative_difference(given, holds),
        "lambda in SCoP_L",
        relative_difference(corrected, holds),
    )


def halved_twice(four_bar: FourBar) -> Discrepancy:
    """Eq. (33) against what holds, and against its supposed origin."""
    judged = at_printed_kappa(four_bar, "(33)")
    origin = []
    for xi in sampled_angles(judged):
        third = judged.weight * judged.rod_length / 4
        Delta = np.append(PRINTED_FORMS["(29)"].evaluate(judged, xi) / 2, third)
        wrenches = redundancy_wrenches(judged, xi, Delta)
        origin.append(wrenches[:, 2] / wrenches[:, 1])
    return Discrepancy(
        _RELATIVE,
        form_difference(four_bar, "(33)", "minimum-torque", "cop"),
        "Delta_1 and Delta_2 halved once more in Eq. (31), and kappa = 3/5",
        relative_difference(printed(judged, "(33)"), np.array(origin)),
    )


def printed_torque_sensitivity(four_bar: FourBar) -> Discrepancy:
    """Eq. (18) against what holds, and against the derivative of Eq. (33)."""
    return Discrepancy(
        _RELATIVE,
        form_difference(four_bar, "(18)", "minimum-torque", "sensitivity"),
        "Eq. (33) differentiated (numerically)",
        relative_difference(printed(four_bar, "(18)"), derived(four_bar, "(33)")),
    )
