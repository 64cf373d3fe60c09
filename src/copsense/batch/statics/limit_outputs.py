"""Limit outputs: what the limited kernel writes of a posture, row by row."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled
from copsense.batch.lanes import get, least, load, splat, where_less
from copsense.batch.layout import Feet
from copsense.batch.statics.active_set import contact_slack
from copsense.batch.statics.kernel import Out
from copsense.batch.statics.kernel_limits import KernelLimits
from copsense.batch.statics.limit_states import WITHIN
from copsense.batch.workspace import WIDTH, Offsets

_NEAR = 1e-8  # weights: slack, of rows of norm one to ten, under which a posture is looked at


class LimitOut(NamedTuple):
    """Arrays that the limited kernel fills, the posture first; see `LimitResult`.

    Attributes:
        state: as in `limit_states` (N, nk).
        pressing: rows that press (N, nk, r); -1 where there are fewer.
        multipliers: theirs (N, nk, r).
        touching: number of rows that only touch (N, nk).
        optimality: largest violation of an optimality condition (N, nk).
        margins: of each group of rows (N, nk, g).
        own_margins: those of the criterion's wrenches without limits (N, nk, g).
        relaxation: least amount by which every row would have to be relaxed (N,).
        conflict: rows that demand it (N, r + 1); -1 where there are fewer.
        unloaded: a bit for each contact without load (N, nk).
        change_travel: of the CoM to the nearest change of the pressing rows (G, nk).
        change_limit: the row that begins or ceases to press there (G, nk); -1 for none.
    """

    state: np.ndarray
    pressing: np.ndarray
    multipliers: np.ndarray
    touching: np.ndarray
    optimality: np.ndarray
    margins: np.ndarray
    own_margins: np.ndarray
    relaxation: np.ndarray
    conflict: np.ndarray
    unloaded: np.ndarray
    change_travel: np.ndarray
    change_limit: np.ndarray


@compiled
def begin_row(
    feet: Feet, rows: KernelLimits, out: Out, found: LimitOut, slack: Any, row: int, column: int
) -> bool:
    """Write what holds where no limit presses; whether one is near."""
    found.state[row, column] = WITHIN
    for k in range(found.pressing.shape[2]):
        found.pressing[row, column, k] = -1
        found.multipliers[row, column, k] = 0.0
    found.touching[row, column] = 0
    found.unloaded[row, column] = 0
    found.optimality[row, column] = 0.0
    found.relaxation[row] = 0.0
    if len(found.change_travel):
        found.change_travel[row, column] = np.nan
        found.change_limit[row, column] = -1
    for k in range(found.conflict.shape[1]):
        found.conflict[row, k] = -1
    nearest = row_margins(feet, rows, out, found.own_margins, slack, row, column)
    for g in range(found.margins.shape[2]):
        found.margins[row, column, g] = found.own_margins[row, column, g]
    return nearest < _NEAR * feet.weight


@compiled
def row_margins(
    feet: Feet, rows: KernelLimits, out: Out, margins: Any, slack: Any, row: int, column: int
) -> float:
    """Write the smallest margin of each group, in its own unit; the least slack of all.

    `slack` is memory for the contacts' rows. A row longer than one counts by its norm.
    """
    contact_slack(rows, out.wrenches[row, column], slack, 0.0)
    near = splat(np.inf)
    for i in range(len(rows.bound) // WIDTH):
        s = load(slack, i) * load(rows.short, i)
        near = where_less(s, near, s, near)
    nearest = least(near)
    for k in range(len(feet.body)):
        normal = out.wrenches[row, column, 6 * k + 2]
        for g in range(rows.group_first[k], rows.group_first[k + 1]):
            start, stop = rows.group_rows[g], rows.group_rows[g + 1]
            margin = _smallest(slack, start, stop, 1.0)
            if rows.cop[g]:  # a length: of a contact that pulls, signs turn
                if normal > 0.0:
                    margin = margin / normal
                else:
                    margin = -_smallest(slack, start, stop, -1.0) / normal
            margins[row, column, g] = margin
    for i in range(1, len(rows.torque)):
        if rows.row[i] >= 0:
            s = rows.torque[i] - abs(out.torques[row, column, i - 1])
            nearest = min(nearest, s)
            margins[row, column, rows.torque_group[i]] = s
    return nearest


@compiled
def _smallest(slack: Any, start: int, stop: int, sign: float) -> float:
    """The smallest of these rows' slacks, or with sign -1 of what is opposite to them."""
    found = splat(np.inf)
    for i in range(start // WIDTH, stop // WIDTH):
        s = sign * load(slack, i)
        found = where_less(s, found, s, found)
    return least(found)


@compiled
def write_lane(
    feet: Feet,
    offset: Offsets,
    W: Any,
    lane: int,
    row: int,
    column: int,
    out: Out,
    nv: int,
    gains: bool,
) -> None:
    """A lane's results."""
    nc = len(feet.body)
    for i in range(6 * nc):
        out.wrenches[row, column, i] = get(W, offset.contact_wrench + i, lane)
    for i in range(out.torques.shape[2]):
        out.torques[row, column, i] = get(W, offset.torque + 1 + i, lane)
    for i in range(2 * nc):
        out.cops[row, column, i] = get(W, offset.cop + i, lane)
    for i in range(2 * nc * nv):
        out.gradient[row, column, i] = get(W, offset.gradient + i, lane)
    for k in range(nc):
        out.margin[row, column, k] = get(W, offset.margin + k, lane)
        share = get(W, offset.contact_wrench + 6 * k + 2, lane) / feet.weight
        out.load_share[row, column, k] = share
    if gains:
        for i in range(4 * nc):
            out.com_gain[row, column, i] = get(W, offset.gain + i, lane)
        for k in range(nc):
            out.com_travel[row, column, k] = get(W, offset.travel + k, lane)
            out.tipping_edge[row, column, k] = int(get(W, offset.edge + k, lane))
            out.unloading_travel[row, column, k] = get(W, offset.unloading + k, lane)
