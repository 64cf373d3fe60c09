"""Tangents: the projection of gradients onto the admissible motions.

The contact Jacobian's rows are spanned by (0, Q) and (1, D), base first. Taking Q off D leaves
(1, C) with C = (1 - Q Q') D, orthogonal to the former and well conditioned whatever the posture:
its Gram matrix is 1 + C' C >= 1. So the projection of a gradient (u, g) is

    g -= Q Q' g;   (u, g) -= (1, C) (1 + C' C)^-1 (u + C' g).
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import load, root, splat, store
from copsense.batch.layout import Feet, Tree
from copsense.batch.vectors import cross3, dot3, load3, store3
from copsense.batch.workspace import Offsets


@inlined
def span(feet: Feet, offset: Offsets, W: Any) -> None:
    """C, and the inverse L^-1 of the Cholesky factor of 1 + C' C."""
    ns = len(feet.support)
    for j in range(6):
        c = offset.C + ns * j
        for t in range(ns):
            store(W, c + t, load(W, offset.held_row + 6 * t + j))
    for j in range(0, 6, 2):
        _remove(feet, offset, W, offset.C + ns * j)
    for i in range(6):
        for j in range(i + 1):
            s = splat(1.0 if i == j else 0.0)
            for t in range(ns):
                s = s + load(W, offset.C + ns * i + t) * load(W, offset.C + ns * j + t)
            for k in range(j):
                s = s - load(W, offset.L + 6 * i + k) * load(W, offset.L + 6 * j + k)
            if i == j:
                store(W, offset.L + 6 * i + i, 1.0 / root(s))  # the diagonal is kept inverted
            else:
                store(W, offset.L + 6 * i + j, s * load(W, offset.L + 6 * j + j))
    for i in range(1, 6):
        for j in range(i):
            s = load(W, offset.L + 6 * i + j) * load(W, offset.L + 6 * j + j)
            for k in range(j + 1, i):
                s = s + load(W, offset.L + 6 * i + k) * load(W, offset.L + 6 * k + j)
            store(W, offset.L + 6 * i + j, -(s * load(W, offset.L + 6 * i + i)))


@compiled
def _remove(feet: Feet, offset: Offsets, W: Any, g: int) -> None:
    """g -= Q Q' g of two gradients, one after the other. Q is read once for both.

    It is orthonormal: no product has to wait for another.
    """
    ns, r = len(feet.support), feet.unknowns
    h, more = g + ns, offset.along + r
    for k in range(r):
        q = offset.Q + ns * k
        x = load(W, q)
        c, d = x * load(W, g), x * load(W, h)
        for t in range(1, ns):
            x = load(W, q + t)
            c, d = c + x * load(W, g + t), d + x * load(W, h + t)
        store(W, offset.along + k, c)
        store(W, more + k, d)
    for t in range(ns):
        c, d = load(W, g + t), load(W, h + t)
        for k in range(r):
            x = load(W, offset.Q + ns * k + t)
            c, d = c - load(W, offset.along + k) * x, d - load(W, more + k) * x
        store(W, g + t, c)
        store(W, h + t, d)


@compiled
def project(feet: Feet, offset: Offsets, W: Any, gradient: int) -> None:
    """Project two gradients (2, nv), base part in world axes, one after the other.

    `felt` holds them on the support joints.
    """
    ns, nv = len(feet.support), len(feet.anchor) + 5
    g, h, other = offset.felt, offset.felt + ns, gradient + nv
    _remove(feet, offset, W, g)
    y, z = offset.six, offset.six + 12  # of both, then for both
    for i in range(6):
        c, d = load(W, gradient + i), load(W, other + i)
        for t in range(ns):
            x = load(W, offset.C + ns * i + t)
            c, d = c + x * load(W, g + t), d + x * load(W, h + t)
        store(W, y + i, c)
        store(W, y + 6 + i, d)
    for i in range(6):
        x = load(W, offset.L + 6 * i)
        c, d = x * load(W, y), x * load(W, y + 6)
        for k in range(1, i + 1):
            x = load(W, offset.L + 6 * i + k)
            c, d = c + x * load(W, y + k), d + x * load(W, y + 6 + k)
        store(W, z + i, c)
        store(W, z + 6 + i, d)
    for i in range(6):
        x = load(W, offset.L + 6 * i + i)
        c, d = x * load(W, z + i), x * load(W, z + 6 + i)
        for k in range(i + 1, 6):
            x = load(W, offset.L + 6 * k + i)
            c, d = c + x * load(W, z + k), d + x * load(W, z + 6 + k)
        store(W, y + i, c)
        store(W, y + 6 + i, d)
        store(W, gradient + i, load(W, gradient + i) - c)
        store(W, other + i, load(W, other + i) - d)
    for t in range(ns):
        c, d, column = load(W, g + t), load(W, h + t), 5 + feet.support[t]
        for i in range(6):
            x = load(W, offset.C + ns * i + t)
            c, d = c - load(W, y + i) * x, d - load(W, y + 6 + i) * x
        store(W, gradient + column, c)
        store(W, other + column, d)


@inlined
def level_gradients(tree: Tree, feet: Feet, offset: Offsets, W: Any) -> None:
    """Projected gradients of h . t for the two level directions t: of the CoM, times the mass."""
    n, ns = len(tree.parent) - 1, len(feet.support)
    for j in range(2):
        t = (splat(tree.level[j, 0]), splat(tree.level[j, 1]), splat(tree.level[j, 2]))
        at = offset.level + (n + 6) * j
        store_base_and_joints(tree, offset, W, at, t)
        for k in range(ns):
            store(W, offset.felt + ns * j + k, load(W, at + 5 + feet.support[k]))
    project(feet, offset, W, offset.level)


@compiled
def store_base_and_joints(tree: Tree, offset: Offsets, W: Any, at: int, u: Any) -> None:
    """Gradient (nv,) of h . u at fixed u: the base in world axes, then the joints."""
    store_base(tree, offset, W, at, u)
    for i in range(1, len(tree.parent)):
        store(W, at + 5 + i, dot3(load3(W, offset.moment_rate + 3 * i), u))


@compiled
def store_base(tree: Tree, offset: Offsets, W: Any, at: int, u: Any) -> None:
    """The base's part of it (6,)."""
    m = tree.carried[0]
    store3(W, at, (m * u[0], m * u[1], m * u[2]))
    store3(W, at + 3, cross3(load3(W, offset.first_moment), u))
