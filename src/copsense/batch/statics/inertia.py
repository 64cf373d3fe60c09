"""Inertia: the joint-space mass matrix and its sparse factor M = L' L.

With P, K the linear and angular momentum (about o) that joint i gives what it carries,
M_ij = s_j . (P, K) for every joint j above it and the base: the composite-rigid-body algorithm
(Featherstone 2008) in world axes. L has entries only between a joint and those above it.
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled
from copsense.batch.lanes import load, root, splat, store, where_less
from copsense.batch.layout import Tree
from copsense.batch.vectors import Vector, add3, cross3, dot3, load3, store3
from copsense.batch.workspace import Offsets

_MASSLESS = 1e-10  # pivot, relative, of a motion that may move no mass: the reference decides

# Where xx, yy, zz, xy, xz, yz stand.
_FIRST, _SECOND = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)


@compiled
def ancestor(tree: Tree, i: int) -> int:
    """The velocity before another in the tree: base 0 to 5, then joints; -1 above the first."""
    if i < 6:
        return i - 1
    return 5 + tree.parent[i - 5]


@compiled
def factorise_inertia(tree: Tree, offset: Offsets, W: Any) -> None:
    """L (nv, nv), by rows, in the places that the tree fills."""
    _compose(tree, offset, W)
    nv, m = len(tree.parent) + 5, tree.carried[0]
    h = load3(W, offset.first_moment)
    zero = splat(0.0)
    # Base: (P, K) = (m v + w x h, h x v + I w).
    cross = ((zero, -h[2], h[1]), (h[2], zero, -h[0]), (-h[1], h[0], zero))
    I = offset.inertia
    for i in range(3):
        for j in range(i + 1):
            store(W, offset.H + nv * i + j, splat(m if i == j else 0.0))
        for j in range(3):
            store(W, offset.H + nv * (3 + i) + j, cross[i][j])
    _symmetric(W, I, offset.H + nv * 3 + 3, nv)
    for i in range(1, len(tree.parent)):
        row, s = offset.H + nv * (5 + i), offset.screw + 6 * i
        v, w = load3(W, s), load3(W, s + 3)
        h = load3(W, offset.first_moment + 3 * i)
        c, turned = tree.carried[i], cross3(w, h)
        P = (c * v[0] + turned[0], c * v[1] + turned[1], c * v[2] + turned[2])
        K = add3(cross3(h, v), _times(W, offset.inertia + 6 * i, w))
        store3(W, row, P)
        store3(W, row + 3, K)
        j = i
        while j > 0:
            other = offset.screw + 6 * j
            store(W, row + 5 + j, dot3(load3(W, other), P) + dot3(load3(W, other + 3), K))
            j = tree.parent[j]
    for k in range(nv):
        store(W, offset.diagonal + k, load(W, offset.H + nv * k + k))
    for k in range(nv - 1, -1, -1):
        own = offset.H + nv * k
        pivot = load(W, own + k)
        least = _MASSLESS * load(W, offset.diagonal + k)
        store(W, offset.flag, where_less(least, pivot, load(W, offset.flag), splat(1.0)))
        length = root(pivot)
        store(W, own + k, length)
        inverse = 1.0 / length
        store(W, offset.diagonal + k, inverse)
        i = ancestor(tree, k)
        while i >= 0:
            store(W, own + i, load(W, own + i) * inverse)
            i = ancestor(tree, i)
        i = ancestor(tree, k)
        while i >= 0:
            a, other = load(W, own + i), offset.H + nv * i
            j = i
            while j >= 0:
                store(W, other + j, load(W, other + j) - a * load(W, own + j))
                j = ancestor(tree, j)
            i = ancestor(tree, i)


@compiled
def _compose(tree: Tree, offset: Offsets, W: Any) -> None:
    """Inertia about o of each body and all that it carries: xx, yy, zz, xy, xz, yz (n + 1, 6).

    I_o = R I R' + 2 (p . c) 1 - p c' - c p' + m (|p|^2 1 - p p'), c = R (m times its CoM).
    """
    n = len(tree.parent) - 1
    for i in range(n + 1):
        R, own, mass = offset.rotation + 9 * i, tree.inertia[i], tree.mass[i]
        x, y, z = load3(W, R), load3(W, R + 3), load3(W, R + 6)
        p, lever = load3(W, offset.position + 3 * i), tree.moment[i]
        c = _mix(x, y, z, lever[0], lever[1], lever[2])
        # R I, by columns.
        a, b = _mix(x, y, z, own[0], own[3], own[4]), _mix(x, y, z, own[3], own[1], own[5])
        d = _mix(x, y, z, own[4], own[5], own[2])
        across = 2.0 * dot3(p, c) + mass * dot3(p, p)
        at = offset.inertia + 6 * i
        for e in range(6):
            k, l = _FIRST[e], _SECOND[e]
            s = a[k] * x[l] + b[k] * y[l] + d[k] * z[l]
            s = s - p[k] * c[l] - c[k] * p[l] - mass * (p[k] * p[l])
            store(W, at + e, s + across if e < 3 else s)
    for i in range(n, 0, -1):
        for e in range(6):
            at = offset.inertia + 6 * tree.parent[i] + e
            store(W, at, load(W, at) + load(W, offset.inertia + 6 * i + e))


@compiled
def _mix(x: Vector, y: Vector, z: Vector, a: float, b: float, c: float) -> Vector:
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )


@compiled
def _times(W: Any, I: int, w: Vector) -> Vector:
    xx, yy, zz = load3(W, I)
    xy, xz, yz = load3(W, I + 3)
    return (
        xx * w[0] + xy * w[1] + xz * w[2],
        xy * w[0] + yy * w[1] + yz * w[2],
        xz * w[0] + yz * w[1] + zz * w[2],
    )


@compiled
def _symmetric(W: Any, I: int, at: int, stride: int) -> None:
    """The lower triangle of a symmetric matrix from xx, yy, zz, xy, xz, yz."""
    store(W, at, load(W, I))
    store(W, at + stride, load(W, I + 3))
    store(W, at + stride + 1, load(W, I + 1))
    store(W, at + 2 * stride, load(W, I + 4))
    store(W, at + 2 * stride + 1, load(W, I + 5))
    store(W, at + 2 * stride + 2, load(W, I + 2))
