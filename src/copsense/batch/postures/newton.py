"""Newton: postures of a chart, several abreast, each lane at a posture of its own.

With x the unknowns (joints of the limbs, and base coordinates where something else is named in
their place), h(x) the error of contacts and CoM, J = dh/dx:

    x := x - s J' (J J' + mu 1)^-1 h,    mu = c |h|^2 + floor

the Levenberg-Marquardt step in its least-norm form: Newton's own where J is square, the smallest
correction where there are more unknowns than rows, least squares where there are fewer, and still
quadratic near a solution (Yamashita and Fukushima 2001). s shortens what is too long. A lane that
is done takes the next posture, so that no lane waits for the slowest.

A search starts between known postures where there are some around its row (`nearby`), and where
that leads nowhere once more from the stance.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled, entry
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import get, load, magnitude, put, root, splat, store, where_less
from copsense.batch.layout import Feet, Tree
from copsense.batch.postures.constraints import errors, jacobian, spread
from copsense.batch.postures.nearby import Nearby
from copsense.batch.postures.search_plan import SearchOffsets, SearchPlan
from copsense.batch.postures.search_settings import (
    BEYOND,
    DAMPING,
    FLOOR,
    LONGEST_STEP,
    MOST_STEPS,
    PATIENCE,
    PROGRESS,
    SOLVED,
    STUCK,
    TINY,
    UNSOLVED,
)
from copsense.batch.postures.starting import begin, give, take
from copsense.batch.workspace import WIDTH, Offsets
from copsense.posture import TOLERANCE
from copsense.stance import AT_LIMIT


class Found(NamedTuple):
    """Arrays that the search fills, the posture first.

    Attributes:
        configurations: (N, nq).
        residuals: largest error of a constraint (N,).
        iterations: steps taken (N,).
        status: solved, unsolved, stuck, beyond a limit, or left to the reference search (N,).
        which: the error that remains, or the joint beyond its limit (N,).
        excess: by how much the joint is (N,).
    """

    configurations: np.ndarray
    residuals: np.ndarray
    iterations: np.ndarray
    status: np.ndarray
    which: np.ndarray
    excess: np.ndarray


@entry
def solve_postures(
    tree: Tree,
    feet: Feet,
    plan: SearchPlan,
    offset: Offsets,
    search: SearchOffsets,
    nearby: Nearby,
    values: Any,
    found: Found,
    W: Any,
    start: int,
    stop: int,
) -> None:
    """Solve postures start to stop, `WIDTH` abreast."""
    given, following, busy = (plan, offset, search, nearby, values), start, 0
    for lane in range(WIDTH):
        following, taken = take(given, found.status, W, lane, following, stop)
        busy += taken >= 0
        if taken < 0:  # so that it computes with something
            give(plan, offset, search, values, W, lane, -1)
    while busy > 0:
        spread(tree, plan, offset, search, W)
        move(tree, offset, W)
        place_feet(feet, offset, W)
        errors(tree, feet, plan, offset, search, W)
        for lane in range(WIDTH):
            put(W, search.going, lane, 0.0)
            row, steps = int(get(W, search.posture, lane)), int(get(W, search.steps, lane))
            if row < 0:
                continue
            worst, done = get(W, search.worst, lane), -1
            if worst < TOLERANCE:
                done = SOLVED
            elif not worst < 1e300 or steps >= MOST_STEPS:
                done = UNSOLVED
            elif steps % PATIENCE == 0:
                if steps > 0 and worst > PROGRESS * get(W, search.before, lane):
                    done = STUCK
                put(W, search.before, lane, worst)
            if done < 0:
                put(W, search.going, lane, 1.0)
                put(W, search.steps, lane, steps + 1)
                continue
            which, most = _farthest(plan, search, W, lane) if done == SOLVED else (0, 0.0)
            if done == SOLVED and most > AT_LIMIT:
                done = BEYOND
            if done != SOLVED and get(W, search.nearby, lane) > 0.0:
                give(plan, offset, search, values, W, lane, row)
                begin(search, W, lane, 0.0, steps)
                continue
            _write(offset, search, found, W, lane, row, done, which, most)
            following, taken = take(given, found.status, W, lane, following, stop)
            busy -= taken < 0
        if busy > 0:
            for limb in range(len(plan.contact_first) - 1):
                jacobian(tree, feet, plan, offset, search, W, limb)
                _step(feet, plan, search, W, limb)


@compiled
def _farthest(plan: SearchPlan, search: SearchOffsets, W: Any, lane: int) -> tuple[int, float]:
    """The joint that is farthest beyond its limit, and by how much; AT_LIMIT where none is."""
    which, most = 0, AT_LIMIT
    for i in range(len(plan.low)):
        x = get(W, search.given + 6 + i, lane)
        beyond = max(plan.low[i] - x, x - plan.high[i])
        if beyond > most:
            which, most = i, beyond
    return which, most


@compiled
def _write(
    offset: Offsets,
    search: SearchOffsets,
    found: Found,
    W: Any,
    lane: int,
    row: int,
    status: int,
    which: int,
    most: float,
) -> None:
    for i in range(found.configurations.shape[1]):
        found.configurations[row, i] = get(W, offset.q + i, lane)
    if status in (SOLVED, BEYOND):
        found.excess[row] = most
    else:
        most = -1.0
        for i in range(search.worst - search.error):
            size = abs(get(W, search.error + i, lane))
            if size > most:
                which, most = i, size
    found.which[row] = which
    found.residuals[row] = get(W, search.worst, lane)
    found.iterations[row] = int(get(W, search.steps, lane) + get(W, search.spent, lane))
    found.status[row] = status


@compiled
def _step(feet: Feet, plan: SearchPlan, search: SearchOffsets, W: Any, limb: int) -> None:
    """Take the step of one limb's unknowns."""
    m, begin = 0, 0
    for l in range(limb + 1):
        m = 0
        for k in plan.contact[plan.contact_first[l] : plan.contact_first[l + 1]]:
            m += 3 if feet.point[k] else 6
        begin += m
    begin -= m
    m += len(plan.com_axis)  # all in one system where the CoM is named
    first, n = plan.unknown_first[limb], plan.unknown_first[limb + 1] - plan.unknown_first[limb]
    h, y = search.error + begin, search.multiplier
    square, trace = splat(0.0), splat(0.0)
    for i in range(m):
        e = load(W, h + i)
        square = square + e * e
        store(W, y + i, e)
        for j in range(i + 1):
            s, a, b = splat(0.0), search.J + n * i, search.J + n * j
            for c in range(n):
                s = s + load(W, a + c) * load(W, b + c)
            store(W, search.M + m * i + j, s)
        trace = trace + load(W, search.M + (m + 1) * i)
    mu = DAMPING * square + FLOOR * trace + TINY
    for i in range(m):
        at = search.M + (m + 1) * i
        store(W, at, load(W, at) + mu)
    _solve(W, search.M, y, m)
    longest = splat(LONGEST_STEP)
    for c in range(n):
        s = splat(0.0)
        for i in range(m):
            s = s - load(W, search.J + n * i + c) * load(W, y + i)
        store(W, search.step + c, s)
        size = magnitude(s)
        longest = where_less(longest, size, size, longest)
    share, going = LONGEST_STEP / longest, load(W, search.going)
    for c in range(n):
        x = search.given + plan.unknown[first + c]
        here = load(W, x)
        store(W, x, where_less(0.5, going, here + share * load(W, search.step + c), here))


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
