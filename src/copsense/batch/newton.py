"""Newton: postures of a chart, several abreast, each lane at a posture of its own.

With x the unknowns (joints of the limbs, and base coordinates where something else is named in
their place), h(x) the error of contacts and CoM, J = dh/dx:

    x := x - s J' (J J' + mu 1)^-1 h,    mu = c |h|^2 + floor

the Levenberg-Marquardt step in its least-norm form: Newton's own where J is square, the smallest
correction where there are more unknowns than rows, least squares where there are fewer, and still
quadratic near a solution (Yamashita and Fukushima 2001). s shortens what is too long. A lane that
is done takes the next posture, so that no lane waits for the slowest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.constraints import errors, jacobian, spread
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import compiled, get, load, magnitude, put, root, splat, store, where_less
from copsense.batch.layout import Feet, Tree
from copsense.batch.planning import Plan, Search
from copsense.batch.rows import Rows
from copsense.batch.steps import (
    BEYOND,
    DAMPING,
    ELSEWHERE,
    FLOOR,
    LONGEST_STEP,
    MOST_STEPS,
    PATIENCE,
    PROGRESS,
    ROUNDING,
    SOLVED,
    STUCK,
    TINY,
    TOLERANCE,
    UNSOLVED,
)
from copsense.batch.vectors import LARGEST_ANGLE


class Found(NamedTuple):
    """Arrays that the search fills, the posture first.

    Attributes:
        configurations: (N, nq).
        residuals: largest error of a constraint (N,).
        iterations: steps taken (N,).
        status: solved, unsolved, stuck, beyond a limit, or left to the clear path (N,).
        which: the error that remains, or the joint beyond its limit (N,).
        excess: by how much the joint is (N,).
    """

    configurations: np.ndarray
    residuals: np.ndarray
    iterations: np.ndarray
    status: np.ndarray
    which: np.ndarray
    excess: np.ndarray


@compiled
def search(
    tree: Tree,
    feet: Feet,
    plan: Plan,
    rows: Rows,
    mine: Search,
    values: Any,
    found: Found,
    W: Any,
    start: int,
    stop: int,
    width: int,
) -> None:
    """Solve postures start to stop, `width` abreast."""
    at, steps = np.full(width, -1), np.zeros(width, dtype=np.int64)
    before, following, busy = np.zeros(width), start, 0
    for lane in range(width):
        following, taken = _take(plan, rows, mine, values, found, W, lane, following, stop)
        at[lane], busy = taken, busy + (taken >= 0)
        if taken < 0:  # so that it computes with something
            _give(plan, rows, mine, values, W, lane, -1)
    while busy > 0:
        spread(tree, plan, rows, mine, W)
        move(tree, rows, W)
        place_feet(feet, rows, W)
        errors(tree, feet, plan, rows, mine, W)
        for lane in range(width):
            put(W, mine.going, lane, 0.0)
            row = at[lane]
            if row < 0:
                continue
            worst, done = get(W, mine.worst, lane), -1
            if worst < TOLERANCE:
                done = SOLVED
            elif not worst < 1e300 or steps[lane] >= MOST_STEPS:
                done = UNSOLVED
            elif steps[lane] % PATIENCE == 0:
                if steps[lane] > 0 and worst > PROGRESS * before[lane]:
                    done = STUCK
                before[lane] = worst
            if done < 0:
                put(W, mine.going, lane, 1.0)
                steps[lane] += 1
                continue
            _write(plan, rows, mine, found, W, lane, row, done, steps[lane])
            following, taken = _take(plan, rows, mine, values, found, W, lane, following, stop)
            at[lane], steps[lane] = taken, 0
            busy -= taken < 0
        if busy > 0:
            for limb in range(len(plan.contact_first) - 1):
                jacobian(tree, feet, plan, rows, mine, W, limb)
                _step(feet, plan, mine, W, limb)


@compiled
def _take(
    plan: Plan,
    rows: Rows,
    mine: Search,
    values: Any,
    found: Found,
    W: Any,
    lane: int,
    following: int,
    stop: int,
) -> tuple[int, int]:
    """Begin the next posture in a lane: the one after it, and itself (-1 where none is left)."""
    while following < stop:
        row = following
        following += 1
        if _give(plan, rows, mine, values, W, lane, row):
            return following, row
        found.status[row] = ELSEWHERE
    return following, -1


@compiled
def _give(plan: Plan, rows: Rows, mine: Search, values: Any, W: Any, lane: int, row: int) -> bool:
    """Set a lane to the stance with a posture's values; whether they are of ordinary size."""
    for i in range(len(plan.given)):
        put(W, mine.given + i, lane, plan.given[i])
    for i in range(4):
        put(W, rows.q + 3 + i, lane, plan.quaternion[i])
    if row < 0:
        return True
    ordinary = True
    com = len(plan.given) - 3 * len(plan.position) - 3
    for i in range(len(plan.place)):
        value, where = values[row, i], plan.place[i]
        ordinary = ordinary and abs(value) < 0.1 * LARGEST_ANGLE
        put(W, mine.given + where, lane, value)
        axis = where - com
        if 0 <= axis < 3:  # the base goes where the CoM goes, to begin with
            moved = plan.given[axis] + value - plan.given[where]
            put(W, mine.given + axis, lane, moved)
    return ordinary


@compiled
def _write(
    plan: Plan,
    rows: Rows,
    mine: Search,
    found: Found,
    W: Any,
    lane: int,
    row: int,
    status: int,
    steps: int,
) -> None:
    for i in range(found.configurations.shape[1]):
        found.configurations[row, i] = get(W, rows.q + i, lane)
    which, most = 0, ROUNDING
    if status == SOLVED:
        for i in range(len(plan.low)):
            x = get(W, mine.given + 6 + i, lane)
            beyond = max(plan.low[i] - x, x - plan.high[i])
            if beyond > most:
                which, most, status = i, beyond, BEYOND
        found.excess[row] = most
    else:
        most = -1.0
        for i in range(mine.worst - mine.error):
            size = abs(get(W, mine.error + i, lane))
            if size > most:
                which, most = i, size
    found.which[row] = which
    found.residuals[row] = get(W, mine.worst, lane)
    found.iterations[row], found.status[row] = steps, status


@compiled
def _step(feet: Feet, plan: Plan, mine: Search, W: Any, limb: int) -> None:
    """Take the step of one limb's unknowns."""
    m, offset = 0, 0
    for l in range(limb + 1):
        m = 0
        for k in plan.contact[plan.contact_first[l] : plan.contact_first[l + 1]]:
            m += 3 if feet.point[k] else 6
        offset += m
    offset -= m
    m += len(plan.com_axis)  # all in one system where the CoM is named
    first, n = plan.unknown_first[limb], plan.unknown_first[limb + 1] - plan.unknown_first[limb]
    h, y = mine.error + offset, mine.multiplier
    square, trace = splat(W, 0.0), splat(W, 0.0)
    for i in range(m):
        e = load(W, h + i)
        square = square + e * e
        store(W, y + i, e)
        for j in range(i + 1):
            s, a, b = splat(W, 0.0), mine.J + n * i, mine.J + n * j
            for c in range(n):
                s = s + load(W, a + c) * load(W, b + c)
            store(W, mine.M + m * i + j, s)
        trace = trace + load(W, mine.M + (m + 1) * i)
    mu = DAMPING * square + FLOOR * trace + TINY
    for i in range(m):
        at = mine.M + (m + 1) * i
        store(W, at, load(W, at) + mu)
    _solve(W, mine.M, y, m)
    longest = splat(W, LONGEST_STEP)
    for c in range(n):
        s = splat(W, 0.0)
        for i in range(m):
            s = s - load(W, mine.J + n * i + c) * load(W, y + i)
        store(W, mine.step + c, s)
        size = magnitude(s)
        longest = where_less(longest, size, size, longest)
    share, going = LONGEST_STEP / longest, load(W, mine.going)
    for c in range(n):
        x = mine.given + plan.unknown[first + c]
        here = load(W, x)
        store(W, x, where_less(0.5, going, here + share * load(W, mine.step + c), here))


@compiled
def _solve(W: Any, M: int, y: int, m: int) -> None:
    """y := M^-1 y by Cholesky, M (lower triangle, by rows) overwritten."""
    for i in range(m):
        for j in range(i):
            s = load(W, M + m * i + j)
            for k in range(j):
                s = s - load(W, M + m * i + k) * load(W, M + m * j + k)
            store(W, M + m * i + j, s * load(W, M + m * j + j))
        s = load(W, M + m * i + i)
        for k in range(i):
            s = s - load(W, M + m * i + k) * load(W, M + m * i + k)
        store(W, M + m * i + i, 1.0 / root(s))
    for i in range(m):
        s = load(W, y + i)
        for k in range(i):
            s = s - load(W, M + m * i + k) * load(W, y + k)
        store(W, y + i, s * load(W, M + m * i + i))
    for i in range(m - 1, -1, -1):
        s = load(W, y + i)
        for k in range(i + 1, m):
            s = s - load(W, M + m * k + i) * load(W, y + k)
        store(W, y + i, s * load(W, M + m * i + i))
