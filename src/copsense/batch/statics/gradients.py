"""Gradients: every CoP's sensitivity ([Romano2016] Eq. (11)) by adjoints, one sweep each.

A CoP coordinate changes as dp = l . df, l its covector on the wrenches. Let mu be the internal
wrenches (sum mu_k = 0) that the criterion's curvature H answers to l with, H(mu, .) + l = xi on
every contact, xi one twist for all. Differentiating the criterion's condition along mu leaves

    dp = xi . db + sum_i [lambda_i (dG_i - ds_i . phi_i) - nu_i ds_i . mu_i],
    nu = W tau,  lambda_i = -(W s . mu)_i      (phi_i, mu_i: sums over what joint i carries)

and no derivative of an inverse. Where limits press, mu leaves them as they are; a torque's
multiplier l_i adds to nu_i, the response of it to lambda_i, and that of a contact's limits to xi.
With Omega_i = xi's rotation + sum lambda_j a_j down to body i and
Jacobi's identity, what is left per joint is the covector

    dp/dq_i = dh/dq_i . (Omega_parent x g) + s_i . sum of T_j over what joint i carries,
    T_j = -lambda_j ([0; dh/dq_j x g] + s_j x* phi_j) - nu_j s_j x* mu_j.
"""

from __future__ import annotations

from typing import Any

from copsense.batch.compiler import compiled, inlined
from copsense.batch.kinematics import screw_cross
from copsense.batch.lanes import load, splat, store
from copsense.batch.layout import PRISMATIC, Feet, Tree
from copsense.batch.statics.com_gains import along_motions
from copsense.batch.statics.criteria import LEAST_TORQUE, KernelCriteria
from copsense.batch.statics.limit_offsets import LimitOffsets
from copsense.batch.statics.load_sharing import across_symmetric, own_wrenches, weigh
from copsense.batch.statics.loops import (
    expand,
    gather_groups,
    pair_line,
    times_lower,
    times_upper,
)
from copsense.batch.statics.tangents import project, store_base
from copsense.batch.vectors import across, add3, cross3, dot3, load3, scale3, store3, sub3
from copsense.batch.workspace import Offsets

LOAD = 2  # output of a contact after its CoP's x and y: its share of the weight, for gains


@inlined
def wrench_gradients(
    tree: Tree, feet: Feet, offset: Offsets, W: Any, arm: float, gains: bool
) -> None:
    """Gradients under the minimum wrench, which follow the centre of mass alone.

    dp = beta . dM_c with dM_c = -dh x g, so dp = dh . (beta x g); for p_x (p_y alike, with x)
    beta = I^-1 (-L^2 y - p_x (rho x z)) / f_z, for the contact's share of the weight, which only
    the gains need, beta = I^-1 (rho x z) / (m g).
    """
    nv = len(tree.parent) + 5
    g = (splat(tree.gravity[0]), splat(tree.gravity[1]), splat(tree.gravity[2]))
    first, second = tree.level[0], tree.level[1]
    for k in range(len(feet.body)):
        if feet.point[k]:
            _stand_still(offset, W, k, nv)
        axes = offset.foot_rotation + 9 * k
        z = load3(W, axes + 6)
        lean = cross3(sub3(load3(W, offset.foot + 3 * k), load3(W, offset.middle)), z)
        share = 1.0 / load(W, offset.contact_wrench + 6 * k + 2)
        for output in range(LOAD if feet.point[k] else 0, LOAD + 1 if gains else LOAD):
            if output == LOAD:
                v = scale3(1.0 / feet.weight, lean)
            else:
                p = load(W, offset.cop + 2 * k + output)
                own = scale3(arm, load3(W, axes))
                if output == 0:
                    own = scale3(-arm, load3(W, axes + 3))
                v = scale3(share, sub3(own, scale3(p, lean)))
            u = cross3(across_symmetric(W, offset.middle + 3, v), g)
            a = u[0] * first[0] + u[1] * first[1] + u[2] * first[2]
            b = u[0] * second[0] + u[1] * second[1] + u[2] * second[2]
            at = offset.load_gradient if output == LOAD else offset.gradient + nv * (2 * k + output)
            for i in range(nv):
                store(W, at + i, a * load(W, offset.level + i) + b * load(W, offset.level + nv + i))
            if output == LOAD:
                along_motions(offset, W, at, offset.load_gain + 2 * k, nv)


@compiled
def _stand_still(offset: Offsets, W: Any, k: int, nv: int) -> None:
    """A point contact's CoP is its origin."""
    for i in range(2 * nv):
        store(W, offset.gradient + 2 * nv * k + i, splat(0.0))


@inlined
def torque_gradients(
    tree: Tree,
    feet: Feet,
    offset: Offsets,
    W: Any,
    criteria: KernelCriteria,
    index: int,
    gains: bool,
    limits: LimitOffsets | None,
) -> None:
    """Gradients under a criterion of weighted torques, and wrenches.

    With `limits` those that press are held, whatever the criterion.
    """
    nv, ns = len(tree.parent) + 5, len(feet.support)
    _lever_arms(tree, feet, offset, W)
    joint_multipliers(feet, offset, W, criteria, index, limits)
    for k in range(len(feet.body)):
        if feet.point[k]:
            _stand_still(offset, W, k, nv)
        for output in range(LOAD if feet.point[k] else 0, LOAD + 1 if gains else LOAD):
            at = offset.load_gradient if output == LOAD else offset.gradient + nv * (2 * k + output)
            felt = offset.felt + ns * output
            _adjoint(feet, offset, W, criteria, index, k, output, limits)
            _sweep(tree, feet, offset, W, at, felt)
            if output == LOAD:
                # The motions it meets are admissible: nothing has to be projected.
                for t in range(ns):
                    store(W, at + 5 + feet.support[t], load(W, felt + t))
                along_motions(offset, W, at, offset.load_gain + 2 * k, nv)
        if not feet.point[k]:
            project(feet, offset, W, offset.gradient + 2 * nv * k)


@compiled
def _lever_arms(tree: Tree, feet: Feet, offset: Offsets, W: Any) -> None:
    """A_j = [0; dh/dq_j x g] + s_j x* phi_j, the same for every output."""
    for t in range(len(feet.support)):
        i, phi = feet.support[t], offset.group + 6 * feet.group[t]
        F, M = screw_cross(W, offset.screw + 6 * i, load3(W, phi), load3(W, phi + 3))
        store3(W, offset.lever_arm + 6 * t, F)
        store3(W, offset.lever_arm + 6 * t + 3, add3(M, load3(W, offset.weight + 3 * i)))


@compiled
def joint_multipliers(
    feet: Feet,
    offset: Offsets,
    W: Any,
    criteria: KernelCriteria,
    index: int,
    limits: LimitOffsets | None,
) -> None:
    """nu of the support joints, the same for every output."""
    for t in range(len(feet.support)):
        store(W, offset.felt + t, load(W, offset.torque + feet.support[t]))
    for t in range(len(feet.support)):
        nu = weigh(W, criteria.torque[index], criteria.torque_reach[index], t, offset.felt)
        if limits is not None:
            nu = nu + load(W, limits.pressing + t)
        store(W, offset.nu + t, nu)


@compiled
def _covector(feet: Feet, offset: Offsets, W: Any, k: int, output: int) -> Any:
    """l of p_x = -m_y / f_z, p_y = m_x / f_z or f_z / (m g), on the wrench about the base's origin.

    The first two give the change of a quotient: -p / f_z times that of f_z, and the moment's.
    """
    axes = offset.foot_rotation + 9 * k
    if output == LOAD:
        zero = splat(0.0)
        return scale3(1.0 / feet.weight, load3(W, axes + 6)), (zero, zero, zero)
    share = 1.0 / load(W, offset.contact_wrench + 6 * k + 2)
    p = load(W, offset.cop + 2 * k + output)
    force = scale3(-(p * share), load3(W, axes + 6))
    moment = scale3(-share, load3(W, axes + 3)) if output == 0 else scale3(share, load3(W, axes))
    return add3(force, cross3(load3(W, offset.foot + 3 * k), moment)), moment


@inlined
def _adjoint(
    feet: Feet,
    offset: Offsets,
    W: Any,
    criteria: KernelCriteria,
    index: int,
    k: int,
    output: int,
    limits: LimitOffsets | None,
) -> None:
    """mu (into `inner`) and xi (into `twist`) of one output.

    mu = N z with the internal wrenches N of the unknowns: R' R z = -N' l. Where limits press, what
    they leave of it: R z = P R^-T (-N' l).
    """
    ns, r = len(feet.support), feet.unknowns
    weighted = criteria.kind[index] != LEAST_TORQUE
    l = _covector(feet, offset, W, k, output)
    v, w = _shared(feet, offset, W, k, l)
    if feet.held == 3:
        for pair in range(3):
            a, b = feet.order[pair], feet.order[(pair + 1) % 3]
            sign = (1.0 if k == b else 0.0) - (1.0 if k == a else 0.0)
            store(W, offset.unknown + pair, sign * dot3(pair_line(offset, W, a, b), l[0]))
    for e in feet.order[feet.held :]:
        # The held contacts feel the opposite of every other.
        own, turn = v, w
        if e == k:
            own, turn = sub3(own, l[0]), sub3(turn, l[1])
        at = offset.unknown + feet.first[e]
        if feet.point[e]:
            own = add3(own, cross3(turn, load3(W, offset.foot + 3 * e)))
        else:
            store3(W, at + 3, turn)
        store3(W, at, own)
    T = offset.Tw if weighted else offset.T
    times_lower(W, T, offset.unknown, r)
    if limits is not None:
        _leave(limits, offset, W, r)
    times_upper(W, T, offset.unknown, r)
    expand(feet, offset, W, offset.unknown, offset.nothing, offset.inner)
    gather_groups(feet, W, offset.inner, offset.inner_group)
    if criteria.wrench_reach[index] >= 0:
        own_wrenches(feet, offset, W, offset.inner, offset.own)
        for h in feet.order[: feet.held]:
            more = _shared(feet, offset, W, h, _cost(offset, W, criteria, index, h))
            w = add3(w, more[1])
    change = offset.felt + 2 * ns
    for t in range(ns):
        s, mu = offset.screw + 6 * feet.support[t], offset.inner_group + 6 * feet.group[t]
        power = dot3(load3(W, s), load3(W, mu)) + dot3(load3(W, s + 3), load3(W, mu + 3))
        store(W, change + t, power)
    for t in range(ns):
        rate = -weigh(W, criteria.torque[index], criteria.torque_reach[index], t, change)
        if limits is not None:
            for j in range(r):
                response = load(W, limits.torque_response + r * t + j)
                rate = rate + response * load(W, limits.shift + j)
        store(W, offset.rate + t, rate)
        w = sub3(w, scale3(rate, load3(W, offset.held_row + 6 * t + 3)))
    if limits is not None:
        for j in range(r):
            response = load3(W, limits.twist_response + 3 * j)
            w = add3(w, scale3(load(W, limits.shift + j), response))
    store3(W, offset.twist, w)  # of xi only the rotation matters: gravity is the same everywhere


@compiled
def _shared(feet: Feet, offset: Offsets, W: Any, k: int, l: Any) -> Any:
    """A covector on a contact's wrench as one on what the held contacts take: zero if not held.

    f_k = F / 3 + I^-1 (M - c x F) x rho_k of three points (see `loops`) gives, with the covector a
    on f_k, Omega = I^-1 (rho_k x a) on M and a / 3 - Omega x c on F.
    """
    zero = splat(0.0)
    v, w = (zero, zero, zero), (zero, zero, zero)
    for h in feet.order[: feet.held]:
        if h == k:
            v, w = l
            if feet.held == 3:
                r, c = load3(W, offset.foot + 3 * k), load3(W, offset.spread)
                a = add3(v, cross3(w, r))
                w = across_symmetric(W, offset.spread + 3, cross3(sub3(r, c), a))
                v = sub3(scale3(1.0 / 3.0, a), cross3(w, c))
    return v, w


@compiled
def _cost(offset: Offsets, W: Any, criteria: KernelCriteria, index: int, held: int) -> Any:
    """W_f of the wrenches `own` at a contact, a covector on its wrench there.

    Moved to the base's origin: (f + r x m, m).
    """
    weights, reach, i = criteria.wrench[index], criteria.wrench_reach[index], 6 * held
    axes = offset.foot_rotation + 9 * held
    f = (
        weigh(W, weights, reach, i, offset.own),
        weigh(W, weights, reach, i + 1, offset.own),
        weigh(W, weights, reach, i + 2, offset.own),
    )
    m = (
        weigh(W, weights, reach, i + 3, offset.own),
        weigh(W, weights, reach, i + 4, offset.own),
        weigh(W, weights, reach, i + 5, offset.own),
    )
    w = across(W, axes, m)
    return add3(across(W, axes, f), cross3(load3(W, offset.foot + 3 * held), w)), w


@compiled
def _leave(limits: LimitOffsets, offset: Offsets, W: Any, r: int) -> None:
    """Of a gradient along x, what the pressing limits leave; the gradient is kept as `shift`."""
    for j in range(r):
        store(W, limits.shift + j, load(W, offset.unknown + j))
    for i in range(r):
        s = load(W, limits.P + r * i) * load(W, limits.shift)
        for j in range(1, r):
            s = s + load(W, limits.P + r * i + j) * load(W, limits.shift + j)
        store(W, offset.unknown + i, s)


@inlined
def _sweep(tree: Tree, feet: Feet, offset: Offsets, W: Any, at: int, felt: int) -> None:
    """One output's gradient (nv,) at row `at`, base in world axes, not yet projected.

    Its entries of the support joints go to `felt`.
    """
    ns = len(feet.support)
    g = (splat(tree.gravity[0]), splat(tree.gravity[1]), splat(tree.gravity[2]))
    base = load3(W, offset.twist)
    store_base(tree, offset, W, at, cross3(base, g))
    for t in range(ns):
        i, up = feet.support[t], feet.anchor[feet.support[t]]
        omega = load3(W, offset.turning + 3 * up) if up >= 0 else base
        rate = load(W, offset.rate + t)
        store(W, felt + t, -dot3(omega, load3(W, offset.weight + 3 * i)))
        if tree.kind[i] != PRISMATIC:
            omega = add3(omega, scale3(rate, load3(W, offset.screw + 6 * i + 3)))
        store3(W, offset.turning + 3 * t, omega)
        mu = offset.inner_group + 6 * feet.group[t]
        F, M = screw_cross(W, offset.screw + 6 * i, load3(W, mu), load3(W, mu + 3))
        nu = load(W, offset.nu + t)
        A = offset.lever_arm + 6 * t
        F = scale3(-1.0, add3(scale3(rate, load3(W, A)), scale3(nu, F)))
        M = scale3(-1.0, add3(scale3(rate, load3(W, A + 3)), scale3(nu, M)))
        store3(W, offset.pull + 6 * t, F)
        store3(W, offset.pull + 6 * t + 3, M)
    for t in range(ns - 1, -1, -1):
        i, up = feet.support[t], feet.anchor[feet.support[t]]
        s, T = offset.screw + 6 * i, offset.pull + 6 * t
        F, M = load3(W, T), load3(W, T + 3)
        power = dot3(load3(W, s), F) + dot3(load3(W, s + 3), M)
        store(W, felt + t, load(W, felt + t) + power)
        above = offset.pull + 6 * up if up >= 0 else at
        store3(W, above, add3(load3(W, above), F))
        store3(W, above + 3, add3(load3(W, above + 3), M))
    for i in feet.rest:
        up = feet.anchor[i]
        omega = load3(W, offset.turning + 3 * up) if up >= 0 else base
        store(W, at + 5 + i, -dot3(omega, load3(W, offset.weight + 3 * i)))
