"""The two criteria along the CoM's travel between the feet, for the claims about them.

The paper means L = 1 m in criterion 1 and never says so. Where a claim rests on that, its check
asks again with a shorter one; below d/2 the two criteria have changed places.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.family import FourBarSolution
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar

LEFT, RIGHT = 0, 1
PAPER_LENGTH = 1.0  # m: the L that criterion 1 means and never says
NEARLY = 0.05  # "almost", "together with", "is": within a twentieth
PARTS = np.linspace(-1.0, 1.0, 41)  # of the way from the centre to a foot


def by_wrench(four_bar: FourBar, travel: float, length: float = PAPER_LENGTH) -> FourBarSolution:
    """Criterion 1 with the CoM `travel` [m] right of the centre, moments over `length` [m]."""
    xi = four_bar.angle_at(travel)
    return solve_four_bar(four_bar, xi, "minimum-wrench", characteristic_length=length)


def by_torque(four_bar: FourBar, travel: float) -> FourBarSolution:
    """Criterion 2 with the CoM `travel` [m] right of the centre."""
    return solve_four_bar(four_bar, four_bar.angle_at(travel), "minimum-torque")


def between_feet(four_bar: FourBar, value: Callable[[float], float]) -> Float[np.ndarray, "n"]:
    """`value` of the CoM's travel [m], at PARTS: from above the left foot to above the right."""
    return np.array([value(part * four_bar.rod_length / 2) for part in PARTS])
