"""Active set: the nearest point of a polyhedron, by the dual method of Goldfarb and Idnani (1983).

A criterion's optimum without limits is known in closed form. With coordinates x about it in which
the cost is |x|^2 / 2, the optimum within limits is the point of

    a_i . x <= s_i        (s_i: the limit's slack without limits)

nearest to x = 0. The method starts there, takes the most violated row, and moves along what the
held rows leave until it holds too, letting go of rows that cease to press. With the held rows as
columns, A_h' = Q_1 R, x = Q_1 w, R' w = s_h, and the multipliers are u = -R^-1 w.

Rows are not written out: what they limit, the contacts' wrenches w_0 + N x and the torques
tau_0 - B x, is. With one coordinate more, t, the same rows a_i . x - t <= s_i give the least t
that leaves a point, as a sequence of nearest points (proximal steps; Rockafellar 1976).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled
from copsense.batch.lanes import least, load, splat, store, where_less
from copsense.batch.statics.kernel_limits import KernelLimits
from copsense.batch.workspace import WIDTH

INFEASIBLE, FAILED = -1, -2
_DEPENDENT = 1e-18  # share (squared) that the held rows must leave of another, as in `Program`
_FIXED = 1e-24  # share (squared) of what a row of its norm may answer to x, that is rounding
_EASES = 1e-10  # rates, relative, under which a multiplier does not ease
_MOST = 200  # changes of the held rows; a few are usual
EXACT = 1e-12  # weights: by which a row may be broken
_STEPS = 20  # proximal steps; two to four are usual
_NEAR, _FAR = 100.0, 1e4  # weights: how far the first proximal step looks, and the last
_RELAXED = 1e-11  # weights: by which a relaxed row may be broken
_PROVEN = 1e-7  # share of a proximal step that may be left: the linear program's dual residual


class Programs(NamedTuple):
    """Memory of one posture's program; m is one more than the kernel's unknowns.

    Attributes:
        N: contacts' wrenches per x, contact axes (6 nc, m).
        B: torque that x takes off each support joint (ns, m).
        wrench: w_0 (6 nc,).
        torque: tau_0 (ns,).
        limit: of each support joint's torque (ns,).
        inverse: 1 / norm of each row over the contacts' wrenches (rows,): those of the contacts,
            two of each support joint, and up to a multiple of `WIDTH` others, never broken.
        number: of each row (rows,).
        x: the point (m,).
        centre: what it shall be near to (m,).
        now: the wrenches at x (6 nc,).
        felt: the torques at x (ns,).
        push: derivatives of the cost by the wrenches (6 nc,).
        strain: and by the torques (ns,).
        slack: of each row at x (rows,).
        start: of each row where the search began (rows,).
        Q: orthonormal, its first columns span the held rows (m, m).
        R: upper triangular (m, m).
        a: a row (m,).
        d: Q' a, or a right-hand side (m,).
        rate: of the held rows' multipliers (m,).
        u: multipliers of the held rows (m,).
        held: the held rows (m,).
        wrench_rate: of the wrenches along both CoM motions (2, 6 nc).
        torque_rate: of the support joints' torques (2, ns).
        u_rate: of the held rows' multipliers (2, m).
        travel: of the CoM until each row changes sides, squared (rows,).
    """

    N: np.ndarray
    B: np.ndarray
    wrench: np.ndarray
    torque: np.ndarray
    limit: np.ndarray
    inverse: np.ndarray
    number: np.ndarray
    x: np.ndarray
    centre: np.ndarray
    now: np.ndarray
    felt: np.ndarray
    push: np.ndarray
    strain: np.ndarray
    slack: np.ndarray
    start: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    a: np.ndarray
    d: np.ndarray
    rate: np.ndarray
    u: np.ndarray
    held: np.ndarray
    wrench_rate: np.ndarray
    torque_rate: np.ndarray
    u_rate: np.ndarray
    travel: np.ndarray


def programs(limits: KernelLimits, contacts: int, supports: int, unknowns: int) -> Programs:
    """Memory for one thread."""
    m, rows = unknowns + 1, len(limits.bound) + 2 * supports
    rows += -rows % WIDTH
    sizes: dict[str, Any] = {
        "N": (6 * contacts, m),
        "B": (supports, m),
        "wrench": 6 * contacts,
        "torque": supports,
        "limit": supports,
        "now": 6 * contacts,
        "felt": supports,
        "push": 6 * contacts,
        "strain": supports,
        "Q": (m, m),
        "R": (m, m),
        "wrench_rate": (2, 6 * contacts),
        "torque_rate": (2, supports),
        "u_rate": (2, m),
    }
    sizes |= dict.fromkeys(("x", "centre", "a", "d", "rate", "u"), m)
    arrays = {name: np.zeros(size) for name, size in sizes.items()}
    arrays |= {name: np.full(rows, np.inf) for name in ("slack", "start", "travel")}
    return Programs(
        **arrays,
        inverse=np.append(limits.inverse, np.ones(rows - len(limits.bound))),
        number=np.arange(rows, dtype=float),
        held=np.zeros(m, dtype=np.int64),
    )


@compiled
def nearest(limits: KernelLimits, p: Programs, n: int, soft: bool, tolerance: float) -> int:
    """The nearest point to `centre` within the rows; how many rows hold, or a reason for none.

    Args:
        limits: the contacts' rows.
        p: the program.
        n: coordinates; with `soft` the last is t.
        soft: whether every row is relaxed by t.
        tolerance: by which a row may be broken, of its norm; with `soft`, as it is.
    """
    for i in range(n):
        p.x[i] = p.centre[i]
        for j in range(n):
            p.Q[i, j] = 1.0 if i == j else 0.0
    q, reach = 0, 0.0
    for i in range(len(p.now)):
        for j in range(n):
            reach += p.N[i, j] * p.N[i, j]
    for change in range(_MOST):
        new = measure(limits, p, n, soft)
        if change == 0:
            for i in range(len(p.slack)):
                p.start[i] = p.slack[i]
        scale = 1.0 if soft else p.inverse[new]
        if not p.slack[new] * scale < -tolerance:
            return q
        for k in range(q):
            if p.held[k] == new:  # rounding: the caller verifies the optimum
                return q
        write_row(limits, p, new, n, soft)
        missing, pressure, length = -p.slack[new], 0.0, 0.0
        for j in range(n):
            length += p.a[j] * p.a[j]
        # What the balance alone fixes, such as the loads of three points, answers to no x.
        nothing = max(_DEPENDENT * length, _FIXED * reach / (p.inverse[new] * p.inverse[new]))
        for _ in range(_MOST):
            left, first, step = _rates(p, n, q)
            free = left > nothing
            full = missing / left if free else np.inf
            if first < 0 and not free:
                return INFEASIBLE
            whole = first < 0 or full <= step
            step = full if whole else step
            for k in range(q):
                p.u[k] -= step * p.rate[k]
            pressure += step
            if free:
                for j in range(q, n):
                    for i in range(n):
                        p.x[i] -= step * p.d[j] * p.Q[i, j]
                missing -= step * left
            if whole:
                _hold(p, n, q, new, pressure)
                q += 1
                break
            release(p, n, q, first)
            q -= 1
        else:
            return FAILED
    return FAILED


@compiled
def measure(limits: KernelLimits, p: Programs, n: int, soft: bool) -> int:
    """Every row's slack at x; the row that is broken most."""
    for i in range(len(p.now)):
        s = p.wrench[i]
        for j in range(n):
            s += p.N[i, j] * p.x[j]
        p.now[i] = s
    for t in range(len(p.felt)):
        s = p.torque[t]
        for j in range(n):
            s -= p.B[t, j] * p.x[j]
        p.felt[t] = s
    more = p.x[n - 1] if soft else 0.0
    rc = len(limits.bound)
    contact_slack(limits, p.now, p.slack, more)
    for t in range(len(p.felt)):
        p.slack[rc + 2 * t] = p.limit[t] - p.felt[t] + more
        p.slack[rc + 2 * t + 1] = p.limit[t] + p.felt[t] + more
    return _most_broken(p, soft)


@compiled
def _most_broken(p: Programs, soft: bool) -> int:
    """The row of least slack, of its norm; the first of several."""
    worst, found = splat(np.inf), splat(0.0)
    for i in range(len(p.slack) // WIDTH):
        s = load(p.slack, i)
        if not soft:
            s = s * load(p.inverse, i)
        found = where_less(s, worst, load(p.number, i), found)
        worst = where_less(s, worst, s, worst)
    return int(least(where_less(least(worst), worst, splat(np.inf), found)))


@compiled
def contact_slack(limits: KernelLimits, wrenches: Any, slack: Any, more: float) -> None:
    """Slack of the contacts' rows, bound - c . w and `more` (rc,), of wrenches (6 nc,)."""
    c, n = limits.coefficient, len(limits.bound) // WIDTH
    for k in range(len(limits.first) - 1):
        at = 6 * k
        for i in range(limits.first[k] // WIDTH, limits.first[k + 1] // WIDTH):
            s = load(limits.bound, i) + more
            for e in range(6):
                s = s - wrenches[at + e] * load(c, n * e + i)
            store(slack, i, s)


@compiled
def write_row(limits: KernelLimits, p: Programs, i: int, n: int, soft: bool) -> None:
    """a of a row; the last coordinate relaxes it."""
    r = n - 1 if soft else n
    rc = len(limits.bound)
    if i >= rc:
        sign = -1.0 if (i - rc) % 2 == 0 else 1.0
        for j in range(r):
            p.a[j] = sign * p.B[(i - rc) // 2, j]
    else:
        k = 0
        while limits.first[k + 1] <= i:
            k += 1
        for j in range(r):
            s = 0.0
            for e in range(6):
                s += limits.coefficient[e, i] * p.N[6 * k + e, j]
            p.a[j] = s
    if soft:
        p.a[r] = -1.0


@compiled
def _rates(p: Programs, n: int, q: int) -> tuple[float, int, float]:
    """What the held rows leave of a (squared); which of them lets go first, and after what step."""
    for j in range(n):
        s = 0.0
        for i in range(n):
            s += p.Q[i, j] * p.a[i]
        p.d[j] = s
    left, most = 0.0, 0.0
    for j in range(q, n):
        left += p.d[j] * p.d[j]
    for k in range(q - 1, -1, -1):
        s = p.d[k]
        for j in range(k + 1, q):
            s -= p.R[k, j] * p.rate[j]
        p.rate[k] = s / p.R[k, k]
        most = max(most, abs(p.rate[k]))
    first, step = -1, np.inf
    for k in range(q):
        if p.rate[k] > _EASES * most and p.u[k] < step * p.rate[k]:
            first, step = k, p.u[k] / p.rate[k]
    return left, first, step


@compiled
def _hold(p: Programs, n: int, q: int, new: int, pressure: float) -> None:
    """Take a row, of which d = Q' a, among the held."""
    for j in range(n - 1, q, -1):  # turn d's entries after q into it
        _turn(p.Q, n, j - 1, j, p.d[j - 1], p.d[j])
        p.d[j - 1] = np.sqrt(p.d[j - 1] * p.d[j - 1] + p.d[j] * p.d[j])
    for k in range(q + 1):
        p.R[k, q] = p.d[k]
    p.held[q], p.u[q] = new, pressure


@compiled
def release(p: Programs, n: int, q: int, row: int) -> None:
    """Let go of one of q held rows."""
    for j in range(row + 1, q):
        p.held[j - 1], p.u[j - 1] = p.held[j], p.u[j]
        for k in range(j + 1):
            p.R[k, j - 1] = p.R[k, j]
    for j in range(row, q - 1):  # its diagonal now stands below the next
        a, b = p.R[j, j], p.R[j + 1, j]
        length = np.sqrt(a * a + b * b)
        if length == 0.0:
            continue
        c, s = a / length, b / length
        for k in range(j, q - 1):
            x, y = p.R[j, k], p.R[j + 1, k]
            p.R[j, k], p.R[j + 1, k] = c * x + s * y, c * y - s * x
        _turn(p.Q, n, j, j + 1, a, b)


@compiled
def _turn(Q: Any, n: int, i: int, j: int, a: float, b: float) -> None:
    """Columns i and j of Q so that (a, b) along them becomes (|(a, b)|, 0)."""
    length = np.sqrt(a * a + b * b)
    if length == 0.0:
        return
    c, s = a / length, b / length
    for k in range(n):
        x, y = Q[k, i], Q[k, j]
        Q[k, i], Q[k, j] = c * x + s * y, c * y - s * x


@compiled
def optimum(p: Programs, n: int, q: int) -> None:
    """x and u exactly, of the rows that hold, near to x = 0 where the search began."""
    for j in range(n):
        p.x[j] = 0.0
    for k in range(q):  # R' w = s
        s = p.start[p.held[k]]
        for j in range(k):
            s -= p.R[j, k] * p.d[j]
        p.d[k] = s / p.R[k, k]
    for k in range(q - 1, -1, -1):  # R u = -w
        s = -p.d[k]
        for j in range(k + 1, q):
            s -= p.R[k, j] * p.u[j]
        p.u[k] = s / p.R[k, k]
    for j in range(q):
        for i in range(n):
            p.x[i] += p.d[j] * p.Q[i, j]


@compiled
def _is_least(p: Programs, n: int, q: int) -> bool:
    """Whether the q held rows alone prove the last coordinate least: e_t + A_h' u = 0 with u >= 0.

    If so u is left in `u`. A first step often ends there, and needs no other to say so.
    """
    left = 0.0
    for j in range(q, n):
        left += p.Q[n - 1, j] * p.Q[n - 1, j]
    if left > _PROVEN * _PROVEN:
        return False
    for k in range(q - 1, -1, -1):
        s = -p.Q[n - 1, k]
        for j in range(k + 1, q):
            s -= p.R[k, j] * p.rate[j]
        p.rate[k] = s / p.R[k, k]
        if p.rate[k] < -_PROVEN:
            return False
    for k in range(q):
        p.u[k] = max(p.rate[k], 0.0)
    return True


@compiled
def relax(limits: KernelLimits, p: Programs, n: int, weight: float) -> int:
    """The least t by which every row must be relaxed, x[n - 1]; how many rows demand it.

    `u` are then their multipliers in the linear program, which sum up to one. FAILED where it was
    not found.
    """
    far = _NEAR * weight
    for j in range(n):
        p.x[j] = 0.0
    for _ in range(_STEPS):
        for j in range(n):
            p.centre[j] = p.x[j]
        p.centre[n - 1] -= far
        q = nearest(limits, p, n, True, _RELAXED * weight)
        if q < 0:
            return FAILED
        if _is_least(p, n, q):
            return q
        # The linear program's own condition, e_t + A' u / far = 0: no step is left.
        moved = abs(p.x[n - 1] - p.centre[n - 1] - far)
        for j in range(n - 1):
            moved = max(moved, abs(p.x[j] - p.centre[j]))
        if moved <= _PROVEN * far:
            for k in range(q):
                p.u[k] /= far
            return q
        far = min(10.0 * far, _FAR * weight)
    return FAILED
