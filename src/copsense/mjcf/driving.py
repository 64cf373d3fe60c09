"""driving: what holds the joints of a robot, as a compiled MJCF describes it."""

from __future__ import annotations

from typing import Any

import mujoco

from copsense.drives import Drives, Spring
from copsense.listing import first_few
from copsense.mjcf.equalities import Equalities
from copsense.mjcf.motors import Motors
from copsense.mjcf.tree_model import Tree

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)


def read_drives(mj: Any, tree: Tree) -> tuple[Drives, tuple[str, ...]]:
    """The drives of a robot, and what was assumed or is not used.

    Args:
        mj: ``mujoco.MjModel``.
        tree: the robot in it, with its effort limits; frames that loops need are added to it.
    """
    equalities = Equalities(mj, tree)
    loops, couplings = equalities.read()
    actuators = Motors(mj, tree, {coupling.joint for coupling in couplings})
    motors, transmissions = actuators.read()
    springs, bent = _springs(mj, tree)
    drives = Drives(
        motors=motors,
        springs=springs,
        couplings=couplings,
        loops=loops,
        transmissions=transmissions,
    )
    return drives, (*equalities.notes, *bent, *actuators.notes)


def _springs(mj: Any, tree: Tree) -> tuple[dict[str, Spring], tuple[str, ...]]:
    """Linear springs of hinges and slides; others are noted."""
    found: dict[str, Spring] = {}
    bent = []
    if mj.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_SPRING):
        return {}, ()
    for joint in tree.joints:
        name, stiffness = tree.name_of(joint), float(mj.jnt_stiffness[joint])
        curved = bool(mj.jnt_stiffnesspoly[joint].any())
        if curved or (stiffness and mj.jnt_type[joint] == _BALL):
            bent.append(name)
        elif stiffness:
            found[name] = Spring(stiffness, float(mj.qpos_spring[mj.jnt_qposadr[joint]]))
    if not bent:
        return found, ()
    why = "they are not linear in one position"
    return found, (f"springs (stiffness) of joints {first_few(bent)} are not used: {why}.",)
