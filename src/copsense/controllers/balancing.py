"""BalancingController: the momentum-based balancing controller of [Romano2016] Section V.

The contacts are to cause a momentum rate, Eq. (19), and the torques to cause those contact forces,
Eq. (20); what is left of the torques keeps a posture. With the joints' coordinates decoupled from
the base (T = M_b^-1 M_bj):

    M_s = M_j - M_jb T      J_s = J_j - J_b T      h_s = h_j - T' h_b      w = M_b^-1 (J_b' f - h_b)
    M_s ds + h_s = tau + J_s' f                    J_s ds = b = -dJ v - J_b w

Postural torques tau_0, projected with the inertia-weighted (dynamically consistent) projector and
so unable to move the feet, give

    tau = tau_0 + J_s' mu - J_s' f*      (J_s M_s^-1 J_s') mu = b - J_s M_s^-1 (tau_0 - h_s)

in which mu does not depend on how the load is shared: along J_b' Z = 0 torques change by -J_s' Z.
A Moore-Penrose projector would let light joints take everything.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.controllers.controller import Command, Observation
from copsense.controllers.dynamics import StandingDynamics
from copsense.controllers.gains import STIFF, Gains
from copsense.controllers.limited import ShareWithinLimits
from copsense.controllers.sharing import LoadProblem, ShareByCriterion, ShareLoad
from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.stance import Stance

_RANK = 1e-10  # relative pivot under which the contacts are taken as redundant


class BalancingController:
    """Momentum-based balancing with any quadratic criterion.

    Args:
        stance: robot, contacts and the posture around which it balances.
        criterion: how the load is shared among the contacts.
        gains: stiffness and damping.
        limits: what the contact wrenches and torques must respect, or None for no limits.
        share: shares the load instead of `ShareByCriterion` or `ShareWithinLimits`.
        name: how it is called in results; default the criterion's name.
    """

    def __init__(
        self,
        stance: Stance,
        criterion: Criterion,
        gains: Gains = STIFF,
        *,
        limits: Limits | None = None,
        share: ShareLoad | None = None,
        name: str | None = None,
    ) -> None:
        """Prepare the gains and check that the criterion determines the forces."""
        self.stance, self.criterion, self.gains = stance, criterion, gains
        self.name = name or criterion.name
        if share is None and limits is not None and limits.any:
            share = ShareWithinLimits(stance, criterion, limits)
        self._share = share or ShareByCriterion(stance, criterion)
        self._dynamics = StandingDynamics(stance)
        self._gravity = np.array(stance.robot.model.gravity.linear)
        self._com_gains = np.array(gains.com_stiffness), np.array(gains.com_damping)
        M, kp, kd = self._dynamics.M, *gains.per_joint(stance.robot)
        decoupled = M[6:, 6:] - M[6:, :6] @ np.linalg.solve(M[:6, :6], M[:6, 6:])
        scale = 1.0 / np.diag(np.linalg.inv(decoupled)) if gains.scaled_by_inertia else 1.0
        self._posture_gains = kp * scale, kd * scale
        upright = self._dynamics.base_wrench(-self._dynamics.mass * self._gravity, np.zeros(3))
        self._compute(upright, np.zeros(len(kp)))

    def __call__(self, observation: Observation) -> Command:
        """The torques at a state, and the contact wrenches they are to cause."""
        q, v, target = observation.q, observation.v, observation.target
        dyn = self._dynamics
        dyn.update(q, v)
        away = pin.difference(dyn.model, target.posture, q)
        # Momentum rate wanted, Eq. (19): linear, then angular about the centre of mass.
        kp, kd = self._com_gains
        acceleration = (
            target.com_acceleration
            - kp * (dyn.com - target.com)
            - kd * (dyn.com_velocity - target.com_velocity)
        )
        # The reference's own angular momentum is not braked: the posture would lag behind it.
        spin = dyn.angular_momentum - dyn.angular_map @ target.velocity
        turning = -self.gains.momentum_damping * spin
        turning -= self.gains.momentum_stiffness * (dyn.angular_map @ away)
        wrench = dyn.base_wrench(dyn.mass * (acceleration - self._gravity), turning)
        stiffness, damping = self._posture_gains
        posture = -stiffness * away[6:] - damping * (v[6:] - target.velocity[6:])
        torques, forces = self._compute(wrench, posture)
        return Command(torques, self.stance.unstack(forces))

    def _compute(
        self, base_wrench: Float[np.ndarray, " 6"], posture: Float[np.ndarray, " n"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torques and stacked contact forces for a wrench on the base and postural torques."""
        M, h, J, bias = self._dynamics.M, self._dynamics.h, self._dynamics.J, self._dynamics.bias
        right = np.empty((6, M.shape[1] - 5), order="F")
        right[:, :-1], right[:, -1] = M[:6, 6:], base_wrench - h[:6]
        solved = lapack.dposv(M[:6, :6], right)[1]
        T, w = solved[:, :-1], solved[:, -1]
        Ms = M[6:, 6:] - M[6:, :6] @ T
        Js = J[:, 6:] - J[:, :6] @ T
        L = lapack.dpotrf(Ms, lower=1)[0]
        # tau_0 compensates h_s, so that tau_0 - h_s is the posture's own torque.
        right = np.empty((len(Ms), len(Js) + 1), order="F")
        right[:, :-1], right[:, -1] = Js.T, posture
        scaled = lapack.dtrtrs(L, right, lower=1)[0]
        Y, p = scaled[:, :-1], scaled[:, -1]
        mu = _solve(Y.T @ Y, -bias - J[:, :6] @ w - Y.T @ p)
        offset = h[6:] - T.T @ h[:6] + posture + Js.T @ mu
        problem = LoadProblem(J[:, :6].T, base_wrench, Js.T, offset, M[6:, 6:])
        forces = self._share(problem)
        return offset - Js.T @ forces, forces


def _solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve a symmetric system; the least solution where contacts are redundant."""
    factor, info = lapack.dpotrf(matrix, lower=1)
    if info == 0 and np.diag(factor).min() ** 2 > _RANK * np.abs(matrix).max():
        return np.asarray(lapack.dpotrs(factor, right, lower=1)[0])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-10)[0])
