"""The claims that are formulas: Lemmas 1 to 3 and the steps of their proofs."""

from __future__ import annotations

from functools import partial

import numpy as np

from copsense.paper.claims.claim import CheckedClaim, Claim, Finding, judge
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import (
    EXACT,
    relative_difference,
    sampled_angles,
    with_kappa,
)
from copsense.paper.closed_form.lexicographic import (
    Objective,
    minimise_in_order,
    tangential_norm,
    torque_norm,
    wrench_norm,
)
from copsense.paper.closed_form.linkage import Hand, Linkage
from copsense.paper.closed_form.printed import PRINTED_FORMS
from copsense.paper.errata.errata_forms import (
    at_printed_kappa,
    derived,
    form_difference,
    printed,
    third_row,
)

_DERIVATIVE = 1e-8  # finite differences of fourth order with a step of 1e-3 are this good
_SIDE = {Hand.LEFT_AT_MINUS_X: "-x", Hand.LEFT_AT_PLUS_X: "+x"}


def _formula(four_bar: FourBar, *, equation: str, criterion: str, quantity: str) -> Finding:
    """A printed form against what holds; the condition is its numbers' kappa, and its hand."""
    form, condition = PRINTED_FORMS[equation], ""
    own = form_difference(four_bar, equation, criterion, quantity)
    under = form_difference(at_printed_kappa(four_bar, equation), equation, criterion, quantity)
    if form.kappa is not None:
        condition = f"; at kappa = {form.kappa} it is {under:.1e}"
    return Finding(
        judge(own < EXACT, under < EXACT),
        own,
        "1",
        f"largest relative difference at kappa = {four_bar.kappa:g} with the left foot at "
        f"{_SIDE[form.hand]}{condition} (tolerance {EXACT:.0e})",
    )


def _one_hand(four_bar: FourBar) -> Finding:
    """Whether some one hand suits Eqs. (15), (16) and (17), each at the kappa of its numbers."""
    least = min(
        max(
            form_difference(
                at_printed_kappa(four_bar, equation), equation, criterion, quantity, hand
            )
            for equation, criterion, quantity in (
                ("(15)", "minimum-wrench", "wrenches"),
                ("(16)", "minimum-wrench", "sensitivity"),
                ("(17)", "minimum-torque", "wrenches"),
            )
        )
        for hand in Hand
    )
    return Finding(
        judge(least < EXACT),
        least,
        "1",
        "largest relative difference of Eqs. (15), (16), (17), each at its own kappa, for the "
        f"better choice of the left foot's side (tolerance {EXACT:.0e})",
    )


def _derivative(four_bar: FourBar, *, given: str, differentiated: str) -> Finding:
    number = relative_difference(printed(four_bar, given), derived(four_bar, differentiated))
    return Finding(
        judge(number < _DERIVATIVE),
        number,
        "1",
        f"largest relative difference from central differences (tolerance {_DERIVATIVE:.0e})",
    )


def _specialises(four_bar: FourBar) -> Finding:
    judged = with_kappa(four_bar, 0.75)
    number = relative_difference(printed(judged, "(31)"), printed(judged, "(17)"), columns=1)
    return Finding(
        judge(number < EXACT),
        number,
        "1",
        f"largest relative difference of Eqs. (31) and (17) at kappa = 3/4 (tolerance {EXACT:.0e})",
    )


def _eq_29(four_bar: FourBar) -> Finding:
    found = third_row(four_bar)
    return Finding(
        judge(found.as_printed < EXACT, found.agreement < EXACT),
        found.as_printed,
        "1",
        "largest relative difference of the wrenches from two rows only. Condition: a third row "
        f"m g d / 4, with which it is {found.agreement:.1e}, left at +x (tolerance {EXACT:.0e})",
    )


def _lemma_3(four_bar: FourBar) -> Finding:
    """Minimise in order on the statics; compare CoPs with minimum wrench norm, same feet."""
    linkage, angles = Linkage(four_bar), sampled_angles(four_bar)

    def worst(raised: float, *tie_breaks: Objective) -> tuple[float, int]:
        numbers, left = [], 0
        for xi in angles:
            found = minimise_in_order(
                linkage, xi, [tangential_norm(), *tie_breaks], right_foot_raised=raised
            )
            lemma_1 = minimise_in_order(linkage, xi, [wrench_norm()], right_foot_raised=raised)
            numbers.append(np.abs(found.cop() - lemma_1.cop()).max() / four_bar.rod_length)
            left = found.freedom[0]
        return float(max(numbers)), left

    by_wrench, free = worst(0.0, wrench_norm())
    by_torque = max(
        np.abs(
            minimise_in_order(linkage, xi, [tangential_norm(), torque_norm(linkage, xi)]).cop()
            - minimise_in_order(linkage, xi, [wrench_norm()]).cop()
        ).max()
        / four_bar.rod_length
        for xi in angles
    )
    uneven, _ = worst(0.1 * four_bar.leg_length, wrench_norm())
    return Finding(
        judge(free == 0 and by_wrench < EXACT, by_wrench < EXACT),
        by_torque,
        "1",
        f"largest difference of the CoPs in parts of d with ties broken by the torque norm: the "
        f"minimisers are a {free}-dimensional family. Condition: ties broken by the wrench norm "
        f"({by_wrench:.0e}, tolerance {EXACT:.0e}) and feet at equal height (a right foot l/10 "
        f"higher: {uneven:.1e})",
    )


LEMMA_CLAIMS: tuple[CheckedClaim[FourBar], ...] = (
    CheckedClaim(
        Claim("eq-15", "Lemma 1, Eq. (15)", "The wrenches of criterion 1."),
        partial(_formula, equation="(15)", criterion="minimum-wrench", quantity="wrenches"),
    ),
    CheckedClaim(
        Claim("eq-16", "Lemma 1, Eq. (16)", "The sensitivities of criterion 1."),
        partial(_formula, equation="(16)", criterion="minimum-wrench", quantity="sensitivity"),
    ),
    CheckedClaim(
        Claim("appendix-a-cop", "Appendix A", "The static CoPs of criterion 1."),
        partial(_formula, equation="Appendix A", criterion="minimum-wrench", quantity="cop"),
    ),
    CheckedClaim(
        Claim("eq-16-derives", "Appendix A", "Eq. (16) is the derivative of these CoPs."),
        partial(_derivative, given="(16)", differentiated="Appendix A"),
    ),
    CheckedClaim(
        Claim("eq-17", "Lemma 2, Eq. (17)", "The wrenches of criterion 2."),
        partial(_formula, equation="(17)", criterion="minimum-torque", quantity="wrenches"),
    ),
    CheckedClaim(
        Claim("eq-18", "Lemma 2, Eq. (18)", "The sensitivities of criterion 2."),
        partial(_formula, equation="(18)", criterion="minimum-torque", quantity="sensitivity"),
    ),
    CheckedClaim(
        Claim(
            "one-hand",
            "Fig. 1, Eqs. (15)-(17)",
            "Left and right mean the same feet throughout the two lemmas.",
        ),
        _one_hand,
    ),
    CheckedClaim(
        Claim("eq-29", "Appendix B, Eq. (29)", "The redundancy that minimises the torques."),
        _eq_29,
    ),
    CheckedClaim(
        Claim("eq-31", "Appendix B, Eq. (31)", "The wrenches of criterion 2 for any masses."),
        partial(_formula, equation="(31)", criterion="minimum-torque", quantity="wrenches"),
    ),
    CheckedClaim(
        Claim("eq-31-specialises", "Appendix B", "With Hypothesis 1-iii, Eq. (31) is Eq. (17)."),
        _specialises,
    ),
    CheckedClaim(
        Claim("eq-32", "Appendix B, Eq. (32)", "The static CoPs of criterion 2 from Delta."),
        partial(_formula, equation="(32)", criterion="minimum-torque", quantity="cop"),
    ),
    CheckedClaim(
        Claim("eq-33", "Appendix B, Eq. (33)", "The static CoPs of criterion 2."),
        partial(_formula, equation="(33)", criterion="minimum-torque", quantity="cop"),
    ),
    CheckedClaim(
        Claim("eq-18-derives", "Appendix B", "Eq. (18) is the derivative of Eq. (33)."),
        partial(_derivative, given="(18)", differentiated="(33)"),
    ),
    CheckedClaim(
        Claim(
            "lemma-3",
            "Lemma 3",
            "Minimising the tangential forces is equivalent to minimising the wrench norm.",
        ),
        _lemma_3,
    ),
)
