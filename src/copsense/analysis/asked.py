"""What an analysis is asked for: the posture, and the criteria that can be told there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from copsense.batch import chart_posture
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.limits import Limits
from copsense.posture import solve_posture
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
    """The posture asked for, and dq/dy (nv,) of the CoM's lateral path there.

    Args:
        stance: what it is to be nearest to.
        com: world x, y and z of the CoM [m]; None holds x and y, and leaves z free.
        joints: joint -> position to hold [rad, or m for a prismatic joint].
        at: coordinates of a posture chart instead, see `copsense.analysis.analyse`.

    Raises:
        UnreachablePostureError: there is none.
        InvalidInputError: `at` beside the others.
    """
    if at:
        if joints or any(value is not None for value in com):
            raise InvalidInputError(
                "at says where the CoM and the joints are, and so do com_x, com_y, com_z and "
                "joints. Give at alone (it takes their names), or the others alone."
            )
        stance, com = chart_posture(stance, at), (None, None, None)
    x, y, z = com
    if x is None and stance.robot.base_nv == 6:
        x = float(stance.com[0])
    posture = solve_posture(
        stance, com=(x, float(stance.com[1]) if y is None else y, z), joints=joints
    )
    return posture.stance, posture.tangents[:, 0 if x is None else 1]


def determined_criteria(
    stance: Stance, criteria: Mapping[str, Criterion | WrenchPolicy], limits: Limits | None
) -> tuple[dict[str, Criterion | WrenchPolicy], list[str]]:
    """The criteria that can be told here, each with a tie-break where it needs one, and notes.

    Args:
        stance: the posture.
        criteria: by name.
        limits: within which they are asked for.

    Raises:
        UndeterminedWrenchError: none of them can be told.
    """
    found: dict[str, Criterion | WrenchPolicy] = {}
    notes, errors = [], []
    for name, criterion in criteria.items():
        found[name] = criterion
        if not isinstance(criterion, Criterion):
            continue
        try:
            found[name] = tied = with_tie_break(stance, criterion)
            if tied is not criterion and limits is not None:
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
