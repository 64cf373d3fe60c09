"""Skeleton: a posture as lines between its joints, to be drawn."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.robot import Robot
from copsense.stance import Stance


def links(robot: Robot) -> list[tuple[int, int]]:
    """Each joint of the model behind the base's, after the one that carries it."""
    return [(int(robot.model.parents[i]), i) for i in range(2, robot.model.njoints)]


def skeleton(stance: Stance) -> Float[np.ndarray, "s 2 3"]:
    """Segments from each joint to the one that carries it, and to the contacts [m], world axes."""
    model = stance.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(stance.q))
    origins = np.array([data.oMi[i].translation for i in range(model.njoints)])
    lines = [(origins[a], origins[b]) for a, b in links(stance.robot)]
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        lines.append((origins[stance.robot.frame(contact.frame).parentJoint], place.translation))
    return np.array(lines).reshape(-1, 2, 3)
