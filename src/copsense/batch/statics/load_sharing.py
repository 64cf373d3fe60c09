"""Load sharing: the wrenches and torques that a criterion chooses ([Romano2016] Eq. (7), (9)).

Minimum wrench, a moment counting as a force at the arm L, has a closed form. With rho_k from the
contacts' centroid c and M_c the moment that they must supply about it,

    F_k = F / nc + alpha x rho_k,    M_k = L^2 alpha (surfaces),
    alpha = (sum |rho_k|^2 1 - rho_k rho_k' + n_s L^2 1)^-1 M_c:

a 3 x 3 system, in which the posture appears through its centre of mass alone. Minimum torque is
the least squares min |W^(1/2) (tau_0 - B y)| on the loop matrix, tau_0 = G - D b; a mixture adds
the wrenches' own rows below.
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled, inlined
from copsense.batch.lanes import load, magnitude, splat, store, where_less
from copsense.batch.layout import Feet, Tree
from copsense.batch.statics.criteria import LEAST_TORQUE, KernelCriteria
from copsense.batch.statics.loops import (
    expand,
    factorise,
    gather_groups,
    invert_spread,
    invert_upper,
    second_moment,
    times_upper,
)
from copsense.batch.vectors import add3, along, cross3, dot3, load3, scale3, store3, sub3
from copsense.batch.workspace import Offsets

_UNLOADED = 2e-9  # share of the weight; nearer to none, the reference decides


@compiled
def set_load(tree: Tree, offset: Offsets, W: Any) -> None:
    """b: the contacts must carry the weight, (F, M) = -(m g, h x g)."""
    g = (splat(tree.gravity[0]), splat(tree.gravity[1]), splat(tree.gravity[2]))
    store3(W, offset.load, scale3(-tree.carried[0], g))
    store3(W, offset.load + 3, cross3(g, load3(W, offset.first_moment)))
    for j in range(6):
        store(W, offset.nothing + j, splat(0.0))


@inlined
def least_wrench(feet: Feet, offset: Offsets, W: Any, arm: float) -> None:
    """Wrenches of least norm, `arm` = L^2; keeps c and the inverse of the 3 x 3 matrix."""
    nc = len(feet.body)
    zero = splat(0.0)
    c = (zero, zero, zero)
    surfaces = 0
    for k in range(nc):
        c = add3(c, load3(W, offset.foot + 3 * k))
        surfaces += 1 - feet.point[k]
    c = scale3(1.0 / nc, c)
    own = splat(surfaces * arm)
    I = (own, own, own, zero, zero, zero)
    for k in range(nc):
        s = second_moment(sub3(load3(W, offset.foot + 3 * k), c))
        I = (I[0] + s[0], I[1] + s[1], I[2] + s[2], I[3] + s[3], I[4] + s[4], I[5] + s[5])
    store3(W, offset.middle, c)
    invert_spread(W, offset.middle + 3, I)
    F, M = load3(W, offset.load), load3(W, offset.load + 3)
    alpha = across_symmetric(W, offset.middle + 3, sub3(M, cross3(c, F)))
    for k in range(nc):
        r = load3(W, offset.foot + 3 * k)
        f = add3(scale3(1.0 / nc, F), cross3(alpha, sub3(r, c)))
        m = cross3(r, f)
        if not feet.point[k]:
            m = add3(m, scale3(arm, alpha))
        store3(W, offset.wrench + 6 * k, f)
        store3(W, offset.wrench + 6 * k + 3, m)


@compiled
def across_symmetric(W: Any, row: int, a: Any) -> Any:
    """A a of a symmetric A in nine rows."""
    return (
        dot3(load3(W, row), a),
        dot3(load3(W, row + 3), a),
        dot3(load3(W, row + 6), a),
    )


@inlined
def least_squares(
    feet: Feet, offset: Offsets, W: Any, criteria: KernelCriteria, index: int
) -> None:
    """Wrenches of least weighted torque, and of least cost where the wrenches count too."""
    ns, r = len(feet.support), feet.unknowns
    weighted = criteria.kind[index] != LEAST_TORQUE
    free = offset.felt if weighted else offset.right
    # Torques that the held contacts alone would leave: tau_0 = G - D b.
    for t in range(ns):
        tau = load(W, offset.gravity + feet.support[t])
        for j in range(6):
            tau = tau - load(W, offset.held_row + 6 * t + j) * load(W, offset.load + j)
        store(W, free + t, tau)
    Q, T, m = offset.Q, offset.T, ns
    if weighted:
        Q, T, m = offset.Qw, offset.Tw, _weigh(feet, offset, W, criteria, index)
    for i in range(r):
        s = load(W, Q + m * i) * load(W, offset.right)
        for t in range(1, m):
            s = s + load(W, Q + m * i + t) * load(W, offset.right + t)
        store(W, offset.unknown + i, s)
    times_upper(W, T, offset.unknown, r)
    expand(feet, offset, W, offset.unknown, offset.load, offset.wrench)


@compiled
def _weigh(feet: Feet, offset: Offsets, W: Any, criteria: KernelCriteria, index: int) -> int:
    """The weighted loop matrix, its factors and its right-hand side; how many rows it has.

    The wrenches' rows are below the torques'. Its columns are what each unknown alone does: B = Q R
    again for the torques, of which `felt` holds tau_0.
    """
    ns, r, nc = len(feet.support), feet.unknowns, len(feet.body)
    mt = ns if criteria.torque_reach[index] >= 0 else 0
    mf = 6 * nc if criteria.wrench_reach[index] >= 0 else 0
    m = mt + mf
    if mt:
        _torque_rows(W, criteria, index, offset.felt, offset.right)
    if mf:
        for k in range(r):
            store(W, offset.unknown + k, splat(0.0))
        expand(feet, offset, W, offset.unknown, offset.load, offset.inner)
        own_wrenches(feet, offset, W, offset.inner, offset.own)
        for i in range(6 * nc):
            store(W, offset.own + i, criteria.reference[index, i] - load(W, offset.own + i))
        _wrench_rows(W, criteria, index, offset.own, offset.right + mt)
    for i in range(r):
        column = offset.Qw + m * i
        if mt:
            for t in range(ns):
                s = load(W, offset.Q + t) * load(W, offset.R + i)
                for k in range(1, i + 1):
                    s = s + load(W, offset.Q + ns * k + t) * load(W, offset.R + r * k + i)
                store(W, offset.felt + t, s)
            _torque_rows(W, criteria, index, offset.felt, column)
        if mf:
            for k in range(r):
                store(W, offset.unknown + k, splat(1.0 if k == i else 0.0))
            expand(feet, offset, W, offset.unknown, offset.nothing, offset.inner)
            own_wrenches(feet, offset, W, offset.inner, offset.own)
            _wrench_rows(W, criteria, index, offset.own, column + mt)
    lost = factorise(W, offset.Qw, offset.Rw, m, r)
    invert_upper(W, offset.Rw, offset.Tw, r)
    store(W, offset.doubt, where_less(lost, 0.5, load(W, offset.doubt), splat(1.0)))
    return m


@compiled
def _torque_rows(W: Any, criteria: KernelCriteria, index: int, x: int, out: int) -> None:
    """W_tau^(1/2) of torques (ns,)."""
    for t in range(criteria.torque_root.shape[1]):
        s = weigh(W, criteria.torque_root[index], criteria.torque_reach[index], t, x)
        store(W, out + t, s)


@compiled
def _wrench_rows(W: Any, criteria: KernelCriteria, index: int, x: int, out: int) -> None:
    """W_f^(1/2) of wrenches in contact axes (6 nc,)."""
    for i in range(criteria.wrench_root.shape[1]):
        s = weigh(W, criteria.wrench_root[index], criteria.wrench_reach[index], i, x)
        store(W, out + i, s)


@compiled
def weigh(W: Any, weights: Any, reach: int, i: int, x: int) -> Any:
    """Row i of a weight matrix, which reaches so far from its diagonal, times x."""
    s = splat(0.0)
    for j in range(max(i - reach, 0), min(i + reach + 1, len(weights))):
        s = s + weights[i, j] * load(W, x + j)
    return s


@compiled
def own_wrenches(feet: Feet, offset: Offsets, W: Any, wrenches: int, out: int) -> None:
    """Wrenches of all contacts about their own origins, in their own axes."""
    for k in range(len(feet.body)):
        F, M = load3(W, wrenches + 6 * k), load3(W, wrenches + 6 * k + 3)
        f = along(W, offset.foot_rotation + 9 * k, F)
        m = sub3(M, cross3(load3(W, offset.foot + 3 * k), F))
        m = along(W, offset.foot_rotation + 9 * k, m)
        if feet.point[k]:
            m = scale3(0.0, f)
        store3(W, out + 6 * k, f)
        store3(W, out + 6 * k + 3, m)


@compiled
def finish(tree: Tree, feet: Feet, offset: Offsets, W: Any) -> None:
    """Torques, wrenches in contact axes and centres of pressure ([Romano2016] Eq. (10))."""
    gather_groups(feet, W, offset.wrench, offset.group)
    for i in range(1, len(tree.parent)):
        store(W, offset.torque + i, load(W, offset.gravity + i))
    for t in range(len(feet.support)):
        i, g = feet.support[t], offset.group + 6 * feet.group[t]
        s = offset.screw + 6 * i
        power = dot3(load3(W, s), load3(W, g)) + dot3(load3(W, s + 3), load3(W, g + 3))
        store(W, offset.torque + i, load(W, offset.gravity + i) - power)
    own_wrenches(feet, offset, W, offset.wrench, offset.contact_wrench)
    doubt = load(W, offset.doubt)
    for k in range(len(feet.body)):
        f, m = offset.contact_wrench + 6 * k, offset.contact_wrench + 6 * k + 3
        normal = load(W, f + 2)
        store(W, offset.cop + 2 * k, -(load(W, m + 1) / normal))
        store(W, offset.cop + 2 * k + 1, load(W, m) / normal)
        doubt = where_less(_UNLOADED * feet.weight, magnitude(normal), doubt, splat(1.0))
    store(W, offset.doubt, doubt)
