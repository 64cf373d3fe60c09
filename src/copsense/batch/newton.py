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

from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import (
    LARGEST_ANGLE,
    add3,
    compiled,
    cross3,
    dot3,
    get,
    load,
    load3,
    magnitude,
    put,
    root,
    scale3,
    sine_cosine,
    splat,
    store,
    store3,
    where_less,
)
from copsense.batch.layout import CONTINUOUS, Feet, Tree
from copsense.batch.rows import Rows
from copsense.batch.steps import (
    BEYOND,
    DAMPING,
    ELSEWHERE,
    FLOOR,
    LONGEST_STEP,
    MOST_STEPS,
    OPPOSITE,
    PATIENCE,
    PROGRESS,
    ROUNDING,
    SOLVED,
    STUCK,
    TINY,
    TOLERANCE,
    UNSOLVED,
)


class Plan(NamedTuple):
    """A chart's coordinates as flat arrays; see `Coordinates`.

    Attributes:
        given: the stance's numbers.
        place: which of them each coordinate sets (k,).
        com_axis: axes of the CoM that are named.
        turned: 1 where the base's orientation may differ from the stance's.
        quaternion: the stance's (4,).
        position: origin of each contact (nc, 3).
        axes: its axes, three columns (nc, 9).
        slope: of its plane (nc, 2).
        contact: the contacts, limb by limb (nc,).
        contact_first: first of each limb's, and the end.
        unknown: the unknowns, limb by limb.
        unknown_first: first of each limb's, and the end.
        carries: whether a joint (1 ... n) moves a contact (n + 1, nc).
        low: lower limit of each joint (n,).
        high: upper limit (n,).
    """

    given: np.ndarray
    place: np.ndarray
    com_axis: np.ndarray
    turned: int
    quaternion: np.ndarray
    position: np.ndarray
    axes: np.ndarray
    slope: np.ndarray
    contact: np.ndarray
    contact_first: np.ndarray
    unknown: np.ndarray
    unknown_first: np.ndarray
    carries: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Search(NamedTuple):
    """First row of each block that the search adds to a workspace.

    Attributes:
        given: the given numbers.
        turn: axes about which roll, pitch and yaw turn the base (3, 3).
        error: h of every contact, limb by limb, then of the CoM.
        worst: the largest of them.
        going: above zero where the lane goes on.
        J: by rows.
        M: J J' + mu 1, then its Cholesky factor, by rows.
        multiplier: of each row.
        step: of each unknown.
        size: rows in all.
    """

    given: int
    turn: int
    error: int
    worst: int
    going: int
    J: int
    M: int
    multiplier: int
    step: int
    size: int


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
        _spread(tree, plan, rows, mine, W)
        move(tree, rows, W)
        place_feet(feet, rows, W)
        _errors(tree, feet, plan, rows, mine, W)
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
                _jacobian(tree, feet, plan, rows, mine, W, limb)
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
def _spread(tree: Tree, plan: Plan, rows: Rows, mine: Search, W: Any) -> None:
    """The configuration from base coordinates and joint positions; the base's turning axes."""
    store3(W, rows.q, load3(W, mine.given))
    if plan.turned:
        angle = load3(W, mine.given + 3)
        sr, cr = sine_cosine(0.5 * angle[0])
        sp, cp = sine_cosine(0.5 * angle[1])
        sy, cy = sine_cosine(0.5 * angle[2])
        # Rz(yaw) Ry(pitch) Rx(roll); of the two signs the one nearer to the stance's.
        x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
        z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
        near = plan.quaternion
        along = x * near[0] + y * near[1] + z * near[2] + w * near[3]
        sign = where_less(along, 0.0, splat(W, -1.0), splat(W, 1.0))
        store3(W, rows.q + 3, (sign * x, sign * y, sign * z))
        store(W, rows.q + 6, sign * w)
        s, c = 2.0 * sy * cy, cy * cy - sy * sy  # of the whole angles
        t, d = 2.0 * sp * cp, cp * cp - sp * sp
        zero = splat(W, 0.0)
        store3(W, mine.turn, (c * d, s * d, -t))
        store3(W, mine.turn + 3, (-s, c, zero))
        store3(W, mine.turn + 6, (zero, zero, splat(W, 1.0)))
    for i in range(1, len(tree.parent)):
        x, at = load(W, mine.given + 5 + i), rows.q + tree.column[i]
        if tree.kind[i] == CONTINUOUS:
            s, c = sine_cosine(x)
            store(W, at, c)
            store(W, at + 1, s)
        else:
            store(W, at, x)


@compiled
def _errors(tree: Tree, feet: Feet, plan: Plan, rows: Rows, mine: Search, W: Any) -> None:
    """h: how far contacts and CoM are from where they are wanted, world axes [m, rad]."""
    at, base, worst = mine.error, load3(W, rows.base), splat(W, 0.0)
    n6 = len(plan.given) - 3 * len(plan.position) - 3
    for k in plan.contact:
        wanted, home = mine.given + n6 + 3 + 3 * k, plan.position[k]
        dx, dy = load(W, wanted) - home[0], load(W, wanted + 1) - home[1]
        rise = plan.slope[k, 0] * dx + plan.slope[k, 1] * dy
        o = add3(base, load3(W, rows.foot + 3 * k))
        store3(W, at, (o[0] - home[0] - dx, o[1] - home[1] - dy, o[2] - home[2] - rise))
        at += 3
        if not feet.point[k]:
            a = plan.axes[k]
            s, c = sine_cosine(load(W, wanted + 2) - plan.given[n6 + 5 + 3 * k])
            x = (c * a[0] + s * a[3], c * a[1] + s * a[4], c * a[2] + s * a[5])
            y = (c * a[3] - s * a[0], c * a[4] - s * a[1], c * a[5] - s * a[2])
            z = (splat(W, a[6]), splat(W, a[7]), splat(W, a[8]))
            R = rows.foot_rotation + 9 * k
            u, v, w = load3(W, R), load3(W, R + 3), load3(W, R + 6)
            # sum of (wanted x here) = 2 sin(angle) axis, 1 + trace = 2 (1 + cos): 2 tan(angle / 2).
            twice = add3(add3(cross3(x, u), cross3(y, v)), cross3(z, w))
            open_ = 1.0 + dot3(x, u) + dot3(y, v) + dot3(z, w)
            worst = where_less(open_, OPPOSITE, splat(W, 1.0), worst)
            store3(W, at, scale3(2.0 / where_less(open_, OPPOSITE, OPPOSITE, open_), twice))
            at += 3
    for axis in plan.com_axis:
        com = load(W, rows.base + axis) + load(W, rows.first_moment + axis) / tree.carried[0]
        store(W, at, com - load(W, mine.given + n6 + axis))
        at += 1
    everything = splat(W, 0.0)
    for i in range(mine.error, at):
        size = magnitude(load(W, i))
        worst, everything = where_less(worst, size, size, worst), everything + size
    store(W, mine.worst, worst + 0.0 * everything)  # not a number where one of them is none


@compiled
def _jacobian(
    tree: Tree, feet: Feet, plan: Plan, rows: Rows, mine: Search, W: Any, limb: int
) -> None:
    """J of a limb, by rows."""
    first, n = plan.unknown_first[limb], plan.unknown_first[limb + 1] - plan.unknown_first[limb]
    zero = splat(W, 0.0)
    nothing = (zero, zero, zero)
    for column in range(n):
        u, at = plan.unknown[first + column], mine.J + column
        for k in plan.contact[plan.contact_first[limb] : plan.contact_first[limb + 1]]:
            v, w = nothing, nothing
            if u < 3:
                v = _unit(W, u)
            else:
                moves, v, w = _twist(plan, rows, mine, W, u, k)
                if moves:
                    v = add3(v, cross3(w, load3(W, rows.foot + 3 * k)))
            _column(W, at, n, v)
            at += 3 * n
            if not feet.point[k]:
                _column(W, at, n, w)
                at += 3 * n
        if len(plan.com_axis):
            rate = nothing
            share = 1.0 / tree.carried[0]
            if u < 3:
                rate = _unit(W, u)
            elif u < 6:
                w = load3(W, mine.turn + 3 * (u - 3))
                rate = scale3(share, cross3(w, load3(W, rows.first_moment)))
            else:
                rate = scale3(share, load3(W, rows.moment_rate + 3 * (u - 5)))
            for axis in plan.com_axis:
                if axis == 0:
                    store(W, at, rate[0])
                elif axis == 1:
                    store(W, at, rate[1])
                else:
                    store(W, at, rate[2])
                at += n


@compiled
def _unit(W: Any, axis: int) -> Any:
    one, zero = splat(W, 1.0), splat(W, 0.0)
    if axis == 0:
        return one, zero, zero
    if axis == 1:
        return zero, one, zero
    return zero, zero, one


@compiled
def _twist(plan: Plan, rows: Rows, mine: Search, W: Any, u: int, k: int) -> Any:
    """Twist that an unknown's unit velocity gives a contact; whether it moves it at all."""
    zero = splat(W, 0.0)
    nothing = (zero, zero, zero)
    if u < 6:
        return True, nothing, load3(W, mine.turn + 3 * (u - 3))
    if plan.carries[u - 5, k]:
        s = rows.screw + 6 * (u - 5)
        return True, load3(W, s), load3(W, s + 3)
    return False, nothing, nothing


@compiled
def _column(W: Any, at: int, n: int, a: Any) -> None:
    store(W, at, a[0])
    store(W, at + n, a[1])
    store(W, at + 2 * n, a[2])


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
