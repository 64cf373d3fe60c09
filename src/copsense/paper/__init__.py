"""The paper's four-bar in closed form, its printed formulas, errata, claims and figures.

F. Romano, D. Pucci, S. Traversaro, F. Nori, "The Static Center of Pressure Sensitivity: a further
Criterion to assess Contact Stability and Balancing Controllers", arXiv:1610.01495.
"""

from __future__ import annotations

from copsense.paper.claims.claim import (
    CheckedClaim,
    Claim,
    EvaluatedClaim,
    Finding,
    Verdict,
    evaluate_claims,
    judge,
)
from copsense.paper.claims.closed_loop_claims import SWAY_CLAIMS, evaluate_sway_claims
from copsense.paper.claims.four_bar_claims import FOUR_BAR_CLAIMS, evaluate_four_bar_claims
from copsense.paper.claims.icub_claims import ICUB_CLAIMS, evaluate_icub_claims
from copsense.paper.claims.icub_sweep import LateralSweep, Series
from copsense.paper.claims.reference_values import ReferenceValue, compare_with_reference
from copsense.paper.claims.sway_runs import (
    Stretch,
    Sway,
    completed,
    stretch,
    tip_travel,
    tracking_error,
)
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import Discrepancy
from copsense.paper.closed_form.family import FourBarSolution, solve_four_bar_member
from copsense.paper.closed_form.figure_data import (
    Curve,
    FigureData,
    Sampling,
    Segment,
    figure_3a,
    figure_3b,
    figure_4,
    figure_5,
)
from copsense.paper.closed_form.four_bar_criteria import (
    FOUR_BAR_CRITERIA,
    FourBarCriterion,
    solve_four_bar,
)
from copsense.paper.closed_form.linkage import Hand
from copsense.paper.closed_form.printed import PRINTED_FORMS, PrintedForm
from copsense.paper.errata.errata_table import ERRATA, Erratum, EvaluatedErratum, evaluate_errata

__all__ = [
    "ERRATA",
    "FOUR_BAR_CLAIMS",
    "FOUR_BAR_CRITERIA",
    "ICUB_CLAIMS",
    "PRINTED_FORMS",
    "SWAY_CLAIMS",
    "CheckedClaim",
    "Claim",
    "Curve",
    "Discrepancy",
    "Erratum",
    "EvaluatedClaim",
    "EvaluatedErratum",
    "FigureData",
    "Finding",
    "FourBar",
    "FourBarCriterion",
    "FourBarSolution",
    "Hand",
    "LateralSweep",
    "PrintedForm",
    "ReferenceValue",
    "Sampling",
    "Segment",
    "Series",
    "Stretch",
    "Sway",
    "Verdict",
    "compare_with_reference",
    "completed",
    "evaluate_claims",
    "evaluate_errata",
    "evaluate_four_bar_claims",
    "evaluate_icub_claims",
    "evaluate_sway_claims",
    "figure_3a",
    "figure_3b",
    "figure_4",
    "figure_5",
    "judge",
    "solve_four_bar",
    "solve_four_bar_member",
    "stretch",
    "tip_travel",
    "tracking_error",
]
