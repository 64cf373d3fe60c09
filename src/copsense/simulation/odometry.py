"""FootOdometry: the base's state from the joints alone, assuming that a foot stands still."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.errors import InvalidInputError, UnknownNameError
from copsense.stance import Stance

LOADED = "loaded"  # the foot that carries the most
_HYSTERESIS = 0.1  # of the weight


class FootOdometry:
    """Base pose and velocity under the assumption that a foot does not move.

    A robot without a tracker of its base estimates it so. When the foot tips or slips, the estimate
    moves with it. With ``"loaded"`` the foot is the one with the largest measured normal force.
    Another foot takes over when it carries more by a tenth of the weight, so that noise does not
    switch feet at every step; it then counts as standing where the last estimate placed it.

    Args:
        stance: robot and contacts; where the feet stand.
        contact: name of a surface contact, or ``"loaded"``.

    Raises:
        UnknownNameError: no such contact.
        InvalidInputError: only point contacts, from which no orientation follows.
    """

    def __init__(self, stance: Stance, contact: str) -> None:
        """Find the feet on the robot."""
        names = [c.name for c in stance.contacts if c.kind == "surface"]
        if not names:
            raise InvalidInputError(
                "odometry needs a foot with a sole: the base's orientation does not follow from a "
                "point contact. Leave odometry out."
            )
        if contact not in (LOADED, *names):
            raise UnknownNameError("foot for odometry", contact, (LOADED, *names))
        self._fixed = None if contact == LOADED else names.index(contact)
        surface = [k for k, c in enumerate(stance.contacts) if c.kind == "surface"]
        self._rows, self._places = surface, [stance.placements[k] for k in surface]
        self._model, self._data = stance.robot.model, stance.robot.model.createData()
        self._feet = []
        for k in surface:
            at = stance.contacts[k].on(stance.robot)
            self._feet.append((at.joint, at.placement))
        self._foot = 0 if self._fixed is None else self._fixed
        self._weight = stance.robot.weight

    def estimate(
        self,
        q: Float[np.ndarray, " nq"],
        v: Float[np.ndarray, " nv"],
        wrenches: Float[np.ndarray, "nc 6"],
    ) -> tuple[Float[np.ndarray, " nq"], Float[np.ndarray, " nv"]]:
        """Configuration and velocity with an estimated base; that in `q` and `v` is not used."""
        model, data = self._model, self._data
        q, v = q.copy(), v.copy()
        q[:7], v[:6] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 0.0
        pin.computeJointJacobians(model, data, q)
        seen = [data.oMi[joint] * place for joint, place in self._feet]
        if self._fixed is None:
            loads = wrenches[self._rows, 2]
            most = int(np.argmax(loads))
            if loads[most] > loads[self._foot] + _HYSTERESIS * self._weight:
                base = self._places[self._foot] * seen[self._foot].inverse()
                self._places[most] = base * seen[most]
                self._foot = most
        foot = self._foot
        base = self._places[foot] * seen[foot].inverse()
        q[:3], q[3:7] = base.translation, pin.Quaternion(base.rotation).normalized().coeffs()
        joint, place = self._feet[foot]
        J = pin.getFrameJacobian(model, data, joint, place, pin.ReferenceFrame.LOCAL)
        # The foot stands still: J_b v_b + J_j v_j = 0.
        v[:6] = np.linalg.solve(J[:, :6], -J[:, 6:] @ v[6:])
        return q, v
