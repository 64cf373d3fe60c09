"""Tie-breaks: the second criterion for forces that contacts exert against each other alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from copsense.criterion import Criterion, minimum_wrench
from copsense.errors import UndeterminedWrenchError
from copsense.stance import Stance
from copsense.statics.kkt import Kkt
from copsense.statics.policy import WrenchPolicy

C = TypeVar("C", Criterion, Criterion | WrenchPolicy)

TIE_BREAK = minimum_wrench(1.0)
_INTERNAL = 1e-8  # of J' f, for f of length one, under which no joint feels forces


def with_tie_break(stance: Stance, criterion: Criterion) -> Criterion:
    """The criterion, with `TIE_BREAK`, ``minimum_wrench(1.0)``, where it needs one.

    It needs one where contacts can push against each other without moving anything (heel and toe
    of one foot, four points under it, a leg of five joints): such forces cost nothing that the
    criterion weighs.

    Raises:
        UndeterminedWrenchError: more than such internal forces is undetermined.
        InvalidInputError: weights that do not fit.
    """
    try:
        Kkt(stance, criterion)
    except UndeterminedWrenchError as error:
        tied = replace(criterion, tie_break=TIE_BREAK)
        free = Kkt(stance, tied).free
        felt = np.abs(stance.constraints.T @ free).max(initial=0.0)
        if criterion.tie_break is not None or felt > _INTERNAL:
            raise error
        return tied
    return criterion


def with_tie_breaks(
    stances: Iterable[Stance], criteria: Mapping[str, C]
) -> tuple[dict[str, C], tuple[str, ...]]:
    """Criteria with the tie-breaks that they need at any of some stances, and what to say of them.

    One that stays undetermined even so is left as it is: solving for it raises, and says why.
    """
    found = dict(criteria)
    for stance in stances:
        for name, criterion in found.items():
            if isinstance(criterion, Criterion) and criterion.tie_break is None:
                try:
                    found[name] = with_tie_break(stance, criterion)
                except UndeterminedWrenchError:
                    continue
    notes = tuple(tie_break_note(name) for name in found if found[name] is not criteria[name])
    return found, notes


def tie_break_note(name: str) -> str:
    """What to say of a criterion that was given a tie-break."""
    return (
        f"{name} leaves forces undetermined that contacts exert against each other; of these the "
        "least wrench is shown (minimum-wrench with L = 1 m as its tie-break)."
    )
