"""Limit changes: how far the CoM may travel before a limit begins or ceases to press.

Along an admissible motion contacts stand still, so that a wrench on them, in their own axes, is
w = w_0 + N x with a constant N. With W_p = (v_p, w_p) the twist of what carries a joint, D_i the
sum of dh/dq_j dq_j over joint i and those it carries, phi_i the wrenches that it carries,

    dG_i = -g . (w_p x dh/dq_i + a_i x D_i),    ds_i = W_p x s_i,
    dtau_i = dG_i - ds_i . phi_i - s_i . dphi_i.

The criterion's condition N' (W_f (f - f_ref) - sum s_i nu_i) + A_h' u = 0, A_h the rows held, gives
with the unit cost of x what it would do at these multipliers if nothing were held,

    dx_0 = N' (sum ds_i nu_i - W_f df_0) + B' W_tau dtau_0,

and dx = dx_0 + z with z + A_h' du = 0, A_h z = ds_h: the system of the optimum itself, on the right
how fast the slack of the held rows would change. A row's slack, or a held row's multiplier, over
the length of its rates along CoM x and y is the travel to first order at which it changes sides; as
`ConstrainedEquilibrium.nearest_active_set_change`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from copsense.batch.compiler import compiled
from copsense.batch.lanes import get, least, load, splat, store, where_less
from copsense.batch.layout import Feet, Tree
from copsense.batch.statics.criteria import KernelCriteria
from copsense.batch.statics.gradients import joint_multipliers
from copsense.batch.statics.limit_offsets import LimitOffsets
from copsense.batch.statics.limited_statics import TOUCHING, Within, read_forces, read_maps
from copsense.batch.statics.load_sharing import own_wrenches, weigh
from copsense.batch.statics.loops import expand, gather_groups
from copsense.batch.vectors import add3, along, cross3, dot3, load3, scale3, store3
from copsense.batch.workspace import WIDTH, Offsets

_STILL = 1e-9  # rates, in shares of the weight or gradient per metre, of none, as in `statics`


@compiled
def move_joints(tree: Tree, feet: Feet, offset: Offsets, limits: LimitOffsets, W: Any) -> None:
    """What both motions change of the posture: gravity's torques, screws, and the load."""
    n, nv, ns = len(tree.parent) - 1, len(tree.parent) + 5, len(feet.support)
    g = (splat(tree.gravity[0]), splat(tree.gravity[1]), splat(tree.gravity[2]))
    zero = splat(0.0)
    for e in range(2):
        u, turns = offset.motion + nv * e, limits.gravity_rate + (n + 1) * e
        for i in range(6):
            store(W, limits.twist + i, load(W, u + i))
        for i in range(n + 1):
            store3(W, limits.moved + 3 * i, (zero, zero, zero))
        for i in range(1, n + 1):
            up, s, rate = (
                limits.twist + 6 * tree.parent[i],
                offset.screw + 6 * i,
                load(W, u + 5 + i),
            )
            store3(W, limits.twist + 6 * i, add3(load3(W, up), scale3(rate, load3(W, s))))
            w = add3(load3(W, up + 3), scale3(rate, load3(W, s + 3)))
            store3(W, limits.twist + 6 * i + 3, w)
        for i in range(n, 0, -1):
            rate, dh = load(W, u + 5 + i), load3(W, offset.moment_rate + 3 * i)
            D = add3(load3(W, limits.moved + 3 * i), scale3(rate, dh))
            carrier = limits.moved + 3 * tree.parent[i]
            store3(W, carrier, add3(load3(W, carrier), D))
            turned = cross3(load3(W, limits.twist + 6 * tree.parent[i] + 3), dh)
            turned = add3(turned, cross3(load3(W, offset.screw + 6 * i + 3), D))
            store(W, turns + i, -dot3(turned, g))
        for t in range(ns):
            up = limits.twist + 6 * tree.parent[feet.support[t]]
            s = offset.screw + 6 * feet.support[t]
            v, w = load3(W, s), load3(W, s + 3)
            spin = load3(W, up + 3)
            at = limits.screw_rate + 6 * (ns * e + t)
            store3(W, at, add3(cross3(spin, v), cross3(load3(W, up), w)))
            store3(W, at + 3, cross3(spin, w))
        dh = add3(cross3(load3(W, u + 3), load3(W, offset.first_moment)), load3(W, limits.moved))
        dh = add3(dh, scale3(tree.carried[0], load3(W, u)))
        store3(W, limits.load_rate + 6 * e, (zero, zero, zero))
        store3(W, limits.load_rate + 6 * e + 3, cross3(g, dh))


@compiled
def write_rates(
    tree: Tree,
    feet: Feet,
    offset: Offsets,
    limits: LimitOffsets,
    W: Any,
    criteria: KernelCriteria,
    index: int,
) -> None:
    """Of both motions: rates of wrenches and torques if no row were held."""
    n, ns, nc, r = len(tree.parent) - 1, len(feet.support), len(feet.body), feet.unknowns
    joint_multipliers(feet, offset, W, criteria, index, limits)
    for j in range(r):
        store(W, offset.unknown + j, splat(0.0))
    for e in range(2):
        df, dtau = limits.wrench_rate + 6 * nc * e, limits.torque_rate + (n + 1) * e
        expand(feet, offset, W, offset.unknown, limits.load_rate + 6 * e, offset.inner)
        gather_groups(feet, W, offset.inner, offset.inner_group)
        own_wrenches(feet, offset, W, offset.inner, df)
        for i in range(1, n + 1):
            store(W, dtau + i, load(W, limits.gravity_rate + (n + 1) * e + i))
        for t in range(ns):
            i, group = feet.support[t], 6 * feet.group[t]
            s, ds = offset.screw + 6 * i, limits.screw_rate + 6 * (ns * e + t)
            phi, more = offset.group + group, offset.inner_group + group
            power = dot3(load3(W, ds), load3(W, phi)) + dot3(load3(W, ds + 3), load3(W, phi + 3))
            power = power + dot3(load3(W, s), load3(W, more))
            power = power + dot3(load3(W, s + 3), load3(W, more + 3))
            store(W, dtau + i, load(W, dtau + i) - power)
            store(W, offset.felt + t, load(W, dtau + i))
        for t in range(ns):
            strain = weigh(W, criteria.torque[index], criteria.torque_reach[index], t, offset.felt)
            store(W, offset.rate + t, strain)
        for i in range(6 * nc):
            push = weigh(W, criteria.wrench[index], criteria.wrench_reach[index], i, df)
            store(W, offset.own + i, push)
        _take_off_turning(feet, offset, limits, W, ns * e)
        for j in range(r):
            x = splat(0.0)
            for t in range(ns):
                x = x + load(W, limits.B + ns * j + t) * load(W, offset.rate + t)
            for c in range(6 * nc):
                x = x - load(W, limits.N + 6 * nc * j + c) * load(W, offset.own + c)
            store(W, offset.along + j, x)
        for c in range(6 * nc):
            s = load(W, df + c)
            for j in range(r):
                s = s + load(W, limits.N + 6 * nc * j + c) * load(W, offset.along + j)
            store(W, df + c, s)
        for t in range(ns):
            s = load(W, dtau + feet.support[t])
            for j in range(r):
                s = s - load(W, limits.B + ns * j + t) * load(W, offset.along + j)
            store(W, dtau + feet.support[t], s)


@compiled
def _take_off_turning(
    feet: Feet, offset: Offsets, limits: LimitOffsets, W: Any, first: int
) -> None:
    """`own` -= sum ds_i nu_i, a covector on each contact's wrench; the ds begin at `first`."""
    zero = splat(0.0)
    for k in range(len(feet.body)):
        v, w = (zero, zero, zero), (zero, zero, zero)
        for t in range(len(feet.support)):
            if feet.member[feet.group[t], k]:
                nu, ds = load(W, offset.nu + t), limits.screw_rate + 6 * (first + t)
                v = add3(v, scale3(nu, load3(W, ds)))
                w = add3(w, scale3(nu, load3(W, ds + 3)))
        v = add3(v, cross3(w, load3(W, offset.foot + 3 * k)))
        axes, at = offset.foot_rotation + 9 * k, offset.own + 6 * k
        store3(W, at, add3(load3(W, at), scale3(-1.0, along(W, axes, v))))
        store3(W, at + 3, add3(load3(W, at + 3), scale3(-1.0, along(W, axes, w))))


@compiled
def nearest_change(
    at: Within, lane: int, q: int, held: Any, u: Any, Q: Any, R: Any, size: float
) -> tuple[float, int]:
    """CoM travel of one posture to the nearest change, and the row that changes; -1 for none.

    Args:
        at: what functions for one posture work with.
        lane: the posture.
        q: how many rows press.
        held: these rows.
        u: their multipliers.
        Q: orthonormal, the first q columns span them.
        R: their triangular factor.
        size: largest entry of the cost's gradient.

    Returns:
        The travel [m], and the row as the program counts them; from `len(p.travel)` on joints that
        no wrench loads, by body.
    """
    feet, offset, limits, rows, _criteria, W, p = at
    rc, ns, n = len(rows.bound), len(feet.support), len(rows.torque) - 1
    read_forces(at, lane)
    _read_rates(at, lane)
    if q:
        read_maps(at, lane)
        for e in range(2):
            _hold_rates(at, e, q, held, Q, R)
    _contact_travels(at)
    still = _STILL * feet.weight
    for t in range(ns):
        slack = max(p.limit[t] - abs(p.torque[t]), 0.0)
        speed = p.torque_rate[0, t] ** 2 + p.torque_rate[1, t] ** 2
        near, far = rc + 2 * t, rc + 2 * t + 1
        if p.torque[t] < 0.0:
            near, far = far, near
        p.travel[far] = np.inf
        # Held at nothing either way, it is so whichever of its rows presses.
        fixed = 2.0 * p.limit[t] * p.inverse[near] <= TOUCHING * feet.weight
        moves = speed * p.inverse[near] ** 2 > still * still and not fixed
        p.travel[near] = slack * slack / speed if moves else np.inf
    for k in range(q):
        speed = p.u_rate[0, k] ** 2 + p.u_rate[1, k] ** 2
        moves = speed > (_STILL * size * p.inverse[held[k]]) ** 2
        if held[k] >= rc:
            limit = p.limit[(held[k] - rc) // 2]
            moves = moves and 2.0 * limit * p.inverse[held[k]] > TOUCHING * feet.weight
        p.travel[held[k]] = u[k] * u[k] / speed if moves else np.inf
        again = held[k] + 1
        while again < rc and rows.public[again] < 0:
            p.travel[again] = np.inf
            again += 1
    travel, row = _least(p)
    for i in feet.rest:
        a, b = (
            get(W, limits.torque_rate + i, lane),
            get(W, limits.torque_rate + n + 1 + i, lane),
        )
        slack = max(rows.torque[i] - abs(get(W, offset.torque + i, lane)), 0.0)
        speed = a * a + b * b
        if speed > still * still and slack * slack < travel * speed:
            travel, row = slack * slack / speed, len(p.travel) + i
    return np.sqrt(travel), row


@compiled
def _read_rates(at: Within, lane: int) -> None:
    """One posture's rates of wrenches and torques along both motions, from its lane."""
    feet, _offset, limits, rows, _criteria, W, p = at
    nc = len(feet.body)
    for e in range(2):
        for c in range(6 * nc):
            p.wrench_rate[e, c] = get(W, limits.wrench_rate + 6 * nc * e + c, lane)
        torque = limits.torque_rate + len(rows.torque) * e
        for t in range(len(feet.support)):
            p.torque_rate[e, t] = get(W, torque + feet.support[t], lane)


@compiled
def _hold_rates(at: Within, e: int, q: int, held: Any, Q: Any, R: Any) -> None:
    """What holding q rows makes of the rates along a motion, and those of their multipliers."""
    feet, _offset, _limits, rows, _criteria, _W, p = at
    r, rc = feet.unknowns, len(rows.bound)
    for k in range(q):  # R' w = ds
        row, s = held[k], 0.0
        if row >= rc:
            sign = 1.0 if (row - rc) % 2 == 0 else -1.0
            s = -sign * p.torque_rate[e, (row - rc) // 2]
        else:
            c = 0
            while rows.first[c + 1] <= row:
                c += 1
            for i in range(6):
                s -= rows.coefficient[i, row] * p.wrench_rate[e, 6 * c + i]
        for j in range(k):
            s -= R[j, k] * p.d[j]
        p.d[k] = s / R[k, k]
    for k in range(q - 1, -1, -1):  # R du = -w
        s = -p.d[k]
        for j in range(k + 1, q):
            s -= R[k, j] * p.u_rate[e, j]
        p.u_rate[e, k] = s / R[k, k]
    for j in range(r):
        z = 0.0
        for k in range(q):
            z += Q[j, k] * p.d[k]
        for c in range(6 * len(feet.body)):
            p.wrench_rate[e, c] += p.N[c, j] * z
        for t in range(len(feet.support)):
            p.torque_rate[e, t] -= p.B[t, j] * z


@compiled
def _contact_travels(at: Within) -> None:
    """CoM travel (squared) after which each of the contacts' rows is on its bound."""
    feet, _offset, _limits, rows, _criteria, _W, p = at
    c, n = rows.coefficient, len(rows.bound) // WIDTH
    still = _STILL * feet.weight
    for k in range(len(feet.body)):
        for i in range(rows.first[k] // WIDTH, rows.first[k + 1] // WIDTH):
            slack, x, y = load(rows.bound, i), splat(0.0), splat(0.0)
            for e in range(6):
                a = load(c, n * e + i)
                slack = slack - p.wrench[6 * k + e] * a
                x = x + p.wrench_rate[0, 6 * k + e] * a
                y = y + p.wrench_rate[1, 6 * k + e] * a
            speed = x * x + y * y
            slack = where_less(slack, 0.0, splat(0.0), slack)
            share = speed * load(rows.inverse, i) * load(rows.inverse, i)
            found = where_less(still * still, share, slack * slack / speed, splat(np.inf))
            store(p.travel, i, found)


@compiled
def _least(p: Any) -> tuple[float, int]:
    """The least travel (squared) of all rows, and the first that has it; -1 where none moves."""
    near, found = splat(np.inf), splat(-1.0)
    for i in range(len(p.travel) // WIDTH):
        travel = load(p.travel, i)
        found = where_less(travel, near, load(p.number, i), found)
        near = where_less(travel, near, travel, near)
    nearest = least(near)
    if not nearest < np.inf:
        return np.inf, -1
    first = least(where_less(nearest, near, splat(np.inf), found))
    return nearest, int(first)
