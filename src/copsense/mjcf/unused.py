"""unused: what a compiled MJCF says about a robot and copsense does not use."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from copsense.mjcf.scene import body_label, listed
from copsense.mjcf.tree_model import Tree, actuators_of

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
# What couplings are between, which MuJoCo does not repeat in `eq_objtype`.
_COUPLING = {
    int(mujoco.mjtEq.mjEQ_JOINT): int(mujoco.mjtObj.mjOBJ_JOINT),
    int(mujoco.mjtEq.mjEQ_TENDON): int(mujoco.mjtObj.mjOBJ_TENDON),
}
_FAR_OFF = 1e-6  # of gravity's size: how much of it may not be vertical


def unused(mj: Any, tree: Tree) -> tuple[str, ...]:
    """A sentence for each kind of thing that is passed over."""
    return (
        *_gravity(mj, tree),
        *_equalities(mj, tree),
        *_springs(mj, tree),
        *_motors(mj, tree),
        *_ball_ranges(mj, tree),
    )


def _gravity(mj: Any, tree: Tree) -> Iterator[str]:
    gravity = np.array(mj.opt.gravity)
    size = float(np.linalg.norm(gravity))
    if size and (gravity[2] > 0 or np.abs(gravity[:2]).max() > _FAR_OFF * size):
        numbers = " ".join(f"{g:g}" for g in gravity)
        yield (
            f"gravity in the file is {numbers} m/s^2, not straight down: the weight acts along it, "
            "while the ground is level and z is up."
        )
    lifted = [b for b in tree.bodies if mj.body_gravcomp[b]]
    if lifted:
        names = listed(body_label(mj, b) for b in lifted)
        yield f"gravcomp of {names} is not used: their whole weight counts."


def _equalities(mj: Any, tree: Tree) -> Iterator[str]:
    if mj.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EQUALITY):
        return
    for e in range(mj.neq):
        kind = mujoco.mjtEq(int(mj.eq_type[e])).name.removeprefix("mjEQ_").lower()
        of = _COUPLING.get(int(mj.eq_type[e]), int(mj.eq_objtype[e]))
        ends = [_end(mj, of, int(number)) for number in (mj.eq_obj1id[e], mj.eq_obj2id[e])]
        if not mj.eq_active0[e] or not any(bodies & tree.bodies.keys() for _, bodies in ends):
            continue
        name = f" {mj.eq(e).name!r}" if mj.eq(e).name else ""
        between = " and ".join(label for label, _ in ends if label)
        yield f"equality{name} ({kind}) of {between} is not used."


def _end(mj: Any, kind: int, number: int) -> tuple[str, set[int]]:
    """What an end of an equality is called, and the bodies it concerns."""
    if number < 0:
        return "", set()
    if kind == int(mujoco.mjtObj.mjOBJ_BODY):
        return (repr(body_label(mj, number)) if number else "the world"), {number}
    if kind == int(mujoco.mjtObj.mjOBJ_SITE):
        return f"site {mj.site(number).name!r}", {int(mj.site_bodyid[number])}
    if kind == int(mujoco.mjtObj.mjOBJ_JOINT):
        return f"joint {mj.joint(number).name!r}", {int(mj.jnt_bodyid[number])}
    if kind == int(mujoco.mjtObj.mjOBJ_TENDON):
        return f"tendon {mj.tendon(number).name!r}", _tendon_bodies(mj, number)
    return f"flex {number}", set()


def _springs(mj: Any, tree: Tree) -> Iterator[str]:
    joints = [j for j in tree.joints if mj.jnt_stiffness[j] or mj.jnt_stiffnesspoly[j].any()]
    if joints:
        names = listed(tree.name_of(j) for j in joints)
        yield f"springs (stiffness) of joints {names} are not used."
    tendons = [
        t
        for t in range(mj.ntendon)
        if (mj.tendon_stiffness[t] or mj.tendon_stiffnesspoly[t].any() or mj.tendon_limited[t])
        and _tendon_bodies(mj, t) & tree.bodies.keys()
    ]
    if tendons:
        names = listed(mj.tendon(t).name or f"number {t}" for t in tendons)
        yield f"springs and limits of tendons {names} are not used."


def _motors(mj: Any, tree: Tree) -> Iterator[str]:
    """Joints without an actuator, where others have one; actuators that act otherwise."""
    names = [tree.name_of(j) for j in tree.joints if not actuators_of(mj, j)]
    if names and len(names) < len(tree.joints):
        yield f"joints {listed(names)} have no actuator; they are held by motors all the same."
    acting = {a for j in range(mj.njnt) for a in actuators_of(mj, j)}
    others = []
    for a in range(len(mj.actuator_trntype)):
        if a in acting or not _acted_on(mj, a) & tree.bodies.keys():
            continue
        others.append(mj.actuator(a).name or f"number {a}")
    if others:
        yield f"actuators {listed(others)} do not act on a single joint; they are not used."


def _acted_on(mj: Any, actuator: int) -> set[int]:
    kind, number = mj.actuator_trntype[actuator], int(mj.actuator_trnid[actuator][0])
    if kind == int(mujoco.mjtTrn.mjTRN_TENDON):
        return _tendon_bodies(mj, number)
    if kind == int(mujoco.mjtTrn.mjTRN_BODY):
        return {number}
    if kind in (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)):
        return {int(mj.site_bodyid[number])}
    return set()


def _tendon_bodies(mj: Any, tendon: int) -> set[int]:
    first = int(mj.tendon_adr[tendon])
    bodies = set()
    for w in range(first, first + int(mj.tendon_num[tendon])):
        kind, number = mj.wrap_type[w], int(mj.wrap_objid[w])
        if kind == int(mujoco.mjtWrap.mjWRAP_JOINT):
            bodies.add(int(mj.jnt_bodyid[number]))
        elif kind == int(mujoco.mjtWrap.mjWRAP_SITE):
            bodies.add(int(mj.site_bodyid[number]))
    return bodies


def _ball_ranges(mj: Any, tree: Tree) -> Iterator[str]:
    balls = [j for j in tree.joints if mj.jnt_type[j] == _BALL and mj.jnt_limited[j]]
    if balls:
        yield f"ranges of ball joints {listed(tree.name_of(j) for j in balls)} are not used."
