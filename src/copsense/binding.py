"""Binding: where on its way a limit binds or lets go, and how the sensitivity jumps there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.optimize
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits
from copsense.margins import check_search
from copsense.path import lateral_posture
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance
from copsense.statics import ConstrainedEquilibrium, distance_to_change

_HERE = 1e-7  # m of CoM: what changes nearer than this changes here
_ROUNDING = 1e-9  # shares of the weight, or of the cost's gradient, by which nothing has changed
_PRECISION = 1e-13  # m: so near that the limit is only touched


@dataclass(frozen=True, eq=False)
class LimitChange:
    """The next limit to bind or to let go, when the CoM goes sideways.

    Attributes:
        criterion: the criterion's name.
        limit: the limit's name.
        binds: whether it begins to bind; False where it lets go.
        com_y: world y of the CoM there [m].
        travel: how far the CoM has gone until then [m].
        first_order: the same, predicted where it set out [m]; infinite if no change was. It may be
            another limit's.
        before: dCoP/dCoM_y of each contact just before the change (nc, 2), contact axes; None
            where a contact carries no load there, and has no centre of pressure.
        after: the same just after; None too where the limits leave no way on.
    """

    criterion: str
    limit: str
    binds: bool
    com_y: float
    travel: float
    first_order: float
    before: Float[np.ndarray, "nc 2"] | None
    after: Float[np.ndarray, "nc 2"] | None


def next_change(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    direction: int = 1,
    *,
    reach: float = 0.15,
    samples: int = 15,
) -> LimitChange | None:
    """Follow the lateral path of a stance until another set of limits presses.

    From a posture at which none does, that is where the first one binds. The wrenches are those
    within the limits.

    Args:
        stance: where the path begins.
        criterion: what shares the load.
        limits: what is to be met.
        direction: +1 towards world +y, -1 towards -y.
        reach: how far to look [m].
        samples: postures looked at before the change is refined.

    Returns:
        The change, or None if there is none within reach.

    Raises:
        InvalidInputError: a direction other than +1 or -1, or no limit to meet.
        InfeasibleError: no wrench respects the limits where the path begins.
    """
    check_search(direction, reach, samples)
    y0 = float(stance.com[1])
    start, tangent = lateral_posture(stance, y0)
    begin = cop_sensitivity(start, criterion, limits)
    if not isinstance(begin.equilibrium, ConstrainedEquilibrium):
        raise InvalidInputError("no limit is switched on: there is none to meet. Give one.")
    predicted = begin.active_set_changes(tangent)[0 if direction < 0 else 1]
    pressing = begin.equilibrium.pressing_after(direction * tangent)

    def at(travel: float, near: Stance) -> tuple[Stance, np.ndarray]:
        here, _ = lateral_posture(stance, y0 + direction * travel, near=near)
        return here, distance_to_change(here, criterion, limits, pressing)

    walked = [(_HERE, *at(_HERE, start))]
    for travel in np.linspace(0.0, reach, samples + 1)[1:]:
        try:
            walked.append((float(travel), *at(float(travel), walked[-1][1])))
        except CopsenseError:
            break  # no posture further on
        if np.any(walked[-1][2] < 0):
            break
    found = _first_below_zero(walked, at)
    if found is None:
        return None
    row, travel = found
    y = y0 + direction * travel
    here, there_tangent = lateral_posture(stance, y, near=walked[-1][1])
    before, after = _sides(here, criterion, limits, direction, there_tangent)
    return LimitChange(
        criterion.name,
        begin.equilibrium.names[row],
        row not in pressing,
        y,
        travel,
        predicted.travel if predicted else np.inf,
        before,
        after,
    )


def _sides(
    stance: Stance, criterion: Criterion, limits: Limits, direction: int, tangent: np.ndarray
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """dCoP/dCoM_y before and after on the way; None where there is none."""
    try:
        there = cop_sensitivity(stance, criterion, limits)
    except CopsenseError:
        return None, None  # a contact that just unloads has no centre of pressure to speak of
    found: list[np.ndarray | None] = []
    for side in (-direction, direction):
        try:
            found.append(there.one_side(tangent, side))
        except CopsenseError:
            found.append(None)  # the limits may leave no way on: a brink, or a sole's corner
    return found[0], found[1]


def _first_below_zero(
    walked: list[tuple[float, Stance, np.ndarray]],
    evaluate: Callable[[float, Stance], tuple[Stance, np.ndarray]],
) -> tuple[int, float] | None:
    """The row that changes sides first, and the travel at which it does."""
    first, _, distances = walked[0]
    if distances.min(initial=0.0) < -_ROUNDING:
        return int(np.argmin(distances)), first
    for (a, near, before), (b, _, after) in pairwise(walked):
        crossings = []
        for row in map(int, np.flatnonzero(after < -_ROUNDING)):

            def distance(travel: float, row: int = row, near: Stance = near) -> float:
                return float(evaluate(travel, near)[1][row])

            root = a
            if before[row] > 0:
                root = float(scipy.optimize.brentq(distance, a, b, xtol=_PRECISION))
            crossings.append((root, row))
        if crossings:
            travel, row = min(crossings)
            return row, travel
    return None
