"""Rigid points: where point contacts that one link carries go, which keeps their distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from copsense.contact import Contact
from copsense.robot import Robot


def keep_distances(
    robot: Robot,
    contacts: Sequence[Contact],
    places: Sequence[pin.SE3],
    targets: Sequence[pin.SE3],
) -> list[pin.SE3]:
    """Targets at which points of one link, such as heel and toe, stay as far apart as they are.

    Points that go straight down from a tilted foot come nearer to each other than the foot lets
    them: their targets are moved to where the link, turned as a whole, comes nearest.

    Args:
        robot: the robot.
        contacts: its contacts.
        places: where they are.
        targets: where each should go by itself.
    """
    found = list(targets)
    carriers: dict[int, list[int]] = {}
    for k, contact in enumerate(contacts):
        if contact.kind == "point":
            carriers.setdefault(int(robot.frame(contact.frame).parentJoint), []).append(k)
    for group in carriers.values():
        here = np.array([places[k].translation for k in group])
        there = np.array([targets[k].translation for k in group])
        start, end = here.mean(axis=0), there.mean(axis=0)
        # The rotation that takes one set of points nearest to another (Kabsch's).
        u, _, vt = np.linalg.svd((there - end).T @ (here - start))
        turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        for k, point in zip(group, here, strict=True):
            found[k] = pin.SE3(targets[k].rotation, end + turn @ (point - start))
    return found
