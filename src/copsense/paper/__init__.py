"""The paper: its four-bar in closed form, errata, claims, reproduction and report.

F. Romano, D. Pucci, S. Traversaro, F. Nori, "The Static Center of Pressure Sensitivity: a further
Criterion to assess Contact Stability and Balancing Controllers", arXiv:1610.01495.

Each room reads from those before it:

- `copsense.paper.closed_form`: the four-bar linkage, and the formulas as printed;
- `copsense.paper.errata`: where the printed text differs from what holds;
- `copsense.paper.claims`: what the paper says, each statement with its check;
- `copsense.paper.reproduce`: everything computed on the four-bar and on the iCub;
- `copsense.paper.report`: the page, its figures and its data.

The four-bar is at hand here; the rest is imported from its room.
"""

from __future__ import annotations

from copsense.paper.closed_form import (
    FOUR_BAR_CRITERIA,
    FourBar,
    FourBarCriterion,
    FourBarSolution,
    solve_four_bar,
    solve_four_bar_member,
)

__all__ = [
    "FOUR_BAR_CRITERIA",
    "FourBar",
    "FourBarCriterion",
    "FourBarSolution",
    "solve_four_bar",
    "solve_four_bar_member",
]
