"""Limited statics: a criterion's wrenches within limits, for the postures where limits press.

All postures abreast get the maps from the coordinates x of the active set (see `active_set`) to
wrenches and torques; then each its own active set; then all abreast what follows from it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled
from copsense.batch.lanes import get, load, put, root, splat, store
from copsense.batch.layout import Feet
from copsense.batch.statics.active_set import Programs, measure, release, write_row
from copsense.batch.statics.criteria import LEAST_TORQUE, KernelCriteria
from copsense.batch.statics.kernel_limits import KernelLimits
from copsense.batch.statics.limit_offsets import LimitOffsets
from copsense.batch.statics.load_sharing import own_wrenches
from copsense.batch.statics.loops import expand, times_upper
from copsense.batch.vectors import add3, cross3, dot3, load3, scale3, sub3
from copsense.batch.workspace import Offsets

PRESSING = 1e-9  # multipliers, relative to the largest gradient, that do not press, as in `statics`
TOUCHING = 1e-9  # slack, relative to the weight, under which a row is on its bound, likewise
APART = 1e-9  # share that the pressing rows leave of a row apart from them, likewise
ROUNDING = 1e-13  # slack, relative to the weight, that is none however little they leave, likewise


class Within(NamedTuple):
    """What the functions for one posture of those abreast work with.

    Attributes:
        feet: the contacts.
        offset: of the workspace's blocks.
        limits: of those that the limited kernel adds.
        rows: the limits.
        criteria: the criteria.
        W: the workspace.
        p: memory of a program.
    """

    feet: Feet
    offset: Offsets
    limits: LimitOffsets
    rows: KernelLimits
    criteria: KernelCriteria
    W: Any
    p: Programs


@compiled
def write_scales(feet: Feet, offset: Offsets, limits: LimitOffsets, W: Any) -> None:
    """Norm of each support joint's torque over the contacts' wrenches."""
    for t in range(len(feet.support)):
        v, w = (
            load3(W, offset.screw + 6 * feet.support[t]),
            load3(W, offset.screw + 6 * feet.support[t] + 3),
        )
        square = splat(0.0)
        for k in range(len(feet.body)):
            if feet.member[feet.group[t], k]:
                here = add3(v, cross3(w, load3(W, offset.foot + 3 * k)))
                square = square + dot3(here, here)
                if not feet.point[k]:
                    square = square + dot3(w, w)
        store(W, limits.scale + t, root(square))


@compiled
def write_maps(
    feet: Feet, offset: Offsets, limits: LimitOffsets, W: Any, criteria: KernelCriteria, index: int
) -> None:
    """N and B of a criterion: unknowns y = y_0 + R^-1 x, in which its cost is |x|^2 / 2."""
    ns, r, nc = len(feet.support), feet.unknowns, len(feet.body)
    weighted = criteria.kind[index] != LEAST_TORQUE
    T = offset.Tw if weighted else offset.T
    for i in range(r):
        store(W, limits.shift + i, splat(0.0))
    for j in range(r):
        store(W, limits.shift + j, splat(1.0))
        expand(feet, offset, W, limits.shift, offset.nothing, offset.inner)
        store(W, limits.shift + j, splat(0.0))
        own_wrenches(feet, offset, W, offset.inner, limits.N + 6 * nc * j)
    # Times R^-1, upper triangular: the last column first, so that the others are still there.
    for j in range(r - 1, -1, -1):
        for c in range(6 * nc):
            s = load(W, limits.N + 6 * nc * j + c) * load(W, T + r * j + j)
            for i in range(j):
                s = s + load(W, limits.N + 6 * nc * i + c) * load(W, T + r * i + j)
            store(W, limits.N + 6 * nc * j + c, s)
    for j in range(r):
        if weighted:  # B R^-1 = Q (R_0 R^-1), B = Q R_0 the factors of the torques
            for i in range(r):
                store(W, limits.shift + i, load(W, T + r * i + j) if i <= j else splat(0.0))
            times_upper(W, offset.R, limits.shift, r)
        for t in range(ns):
            if weighted:
                s = load(W, offset.Q + t) * load(W, limits.shift)
                for i in range(1, j + 1):
                    s = s + load(W, offset.Q + ns * i + t) * load(W, limits.shift + i)
            else:
                s = load(W, offset.Q + ns * j + t)
            store(W, limits.B + ns * j + t, s)


@compiled
def unlimited(feet: Feet, limits: LimitOffsets, W: Any) -> None:
    """No shift, nothing pressing."""
    ns, r = len(feet.support), feet.unknowns
    for i in range(r):
        store(W, limits.shift + i, splat(0.0))
        for j in range(r):
            store(W, limits.P + r * i + j, splat(1.0 if i == j else 0.0))
        for t in range(ns):
            store(W, limits.torque_response + r * t + i, splat(0.0))
        for e in range(3):
            store(W, limits.twist_response + 3 * i + e, splat(0.0))
    for t in range(ns):
        store(W, limits.pressing + t, splat(0.0))


@compiled
def move_unknowns(
    feet: Feet, offset: Offsets, limits: LimitOffsets, W: Any, criteria: KernelCriteria, index: int
) -> None:
    """Wrenches of the unknowns y_0 + R^-1 x."""
    r = feet.unknowns
    T = offset.T if criteria.kind[index] == LEAST_TORQUE else offset.Tw
    times_upper(W, T, limits.shift, r)
    for i in range(r):
        store(W, offset.unknown + i, load(W, offset.unknown + i) + load(W, limits.shift + i))
    expand(feet, offset, W, offset.unknown, offset.load, offset.wrench)


@compiled
def read_program(at: Within, lane: int) -> None:
    """One posture's program, from its lane."""
    read_forces(at, lane)
    read_maps(at, lane)


@compiled
def read_maps(at: Within, lane: int) -> None:
    """Of one posture's program N, B and the centre."""
    feet, _offset, limits, _rows, _criteria, W, p = at
    ns, r, nc = len(feet.support), feet.unknowns, len(feet.body)
    for j in range(r):
        for c in range(6 * nc):
            p.N[c, j] = get(W, limits.N + 6 * nc * j + c, lane)
        for t in range(ns):
            p.B[t, j] = get(W, limits.B + ns * j + t, lane)
        p.centre[j] = 0.0
    for c in range(6 * nc):
        p.N[c, r] = 0.0
    for t in range(ns):
        p.B[t, r] = 0.0


@compiled
def read_forces(at: Within, lane: int) -> None:
    """Of one posture's program wrenches and torques, and the torques' limits."""
    feet, offset, limits, rows, _criteria, W, p = at
    rc = len(rows.bound)
    for c in range(6 * len(feet.body)):
        p.wrench[c] = get(W, offset.contact_wrench + c, lane)
    for t in range(len(feet.support)):
        p.torque[t] = get(W, offset.torque + feet.support[t], lane)
        p.limit[t] = rows.torque[feet.support[t]]
        scale = get(W, limits.scale + t, lane)
        p.inverse[rc + 2 * t] = p.inverse[rc + 2 * t + 1] = 1.0 / scale


@compiled
def gradient_size(at: Within, lane: int, index: int) -> float:
    """Largest entry of the cost's gradient over the wrenches, W_f (f - f_ref) - J W_tau tau.

    Leaves its parts, W_f (f - f_ref) and W_tau tau, in the program.
    """
    feet, offset, _limits, _rows, criteria, W, p = at
    weights, reach = criteria.wrench[index], criteria.wrench_reach[index]
    for i in range(len(p.now)):
        p.push[i] = 0.0
        for j in range(max(i - reach, 0), min(i + reach + 1, len(p.now))):
            p.push[i] += weights[i, j] * (p.now[j] - criteria.reference[index, j])
    weights, reach = criteria.torque[index], criteria.torque_reach[index]
    for t in range(len(p.felt)):
        p.strain[t] = 0.0
        for u in range(max(t - reach, 0), min(t + reach + 1, len(p.felt))):
            p.strain[t] += weights[t, u] * p.felt[u]
    size = 0.0
    for k in range(len(feet.body)):
        v0, v1, v2, w0, w1, w2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for t in range(len(feet.support)):
            if feet.member[feet.group[t], k]:
                nu, s = p.strain[t], offset.screw + 6 * feet.support[t]
                v0 += nu * get(W, s, lane)
                v1 += nu * get(W, s + 1, lane)
                v2 += nu * get(W, s + 2, lane)
                w0 += nu * get(W, s + 3, lane)
                w1 += nu * get(W, s + 4, lane)
                w2 += nu * get(W, s + 5, lane)
        x = get(W, offset.foot + 3 * k, lane)
        y = get(W, offset.foot + 3 * k + 1, lane)
        z = get(W, offset.foot + 3 * k + 2, lane)
        v0 += w1 * z - w2 * y
        v1 += w2 * x - w0 * z
        v2 += w0 * y - w1 * x
        for e in range(3):
            a = offset.foot_rotation + 9 * k + 3 * e
            R0, R1, R2 = get(W, a, lane), get(W, a + 1, lane), get(W, a + 2, lane)
            size = max(size, abs(p.push[6 * k + e] - (R0 * v0 + R1 * v1 + R2 * v2)))
            if not feet.point[k]:
                turned = R0 * w0 + R1 * w1 + R2 * w2
                size = max(size, abs(p.push[6 * k + 3 + e] - turned))
    return max(size, 1e-300)


@compiled
def keep_pressing(p: Programs, n: int, q: int, size: float) -> int:
    """Let go of the held rows that do not press; how many are left."""
    for k in range(q - 1, -1, -1):
        if not p.u[k] > PRESSING * size * p.inverse[p.held[k]]:
            release(p, n, q, k)
            q -= 1
    return q


@compiled
def write_responses(at: Within, lane: int, q: int) -> None:
    """Into a lane: x, what the pressing rows leave, and how their multipliers answer."""
    feet, offset, limits, rows, _criteria, W, p = at
    r, rc = feet.unknowns, len(rows.bound)
    for i in range(r):
        put(W, limits.shift + i, lane, p.x[i])
        for j in range(r):
            s = 0.0
            for c in range(q, r):
                s += p.Q[i, c] * p.Q[j, c]
            put(W, limits.P + r * i + j, lane, s)
    for k in range(q):
        row = p.held[k]
        if row >= rc:
            t = (row - rc) // 2
            sign = 1.0 if (row - rc) % 2 == 0 else -1.0
            put(W, limits.pressing + t, lane, sign * p.u[k])
    for j in range(r):  # of R kappa = Q' e_j
        for k in range(q - 1, -1, -1):
            s = p.Q[j, k]
            for c in range(k + 1, q):
                s -= p.R[k, c] * p.d[c]
            p.d[k] = s / p.R[k, k]
        for k in range(q):
            row = p.held[k]
            if row >= rc:
                t = (row - rc) // 2
                sign = 1.0 if (row - rc) % 2 == 0 else -1.0
                put(W, limits.torque_response + r * t + j, lane, sign * p.d[k])
        w = (0.0, 0.0, 0.0)
        for h in feet.order[: feet.held]:
            # A surface turns by the moments of its rows, three points by I^-1 rho x their forces.
            part = 3 if feet.held == 1 else 0
            a = (0.0, 0.0, 0.0)
            for k in range(q):
                row, share = p.held[k], rows.coefficient
                if rows.first[h] <= row < rows.first[h + 1]:
                    own = share[part, row], share[part + 1, row], share[part + 2, row]
                    a = add3(a, scale3(p.d[k], own))
            a = _across_lane(W, offset.foot_rotation + 9 * h, lane, a)
            if feet.held == 3:
                foot, middle = offset.foot + 3 * h, offset.spread
                a = cross3(sub3(_get3(W, foot, lane), _get3(W, middle, lane)), a)
            w = add3(w, a)
        if feet.held == 3:
            w = _across_lane(W, offset.spread + 3, lane, w)
        for e in range(3):
            put(W, limits.twist_response + 3 * j + e, lane, w[e])


@compiled
def _get3(W: Any, row: int, lane: int) -> Any:
    """A vector of one posture."""
    return get(W, row, lane), get(W, row + 1, lane), get(W, row + 2, lane)


@compiled
def _across_lane(W: Any, row: int, lane: int, a: Any) -> Any:
    """A a of one posture's A, three columns in nine rows."""
    x, y, z = _get3(W, row, lane), _get3(W, row + 3, lane), _get3(W, row + 6, lane)
    return add3(add3(scale3(a[0], x), scale3(a[1], y)), scale3(a[2], z))


@compiled
def violation(at: Within, lane: int, index: int, held: Any, u: Any, q: int) -> float:
    """Largest violation of an optimality condition, as `Program.violation`, of what came out.

    Leaves the rows' slack in the program. The stationarity is taken along the internal wrenches.
    """
    feet, offset, _limits, rows, criteria, W, p = at
    r, ns, nc = feet.unknowns, len(feet.support), len(feet.body)
    weighted = criteria.kind[index] != LEAST_TORQUE
    read_program(at, lane)
    for j in range(r):
        p.x[j] = 0.0
    new = measure(rows, p, r, False)
    size = gradient_size(at, lane, index)
    unit = feet.weight
    worst = max(0.0, -p.slack[new] * p.inverse[new] / unit)
    for e in range(6):
        s = -get(W, offset.load + e, lane)
        for k in range(nc):
            s += get(W, offset.wrench + 6 * k + e, lane)
        worst = max(worst, abs(s) / unit)
    for j in range(r):  # N' W_f (f - f_ref) - B' W_tau tau, and the rows' part below
        s = 0.0
        for c in range(6 * nc):
            s += p.N[c, j] * p.push[c]
        for t in range(ns):
            s -= p.B[t, j] * p.strain[t]
        p.d[j] = s
    for k in range(q):
        write_row(rows, p, held[k], r, False)
        for j in range(r):
            p.d[j] += u[k] * p.a[j]
        pressure, slack = u[k] / p.inverse[held[k]], p.slack[held[k]] * p.inverse[held[k]]
        worst = max(worst, -pressure / size, abs(pressure * slack) / (size * unit))
    R = offset.Rw if weighted else offset.R
    for i in range(r):
        s = 0.0
        for j in range(i + 1):
            s += get(W, R + r * j + i, lane) * p.d[j]
        worst = max(worst, abs(s) / size)
    return worst if np.isfinite(worst) else np.inf
