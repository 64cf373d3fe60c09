"""tree_model: the ``pin.Model`` of one tree of a compiled MJCF.

A body's joints act in the order of the file, each about (or along) its axis through its anchor,
both given in the body's axes:

    body in parent = M_b A_1 J_1(q_1 - ref_1) A_1^-1 ... A_n J_n(q_n - ref_n) A_n^-1

with A_k the translation to the anchor. Pinocchio's joint k therefore stands at A_(k-1)^-1 A_k
J_k(-ref_k) in the joint before it, and its position is MuJoCo's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from copsense.errors import InvalidInputError, ModelLoadError
from copsense.joint_models import along
from copsense.mjcf.scene import body_label

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_BALL, _FREE = int(mujoco.mjtJoint.mjJNT_BALL), int(mujoco.mjtJoint.mjJNT_FREE)
_ON_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_BASE = "root_joint"
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Tree:
    """A tree of a compiled MJCF as a Pinocchio model.

    Attributes:
        model: the model; its first joint is the base.
        root: the tree's root body in MuJoCo.
        base: MuJoCo's joints that make the base; none where the file fixes it in the world.
        joints: MuJoCo's joint -> index of Pinocchio's.
        bodies: MuJoCo's body -> index of Pinocchio's joint that moves it, and its axes there.
    """

    model: pin.Model
    root: int
    base: tuple[int, ...]
    joints: dict[int, int] = field(default_factory=dict)
    bodies: dict[int, tuple[int, pin.SE3]] = field(default_factory=dict)

    def name_of(self, joint: int) -> str:
        """The name in the model of one of MuJoCo's joints."""
        return str(self.model.names[self.joints[joint]])


def build_tree(mj: Any, root: int) -> Tree:
    """The tree of a body that is a child of the world, with a floating base.

    Where the file fixes the body in the world the base floats all the same. Slides and hinges (or
    a ball) of the root body that together let it move freely, or freely in a plane, are the base.

    Args:
        mj: ``mujoco.MjModel``.
        root: number of the body.

    Raises:
        ModelLoadError: a joint has a name that Pinocchio keeps for itself.
        InvalidInputError: joints let the root body move, and not freely.
    """
    model = pin.Model()
    tree = Tree(model, root, base_joints(mj, root))
    owners: list[int | None] = [None]  # MuJoCo's joint behind each of Pinocchio's
    frames: dict[int, int] = {}  # of each body
    for body in _depth_first(mj, root):
        label, joints = body_label(mj, body), _joints(mj, body)
        if body == root:
            place = _add_base(mj, tree, joints)
            owners.append(None)
            here, frame = 1, model.addJointFrame(1, 0)
            joints = joints[len(tree.base) :]
        else:
            parent = int(mj.body_parentid[body])
            (here, outer), frame = tree.bodies[parent], frames[parent]
            place = outer * pose(mj.body_pos[body], mj.body_quat[body])
        for number, joint in enumerate(joints):
            name = mj.joint(joint).name or f"{label}Joint_{number}"
            here = _add_joint(mj, model, here, place, joint, name)
            frame = model.addJointFrame(here, frame)
            tree.joints[joint] = here
            owners.append(joint)
            place = pin.SE3(np.eye(3), -np.array(mj.jnt_pos[joint]))
        tree.bodies[body] = here, place
        model.appendBodyToJoint(here, _inertia(mj, body), place)
        frames[body] = model.addFrame(pin.Frame(label, here, frame, place, pin.FrameType.BODY))
    for site in range(mj.nsite):
        body, name = int(mj.site_bodyid[site]), mj.site(site).name
        if body in tree.bodies and name:
            here, outer = tree.bodies[body]
            place = outer * pose(mj.site_pos[site], mj.site_quat[site])
            model.addFrame(pin.Frame(name, here, frames[body], place, pin.FrameType.OP_FRAME))
    _set_joint_numbers(mj, model, owners)
    return tree


def actuators_of(mj: Any, joint: int) -> list[int]:
    """The actuators that act on a joint itself."""
    kinds, on = mj.actuator_trntype, mj.actuator_trnid[:, 0]
    return [a for a in range(len(kinds)) if kinds[a] in _ON_JOINT and on[a] == joint]


def base_joints(mj: Any, root: int) -> tuple[int, ...]:
    """The joints of a tree's root body that make it a floating or planar base; maybe none."""
    joints = _joints(mj, root)
    if joints and mj.jnt_type[joints[0]] == _FREE:
        return (joints[0],)
    for count in (3, 4, 6):
        first = joints[:count]
        driven = any(actuators_of(mj, joint) for joint in first)
        if len(first) == count and not driven and _moves_freely(mj, first):
            return tuple(first)
    return ()


def _moves_freely(mj: Any, joints: list[int]) -> bool:
    """Whether joints of one body are together a planar (three) or a free joint."""
    kinds = [mj.jnt_type[j] for j in joints]
    slides, hinges = (
        np.array([mj.jnt_axis[j] for j in joints if mj.jnt_type[j] == kind]).reshape(-1, 3)
        for kind in (_SLIDE, _HINGE)
    )
    if len(joints) == 3:
        flat = len(slides) == 2 and len(hinges) == 1
        return flat and _rank(slides) == 2 and bool(np.abs(slides @ hinges[0]).max() < _SAME)
    turns = kinds.count(_BALL) == 1 if len(joints) == 4 else _rank(hinges) == 3
    return len(slides) == 3 and _rank(slides) == 3 and turns


def _rank(axes: np.ndarray) -> int:
    return int(np.linalg.matrix_rank(axes, tol=_SAME)) if len(axes) else 0


def _add_base(mj: Any, tree: Tree, joints: list[int]) -> pin.SE3:
    """Add the base as the first joint; returns the root body's axes in it."""
    model, root = tree.model, tree.root
    if joints and not tree.base:
        names = ", ".join(mj.joint(j).name or "without a name" for j in joints)
        raise InvalidInputError(
            f"the robot has no floating base: its root body {body_label(mj, root)!r} is moved in "
            f"the world by joints ({names}) that leave it less than free. Put a <freejoint/> in "
            "their place."
        )
    taken = {mj.joint(j).name for j in range(mj.njnt)} - {mj.joint(j).name for j in tree.base}
    name = next(n for n in (_BASE, f"{body_label(mj, root)}_free", "base_free") if n not in taken)
    if len(tree.base) != 3:
        model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
        return pin.SE3.Identity()
    hinge = next(mj.jnt_axis[j] for j in tree.base if mj.jnt_type[j] == _HINGE)
    slide = next(mj.jnt_axis[j] for j in tree.base if mj.jnt_type[j] == _SLIDE)
    plane = pin.SE3(np.column_stack([slide, np.cross(hinge, slide), hinge]), np.zeros(3))
    world = pose(mj.body_pos[root], mj.body_quat[root])
    model.addJoint(0, pin.JointModelPlanar(), world * plane, name)
    return plane.inverse()


def _add_joint(
    mj: Any, model: pin.Model, parent: int, outer: pin.SE3, joint: int, name: str
) -> int:
    """Add a hinge, slide or ball of a body whose axes, before it moves, are `outer`."""
    if model.existJointName(name):
        raise ModelLoadError(
            f"the MJCF calls a joint {name!r}, a name that is taken. Rename the joint."
        )
    axis, reference = np.array(mj.jnt_axis[joint]), float(mj.qpos0[mj.jnt_qposadr[joint]])
    kind, back = mj.jnt_type[joint], pin.SE3.Identity()
    if kind == _BALL:
        moved: Any = pin.JointModelSpherical()
    elif kind == _SLIDE:
        moved, back = along(axis, "P"), pin.SE3(np.eye(3), -reference * axis)
    else:
        moved, back = along(axis, "R"), pin.SE3(pin.exp3(-reference * axis), np.zeros(3))
    anchor = pin.SE3(np.eye(3), np.array(mj.jnt_pos[joint]))
    return int(model.addJoint(parent, moved, outer * anchor * back, name))


def _inertia(mj: Any, body: int) -> pin.Inertia:
    """Mass, centre of mass and inertia of a body, in its axes."""
    turn = pose(np.zeros(3), mj.body_iquat[body]).rotation
    about_com = turn @ np.diag(mj.body_inertia[body]) @ turn.T
    if not np.isfinite(about_com).all():
        raise ModelLoadError(
            f"the inertia of body {mj.body(body).name!r} is not finite. Correct its mass and size."
        )
    about_com = (about_com + about_com.T) / 2  # rounding of an inertia that is very large
    return pin.Inertia(float(mj.body_mass[body]), np.array(mj.body_ipos[body]), about_com)


def _set_joint_numbers(mj: Any, model: pin.Model, owners: list[int | None]) -> None:
    """Position limits, armature and damping of every joint."""
    lower, upper = np.full(model.nq, -np.inf), np.full(model.nq, np.inf)
    armature, damping = np.zeros(model.nv), np.zeros(model.nv)
    for moved, joint in zip(model.joints, owners, strict=True):
        turning = {7: 4, 4: 4 if moved.shortname() == "JointModelSpherical" else 2}.get(moved.nq, 0)
        if turning:  # a quaternion, or a cosine and a sine, which stand last
            ends = slice(moved.idx_q + moved.nq - turning, moved.idx_q + moved.nq)
            lower[ends], upper[ends] = -1.01, 1.01
        if joint is None:
            continue
        dofs = slice(moved.idx_v, moved.idx_v + moved.nv)
        theirs = slice(mj.jnt_dofadr[joint], mj.jnt_dofadr[joint] + moved.nv)
        armature[dofs], damping[dofs] = mj.dof_armature[theirs], mj.dof_damping[theirs]
        if moved.nq == 1 and mj.jnt_limited[joint]:
            lower[moved.idx_q], upper[moved.idx_q] = mj.jnt_range[joint]
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    model.armature, model.damping = armature, damping


def _depth_first(mj: Any, body: int) -> Iterator[int]:
    yield body
    for child in range(body + 1, mj.nbody):
        if mj.body_parentid[child] == body:
            yield from _depth_first(mj, child)


def _joints(mj: Any, body: int) -> list[int]:
    first = int(mj.body_jntadr[body])
    return list(range(first, first + int(mj.body_jntnum[body])))


def pose(position: np.ndarray, wxyz: np.ndarray) -> pin.SE3:
    """A pose from MuJoCo's position and quaternion (w, x, y, z)."""
    w, x, y, z = (float(c) for c in wxyz)
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(position))
