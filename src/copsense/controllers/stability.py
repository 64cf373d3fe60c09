"""check_unheld: whether what motors, contacts and loops leave free stands by itself.

Along an unheld motion u a robot is at rest only where u'N = 0, and stays there only if u'A u > 0,
A = d(N - C'x)/dq at fixed forces x: gravity and springs must bring it back (theory of a pendulum).
"""

from __future__ import annotations

import numpy as np

from copsense.criterion import Criterion
from copsense.errors import UnstablePostureError
from copsense.stance import Stance
from copsense.statics import solve_equilibrium
from copsense.unheld import moved_joints

_FLAT = 1e-9  # of the weight, in metres: a stiffness so small counts as none


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
    free = stance.hanging_motions  # what spins about its own axis may
    if not free.shape[1]:
        return
    stiffness = free.T @ stance.balance_derivative(forces) @ free
    values, vectors = np.linalg.eigh((stiffness + stiffness.T) / 2)
    if values[0] > _FLAT * stance.robot.weight:
        return
    joints = moved_joints(stance.robot, free @ vectors[:, :1])
    raise UnstablePostureError(stance.robot.name, joints, float(values[0]))
