"""DrivenDynamics: the dynamics of a robot with drives and loads on fixed contacts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.closures import Closures
from copsense.controllers.dynamics import StandingDynamics
from copsense.loads import apply_loads
from copsense.stance import Stance


class DrivenDynamics(StandingDynamics):
    """Dynamics M dv + h + load = S t_m + C' x, where C dv + drift = 0.

    C are the contacts' rows J over the independent ones of loops and couplings, as
    `Stance.constraints`, and x their forces.

    Attributes, after `update`, beside those of `StandingDynamics`:
        load: what springs, held torques and loads add to the bias (nv,).
        C: (c, nv).
        drift: dC/dt v (c,).
    """

    C: Float[np.ndarray, "c nv"]
    drift: Float[np.ndarray, " c"]
    load: Float[np.ndarray, " nv"]

    def _begin(self, stance: Stance) -> None:
        """Count the loops' independent rows, which a loop slightly open must not change."""
        self._robot, self._loads = stance.robot, stance.loads
        self._loops = 0 if stance.closures is None else stance.closures.basis.shape[1]
        self._acted_on = bool(stance.robot.drives.springs or stance.robot.drives.held)
        self.load = np.zeros(stance.robot.model.nv)
        self.C, self.drift = self.J, self.bias

    def update(self, q: Float[np.ndarray, " nq"], v: Float[np.ndarray, " nv"]) -> None:
        """Compute everything at a configuration and velocity."""
        super().update(q, v)
        if self._acted_on:
            self.load = -self._robot.joint_forces(q)
        if self._loads:
            balanced = apply_loads(self._loads, self._robot, q).balanced
            self.load = self.load - balanced if self._acted_on else -balanced
        if self._loops:
            closures = Closures(self._robot, q)
            rows = closures.jacobian
            basis = np.linalg.svd(rows, full_matrices=False)[0][:, : self._loops].T
            self.C = np.concatenate([self.J, basis.dot(rows)])
            # d(J_l v)/dq v is the time derivative of J_l, times v.
            turned = closures.motion_derivative(v).dot(v)
            self.drift = np.concatenate([self.bias, basis.dot(turned)])
