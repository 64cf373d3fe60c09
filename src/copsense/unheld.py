"""Unheld motions: what motors, contacts, loops and couplings leave free.

With the motors locked a motion u is unheld if J u = 0 and J_l u = 0: a hanging arm, two elbows tied
to each other, a leg on leaf springs, a rod that spins about its own axis. Nothing but weight,
loads, springs and held torques acts along it, so that the robot is at rest only where u' N = 0.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.robot import Robot

_LOST = 1e-6  # singular values under which a row depends on others
_TAKES_PART = 0.1  # share of an unheld motion from which a joint is named
_NAMED = 6


def unheld_motions(
    robot: Robot, constraints: Float[np.ndarray, "c nv"]
) -> Float[np.ndarray, "nv u"]:
    """Orthonormal motions that move no motor and no contact and open no loop (nv, u).

    Args:
        robot: the robot, with its drives.
        constraints: rows of contacts, loops and couplings.
    """
    nv, nb = robot.model.nv, robot.unactuated_nv
    rows = robot.by_drive(constraints.T)[:nb]
    s = np.linalg.svd(rows, compute_uv=False)
    count = nb - int(np.sum(s > _LOST * max(1.0, s.max(initial=0.0))))
    if not count:
        return np.zeros((nv, 0))
    return np.asarray(np.linalg.qr(robot.from_drives(vanishing(rows, count, nv)))[0])


def vanishing(
    rows: Float[np.ndarray, "b c"], count: int, size: int
) -> Float[np.ndarray, "size count"]:
    """The combinations of rows that come nearest to vanishing, one a column, padded with zeros."""
    found = np.zeros((size, count))
    if count:
        found[: len(rows)] = np.linalg.svd(rows)[0][:, len(rows) - count :]
    return found


def moved_joints(robot: Robot, motions: Float[np.ndarray, "nv u"]) -> tuple[str, ...]:
    """The joints that motions move most, at most six, the one that moves most first.

    Args:
        robot: the robot.
        motions: velocities as columns (nv, u); of none no joint is named.
    """
    size = np.linalg.norm(motions[robot.base_nv :], axis=1)
    largest = sorted(
        np.flatnonzero(size > _TAKES_PART * size.max(initial=1e-300)), key=lambda i: -size[i]
    )
    return tuple(robot.dof_names[i] for i in largest[:_NAMED])
