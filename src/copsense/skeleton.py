"""Skeleton: a posture as lines between its joints, to be drawn."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.stance import Stance


def skeleton(stance: Stance) -> Float[np.ndarray, "s 2 3"]:
    """Segments from each joint to the one that carries it, and to the contacts [m], world axes."""
    model = stance.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(stance.q))
    origins = np.array([data.oMi[i].translation for i in range(model.njoints)])
    lines = [(origins[model.parents[i]], origins[i]) for i in range(2, model.njoints)]
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        lines.append((origins[stance.robot.frame(contact.frame).parentJoint], place.translation))
    return np.array(lines).reshape(-1, 2, 3)
