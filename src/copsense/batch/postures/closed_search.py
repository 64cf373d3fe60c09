"""Closed search: the posture of one row of coordinates for a robot with loops or hanging joints.

What keeps such a robot together moves base and limbs at once, so `solve_posture` finds it: what is
not named stays as near to the stance's own as loops, couplings and contacts let it.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from copsense.batch.postures.coordinates import Coordinates
from copsense.batch.postures.reference_search import Attempt, contact_target, within_limits
from copsense.batch.postures.search_settings import STUCK
from copsense.errors import CopsenseError
from copsense.path import COM_COORDINATES
from copsense.posture import contact_error, solve_posture
from copsense.stance import Stance


def closed_one(stance: Stance, plan: Coordinates, values: np.ndarray) -> tuple[Attempt, str]:
    """The posture of one row of values (k,), and why there is none, or ""."""
    asked = dict(zip(plan.names, values.tolist(), strict=True))
    given = plan.given.copy()
    given[plan.place] = values
    nv = stance.robot.model.nv
    joints = {n: v for n, v in asked.items() if n in stance.robot.joint_names}
    targets = []
    for k in range(len(stance.contacts)):
        position, rotation = contact_target(plan, k, given[nv + 3 + 3 * k : nv + 6 + 3 * k])
        targets.append(pin.SE3(rotation, position))
    try:
        found = solve_posture(
            stance,
            com=[asked.get(name) for name in COM_COORDINATES],
            joints=joints,
            targets=targets,
            reference=stance.q,
        )
    except CopsenseError as error:
        return Attempt(stance.q, np.inf, 0, STUCK, 0, 0.0), str(error)
    here = found.stance
    status, which, excess = within_limits(here, plan)
    residual = float(np.abs(contact_error(here, targets)).max(initial=0.0))
    return Attempt(here.q, residual, found.iterations, status, which, excess), ""
