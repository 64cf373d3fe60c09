"""Loops: the contacts' redundancy, a small matrix and its orthonormal factor.

With wrenches phi_k on the contacts (world axes, about the base's origin o), equilibrium is
sum phi_k = b on the base and tau_i = G_i - s_i . sum over the contacts that joint i carries.
Let the **held** contacts take what the others leave. Then nothing but the other wrenches y stays
free, and only joints between contacts (rows) feel them:

    tau = (G - D b) - B y          D: torque per wrench held,  B: torque per unknown

B is (ns x r), 12 x 6 on two feet. Its columns, with zeros for the base, and [1 | D]' span the rows
of the contact Jacobian: one factorisation B = Q R gives least squares, adjoints and tangent space.
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import any_less, load, root, splat, store, where_less
from copsense.batch.layout import Feet
from copsense.batch.vectors import Vector, add3, cross3, dot3, load3, scale3, store3, sub3
from copsense.batch.workspace import Offsets

_REPEAT = 1e-2  # a column that shrinks to less (squared) is made orthogonal once more
_LOST = 1e-12  # less (squared): it may depend on the others, and the reference decides
_FLAT = 1e-9  # determinant, relative, of the second moment of three points nearly on a line


@compiled
def invert_spread(W: Any, out: int, second: Any) -> Any:
    """Inverse (nine rows) of a symmetric matrix xx, yy, zz, xy, xz, yz; how far from singular."""
    xx, yy, zz, xy, xz, yz = second
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, e, f = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    det = xx * a + xy * b + xz * c
    s = 1.0 / det
    store3(W, out, (s * a, s * b, s * c))
    store3(W, out + 3, (s * b, s * d, s * e))
    store3(W, out + 6, (s * c, s * e, s * f))
    trace = xx + yy + zz
    return det / (trace * trace * trace)


@compiled
def second_moment(a: Vector) -> Any:
    """|a|^2 1 - a a' as xx, yy, zz, xy, xz, yz."""
    x, y, z = a[0] * a[0], a[1] * a[1], a[2] * a[2]
    return y + z, x + z, x + y, -(a[0] * a[1]), -(a[0] * a[2]), -(a[1] * a[2])


@inlined
def build(feet: Feet, offset: Offsets, W: Any) -> None:
    """D and B, then B = Q R in place."""
    if feet.held == 1:
        _hold_surface(feet, offset, W)
    else:
        _hold_points(feet, offset, W)
    ns = len(feet.support)
    for k in feet.order[feet.held :]:
        r = load3(W, offset.foot + 3 * k)
        for t in range(ns):
            s, d = offset.screw + 6 * feet.support[t], offset.held_row + 6 * t
            v, w = load3(W, d), load3(W, d + 3)
            v, w = scale3(-1.0, v), scale3(-1.0, w)
            if feet.member[feet.group[t], k]:
                v, w = add3(v, load3(W, s)), add3(w, load3(W, s + 3))
            at = offset.Q + ns * feet.first[k] + t
            if feet.point[k]:  # only a force: the velocity at the contact's origin
                v = add3(v, cross3(w, r))
            for j in range(3):
                store(W, at + ns * j, v[j])
                if not feet.point[k]:
                    store(W, at + ns * (3 + j), w[j])
    lost = factorise(W, offset.Q, offset.R, ns, feet.unknowns)
    invert_upper(W, offset.R, offset.T, feet.unknowns)
    store(W, offset.flag, where_less(lost, 0.5, load(W, offset.flag), splat(1.0)))


@compiled
def _hold_surface(feet: Feet, offset: Offsets, W: Any) -> None:
    """D where one surface contact takes all that is left: the screws of the joints it is on."""
    k = feet.order[0]
    for t in range(len(feet.support)):
        for j in range(6):
            s = splat(0.0)
            if feet.member[feet.group[t], k]:
                s = load(W, offset.screw + 6 * feet.support[t] + j)
            store(W, offset.held_row + 6 * t + j, s)


@compiled
def _hold_points(feet: Feet, offset: Offsets, W: Any) -> None:
    """D where three points share a wrench (F, M) with the least norm, and their own three unknowns.

    With rho_k from their centroid c and I = sum |rho|^2 1 - rho rho':
    F_k = F / 3 + alpha x rho_k, alpha = I^-1 (M - c x F). Pulling two of them together along their
    line changes nothing in the sum: three pairs, three unknowns.
    """
    i, j, k = feet.order[0], feet.order[1], feet.order[2]
    a, b, c = (
        load3(W, offset.foot + 3 * i),
        load3(W, offset.foot + 3 * j),
        load3(W, offset.foot + 3 * k),
    )
    middle = scale3(1.0 / 3.0, add3(add3(a, b), c))
    store3(W, offset.spread, middle)
    x, y = second_moment(sub3(a, middle)), second_moment(sub3(b, middle))
    z = second_moment(sub3(c, middle))
    total = (
        x[0] + y[0] + z[0],
        x[1] + y[1] + z[1],
        x[2] + y[2] + z[2],
        x[3] + y[3] + z[3],
        x[4] + y[4] + z[4],
        x[5] + y[5] + z[5],
    )
    solid = invert_spread(W, offset.spread + 3, total)
    store(W, offset.flag, where_less(_FLAT, solid, load(W, offset.flag), splat(1.0)))
    ns = len(feet.support)
    for t in range(ns):
        s = offset.screw + 6 * feet.support[t]
        zero = splat(0.0)
        u, sum_v = (zero, zero, zero), (zero, zero, zero)
        for h in feet.order[:3]:
            if feet.member[feet.group[t], h]:
                r = load3(W, offset.foot + 3 * h)
                v = add3(load3(W, s), cross3(load3(W, s + 3), r))
                u = add3(u, cross3(sub3(r, middle), v))
                sum_v = add3(sum_v, scale3(1.0 / 3.0, v))
        u = (
            dot3(load3(W, offset.spread + 3), u),
            dot3(load3(W, offset.spread + 6), u),
            dot3(load3(W, offset.spread + 9), u),
        )
        store3(W, offset.held_row + 6 * t, sub3(sum_v, cross3(u, middle)))
        store3(W, offset.held_row + 6 * t + 3, u)
        for pair in range(3):
            h, l = feet.order[pair], feet.order[(pair + 1) % 3]
            e = pair_line(offset, W, h, l)
            felt = zero
            if feet.member[feet.group[t], h]:
                r = load3(W, offset.foot + 3 * h)
                felt = felt + dot3(e, add3(load3(W, s), cross3(load3(W, s + 3), r)))
            if feet.member[feet.group[t], l]:
                r = load3(W, offset.foot + 3 * l)
                felt = felt - dot3(e, add3(load3(W, s), cross3(load3(W, s + 3), r)))
            store(W, offset.Q + ns * pair + t, felt)


@compiled
def pair_line(offset: Offsets, W: Any, h: int, l: int) -> Vector:
    """Unit vector from contact l to contact h."""
    e = sub3(load3(W, offset.foot + 3 * h), load3(W, offset.foot + 3 * l))
    return scale3(1.0 / root(dot3(e, e)), e)


@compiled
def factorise(W: Any, A: int, R: int, m: int, r: int) -> Any:
    """A = Q R by modified Gram-Schmidt, A (m x r, by columns) becomes Q; 1 where rank is in doubt.

    A column that loses most of its length is made orthogonal once more ("twice is enough",
    Giraud, Langou and Rozloznik 2005), so that Q is orthonormal to rounding.
    """
    lost = splat(0.0)
    for j in range(r):
        store(W, R + r * j + j, _square(W, A + m * j, m))
    for j in range(r):
        a = A + m * j
        before, after = load(W, R + r * j + j), _square(W, a, m)
        if any_less(after, before * _REPEAT):
            again = where_less(after, before * _REPEAT, splat(1.0), splat(0.0))
            for k in range(j):
                more = _take_off(W, a, A + m * k, m, again)
                store(W, R + r * k + j, load(W, R + r * k + j) + more)
            after = _square(W, a, m)
        lost = where_less(before * _LOST, after, lost, splat(1.0))
        length = root(after)
        store(W, R + r * j + j, length)
        inverse = 1.0 / length
        for i in range(m):
            store(W, a + i, load(W, a + i) * inverse)
        # Off the columns to come at once, two at a time: these do not wait for one another.
        for k in range(j + 1, r - 1, 2):
            _take_off_two(W, A + m * k, a, m, R + r * j + k)
        if (r - j) % 2 == 0:
            store(W, R + r * j + r - 1, _take_off(W, A + m * (r - 1), a, m, splat(1.0)))
    return lost


@compiled
def _square(W: Any, a: int, m: int) -> Any:
    s = load(W, a) * load(W, a)
    for i in range(1, m):
        s = s + load(W, a + i) * load(W, a + i)
    return s


@compiled
def _take_off(W: Any, a: int, q: int, m: int, share: Any) -> Any:
    """a -= c q with c = share (q . a); c."""
    c = load(W, q) * load(W, a)
    for i in range(1, m):
        c = c + load(W, q + i) * load(W, a + i)
    c = c * share
    for i in range(m):
        store(W, a + i, load(W, a + i) - c * load(W, q + i))
    return c


@compiled
def _take_off_two(W: Any, a: int, q: int, m: int, out: int) -> None:
    """a -= c q with c = q . a, into `out`, for two columns one after the other."""
    b = a + m
    x = load(W, q)
    c, d = x * load(W, a), x * load(W, b)
    for i in range(1, m):
        x = load(W, q + i)
        c, d = c + x * load(W, a + i), d + x * load(W, b + i)
    for i in range(m):
        x = load(W, q + i)
        store(W, a + i, load(W, a + i) - c * x)
        store(W, b + i, load(W, b + i) - d * x)
    store(W, out, c)
    store(W, out + 1, d)


@compiled
def invert_upper(W: Any, R: int, T: int, r: int) -> None:
    """T = R^-1. Products with it need no number before the last, unlike back substitution."""
    for j in range(r):
        last = 1.0 / load(W, R + r * j + j)
        store(W, T + r * j + j, last)
        for i in range(j):
            s = load(W, T + r * i + i) * load(W, R + r * i + j)
            for k in range(i + 1, j):
                s = s + load(W, T + r * i + k) * load(W, R + r * k + j)
            store(W, T + r * i + j, -(s * last))


@compiled
def times_upper(W: Any, T: int, x: int, r: int) -> None:
    """x := T x, T upper triangular."""
    for i in range(r):
        s = load(W, T + r * i + i) * load(W, x + i)
        for j in range(i + 1, r):
            s = s + load(W, T + r * i + j) * load(W, x + j)
        store(W, x + i, s)


@compiled
def times_lower(W: Any, T: int, x: int, r: int) -> None:
    """x := T' x, T upper triangular."""
    for i in range(r - 1, -1, -1):
        s = load(W, T + r * i + i) * load(W, x + i)
        for j in range(i):
            s = s + load(W, T + r * j + i) * load(W, x + j)
        store(W, x + i, s)


@compiled
def expand(feet: Feet, offset: Offsets, W: Any, y: int, b: int, out: int) -> None:
    """Wrenches of all contacts (nc, 6) from the unknowns y and what they sum up to, b."""
    F, M = load3(W, b), load3(W, b + 3)
    for k in feet.order[feet.held :]:
        at = y + feet.first[k]
        f = load3(W, at)
        m = cross3(load3(W, offset.foot + 3 * k), f) if feet.point[k] else load3(W, at + 3)
        store3(W, out + 6 * k, f)
        store3(W, out + 6 * k + 3, m)
        F, M = sub3(F, f), sub3(M, m)
    if feet.held == 1:
        store3(W, out + 6 * feet.order[0], F)
        store3(W, out + 6 * feet.order[0] + 3, M)
        return
    c = load3(W, offset.spread)
    m = sub3(M, cross3(c, F))
    alpha = (
        dot3(load3(W, offset.spread + 3), m),
        dot3(load3(W, offset.spread + 6), m),
        dot3(load3(W, offset.spread + 9), m),
    )
    for h in range(3):
        k = feet.order[h]
        r = load3(W, offset.foot + 3 * k)
        f = add3(scale3(1.0 / 3.0, F), cross3(alpha, sub3(r, c)))
        # Pairs (h, h + 1) and (h - 1, h).
        f = add3(f, scale3(load(W, y + h), pair_line(offset, W, k, feet.order[(h + 1) % 3])))
        before = (h + 2) % 3
        f = sub3(f, scale3(load(W, y + before), pair_line(offset, W, feet.order[before], k)))
        store3(W, out + 6 * k, f)
        store3(W, out + 6 * k + 3, cross3(r, f))


@compiled
def gather_groups(feet: Feet, W: Any, wrenches: int, out: int) -> None:
    """Sum of the wrenches that each group of contacts carries."""
    for g in range(len(feet.member)):
        F, M = (splat(0.0), splat(0.0), splat(0.0)), splat(0.0)
        m = (M, M, M)
        for k in range(len(feet.body)):
            if feet.member[g, k]:
                F = add3(F, load3(W, wrenches + 6 * k))
                m = add3(m, load3(W, wrenches + 6 * k + 3))
        store3(W, out + 6 * g, F)
        store3(W, out + 6 * g + 3, m)
