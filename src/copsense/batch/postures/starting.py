"""Starting: which posture a lane looks for next, and where it looks first."""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled
from copsense.batch.lanes import get, put
from copsense.batch.postures.nearby import Nearby
from copsense.batch.postures.search_plan import SearchOffsets, SearchPlan
from copsense.batch.postures.search_settings import EDGE, ELSEWHERE
from copsense.batch.vectors import LARGEST_ANGLE
from copsense.batch.workspace import Offsets


@compiled
def take(
    given: tuple[SearchPlan, Offsets, SearchOffsets, Nearby, Any],
    status: Any,
    W: Any,
    lane: int,
    following: int,
    stop: int,
) -> tuple[int, int]:
    """Begin the next posture in a lane: the one after it, and itself (-1 where none is left)."""
    plan, offset, search, nearby, values = given
    while following < stop:
        row = following
        following += 1
        if give(plan, offset, search, values, W, lane, row):
            near = _go_between(plan, search, nearby, values, W, lane, row)
            begin(search, W, lane, 1.0 if near else 0.0, 0)
            put(W, search.posture, lane, row)
            return following, row
        status[row] = ELSEWHERE
    put(W, search.posture, lane, -1)
    return following, -1


@compiled
def begin(search: SearchOffsets, W: Any, lane: int, near: float, spent: int) -> None:
    """Begin a search in a lane, near known postures or not, after so many steps in vain."""
    put(W, search.nearby, lane, near)
    put(W, search.steps, lane, 0)
    put(W, search.spent, lane, spent)


@compiled
def give(
    plan: SearchPlan,
    offset: Offsets,
    search: SearchOffsets,
    values: Any,
    W: Any,
    lane: int,
    row: int,
) -> bool:
    """Set a lane to the stance with a posture's values; whether they are of ordinary size."""
    for i in range(len(plan.given)):
        put(W, search.given + i, lane, plan.given[i])
    for i in range(4):
        put(W, offset.q + 3 + i, lane, plan.quaternion[i])
    if row < 0:
        return True
    ordinary = True
    com = len(plan.given) - 3 * len(plan.position) - 3
    for i in range(len(plan.place)):
        value, where = values[row, i], plan.place[i]
        ordinary = ordinary and abs(value) < 0.1 * LARGEST_ANGLE
        put(W, search.given + where, lane, value)
        axis = where - com
        if 0 <= axis < 3:  # the base goes where the CoM goes, to begin with
            moved = plan.given[axis] + value - plan.given[where]
            put(W, search.given + axis, lane, moved)
    return ordinary


@compiled
def _go_between(
    plan: SearchPlan,
    search: SearchOffsets,
    nearby: Nearby,
    values: Any,
    W: Any,
    lane: int,
    row: int,
) -> bool:
    """Set a lane's unknowns between the postures around its row; whether there are any."""
    if len(nearby.serves) == 0:
        return False
    cell, lowest = 0, 0
    for i in range(len(nearby.column)):
        cells = nearby.cells[i]
        place = (values[row, nearby.column[i]] - nearby.low[i]) * nearby.scale[i]
        if not -EDGE <= place <= cells + EDGE:
            return False
        below = _below(place, cells)
        cell, lowest = cell * cells + below, lowest * (cells + 1) + below
    if nearby.serves[cell] == 0:
        return False
    for n in range(len(plan.unknown)):
        put(W, search.given + plan.unknown[n], lane, 0.0)
    for corner in range(2 ** len(nearby.column)):
        share, at, stride, bits = 1.0, lowest, 1, corner
        for i in range(len(nearby.column) - 1, -1, -1):
            cells, upper = nearby.cells[i], bits % 2
            place = (values[row, nearby.column[i]] - nearby.low[i]) * nearby.scale[i]
            part = place - _below(place, cells)
            share *= part if upper else 1.0 - part
            at += stride * upper
            stride *= cells + 1
            bits //= 2
        for n in range(len(plan.unknown)):
            x = search.given + plan.unknown[n]
            put(W, x, lane, get(W, x, lane) + share * nearby.unknowns[at, n])
    return True


@compiled
def _below(place: float, cells: int) -> int:
    """The cell that a place along a coordinate is in."""
    return max(min(int(place), cells - 1), 0)
