"""CoM gains: how the CoPs answer to the centre of mass, and how far it may travel.

The gain is taken along the admissible motions of least kinetic energy per CoM x and y velocity
(theory: Gamma = eta S J_c' (J_c S J_c')^-1, S = (Z' M Z)^-1). A force through the CoM accelerates
the whole robot without turning a joint, M^-1 J_c' e = (translation along e) / m. So with M = L' L
(Featherstone 2005, sparse along the tree) and x = L (translation), taking off x its part in the
span of L^-T J' leaves the motion sought, u = L^-1 x, up to a 2 x 2 normalisation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import load, magnitude, root, splat, store, where_less
from copsense.batch.layout import Feet, Tree
from copsense.batch.statics.inertia import ancestor
from copsense.batch.statics.loops import factorise
from copsense.batch.vectors import cross3, load3
from copsense.batch.workspace import Offsets
from copsense.polygon import ON_EDGE
from copsense.sensitivity import HELD, STILL  # what the reference takes for nothing

_FIXED = 1e-12  # determinant, relative, of a CoM that cannot move both ways


@compiled
def com_motions(tree: Tree, feet: Feet, offset: Offsets, W: Any) -> None:
    """The two motions (2, nv) of unit CoM velocity along x and y, the base in world axes.

    Two of everything at a time: what one computes need not wait for the other.
    """
    nv, ns, r = len(tree.parent) + 5, len(feet.support), feet.unknowns
    m = 6 + ns
    for c in range(0, r + 6, 2):
        _constraints(feet, offset, W, min(c, r + 4), nv)
    lost = factorise(W, offset.Y, offset.RY, m, r + 6)
    store(W, offset.flag, where_less(lost, 0.5, load(W, offset.flag), splat(1.0)))
    one, two = offset.motion, offset.motion + nv
    for i in range(nv):
        store(W, one + i, load(W, offset.H + nv * i))
        store(W, two + i, load(W, offset.H + nv * i + 1) if i >= 1 else splat(0.0))
    for c in range(r + 6):
        y = offset.Y + m * c
        a, b = load(W, y) * load(W, one), load(W, y) * load(W, two)
        for i in range(1, m):
            where, q = i if i < 6 else 5 + feet.support[i - 6], load(W, y + i)
            a, b = a + q * load(W, one + where), b + q * load(W, two + where)
        store(W, offset.along + c, a)
        store(W, offset.along + r + 6 + c, b)
    for i in range(m):
        where = i if i < 6 else 5 + feet.support[i - 6]
        a, b = load(W, one + where), load(W, two + where)
        for c in range(r + 6):
            q = load(W, offset.Y + m * c + i)
            a, b = a - load(W, offset.along + c) * q, b - load(W, offset.along + r + 6 + c) * q
        store(W, one + where, a)
        store(W, two + where, b)
    for i in range(nv):
        a, b = load(W, one + i), load(W, two + i)
        j = ancestor(tree, i)
        while j >= 0:
            l = load(W, offset.H + nv * i + j)
            a, b = a - l * load(W, one + j), b - l * load(W, two + j)
            j = ancestor(tree, j)
        store(W, one + i, a * load(W, offset.diagonal + i))
        store(W, two + i, b * load(W, offset.diagonal + i))
    _normalise(tree, offset, W, nv)


@compiled
def _constraints(feet: Feet, offset: Offsets, W: Any, c: int, nv: int) -> None:
    """y = L^-T of rows c and c + 1 of the contact Jacobian, on base and support joints.

    Its rows are (0, Q) and (1, D).
    """
    ns, r = len(feet.support), feet.unknowns
    y, z = offset.Y + (6 + ns) * c, offset.Y + (6 + ns) * (c + 1)
    for e, at in ((c, y), (c + 1, z)):
        for i in range(6):
            store(W, at + i, splat(1.0 if i == e - r else 0.0))
        for t in range(ns):
            on = offset.Q + ns * e + t if e < r else offset.held_row + 6 * t + e - r
            store(W, at + 6 + t, load(W, on))
    for t in range(ns - 1, -1, -1):
        own = offset.H + nv * (5 + feet.support[t])
        d = load(W, offset.diagonal + 5 + feet.support[t])
        a, b = load(W, y + 6 + t) * d, load(W, z + 6 + t) * d
        store(W, y + 6 + t, a)
        store(W, z + 6 + t, b)
        up = feet.anchor[feet.support[t]]
        while up >= 0:
            l = load(W, own + 5 + feet.support[up])
            store(W, y + 6 + up, load(W, y + 6 + up) - l * a)
            store(W, z + 6 + up, load(W, z + 6 + up) - l * b)
            up = feet.anchor[feet.support[up]]
        for i in range(6):
            l = load(W, own + i)
            store(W, y + i, load(W, y + i) - l * a)
            store(W, z + i, load(W, z + i) - l * b)
    for i in range(5, -1, -1):
        own, d = offset.H + nv * i, load(W, offset.diagonal + i)
        a, b = load(W, y + i) * d, load(W, z + i) * d
        store(W, y + i, a)
        store(W, z + i, b)
        for j in range(i):
            l = load(W, own + j)
            store(W, y + j, load(W, y + j) - l * a)
            store(W, z + j, load(W, z + j) - l * b)


@compiled
def _com_velocity(tree: Tree, offset: Offsets, W: Any, at: int) -> Any:
    """Velocity of the CoM, x and y, of a motion."""
    m = tree.carried[0]
    v, w = load3(W, at), load3(W, at + 3)
    turned = cross3(w, load3(W, offset.first_moment))
    x, y = m * v[0] + turned[0], m * v[1] + turned[1]
    for i in range(1, len(tree.parent)):
        rate = load(W, at + 5 + i)
        x = x + load(W, offset.moment_rate + 3 * i) * rate
        y = y + load(W, offset.moment_rate + 3 * i + 1) * rate
    return x / m, y / m


@compiled
def _normalise(tree: Tree, offset: Offsets, W: Any, nv: int) -> None:
    first, second = offset.motion, offset.motion + nv
    a, c = _com_velocity(tree, offset, W, first)
    b, d = _com_velocity(tree, offset, W, second)
    det, trace = a * d - b * c, a + d
    flag = load(W, offset.flag)
    store(W, offset.flag, where_less(_FIXED * trace * trace, det, flag, splat(1.0)))
    for i in range(nv):
        u, v = load(W, first + i), load(W, second + i)
        store(W, first + i, (u * d - v * c) / det)
        store(W, second + i, (v * a - u * b) / det)


@compiled
def com_gains(feet: Feet, offset: Offsets, W: Any, nv: int) -> None:
    """Gamma (nc, 2, 2) of the gradients at hand, their base part still in world axes."""
    for output in range(2 * len(feet.body)):
        along_motions(offset, W, offset.gradient + nv * output, offset.gain + 2 * output, nv)


@compiled
def along_motions(offset: Offsets, W: Any, gradient: int, out: int, nv: int) -> None:
    """Rates of a quantity of this gradient (nv,) per CoM x and y (2,)."""
    for e in range(2):
        u = offset.motion + nv * e
        s = load(W, gradient) * load(W, u)
        for i in range(1, nv):
            s = s + load(W, gradient + i) * load(W, u + i)
        store(W, out + e, s)


@inlined
def margins(feet: Feet, offset: Offsets, W: Any, travel: bool) -> None:
    """Distance to each sole's nearest edge; with `travel`, how far the CoM may move.

    Until it tips, the least s / |grad s| over the edges, with the slack s = w (b - a . p), w the
    contact's share of the weight, and grad s = (b - a . p) grad w - w a' Gamma. An edge already
    passed whose slack stands still makes it minus infinity. As `CopSensitivity.com_travel`.
    Until it carries no load, w / |grad w|, as `CopSensitivity.unloading_travel`.
    """
    for k in range(len(feet.body)):
        x, y = load(W, offset.cop + 2 * k), load(W, offset.cop + 2 * k + 1)
        w = load(W, offset.contact_wrench + 6 * k + 2) / feet.weight
        least, free = splat(np.inf), splat(np.inf)
        nearest = splat(-1.0)
        for e in range(feet.edge_first[k], feet.edge_first[k + 1]):
            ax, ay, b = feet.edges[e, 0], feet.edges[e, 1], feet.edges[e, 2]
            margin = b - (ax * x + ay * y)
            least = where_less(margin, least, margin, least)
            if travel:
                gain, lift = offset.gain + 4 * k, offset.load_gain + 2 * k
                u = ax * load(W, gain) + ay * load(W, gain + 2)
                v = ax * load(W, gain + 1) + ay * load(W, gain + 3)
                u, v = margin * load(W, lift) - w * u, margin * load(W, lift + 1) - w * v
                slack, speed = w * margin, root(u * u + v * v)
                still = where_less(slack, -ON_EDGE, splat(-np.inf), splat(np.inf))
                distance = where_less(STILL, speed, slack / speed, still)
                nearest = where_less(distance, free, 1.0 * (e - feet.edge_first[k]), nearest)
                free = where_less(distance, free, distance, free)
        store(W, offset.margin + k, least)
        if not travel:
            continue
        u, v = load(W, offset.load_gain + 2 * k), load(W, offset.load_gain + 2 * k + 1)
        fall = root(u * u + v * v)
        if feet.edge_first[k] < feet.edge_first[k + 1]:
            # A CoP that limits hold at a vertex meets all edges at once, where the load is gone.
            moves = splat(0.0)
            for e in range(4):
                entry = magnitude(load(W, offset.gain + 4 * k + e))
                moves = where_less(moves, entry, entry, moves)
            empty = where_less(STILL, fall, w / fall, splat(np.inf))
            first = where_less(STILL, fall, splat(0.0), splat(-1.0))
            free = where_less(moves, HELD, empty, free)
            nearest = where_less(moves, HELD, first, nearest)
        store(W, offset.travel + k, free)
        store(W, offset.edge + k, nearest)
        still = where_less(w, 0.0, splat(-np.inf), splat(np.inf))
        store(W, offset.unloading + k, where_less(STILL, fall, w / fall, still))
