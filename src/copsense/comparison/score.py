"""Score: a row of the benchmark's table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from copsense.comparison.score_kinds import SCORES

Status = Literal["measured", "bound", "tipped", "none", "failed"]


@dataclass(frozen=True)
class Score:
    """A row of the table.

    Attributes:
        score: its name, one of `SCORES`.
        status: ``"measured"``; ``"bound"`` if only one end of the interval is known, such as when
            nothing tipped; ``"tipped"`` if a contact tipped before it could be measured;
            ``"none"`` if the robot has nothing to measure, such as edges of point feet;
            ``"failed"``.
        value: in the score's unit, NaN unless measured.
        low: lower end of the value's interval: resolution, bracket, or 95 % interval of a rate.
        high: upper end.
        predicted: by the statics along the exact path; NaN without a prediction.
        first_order: by statics and sensitivity at the start alone.
        contact: the contact that tipped, lifted or slipped first, or empty.
        how: ``"tips"``, ``"lifts"`` or ``"slips"``, or empty.
        predicted_contact: the contact that should do so, by the statics.
        runs: number of simulations.
        reason: how the run ended, or why it failed.
    """

    score: str
    status: Status
    value: float = math.nan
    low: float = math.nan
    high: float = math.nan
    predicted: float = math.nan
    first_order: float = math.nan
    contact: str = ""
    how: str = ""
    predicted_contact: str = ""
    runs: int = 1
    reason: str = ""

    @property
    def unit(self) -> str:
        """Of value, interval and predictions."""
        return SCORES[self.score].unit


def failed(scores: tuple[str, ...], reason: str) -> list[Score]:
    """The rows of a case that could not be run."""
    return [Score(name, "failed", reason=reason) for name in scores]
