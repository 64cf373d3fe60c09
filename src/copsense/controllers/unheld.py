"""Unheld motions: what motors, contacts and loops leave free, and whether it stands by itself.

Along an unheld motion u a robot is at rest only where u'N = 0, and stays there only if u'A u > 0,
A = d(N - C'x)/dq at fixed forces x: gravity and springs must bring it back (theory of a pendulum).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.errors import UnstablePostureError
from copsense.stance import Stance
from copsense.statics import solve_equilibrium

_LOST = 1e-6  # singular values under which a row depends on others
_FLAT = 1e-9  # of the weight, in metres: a stiffness so small counts as none
_TAKES_PART = 0.1  # share of an unheld motion from which a joint is named


def unheld_motions(stance: Stance) -> Float[np.ndarray, "nv u"]:
    """Orthonormal motions that move no motor and no contact and open no loop, (nv, u)."""
    robot, nb = stance.robot, stance.robot.unactuated_nv
    rows = robot.by_drive(stance.constraints.T)[:nb]
    s = np.linalg.svd(rows, compute_uv=False)
    count = nb - int(np.sum(s > _LOST * max(1.0, s.max(initial=0.0))))
    found = robot.from_drives(vanishing(rows, count, robot.model.nv))
    return np.asarray(np.linalg.qr(found)[0])


def vanishing(
    rows: Float[np.ndarray, "b c"], count: int, size: int
) -> Float[np.ndarray, "size count"]:
    """The combinations of rows that come nearest to vanishing, one a column, padded with zeros."""
    found = np.zeros((size, count))
    if count:
        found[: len(rows)] = np.linalg.svd(rows)[0][:, len(rows) - count :]
    return found


def check_unheld(stance: Stance, criterion: Criterion) -> None:
    """Reject a stance whose joints without motors would fall.

    Args:
        stance: where the robot is to stay.
        criterion: what shares the load.

    Raises:
        UnbalancedError: a joint without a motor is not at rest there.
        UndeterminedWrenchError: the criterion leaves several wrenches.
        UnstablePostureError: it is at rest, but would fall at the least disturbance.
    """
    forces = solve_equilibrium(stance, criterion).forces
    free = unheld_motions(stance)
    if not free.shape[1]:
        return
    stiffness = free.T @ stance.balance_derivative(forces) @ free
    values, vectors = np.linalg.eigh((stiffness + stiffness.T) / 2)
    if values[0] > _FLAT * stance.robot.weight:
        return
    motion = (free @ vectors[:, 0])[stance.robot.base_nv :]
    size = np.abs(motion)
    largest = sorted(np.flatnonzero(size > _TAKES_PART * size.max()), key=lambda i: -size[i])
    joints = tuple(stance.robot.dof_names[i] for i in largest[:6])
    raise UnstablePostureError(stance.robot.name, joints, float(values[0]))
