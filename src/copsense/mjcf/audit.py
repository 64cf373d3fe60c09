"""audit: whether the model that was built is the one MuJoCo compiled."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from copsense.errors import EngineMismatchError
from copsense.mjcf.scene import body_label
from copsense.mjcf.tree_model import Tree

_POSTURES = 3
_CLOSE = 1e-9  # of masses relative to the whole, of lengths [m] relative to a metre or the robot


def check_against(mj: Any, tree: Tree) -> None:
    """Compare mass, centre of mass and every body's and site's axes at random postures.

    Raises:
        EngineMismatchError: they differ; the message says where and by how much.
    """
    model, data, theirs = tree.model, tree.model.createData(), mujoco.MjData(mj)
    mass, total = pin.computeTotalMass(model), float(mj.body_subtreemass[tree.root])
    if abs(mass - total) > _CLOSE * max(total, 1e-3):
        raise _mismatch(f"a mass of {mass:.9g} kg instead of {total:.9g}")
    random = np.random.default_rng(0)
    sites = {mj.site(s).name: s for s in range(mj.nsite) if mj.site(s).name}
    for _ in range(_POSTURES):
        q = _posture(mj, theirs, tree, random)
        mujoco.mj_kinematics(mj, theirs)
        mujoco.mj_comPos(mj, theirs)
        pin.framesForwardKinematics(model, data, q)
        joint, place = tree.bodies[tree.root]
        ours_root = data.oMi[joint] * place
        their_root = _axes(theirs.xpos[tree.root], theirs.xmat[tree.root])
        size = max(1.0, float(np.abs(theirs.xpos - theirs.xpos[tree.root]).max()))
        if total:
            com = ours_root.actInv(pin.centerOfMass(model, data, q))
            off = np.abs(com - their_root.actInv(np.array(theirs.subtree_com[tree.root]))).max()
            if off > _CLOSE * size:
                raise _mismatch(f"a centre of mass {off:.3g} m off")
        for body, (joint, place) in tree.bodies.items():
            here = ours_root.actInv(data.oMi[joint] * place)
            there = their_root.actInv(_axes(theirs.xpos[body], theirs.xmat[body]))
            _compare(here, there, size, f"body {body_label(mj, body)!r}")
        for i, frame in enumerate(model.frames):
            if frame.type == pin.FrameType.OP_FRAME:
                s = sites[frame.name]
                there = their_root.actInv(_axes(theirs.site_xpos[s], theirs.site_xmat[s]))
                _compare(ours_root.actInv(data.oMf[i]), there, size, f"site {frame.name!r}")


def _posture(mj: Any, theirs: Any, tree: Tree, random: np.random.Generator) -> np.ndarray:
    """A random posture of the robot's own joints, set in MuJoCo's data; returns q (nq,)."""
    mujoco.mj_resetData(mj, theirs)
    q = pin.neutral(tree.model)
    for joint, moved in tree.joints.items():
        ours, at = tree.model.joints[moved], int(mj.jnt_qposadr[joint])
        if ours.nq == 1:
            q[ours.idx_q] = theirs.qpos[at] = mj.qpos0[at] + random.normal()
        else:
            x, y, z, w = turn = pin.Quaternion(pin.exp3(random.normal(size=3))).coeffs()
            q[ours.idx_q : ours.idx_q + 4] = turn
            theirs.qpos[at : at + 4] = w, x, y, z
    return q


def _axes(position: np.ndarray, matrix: np.ndarray) -> pin.SE3:
    return pin.SE3(np.array(matrix).reshape(3, 3), np.array(position))


def _compare(here: pin.SE3, there: pin.SE3, size: float, what: str) -> None:
    off = float(np.abs(here.translation - there.translation).max())
    turned = float(np.abs(here.rotation - there.rotation).max())
    if off > _CLOSE * size or turned > _CLOSE:
        raise _mismatch(f"{what} {off:.3g} m off and turned by {turned:.3g} rad")


def _mismatch(what: str) -> EngineMismatchError:
    return EngineMismatchError(
        f"the robot read from this MJCF is not the one MuJoCo compiles: it has {what}. This is a "
        "fault of copsense; please report the file."
    )
