"""Binding: where on its way a limit first binds, and how the sensitivity jumps there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.margins import limit_travel
from copsense.motion import lateral_posture
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance


@dataclass(frozen=True, eq=False)
class FirstBinding:
    """The first limit that the CoM meets on its way to one side.

    Attributes:
        criterion: the criterion's name.
        limit: the limit's name.
        com_y: world y of the CoM there [m].
        before: dCoP/dCoM_y of each contact just before it binds (nc, 2), contact axes.
        after: the same just after.
    """

    criterion: str
    limit: str
    com_y: float
    before: Float[np.ndarray, "nc 2"]
    after: Float[np.ndarray, "nc 2"]


def first_binding(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    direction: int = 1,
    *,
    reach: float = 0.15,
) -> FirstBinding | None:
    """Follow the lateral path of a stance until a limit binds; None if none does within reach.

    Args:
        stance: where the path begins, within the limits.
        criterion: what shares the load.
        limits: what is to be met.
        direction: +1 towards world +y, -1 towards -y.
        reach: how far to look [m].
    """
    first = limit_travel(stance, criterion, limits, direction, reach=reach).first
    if first is None or first.exact is None:
        return None
    y = float(stance.com[1]) + direction * first.exact
    here, tangent = lateral_posture(stance, y)
    there = cop_sensitivity(here, criterion, limits)
    # Along the direction of travel; turned back to world +y.
    before, after = (direction * side for side in there.one_sided(direction * tangent))
    return FirstBinding(criterion.name, first.margin.name, y, before, after)
