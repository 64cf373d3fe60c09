"""Kinematics: all that statics needs of a posture, from one pass out and one pass back.

Statics needs no inverse dynamics. With m_i and h_i the mass and the first moment of body i and all
that it carries, a joint of axis a through p feels gravity as (theory: G = dV/dq, V = -h . g)

    G_i = -g . dh/dq_i,    dh/dq_i = a x (h_i - m_i p)   (prismatic: m_i a)

and a contact at r moves by the screw s_i = (p x a, a) (prismatic: (a, 0)).
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import load, magnitude, root, splat, store, where_less
from copsense.batch.layout import CONTINUOUS, PRISMATIC, Feet, Tree
from copsense.batch.vectors import (
    LARGEST_ANGLE,
    Vector,
    add3,
    cross3,
    dot3,
    load3,
    scale3,
    sine_cosine,
    store3,
    sub3,
)
from copsense.batch.workspace import Offsets

# Nearer than this to the limits of `Stance`'s checks, the reference decides.
_HEIGHT = 0.5e-6  # m
_TILT = 0.5e-6  # rad
_UNIT = 1e-6  # by which the square of a quaternion's length may miss one


@inlined
def move(tree: Tree, offset: Offsets, W: Any) -> None:
    """Rotations and positions of the bodies, their first moments, screws and gravity."""
    uneven = _place_base(tree, offset, W)
    n = len(tree.parent) - 1
    largest = splat(0.0)
    for i in range(1, n + 1):
        up, here = offset.rotation + 9 * tree.parent[i], offset.rotation + 9 * i
        t = tree.placement[i]
        p = add3(load3(W, offset.position + 3 * tree.parent[i]), _turn(W, up, t[9], t[10], t[11]))
        x, y = _turn(W, up, t[0], t[1], t[2]), _turn(W, up, t[3], t[4], t[5])
        z = _turn(W, up, t[6], t[7], t[8])
        q = load(W, offset.q + tree.column[i])
        if tree.kind[i] == PRISMATIC:
            p = add3(p, scale3(q, z))
            store3(W, here, x)
            store3(W, here + 3, y)
        else:
            if tree.kind[i] == CONTINUOUS:  # q holds (cos, sin)
                c, s = q, load(W, offset.q + tree.column[i] + 1)
                square = c * c + s * s
                off, length = magnitude(square - 1.0), root(square)
                uneven = where_less(uneven, off, off, uneven)
                c, s = c / length, s / length
            else:
                s, c = sine_cosine(q)
                largest = where_less(largest, magnitude(q), magnitude(q), largest)
            store3(W, here, add3(scale3(c, x), scale3(s, y)))
            store3(W, here + 3, sub3(scale3(c, y), scale3(s, x)))
        store3(W, here + 6, z)
        store3(W, offset.position + 3 * i, p)
    flag = where_less(largest, LARGEST_ANGLE, splat(0.0), splat(1.0))
    store(W, offset.flag, where_less(uneven, _UNIT, flag, splat(1.0)))
    _carry(tree, offset, W)


@compiled
def _place_base(tree: Tree, offset: Offsets, W: Any) -> Any:
    """R(q) and the base's origin from where the model roots it; how far from unit q is."""
    x, y, z = load3(W, offset.q + 3)
    w = load(W, offset.q + 6)
    square = x * x + y * y + z * z + w * w
    two = 2.0 / square
    columns = (
        (1.0 - two * (y * y + z * z), two * (x * y + z * w), two * (x * z - y * w)),
        (two * (x * y - z * w), 1.0 - two * (x * x + z * z), two * (y * z + x * w)),
        (two * (x * z + y * w), two * (y * z - x * w), 1.0 - two * (x * x + y * y)),
    )
    t = tree.placement[0]
    for k in range(3):
        store3(W, offset.rotation + 3 * k, _rooted(t, columns[k]))
        store(W, offset.position + k, splat(0.0))
    o = _rooted(t, load3(W, offset.q))
    store3(W, offset.base, (o[0] + t[9], o[1] + t[10], o[2] + t[11]))
    return magnitude(square - 1.0)


@compiled
def _rooted(t: Any, a: Vector) -> Vector:
    """A constant rotation, given by columns, of a vector."""
    return (
        t[0] * a[0] + t[3] * a[1] + t[6] * a[2],
        t[1] * a[0] + t[4] * a[1] + t[7] * a[2],
        t[2] * a[0] + t[5] * a[1] + t[8] * a[2],
    )


@compiled
def _turn(W: Any, row: int, x: float, y: float, z: float) -> Vector:
    """R (x, y, z) of constants, the columns of R in nine rows."""
    a, b, c = load3(W, row), load3(W, row + 3), load3(W, row + 6)
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
    )


@compiled
def _carry(tree: Tree, offset: Offsets, W: Any) -> None:
    """First moments from the tips to the base; then what each joint feels."""
    n = len(tree.parent) - 1
    g = (tree.gravity[0], tree.gravity[1], tree.gravity[2])
    for i in range(n + 1):
        own = tree.moment[i]
        turned = _turn(W, offset.rotation + 9 * i, own[0], own[1], own[2])
        store3(
            W,
            offset.first_moment + 3 * i,
            add3(scale3(tree.mass[i], load3(W, offset.position + 3 * i)), turned),
        )
    for i in range(n, 0, -1):
        h, up = load3(W, offset.first_moment + 3 * i), offset.first_moment + 3 * tree.parent[i]
        store3(W, up, add3(load3(W, up), h))
        a, p = load3(W, offset.rotation + 9 * i + 6), load3(W, offset.position + 3 * i)
        if tree.kind[i] == PRISMATIC:
            rate = scale3(tree.carried[i], a)
            store3(W, offset.screw + 6 * i, a)
            for k in range(3, 6):
                store(W, offset.screw + 6 * i + k, splat(0.0))
        else:
            rate = cross3(a, sub3(h, scale3(tree.carried[i], p)))
            store3(W, offset.screw + 6 * i, cross3(p, a))
            store3(W, offset.screw + 6 * i + 3, a)
        store3(W, offset.moment_rate + 3 * i, rate)
        store3(W, offset.weight + 3 * i, cross3(rate, g))
        store(W, offset.gravity + i, -dot3(rate, g))


@inlined
def place_feet(feet: Feet, offset: Offsets, W: Any) -> None:
    """Origins and axes of the contact frames; flag a contact that is off its stated plane."""
    base = load3(W, offset.base)
    for k in range(len(feet.body)):
        up, here = offset.rotation + 9 * feet.body[k], offset.foot_rotation + 9 * k
        t = feet.placement[k]
        r = add3(load3(W, offset.position + 3 * feet.body[k]), _turn(W, up, t[9], t[10], t[11]))
        store3(W, offset.foot + 3 * k, r)
        if feet.point[k]:
            for j in range(9):
                store(W, here + j, splat(feet.axes[k, j]))
        else:
            for j in range(0, 9, 3):
                store3(W, here + j, _turn(W, up, t[j], t[j + 1], t[j + 2]))
        n = (feet.plane[k, 0], feet.plane[k, 1], feet.plane[k, 2])
        if n[0] != 0.0 or n[1] != 0.0 or n[2] != 0.0:
            p0 = (feet.plane[k, 3], feet.plane[k, 4], feet.plane[k, 5])
            z = load3(W, here + 6)
            height = magnitude(dot3(sub3(add3(base, r), p0), n))
            tilt = magnitude(z[0] - n[0]) + magnitude(z[1] - n[1]) + magnitude(z[2] - n[2])
            flag = load(W, offset.flag)
            flag = where_less(height, _HEIGHT, flag, splat(1.0))
            store(W, offset.flag, where_less(tilt, _TILT, flag, splat(1.0)))


@compiled
def screw_cross(W: Any, row: int, F: Vector, M: Vector) -> tuple[Vector, Vector]:
    """s x* (F, M) = (w x F, w x M + v x F) of the screw s = (v, w) in six rows.

    (V x s) . W = V . (s x* W): how the power of a wrench W on a joint's screw changes when the
    twist V carries the joint along.
    """
    v, w = load3(W, row), load3(W, row + 3)
    return cross3(w, F), add3(cross3(w, M), cross3(v, F))
