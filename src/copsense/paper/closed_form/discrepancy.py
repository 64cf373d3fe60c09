"""What holds, laid beside a printed form: the same quantity, hand and sampled angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.family import FourBarSolution
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar
from copsense.paper.closed_form.linkage import Hand

# Where the CoM is, in parts of the way from the centre to the point above a foot.
_TRAVEL = (-0.9, -0.5, -0.1, 0.2, 0.6, 0.95)

# Nothing that holds differs by more than rounding; nothing that does not comes near this.
EXACT = 1e-9


@dataclass(frozen=True)
class Discrepancy:
    """How far a printed statement is from what holds, and that the reason given explains it.

    Attributes:
        measure: what the two numbers are.
        as_printed: the statement against what holds at the linkage's own parameters; for a formula
            after the change of hand that brings it nearest.
        hypothesis: the reading or the correction that the erratum names.
        agreement: the same measure under that hypothesis; zero to rounding.
    """

    measure: str
    as_printed: float
    hypothesis: str
    agreement: float


def sampled_angles(four_bar: FourBar) -> tuple[float, ...]:
    """Angles xi [rad] that spread the CoM between the feet, lopsidedly so that signs show."""
    half = four_bar.rod_length / 2
    return tuple(four_bar.angle_at(part * half) for part in _TRAVEL)


def rows(solution: FourBarSolution, quantity: str, hand: Hand) -> Float[np.ndarray, "..."]:
    """A quantity of a solution with its rows left, right in the sense of `hand`."""
    values: Float[np.ndarray, "..."] = getattr(solution, quantity)
    return values if hand is Hand.LEFT_AT_MINUS_X else values[::-1]


def sampled(
    four_bar: FourBar, criterion: str, quantity: str, hand: Hand
) -> Float[np.ndarray, "n 2 ..."]:
    """A quantity of the criterion's solutions at the sampled angles, in the sense of `hand`."""
    solutions = (solve_four_bar(four_bar, xi, criterion) for xi in sampled_angles(four_bar))
    return np.array([rows(solution, quantity, hand) for solution in solutions])


def relative_difference(
    given: Float[np.ndarray, "n ..."], holds: Float[np.ndarray, "n ..."], *, columns: int = 0
) -> float:
    """Largest difference in parts of the largest magnitude of what holds.

    Args:
        given: samples first.
        holds: the same shape.
        columns: 1 if each entry of the last axis has a unit of its own and so its own scale.
    """
    difference, scale = np.abs(given - holds), np.abs(holds)
    if columns:
        difference = difference.reshape(-1, holds.shape[-1]).max(axis=0)
        scale = scale.reshape(-1, holds.shape[-1]).max(axis=0)
        # A column that holds as zero (f_x) is measured by the largest of the others.
        scale = np.where(scale > 0, scale, scale.max())
        return float((difference / scale).max())
    return float(difference.max() / scale.max())
