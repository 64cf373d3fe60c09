"""Limit reference: one row of a `LimitResult` from the equilibrium that the reference solves."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from copsense.batch.statics.limit_result import LimitResult
from copsense.batch.statics.limit_states import (
    IMPOSSIBLE,
    PRESSED,
    UNANSWERED,
    UNLOADED,
    WITHIN,
)
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InfeasibleError
from copsense.margins import MarginTable, margin_table
from copsense.stance import Stance
from copsense.statics import ConstrainedEquilibrium, StaticEquilibrium, solve_equilibrium


def solve_limited(
    stance: Stance, criterion: Criterion, result: LimitResult, row: int, column: int
) -> ConstrainedEquilibrium:
    """The equilibrium within the limits, which also fills one row of the result.

    Raises:
        CopsenseError: there is none; the row says what is known.
    """
    table = margin_table(stance, result.limits)
    nowhere = len(result.pressing[row, column])
    result.state[row, column] = UNANSWERED
    result.pressing[row, column] = -1
    result.multipliers[row, column] = 0.0
    result.touching[row, column] = result.unloaded[row, column] = 0
    if len(result.change_travel):
        result.change_travel[row, column], result.change_limit[row, column] = np.nan, -1
    result.optimality[row, column] = np.nan
    result.margins[row, column] = result.own_margins[row, column] = np.nan
    result.own_margins[row, column] = _margins(table, _or_none(stance, criterion))
    try:
        found = solve_equilibrium(stance, criterion, result.limits)
    except InfeasibleError as error:
        result.state[row, column] = IMPOSSIBLE
        result.relaxation[row] = error.violation
        demands = sorted(result.names.index(name) for name in error.demands)
        demands = demands[: result.conflict.shape[1]]
        result.conflict[row] = -1
        result.conflict[row, : len(demands)] = demands
        raise
    assert isinstance(found, ConstrainedEquilibrium)
    pressing = found.pressing[:nowhere]
    result.pressing[row, column, : len(pressing)] = pressing
    result.multipliers[row, column, : len(pressing)] = found.row_multipliers[pressing]
    result.touching[row, column] = len(found.active) - len(found.pressing)
    result.optimality[row, column] = found.optimality() if len(pressing) else 0.0
    result.margins[row, column] = _margins(table, found)
    result.state[row, column] = PRESSED if len(pressing) else WITHIN
    if len(result.change_travel) and not found.unloaded:
        _look_ahead(found, result, row, column)
    if found.unloaded:
        names = stance.contact_names
        result.state[row, column] = UNLOADED
        result.unloaded[row, column] = sum(1 << names.index(name) for name in found.unloaded)
    return found


def _look_ahead(found: ConstrainedEquilibrium, result: LimitResult, row: int, column: int) -> None:
    """The nearest change of the pressing limits; NaN where it cannot be followed."""
    with suppress(CopsenseError):
        limit, travel = found.nearest_changing_row(found.stance.com_motions)
        result.change_limit[row, column], result.change_travel[row, column] = limit, travel


def _or_none(stance: Stance, criterion: Criterion) -> StaticEquilibrium | None:
    try:
        return solve_equilibrium(stance, criterion)
    except CopsenseError:
        return None


def _margins(table: MarginTable, found: StaticEquilibrium | None) -> np.ndarray | float:
    """The smallest margin of each group."""
    if found is None:
        return float(np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = table.values(found.contact_forces, found.torques)
    return np.array([values[rows].min() for rows in table.groups])
