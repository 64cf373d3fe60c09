"""The claims that are formulas: Lemmas 1 to 3 and the steps of their proofs."""

from __future__ import annotations

from functools import partial

import numpy as np

from copsense.paper.claims.verdict import Claim, Finding, claim, judge
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import (
    EXACT,
    relative_difference,
    sampled_angles,
)
from copsense.paper.closed_form.lexicographic import (
    Objective,
    minimise_in_order,
    tangential_norm,
    torque_norm,
    wrench_norm,
)
from copsense.paper.closed_form.linkage import Hand, Linkage
from copsense.paper.closed_form.printed import HYPOTHESIS_KAPPA, PRINTED_FORMS
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
        condition = f"kappa = {form.kappa}, where it is {under:.1e}"
        if form.kappa != HYPOTHESIS_KAPPA:
            condition += (
                f". It contradicts the lemma's own Hypothesis 1-iii, kappa = {HYPOTHESIS_KAPPA}"
            )
    return Finding(
        judge(own < EXACT, under < EXACT),
        own,
        "1",
        f"largest relative difference at six postures, at kappa = {four_bar.kappa:g} with the left "
        f"foot at {_SIDE[form.hand]} (tolerance {EXACT:.0e})",
        condition,
    )


@claim(
    "one-hand",
    "Fig. 1, Eqs. (15)-(17)",
    "Left and right mean the same feet throughout the two lemmas.",
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


@claim("eq-31-specialises", "Appendix B", "With Hypothesis 1-iii, Eq. (31) is Eq. (17).")
def _eq_31_specialises(four_bar: FourBar) -> Finding:
    judged = four_bar.with_kappa(0.75)
    number = relative_difference(printed(judged, "(31)"), printed(judged, "(17)"), columns=1)
    return Finding(
        judge(number < EXACT),
        number,
        "1",
        f"largest relative difference of Eqs. (31) and (17) at kappa = 3/4 (tolerance {EXACT:.0e})",
    )


@claim("eq-29", "Appendix B, Eq. (29)", "The redundancy that minimises the torques.")
def _eq_29(four_bar: FourBar) -> Finding:
    found = third_row(four_bar)
    return Finding(
        judge(found.as_printed < EXACT),
        found.as_printed,
        "1",
        "largest relative difference of the wrenches from the two rows printed (tolerance "
        f"{EXACT:.0e}); corrected by a third row, m g d / 4, it is {found.agreement:.1e}, left at "
        "+x",
    )


@claim(
    "lemma-3",
    "Lemma 3",
    "Minimising the tangential forces is equivalent to minimising the wrench norm.",
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
        f"minimisers are a {free}-dimensional family",
        f"ties broken by the wrench norm ({by_wrench:.0e}, tolerance {EXACT:.0e}) and feet at "
        f"equal height (a right foot l/10 higher: {uneven:.1e})",
    )


def _formula_claim(
    identifier: str, where: str, statement: str, equation: str, criterion: str, quantity: str
) -> Claim[FourBar]:
    check = partial(_formula, equation=equation, criterion=criterion, quantity=quantity)
    return Claim(identifier, where, statement, check)


_WRENCH, _TORQUE = "minimum-wrench", "minimum-torque"

_eq_15 = _formula_claim(
    "eq-15", "Lemma 1, Eq. (15)", "The wrenches of criterion 1.", "(15)", _WRENCH, "wrenches"
)
_eq_16 = _formula_claim(
    "eq-16",
    "Lemma 1, Eq. (16)",
    "The sensitivities of criterion 1.",
    "(16)",
    _WRENCH,
    "sensitivity",
)
_appendix_a_cop = _formula_claim(
    "appendix-a-cop", "Appendix A", "The static CoPs of criterion 1.", "Appendix A", _WRENCH, "cop"
)
_eq_16_derives = Claim(
    "eq-16-derives",
    "Appendix A",
    "Eq. (16) is the derivative of these CoPs.",
    partial(_derivative, given="(16)", differentiated="Appendix A"),
)
_eq_17 = _formula_claim(
    "eq-17", "Lemma 2, Eq. (17)", "The wrenches of criterion 2.", "(17)", _TORQUE, "wrenches"
)
_eq_18 = _formula_claim(
    "eq-18",
    "Lemma 2, Eq. (18)",
    "The sensitivities of criterion 2.",
    "(18)",
    _TORQUE,
    "sensitivity",
)
_eq_31 = _formula_claim(
    "eq-31",
    "Appendix B, Eq. (31)",
    "The wrenches of criterion 2 for any masses.",
    "(31)",
    _TORQUE,
    "wrenches",
)
_eq_32 = _formula_claim(
    "eq-32",
    "Appendix B, Eq. (32)",
    "The static CoPs of criterion 2 from Delta.",
    "(32)",
    _TORQUE,
    "cop",
)
_eq_33 = _formula_claim(
    "eq-33", "Appendix B, Eq. (33)", "The static CoPs of criterion 2.", "(33)", _TORQUE, "cop"
)
_eq_18_derives = Claim(
    "eq-18-derives",
    "Appendix B",
    "Eq. (18) is the derivative of Eq. (33).",
    partial(_derivative, given="(18)", differentiated="(33)"),
)

LEMMA_CLAIMS: tuple[Claim[FourBar], ...] = (
    _eq_15,
    _eq_16,
    _appendix_a_cop,
    _eq_16_derives,
    _eq_17,
    _eq_18,
    _one_hand,
    _eq_29,
    _eq_31,
    _eq_31_specialises,
    _eq_32,
    _eq_33,
    _eq_18_derives,
    _lemma_3,
)
