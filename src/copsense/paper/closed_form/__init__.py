"""The paper's four-bar in closed form, its printed formulas and the data of its figures."""

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

__all__ = [
    "FOUR_BAR_CRITERIA",
    "PRINTED_FORMS",
    "Curve",
    "Discrepancy",
    "FigureData",
    "FourBar",
    "FourBarCriterion",
    "FourBarSolution",
    "Hand",
    "PrintedForm",
    "Sampling",
    "Segment",
    "figure_3a",
    "figure_3b",
    "figure_4",
    "figure_5",
    "solve_four_bar",
    "solve_four_bar_member",
]
