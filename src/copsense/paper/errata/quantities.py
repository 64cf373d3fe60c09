"""What the formulas of the errata stand for: the closed forms, and the printed ones.

A quantity takes the linkage, the angle xi [rad] and a side, -1 for the foot at -x and +1 for the
one at +x, which is also the sign that ± takes.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.family import FourBarSolution
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar
from copsense.paper.closed_form.linkage import Hand, Linkage, wrench_balance
from copsense.paper.closed_form.printed import PRINTED_FORMS
from copsense.paper.errata.errata_statements import pole

Quantity = Callable[[FourBar, float, int], float]


def letters(four_bar: FourBar, xi: float) -> dict[str, float]:
    """The letters of the errata's formulas at the angle `xi` [rad]."""
    c, s = math.cos(xi), math.sin(xi)
    return {
        "l": four_bar.leg_length,
        "d": four_bar.rod_length,
        "m": four_bar.mass,
        "g": four_bar.gravity,
        "kappa": four_bar.kappa,
        "c": c,
        "c3": c,
        "s": s,
    }


def of_solution(criterion: str, read: Callable[[FourBarSolution, int], float]) -> Quantity:
    """A quantity of the criterion's solution, read for a foot: 0 at -x, 1 at +x."""

    def quantity(four_bar: FourBar, xi: float, side: int) -> float:
        return float(read(solve_four_bar(four_bar, xi, criterion), (side + 1) // 2))

    return quantity


def cop(criterion: str) -> Quantity:
    """SCoP of a foot [m]."""
    return of_solution(criterion, lambda found, foot: found.cop[foot])


def sensitivity(criterion: str) -> Quantity:
    """Sensitivity eta of a foot [m/rad]."""
    return of_solution(criterion, lambda found, foot: found.sensitivity[foot])


def load(criterion: str) -> Quantity:
    """Vertical force of a foot in parts of m g."""
    return of_solution(criterion, lambda f, foot: f.wrenches[foot, 1] / f.four_bar.weight)


def moment(criterion: str) -> Quantity:
    """Moment under a foot in parts of m g [m]."""
    return of_solution(criterion, lambda f, foot: f.wrenches[foot, 2] / f.four_bar.weight)


def load_over_foot(four_bar: FourBar, xi: float, side: int) -> float:
    """Vertical force of a foot under criterion 2 with the CoM over it [N], whatever xi is."""
    there = four_bar.angle_at(side * four_bar.rod_length / 2)
    return load("minimum-torque")(four_bar, there, side) * four_bar.weight


def sine_of_pole(four_bar: FourBar, xi: float, side: int) -> float:
    """Sine of the Delta xi at which criterion 2 unloads a foot."""
    return math.sin(pole(four_bar))


def right_foot_jacobian_entry(four_bar: FourBar, xi: float, side: int) -> float:
    """Second row of J_CR's column of theta, left at +x [m]."""
    return float(Linkage(four_bar, Hand.LEFT_AT_PLUS_X).jacobian(xi)[4, 2])


def redundancy(row: int) -> Quantity:
    """A row of the Delta that minimises the torques, over m g / 2, by Eq. (24) with left at +x."""

    def quantity(four_bar: FourBar, xi: float, side: int) -> float:
        half = four_bar.weight / 2
        X_L = wrench_balance(Linkage(four_bar, Hand.LEFT_AT_PLUS_X).com_to_feet(xi))[:, :3]
        f_L = solve_four_bar(four_bar, xi, "minimum-torque").wrenches[1]
        # X_L f_L = (m g / 2) e2 + Delta
        return float((X_L @ f_L - half * np.eye(3)[1])[row] / half)

    return quantity


def as_printed(equation: str, *entry: int, over_weight: bool = False) -> Quantity:
    """An entry of a printed form, in the row of the side's foot where it has one.

    Args:
        equation: a key of PRINTED_FORMS.
        *entry: indices within the row, or of the whole array where it has no rows for the feet.
        over_weight: whether to divide by m g.
    """
    form = PRINTED_FORMS[equation]

    def quantity(four_bar: FourBar, xi: float, side: int) -> float:
        values = form.evaluate(four_bar, xi)
        if len(values) == 2:
            values = values[0 if side == form.hand.value else 1]
        value = values[entry] if entry else values
        return float(value) / (four_bar.weight if over_weight else 1.0)

    return quantity
