"""scene: which tree of a compiled MJCF is the robot, and what stands beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco

from copsense.errors import InvalidInputError, ModelLoadError, UnknownNameError
from copsense.listing import first_few

_FREE = int(mujoco.mjtJoint.mjJNT_FREE)


def find_robot(mj: Any, frames: Sequence[str], root: str | None) -> int:
    """The body at the root of the robot's tree.

    The tree of `root` where it is given, else the one that holds the frames, else the one whose
    joints make it a robot: only one has any, or only one of those has a free base.

    Args:
        mj: ``mujoco.MjModel``.
        frames: names of bodies, sites or joints of the robot, such as its contacts; a name that
            the file does not hold is for who looks it up later.
        root: name of any of its bodies.

    Raises:
        UnknownNameError: there is no body called `root`.
        InvalidInputError: the frames are of several trees, or of none, or several trees could be
            meant.
        ModelLoadError: there is no body at all.
    """
    if root is not None:
        names = [mj.body(i).name for i in range(1, mj.nbody)]
        if root not in names:
            raise UnknownNameError("body to take as the robot's root", root, filter(None, names))
        return int(mj.body_rootid[mj.body(root).id])
    found = {frame: _tree_of(mj, frame) for frame in frames}
    holding = {frame: tree for frame, tree in found.items() if tree is not None}
    for frame, tree in holding.items():
        if tree == 0:
            raise InvalidInputError(
                f"frame {frame!r} is fixed in the world, not part of a robot. Name a frame of a "
                "foot."
            )
    trees = set(holding.values())
    if len(trees) > 1:
        where = ", ".join(f"{frame} on {_label(mj, tree)}" for frame, tree in holding.items())
        raise InvalidInputError(
            f"the contacts are on separate robots or things: {where}. Name contacts of one."
        )
    return trees.pop() if trees else _likely(mj)


def left_out(mj: Any, root: int) -> tuple[str, ...]:
    """What else stands in the scene, in a sentence; empty where nothing does."""
    others = [_described(mj, tree) for tree in _trees(mj) if tree != root]
    if not others:
        return ()
    held = first_few(others)
    return (f"beside the robot ({_label(mj, root)}) the file holds {held}; none of it is used.",)


def body_label(mj: Any, body: int) -> str:
    """The body's name, or one made of its number."""
    return str(mj.body(body).name) or f"body_{body}"


def _label(mj: Any, tree: int) -> str:
    return repr(body_label(mj, tree))


def _described(mj: Any, tree: int) -> str:
    mass = f"{mj.body_subtreemass[tree]:.4g} kg"
    if mj.body_mocapid[tree] >= 0:
        return f"{_label(mj, tree)} (mocap)"
    return f"{_label(mj, tree)} ({mass}, {'moving' if _joints(mj, tree) else 'fixed'})"


def _trees(mj: Any) -> list[int]:
    """Children of the world, in the file's order."""
    return [i for i in range(1, mj.nbody) if mj.body_parentid[i] == 0]


def _joints(mj: Any, tree: int) -> list[int]:
    return [j for j in range(mj.njnt) if mj.body_rootid[mj.jnt_bodyid[j]] == tree]


def _tree_of(mj: Any, frame: str) -> int | None:
    """Root of the tree that holds a body, site or joint of that name; 0 for the world."""
    for kind, bodies in (
        (int(mujoco.mjtObj.mjOBJ_BODY), None),
        (int(mujoco.mjtObj.mjOBJ_SITE), mj.site_bodyid),
        (int(mujoco.mjtObj.mjOBJ_JOINT), mj.jnt_bodyid),
    ):
        found = mujoco.mj_name2id(mj, kind, frame)
        if found >= 0:
            return int(mj.body_rootid[found if bodies is None else bodies[found]])
    return None


def _likely(mj: Any) -> int:
    """The tree that must be meant where nothing says so."""
    trees = [t for t in _trees(mj) if mj.body_mocapid[t] < 0]
    joints = {t: _joints(mj, t) for t in trees}
    free = {t for t in trees if any(mj.jnt_type[j] == _FREE for j in joints[t])}
    limbed = [t for t in trees if len(joints[t]) > (t in free)]
    for candidates in (
        limbed,
        [t for t in limbed if t in free],
        # Without any joint but the base's: a body that moves, then a body with mass.
        [] if limbed else list(free),
        [] if limbed or free else [t for t in trees if mj.body_subtreemass[t] > 0],
    ):
        if len(candidates) == 1:
            return candidates[0]
    if not any(joints[t] or mj.body_subtreemass[t] for t in trees):
        raise ModelLoadError(
            "the MJCF holds no robot: its <worldbody> has no <body> that moves or has "
            "mass. Correct the file."
        )
    choices = first_few(_described(mj, t) for t in (limbed or sorted(free) or trees))
    raise InvalidInputError(
        f"the MJCF holds several things that could be the robot: {choices}. Name the contacts "
        "(contacts=[...], --contact FRAME), or say which with load_robot(..., root=BODY) "
        "(--root BODY)."
    )
