"""Evaluation: values of a function of the posture, and its gradients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from copsense.content import freeze


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Centres of pressure of N postures, and their gradients over k inputs.

    Values of a posture that is not valid are NaN, and its gradients are zero.

    Attributes:
        cop: centres of pressure, contact axes [m].
        margin: signed distance of each to its sole's nearest edge [m]; infinite without a sole.
        travel: first-order distance of the CoM to tipping, as `CopSensitivity.com_travel` [m];
            empty unless everything was asked for.
        valid: whether the posture exists and has values and gradients.
        gradient: d cop / d input [m per m or rad].
        inward: d margin / d cop, unit vectors away from the nearest edge; zero without a sole, and
            unless everything was asked for.
        reasons: posture -> why it is not valid.
    """

    cop: Float[np.ndarray, "N nc 2"]
    margin: Float[np.ndarray, "N nc"]
    travel: Float[np.ndarray, "T nc"]
    valid: Bool[np.ndarray, " N"]
    gradient: Float[np.ndarray, "N nc 2 k"]
    inward: Float[np.ndarray, "N nc 2"]
    reasons: Mapping[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Own the reasons; the arrays are the caller's to hand on."""
        freeze(self, "reasons")

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.valid)

    def __repr__(self) -> str:
        """How many postures, and how many of them are valid."""
        return f"Evaluation({int(self.valid.sum())} postures of {len(self)} valid)"

    def arrays(self, everything: bool) -> tuple[np.ndarray, ...]:
        """cop, margin, travel, valid, gradient and inward, each with a row for every posture.

        Args:
            everything: whether it was asked for; travels have no columns otherwise.
        """
        travel = self.travel if everything else np.zeros((len(self), 0))
        return self.cop, self.margin, travel, self.valid, self.gradient, self.inward

    def rows(self, first: int, stop: int) -> Evaluation:
        """Some rows, in the same memory."""
        part = slice(first, stop)
        return Evaluation(
            self.cop[part],
            self.margin[part],
            self.travel[part],
            self.valid[part],
            self.gradient[part],
            self.inward[part],
        )

    def clear(self) -> None:
        """Make every row one that is not valid."""
        for array in (self.cop, self.margin, self.travel):
            array[:] = np.nan
        self.valid[:] = False
        self.gradient[:] = 0.0
        self.inward[:] = 0.0


def empty_evaluation(count: int, contacts: int, inputs: int, *, everything: bool) -> Evaluation:
    """Arrays to be filled: no posture is valid yet."""
    return Evaluation(
        np.empty((count, contacts, 2)),
        np.empty((count, contacts)),
        np.empty((count if everything else 0, contacts)),
        np.zeros(count, dtype=bool),
        np.empty((count, contacts, 2, inputs)),
        np.zeros((count, contacts, 2)),
    )
