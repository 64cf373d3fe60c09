"""unused: what a compiled MJCF says about a robot and copsense does not use."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco

from copsense.listing import first_few
from copsense.mjcf.scene import body_label
from copsense.mjcf.tendons import tendon_bodies
from copsense.mjcf.tree_model import Tree

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)


def unused(mj: Any, tree: Tree) -> tuple[str, ...]:
    """A sentence for each kind of thing that is passed over."""
    return (
        *_lifted(mj, tree),
        *_tendons(mj, tree),
        *_ball_ranges(mj, tree),
    )


def _lifted(mj: Any, tree: Tree) -> Iterator[str]:
    lifted = [b for b in tree.bodies if mj.body_gravcomp[b]]
    if lifted:
        names = first_few(body_label(mj, b) for b in lifted)
        yield f"gravcomp of {names} is not used: their whole weight counts."


def _tendons(mj: Any, tree: Tree) -> Iterator[str]:
    tendons = [
        t
        for t in range(mj.ntendon)
        if (mj.tendon_stiffness[t] or mj.tendon_stiffnesspoly[t].any() or mj.tendon_limited[t])
        and tendon_bodies(mj, t) & tree.bodies.keys()
    ]
    if tendons:
        names = first_few(mj.tendon(t).name or f"number {t}" for t in tendons)
        yield f"springs and limits of tendons {names} are not used."


def _ball_ranges(mj: Any, tree: Tree) -> Iterator[str]:
    balls = [j for j in tree.joints if mj.jnt_type[j] == _BALL and mj.jnt_limited[j]]
    if balls:
        yield f"ranges of ball joints {first_few(tree.name_of(j) for j in balls)} are not used."
