"""What an analysis is asked for: the posture, and the criteria that have an answer there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from copsense.batch import chart_posture
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.limits import Limits
from copsense.path import lateral_posture
from copsense.posture import move_stance
from copsense.stance import Stance
from copsense.statics import (
    WrenchPolicy,
    solve_equilibrium,
    tie_break_note,
    with_tie_break,
)


def asked_posture(
    stance: Stance,
    com: tuple[float | None, float | None, float | None],
    joints: Mapping[str, float] | None,
    at: Mapping[str, float] | None,
) -> tuple[Stance, Float[np.ndarray, " nv"]]:
    """The posture asked for, and dq/dy (nv,) of the lateral path of the CoM that begins there.

    Arguments and errors are those of `placed_stance`.
    """
    moved = placed_stance(stance, com, joints, at)
    # The path stays nearest to the posture that is analysed, wherever that was moved from: a
    # stance that was written down and read again has the same.
    return lateral_posture(moved, float(moved.com[1]))


def placed_stance(
    stance: Stance,
    com: tuple[float | None, float | None, float | None],
    joints: Mapping[str, float] | None,
    at: Mapping[str, float] | None,
) -> Stance:
    """The stance where it is asked for.

    Args:
        stance: what it is to be nearest to.
        com: world x, y and z of the CoM [m]; None holds x and y, and leaves z free.
        joints: joint -> position to put it at [rad, or m for a prismatic joint].
        at: coordinates of a posture chart instead, see `copsense.analysis.analyse`.

    Raises:
        UnreachablePostureError: there is none.
        InvalidInputError: `at` beside the others.
    """
    x, y, z = com
    if not at:
        return move_stance(stance, com_x=x, com_y=y, com_z=z, joints=joints)
    if joints or any(value is not None for value in com):
        raise InvalidInputError(
            "at says where the CoM and the joints are, and so do com_x, com_y, com_z and "
            "joints. Give at alone (it takes their names), or the others alone."
        )
    return chart_posture(stance, at)


def determined_criteria(
    stance: Stance, criteria: Mapping[str, Criterion | WrenchPolicy], limits: Limits | None
) -> tuple[dict[str, Criterion | WrenchPolicy], list[str]]:
    """The criteria that have an answer here, each with a tie-break where it needs one, and notes.

    Args:
        stance: the posture.
        criteria: by name.
        limits: within which they are asked for.

    Raises:
        UndeterminedWrenchError: none of them has one.
    """
    found: dict[str, Criterion | WrenchPolicy] = {}
    notes, errors = [], []
    for name, criterion in criteria.items():
        found[name] = criterion
        if not isinstance(criterion, Criterion):
            continue
        try:
            found[name] = tied = with_tie_break(stance, criterion)
            loops = stance.closures is not None  # whose forces limits may leave free
            if limits is not None and (tied is not criterion or loops):
                solve_equilibrium(stance, tied, limits)  # or says why it cannot
        except UndeterminedWrenchError as error:
            del found[name]
            errors.append(error)
            notes.append(f"{name} is left out: {error}")
            continue
        if tied is not criterion:
            notes.append(tie_break_note(name))
    if not found:
        raise errors[0]
    return found, notes
