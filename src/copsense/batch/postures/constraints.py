"""Constraints: what a chart wants of a posture, how far it is from that, and its derivative.

The contacts stand at their places, turned as they should be; the CoM is where it was named. World
axes; with the base's coordinates and the joints' positions as unknowns.
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled
from copsense.batch.lanes import load, magnitude, splat, store, where_less
from copsense.batch.layout import CONTINUOUS, Feet, Tree
from copsense.batch.postures.search_plan import SearchOffsets, SearchPlan
from copsense.batch.postures.search_settings import OPPOSITE
from copsense.batch.vectors import add3, cross3, dot3, load3, scale3, sine_cosine, store3
from copsense.batch.workspace import Offsets


@compiled
def spread(tree: Tree, plan: SearchPlan, offset: Offsets, search: SearchOffsets, W: Any) -> None:
    """The configuration from base coordinates and joint positions; the base's turning axes."""
    store3(W, offset.q, load3(W, search.given))
    if plan.turned:
        angle = load3(W, search.given + 3)
        sr, cr = sine_cosine(0.5 * angle[0])
        sp, cp = sine_cosine(0.5 * angle[1])
        sy, cy = sine_cosine(0.5 * angle[2])
        # Rz(yaw) Ry(pitch) Rx(roll); of the two signs the one nearer to the stance's.
        x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
        z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
        near = plan.quaternion
        along = x * near[0] + y * near[1] + z * near[2] + w * near[3]
        sign = where_less(along, 0.0, splat(-1.0), splat(1.0))
        store3(W, offset.q + 3, (sign * x, sign * y, sign * z))
        store(W, offset.q + 6, sign * w)
        s, c = 2.0 * sy * cy, cy * cy - sy * sy  # of the whole angles
        t, d = 2.0 * sp * cp, cp * cp - sp * sp
        zero = splat(0.0)
        store3(W, search.turn, (c * d, s * d, -t))
        store3(W, search.turn + 3, (-s, c, zero))
        store3(W, search.turn + 6, (zero, zero, splat(1.0)))
    for i in range(1, len(tree.parent)):
        x, at = load(W, search.given + 5 + i), offset.q + tree.column[i]
        if tree.kind[i] == CONTINUOUS:
            s, c = sine_cosine(x)
            store(W, at, c)
            store(W, at + 1, s)
        else:
            store(W, at, x)


@compiled
def errors(
    tree: Tree, feet: Feet, plan: SearchPlan, offset: Offsets, search: SearchOffsets, W: Any
) -> None:
    """h: how far contacts and CoM are from where they are wanted, world axes [m, rad]."""
    at, base, worst = search.error, load3(W, offset.base), splat(0.0)
    n6 = len(plan.given) - 3 * len(plan.position) - 3
    for k in plan.contact:
        wanted, home = search.given + n6 + 3 + 3 * k, plan.position[k]
        dx, dy = load(W, wanted) - home[0], load(W, wanted + 1) - home[1]
        rise = plan.slope[k, 0] * dx + plan.slope[k, 1] * dy
        o = add3(base, load3(W, offset.foot + 3 * k))
        store3(W, at, (o[0] - home[0] - dx, o[1] - home[1] - dy, o[2] - home[2] - rise))
        at += 3
        if not feet.point[k]:
            a = plan.axes[k]
            s, c = sine_cosine(load(W, wanted + 2) - plan.given[n6 + 5 + 3 * k])
            x = (c * a[0] + s * a[3], c * a[1] + s * a[4], c * a[2] + s * a[5])
            y = (c * a[3] - s * a[0], c * a[4] - s * a[1], c * a[5] - s * a[2])
            z = (splat(a[6]), splat(a[7]), splat(a[8]))
            R = offset.foot_rotation + 9 * k
            u, v, w = load3(W, R), load3(W, R + 3), load3(W, R + 6)
            # sum of (wanted x here) = 2 sin(angle) axis, 1 + trace = 2 (1 + cos): 2 tan(angle / 2).
            twice = add3(add3(cross3(x, u), cross3(y, v)), cross3(z, w))
            open_ = 1.0 + dot3(x, u) + dot3(y, v) + dot3(z, w)
            worst = where_less(open_, OPPOSITE, splat(1.0), worst)
            store3(W, at, scale3(2.0 / where_less(open_, OPPOSITE, OPPOSITE, open_), twice))
            at += 3
    for axis in plan.com_axis:
        com = load(W, offset.base + axis) + load(W, offset.first_moment + axis) / tree.carried[0]
        store(W, at, com - load(W, search.given + n6 + axis))
        at += 1
    everything = splat(0.0)
    for i in range(search.error, at):
        size = magnitude(load(W, i))
        worst, everything = where_less(worst, size, size, worst), everything + size
    store(W, search.worst, worst + 0.0 * everything)  # not a number where one of them is none


@compiled
def jacobian(
    tree: Tree,
    feet: Feet,
    plan: SearchPlan,
    offset: Offsets,
    search: SearchOffsets,
    W: Any,
    limb: int,
) -> None:
    """J of a limb, by rows."""
    first, n = plan.unknown_first[limb], plan.unknown_first[limb + 1] - plan.unknown_first[limb]
    zero = splat(0.0)
    nothing = (zero, zero, zero)
    for column in range(n):
        u, at = plan.unknown[first + column], search.J + column
        for k in plan.contact[plan.contact_first[limb] : plan.contact_first[limb + 1]]:
            v, w = nothing, nothing
            if u < 3:
                v = _unit(W, u)
            else:
                moves, v, w = _twist(plan, offset, search, W, u, k)
                if moves:
                    v = add3(v, cross3(w, load3(W, offset.foot + 3 * k)))
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
                w = load3(W, search.turn + 3 * (u - 3))
                rate = scale3(share, cross3(w, load3(W, offset.first_moment)))
            else:
                rate = scale3(share, load3(W, offset.moment_rate + 3 * (u - 5)))
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
    one, zero = splat(1.0), splat(0.0)
    if axis == 0:
        return one, zero, zero
    if axis == 1:
        return zero, one, zero
    return zero, zero, one


@compiled
def _twist(plan: SearchPlan, offset: Offsets, search: SearchOffsets, W: Any, u: int, k: int) -> Any:
    """Twist that an unknown's unit velocity gives a contact; whether it moves it at all."""
    zero = splat(0.0)
    nothing = (zero, zero, zero)
    if u < 6:
        return True, nothing, load3(W, search.turn + 3 * (u - 3))
    if plan.carries[u - 5, k]:
        s = offset.screw + 6 * (u - 5)
        return True, load3(W, s), load3(W, s + 3)
    return False, nothing, nothing


@compiled
def _column(W: Any, at: int, n: int, a: Any) -> None:
    store(W, at, a[0])
    store(W, at + n, a[1])
    store(W, at + 2 * n, a[2])
