"""effort: what the actuators of a compiled MJCF can exert at each joint."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from copsense.mjcf.tree_model import Tree, actuators_of

_SINGLE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def effort_limits(mj: Any, tree: Tree) -> Float[np.ndarray, " nv"]:
    """Largest effort of the motors at each joint (nv,) [Nm, or N]; infinite where none is known.

    The sum over a joint's actuators of |gear| times the force that ``forcerange`` allows, or, of a
    plain motor, what ``ctrlrange`` asks at most; never more than the joint's ``actuatorfrcrange``.
    The smaller side of a range counts.
    """
    limits = np.full(tree.model.nv, np.inf)
    for joint, moved in tree.joints.items():
        if mj.jnt_type[joint] not in _SINGLE:
            continue
        forces = [largest_force(mj, a) for a in actuators_of(mj, joint)]
        limit = sum(forces) if forces else np.inf
        if mj.jnt_actfrclimited[joint]:
            limit = min(limit, _smaller_side(mj.jnt_actfrcrange[joint]))
        limits[tree.model.joints[moved].idx_v] = limit
    return limits


def largest_force(mj: Any, actuator: int) -> float:
    """Largest force of an actuator at its joint, or along its tendon."""
    gear = abs(float(mj.actuator_gear[actuator][0]))
    if mj.actuator_forcelimited[actuator]:
        return gear * _smaller_side(mj.actuator_forcerange[actuator])
    control = int(mj.actuator_ctrladr[actuator])
    plain = mj.actuator_gaintype[actuator] == int(
        mujoco.mjtGain.mjGAIN_FIXED
    ) and mj.actuator_biastype[actuator] == int(mujoco.mjtBias.mjBIAS_NONE)
    if plain and mj.actuator_ctrllimited[control]:
        gain = abs(float(mj.actuator_gainprm[actuator][0]))
        return gear * gain * _smaller_side(mj.actuator_ctrlrange[control])
    return float("inf")


def _smaller_side(bounds: Any) -> float:
    """How far both signs can go; of a range to one side, how far it goes."""
    low, high = float(bounds[0]), float(bounds[1])
    return min(-low, high) if low < 0 < high else max(abs(low), abs(high))
