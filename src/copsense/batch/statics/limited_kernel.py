"""Limited kernel: postures that a criterion's own wrenches take to a limit, solved within limits.

It follows the kernel without limits and takes its results. Where no limit is near they stand;
elsewhere postures are gathered, a few abreast, and solved within the limits, each from its own
optimum without limits: a neighbour's active set would save it two or three changes of rows, and
have it depend on who came before. Where gains are asked for, all postures go through once more, for
the limits that come nearer as the CoM moves.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled, entry, from_array, inlined
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import get, load, store
from copsense.batch.layout import Feet, Tree
from copsense.batch.statics.active_set import (
    EXACT,
    INFEASIBLE,
    Programs,
    measure,
    nearest,
    optimum,
    relax,
    write_row,
)
from copsense.batch.statics.com_gains import com_gains, com_motions, margins
from copsense.batch.statics.criteria import KernelCriteria
from copsense.batch.statics.gradients import torque_gradients
from copsense.batch.statics.inertia import factorise_inertia
from copsense.batch.statics.kernel import Out
from copsense.batch.statics.kernel_limits import KernelLimits
from copsense.batch.statics.limit_changes import move_joints, nearest_change, write_rates
from copsense.batch.statics.limit_offsets import LimitOffsets
from copsense.batch.statics.limit_outputs import LimitOut, begin_row, row_margins, write_lane
from copsense.batch.statics.limit_states import IMPOSSIBLE, PRESSED, UNLOADED
from copsense.batch.statics.limited_statics import (
    APART,
    ROUNDING,
    TOUCHING,
    Within,
    gradient_size,
    keep_pressing,
    move_unknowns,
    read_program,
    unlimited,
    violation,
    write_maps,
    write_responses,
    write_scales,
)
from copsense.batch.statics.load_sharing import finish, least_squares, set_load
from copsense.batch.statics.loops import build
from copsense.batch.statics.tangents import span
from copsense.batch.transfer import read_postures
from copsense.batch.vectors import along, load3, store3
from copsense.batch.workspace import WIDTH, Offsets

_offsets, _limit_offsets = from_array(Offsets), from_array(LimitOffsets)

_NO_LOAD = 0.5e-9  # share of the weight that is none, well under what the reference calls none
_PROVEN = 1e-8  # violation of an optimality condition above which the reference answers
_HUGE = 1e6  # weights: wrenches that no robot is meant to bear, likewise
_DEMANDS = 1e-9  # multiplier of a row that demands that all be relaxed, as in `Program`


class Pack(NamedTuple):
    """Memory for the postures in hand.

    Attributes:
        queue: postures that are to be solved (block,).
        candidate: whether a limit is near (block, nk).
        q: configurations of those abreast (`WIDTH`, nq).
        motions: their CoM motions (`WIDTH`, 2 nv).
        pressed: rows that press, of each of them; -1 where nothing has to be done, -2 where the
            reference must (`WIDTH`,).
        held: these rows (`WIDTH`, m).
        u: their multipliers (`WIDTH`, m).
        Q: orthonormal, its first columns span them (`WIDTH`, m, m).
        R: their triangular factor (`WIDTH`, m, m).
        size: largest entry of the cost's gradient (`WIDTH`,).
    """

    queue: np.ndarray
    candidate: np.ndarray
    q: np.ndarray
    motions: np.ndarray
    pressed: np.ndarray
    held: np.ndarray
    u: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    size: np.ndarray


@entry
def limit_postures(
    tree: Tree,
    feet: Feet,
    criteria: KernelCriteria,
    rows: KernelLimits,
    offsets: Any,
    limit_offsets: Any,
    q: Any,
    out: Out,
    found: LimitOut,
    W: Any,
    p: Programs,
    pack: Pack,
    start: int,
    stop: int,
) -> bool:
    """Put the results of postures start to stop within the limits.

    Returns:
        Whether any of them is in doubt, or has no answer.
    """
    offset, limits = _offsets(offsets), _limit_offsets(limit_offsets)
    at = Within(feet, offset, limits, rows, criteria, W, p)
    doubt, waiting, calm = False, 0, stop - start
    moving, gains, nv = feet.held == 1, len(out.com_gain) > 0, len(tree.parent) + 5
    for row in range(start, stop):
        near, known = False, False
        for index in range(len(criteria.kind)):
            column = criteria.column[index]
            doubtful = out.doubtful[row, column] != 0
            pack.candidate[row - start, index] = 0
            if not doubtful and begin_row(feet, rows, out, found, p.slack, row, column):
                pack.candidate[row - start, index] = 1
                near = True
            known = known or not doubtful
            doubt = doubt or doubtful
        if near:
            pack.queue[waiting] = row
            waiting += 1
        elif known and gains:  # behind the others: no gradient is theirs
            calm -= 1
            pack.queue[calm] = row
    for i in range(calm, stop - start):
        pack.queue[waiting] = pack.queue[i]
        waiting += 1
    for first in range(0, waiting, WIDTH):
        count = min(WIDTH, waiting - first)
        for lane in range(count):
            for i in range(q.shape[1]):
                pack.q[lane, i] = q[pack.queue[first + lane], i]
        read_postures(W, offset.q, pack.q, 0, count)
        move(tree, offset, W)
        place_feet(feet, offset, W)
        build(feet, offset, W)
        set_load(tree, offset, W)
        write_scales(feet, offset, limits, W)
        spanned = not moving
        if gains:
            if len(out.motions) > 0:
                for lane in range(count):
                    for i in range(2 * nv):
                        pack.motions[lane, i] = out.motions[pack.queue[first + lane] - start, i]
                read_postures(W, offset.motion, pack.motions, 0, count)
            else:
                factorise_inertia(tree, offset, W)
                com_motions(tree, feet, offset, W)
            move_joints(tree, feet, offset, limits, W)
        for index in range(len(criteria.kind)):
            store(W, offset.doubt, load(W, offset.flag))
            least_squares(feet, offset, W, criteria, index)
            store(W, limits.lost, load(W, offset.doubt))
            finish(tree, feet, offset, W)
            write_maps(feet, offset, limits, W, criteria, index)
            unlimited(feet, limits, W)
            some = False
            for lane in range(count):
                row = pack.queue[first + lane]
                pack.pressed[lane] = -1
                if pack.candidate[row - start, index]:
                    _settle(at, lane, row, index, pack, found)
                    if pack.pressed[lane] > 0:
                        some = True
                    elif pack.pressed[lane] < -1:
                        out.doubtful[row, criteria.column[index]] = 1
                    doubt = doubt or pack.pressed[lane] < -1
                    doubt = doubt or found.state[row, criteria.column[index]] == IMPOSSIBLE
            if some:
                if not spanned:
                    span(feet, offset, W)
                    spanned = True
                move_unknowns(feet, offset, limits, W, criteria, index)
                store(W, offset.doubt, load(W, limits.lost))
                finish(tree, feet, offset, W)
                torque_gradients(tree, feet, offset, W, criteria, index, gains, limits)
                if gains:
                    com_gains(feet, offset, W, nv)
                margins(feet, offset, W, gains)
                for output in range(2 * len(feet.body)):
                    base = offset.gradient + nv * output
                    store3(W, base, along(W, offset.rotation, load3(W, base)))
                    store3(W, base + 3, along(W, offset.rotation, load3(W, base + 3)))
            if gains:
                write_rates(tree, feet, offset, limits, W, criteria, index)
            for lane in range(count):
                row, column = pack.queue[first + lane], criteria.column[index]
                if pack.pressed[lane] > 0:
                    good = _conclude(at, lane, row, index, pack, found)
                    write_lane(feet, offset, W, lane, row, column, out, nv, gains)
                    row_margins(feet, rows, out, found.margins, p.slack, row, column)
                    if not good:
                        out.doubtful[row, column] = 1
                    doubt = doubt or not good or found.state[row, column] == UNLOADED
                if gains and out.doubtful[row, column] == 0:
                    _look_ahead(at, lane, row, column, pack, found)
    return doubt


@inlined
def _settle(at: Within, lane: int, row: int, index: int, pack: Pack, found: LimitOut) -> None:
    """The active set of one posture, into its lane; `pack.pressed` is -2 if it was not found."""
    feet, offset, limits, rows, criteria, W, p = at
    r, column = feet.unknowns, criteria.column[index]
    pack.pressed[lane] = -2
    if get(W, limits.lost, lane) != 0.0:
        return
    read_program(at, lane)
    most, fixed = 0.0, -1
    for i in feet.rest:  # torques that no wrench changes
        over = abs(get(W, offset.torque + i, lane)) - rows.torque[i]
        if over > most:
            most, fixed = over, i
    stuck = fixed >= 0 and most > TOUCHING * feet.weight
    q = nearest(rows, p, r, False, EXACT * feet.weight)
    if q == INFEASIBLE or (q >= 0 and stuck):
        found.state[row, column] = IMPOSSIBLE
        if found.relaxation[row] > 0.0:
            pack.pressed[lane] = -1
            return
        if not stuck:
            most = 0.0
        if q == INFEASIBLE:
            q = relax(rows, p, r + 1, feet.weight)
            if q < 0:
                return
            if p.x[r] > most:
                fixed, most = -1, p.x[r]
                k = 0
                for c in range(q):
                    if p.u[c] > _DEMANDS:
                        found.conflict[row, k] = _public(feet, rows, p.held[c])
                        k += 1
        if fixed >= 0 and stuck:
            found.conflict[row, 0] = rows.row[fixed]
            if get(W, offset.torque + fixed, lane) < 0.0:
                found.conflict[row, 0] += 1
        if most > TOUCHING * feet.weight:
            found.relaxation[row] = most
            pack.pressed[lane] = -1
        return
    if q < 0:
        return
    optimum(p, r, q)
    measure(rows, p, r, False)
    size = gradient_size(at, lane, index)
    q = keep_pressing(p, r, q, size)
    found.touching[row, column] = _touching(at, lane, p.held, q)
    pack.pressed[lane] = q
    if q == 0:
        pack.pressed[lane] = -1
        return
    found.state[row, column] = PRESSED
    write_responses(at, lane, q)
    pack.size[lane] = size
    for i in range(r):
        for j in range(r):
            pack.Q[lane, i, j], pack.R[lane, i, j] = p.Q[i, j], p.R[i, j]
    for k in range(q):
        pack.held[lane, k], pack.u[lane, k] = p.held[k], p.u[k]
        found.pressing[row, column, k] = _public(feet, rows, p.held[k])
        found.multipliers[row, column, k] = criteria.unit[index] * p.u[k]


@compiled
def _touching(at: Within, lane: int, held: Any, q: int) -> int:
    """How many rows are on their bounds and do not press, as the reference says it."""
    feet, offset, _limits, rows, _criteria, W, p = at
    touching, tolerance = 0, TOUCHING * feet.weight
    rc = len(rows.bound)
    for i in range(len(p.slack)):
        if p.slack[i] * p.inverse[i] <= tolerance and (i >= rc or rows.public[i] >= 0):
            presses = False
            for k in range(q):
                presses = presses or held[k] == i
            if not presses and _meets(at, i, q):
                touching += 1
    for i in feet.rest:
        torque = get(W, offset.torque + i, lane)
        for sign in (1.0, -1.0):
            if rows.row[i] >= 0 and rows.torque[i] - sign * torque <= tolerance:
                touching += 1
    return touching


@compiled
def _meets(at: Within, row: int, q: int) -> bool:
    """Whether a row's slack is none along what the q pressing rows leave free."""
    feet, _offset, _limits, rows, _criteria, _W, p = at
    write_row(rows, p, row, feet.unknowns, False)
    length, left = 0.0, 0.0
    for j in range(feet.unknowns):
        along = 0.0
        for i in range(feet.unknowns):
            along += p.Q[i, j] * p.a[i]
        length += along * along
        if j >= q:
            left += along * along
    if left <= APART * APART * length:
        return True
    near = p.slack[row] * p.inverse[row] / feet.weight
    return near <= max(TOUCHING * np.sqrt(left / length), ROUNDING)


@compiled
def _public(feet: Feet, rows: KernelLimits, row: int) -> int:
    """A row's place in `LimitRows.all_names`."""
    rc = len(rows.bound)
    if row < rc:
        return rows.public[row]
    return rows.row[feet.support[(row - rc) // 2]] + (row - rc) % 2


@inlined
def _look_ahead(at: Within, lane: int, row: int, column: int, pack: Pack, found: LimitOut) -> None:
    """The nearest change of the pressing rows, where there are wrenches within the limits."""
    feet, rows, p = at.feet, at.rows, at.p
    if found.state[row, column] == IMPOSSIBLE:
        return
    held, u, Q, R = pack.held[lane], pack.u[lane], pack.Q[lane], pack.R[lane]
    q = max(pack.pressed[lane], 0)
    travel, which = nearest_change(at, lane, q, held, u, Q, R, pack.size[lane])
    found.change_travel[row, column] = travel
    found.change_limit[row, column] = -1
    if which >= len(p.travel):
        i = which - len(p.travel)
        found.change_limit[row, column] = rows.row[i]
        if get(at.W, at.offset.torque + i, lane) < 0.0:
            found.change_limit[row, column] += 1
    elif which >= 0:
        found.change_limit[row, column] = _public(feet, rows, which)


@compiled
def _conclude(at: Within, lane: int, row: int, index: int, pack: Pack, found: LimitOut) -> bool:
    """Verify an optimum, as it came out; note contacts without load. Whether it can be believed."""
    feet, offset, limits, _rows, criteria, W, p = at
    column, q = criteria.column[index], pack.pressed[lane]
    error = violation(at, lane, index, pack.held[lane], pack.u[lane], q)
    found.optimality[row, column] = error
    for c in range(len(p.now)):
        if not abs(p.now[c]) < _HUGE * feet.weight:
            return False
    if get(W, offset.doubt, lane) != 0.0:
        if get(W, limits.lost, lane) != 0.0:
            return False
        bits = 0
        for k in range(len(feet.body)):
            if abs(p.now[6 * k + 2]) < _NO_LOAD * feet.weight:
                bits |= 1 << k
        found.unloaded[row, column] = bits
        found.state[row, column] = UNLOADED
        if bits == 0:
            return False
    return error <= _PROVEN
