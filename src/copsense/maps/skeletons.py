"""Skeletons: a posture as lines between its joints, to be drawn; the worst postures of a map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.batch import PostureChart
from copsense.maps.map_statistics import WorstPosture
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


def worst_stances(stance: Stance, worst: Sequence[WorstPosture]) -> list[Stance]:
    """The stances at a map's worst postures, solved again from their coordinates."""
    if not worst:
        return []
    names = tuple(worst[0].coordinates)
    values = np.array([[w.coordinates[n] for n in names] for w in worst])
    return [stance.at(q) for q in PostureChart(stance, names).solve(values).configurations]
