"""Posture batch: the postures of a chart in arrays, the posture first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from copsense.listing import counted
from copsense.stance import Stance


@dataclass(frozen=True, eq=False)
class PostureBatch:
    """Postures of a chart, one for each row of values.

    Attributes:
        configurations: with the contacts in place; NaN where there is none [m, rad].
        converged: whether there is a posture, within the joint limits.
        residuals: largest error of a contact or of the CoM where the search ended [m or rad].
        iterations: steps that the search took.
        reasons: why a row has no posture; empty where it has one.
    """

    configurations: Float[np.ndarray, "N nq"]
    converged: Bool[np.ndarray, " N"]
    residuals: Float[np.ndarray, " N"]
    iterations: Int[np.ndarray, " N"]
    reasons: np.ndarray

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.converged)

    def __repr__(self) -> str:
        """How many rows it has, and how many of them a posture."""
        found = counted(int(self.converged.sum()), "posture")
        return f"PostureBatch({found} of {counted(len(self), 'row')})"


def empty_postures(stance: Stance, count: int) -> PostureBatch:
    """A batch to be filled."""
    return PostureBatch(
        np.full((count, stance.robot.model.nq), np.nan),
        np.zeros(count, dtype=bool),
        np.full(count, np.nan),
        np.zeros(count, dtype=np.int64),
        np.full(count, "", dtype=object),
    )
