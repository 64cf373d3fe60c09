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
Robots with joints that have no motor of their own, or with loads, go by `driven` instead.
A Moore-Penrose projector would let light joints take everything.

All of it follows from one Cholesky factor of the mass matrix, M = L L', base first:

    L = [L_b 0; L_jb L_s]     M_s = L_s L_s'     L^-1 J' = [L_b^-1 J_b'; Y]     Y = L_s^-1 J_s'
    L^-1 h = [L_b^-1 h_b; L_s^-1 h_s]
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.arrays import check_name, check_type
from copsense.controllers.controller import Command, Observation
from copsense.controllers.driven import DrivenTorques
from copsense.controllers.driven_dynamics import DrivenDynamics
from copsense.controllers.dynamics import StandingDynamics
from copsense.controllers.gains import STIFF, Gains
from copsense.controllers.limited import ShareWithinLimits
from copsense.controllers.sharing import ShareByCriterion, ShareLoad, well_determined
from copsense.controllers.stability import check_unheld
from copsense.criterion import Criterion, check_criterion, minimum_wrench
from copsense.errors import InvalidInputError
from copsense.limits import Limits, optional_limits
from copsense.load_problem import LoadProblem
from copsense.stance import Stance, check_stance

# Mobility, relative to the largest, under which the contacts are taken as redundant. So is what a
# leg within some tenths of a degree of straight lets move: with a knee's sine in the denominator,
# a micrometre of the CoM's height would ask for all of its torque.
_RANK = 1e-6


class BalancingController:
    """Momentum-based balancing with any quadratic criterion.

    Args:
        stance: robot, contacts and the posture around which it balances.
        criterion: how the load is shared among the contacts.
        gains: stiffness and damping.
        limits: what the contact wrenches and torques must respect, or None for no limits.
        feedforward: whether it knows the reference's posture acceleration too: the momentum rate
            then has the reference's angular part, and the postural torques M_s times it. Without,
            as in the paper, a fast sway shares its load a little differently from its criterion.
        share: shares the load instead of `ShareByCriterion` or `ShareWithinLimits`.
        name: how it is called in results; default the criterion's name.
    """

    def __repr__(self) -> str:
        """Criterion, robot and limits."""
        within = f" within {self.limits!r}" if self.limits is not None else ""
        return f"BalancingController({self.name} on {self.stance.robot.name!r}{within})"

    def __init__(
        self,
        stance: Stance,
        criterion: Criterion,
        gains: Gains = STIFF,
        *,
        limits: Limits | None = None,
        feedforward: bool = False,
        share: ShareLoad | None = None,
        name: str | None = None,
    ) -> None:
        """Prepare the gains and check that the criterion determines the forces."""
        check_stance(stance)
        check_criterion(criterion)
        limits = optional_limits(limits)
        check_type(gains, Gains, "a set of gains", "Give STIFF, public_gains(robot) or Gains(...).")
        if share is not None and not callable(share):
            remedy = "Give a function LoadProblem -> forces, or leave it out."
            raise InvalidInputError(f"{share!r} does not share a load. {remedy}")
        if name is not None:
            check_name(name, "the name of a controller")
        self.stance = stance
        self.criterion = criterion
        self.gains = gains
        self.limits = limits
        self.feedforward: bool = bool(feedforward)
        self.name: str = name or criterion.name
        driven = bool(stance.robot.drives or stance.loads)
        self._dynamics = (DrivenDynamics if driven else StandingDynamics)(stance)
        if driven:
            check_unheld(stance, criterion if share is None else minimum_wrench(1.0))
        if share is None and limits is not None and limits.any:
            share = ShareWithinLimits(stance, criterion, limits)
        self._share = share or ShareByCriterion(stance, criterion)
        self._gravity = np.array(stance.robot.model.gravity.linear)
        self._com_gains = np.array(gains.com_stiffness), np.array(gains.com_damping)
        self._none = np.zeros(len(self._dynamics.M))
        M, kp, kd = self._dynamics.M, *gains.per_joint(stance.robot)
        self._redundant = 0  # rows of J_s that depend on others at the stance
        self._driven: DrivenTorques | None = None
        if isinstance(self._dynamics, DrivenDynamics):
            self._driven = DrivenTorques(stance, self._dynamics)
            inertia = self._driven.inertia()
        else:
            T = np.linalg.solve(M[:6, :6], M[:6, 6:])
            mobile = np.linalg.inv(M[6:, 6:] - M[6:, :6] @ T)
            inertia = 1.0 / np.diag(mobile)
            Js = self._dynamics.J[:, 6:] - self._dynamics.J[:, :6] @ T
            values = np.linalg.eigvalsh(Js @ mobile @ Js.T)
            self._redundant = int(np.sum(values <= _RANK * values[-1]))
        scale = inertia if gains.scaled_by_inertia else 1.0
        self._posture_gains = -kp * scale, -kd * scale
        # Where each stacked force stands among the wrenches.
        m = len(self._dynamics.J)
        self._slots = np.flatnonzero(stance.unstack(np.ones(m)).ravel())
        self._wrenches = (len(stance.contacts), 6)
        upright = self._dynamics.base_wrench(-self._dynamics.mass * self._gravity, np.zeros(3))
        if self._driven is None:
            self._compute(upright, np.zeros(len(kp)), self._none[6:])
        else:
            self._driven.compute(self._share, upright, np.zeros(len(kp)), self._none, self._none)

    def __call__(self, observation: Observation) -> Command:
        """The torques at a state, and the contact wrenches they are to cause."""
        q, v, target = observation.q, observation.v, observation.target
        dyn, gains = self._dynamics, self.gains
        dyn.update(q, v)
        away = pin.difference(dyn.model, target.posture, q)
        faster = v - target.velocity
        # Momentum rate wanted, Eq. (19): linear, then angular about the centre of mass.
        kp, kd = self._com_gains
        acceleration = (
            target.com_acceleration
            - kp * (dyn.com - target.com)
            - kd * (dyn.com_velocity - target.com_velocity)
        )
        # The reference's own angular momentum is not braked: the posture would lag behind it.
        spin = gains.momentum_damping * faster + gains.momentum_stiffness * away
        moment = -dyn.angular_map.dot(spin)
        ahead = target.acceleration if self.feedforward else self._none
        if self.feedforward:  # M_b a + h_b has the angular momentum rate of the reference
            moment = moment + dyn.moment(dyn.M[:6].dot(ahead) + dyn.h[:6])
        wrench = dyn.base_wrench(dyn.mass * (acceleration - self._gravity), moment)
        stiffness, damping = self._posture_gains
        driven = self._driven
        if driven is None:
            torques, forces = self._compute(
                wrench, stiffness * away[6:] + damping * faster[6:], ahead[6:]
            )
        else:
            posture = stiffness * driven.speeds(away) + damping * driven.speeds(faster)
            torques, forces = driven.compute(self._share, wrench, posture, faster, ahead)
            forces = forces[: len(self._slots)]
        wrenches = np.zeros(self._wrenches)
        wrenches.put(self._slots, forces)
        return Command(torques, wrenches)

    def _compute(
        self,
        base_wrench: Float[np.ndarray, " 6"],
        posture: Float[np.ndarray, " n"],
        ahead: Float[np.ndarray, " n"],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torques and stacked contact forces for a wrench on the base and postural torques.

        `ahead` are accelerations of the joints that are known before: M_s times them is added.
        """
        M, h, J, bias = self._dynamics.M, self._dynamics.h, self._dynamics.J, self._dynamics.bias
        m, nv = J.shape
        L = lapack.dpotrf(M, lower=1)[0]
        # J', h, then two columns of which only the base's or the joints' part is meant. tau_0
        # compensates h_s, so that tau_0 - h_s is the posture's own torque.
        right = np.zeros((nv, m + 3), order="F")
        right[:, :m], right[:, m] = J.T, h
        right[:6, m + 1] = base_wrench - h[:6]
        right[6:, m + 2] = posture
        solved = lapack.dtrtrs(L, right, lower=1, overwrite_b=1)[0]
        Ls = L[6:, 6:]
        Y, k, p = solved[6:, :m], solved[6:, m], solved[6:, m + 2]
        p += Ls.T.dot(ahead)  # L_s^-1 M_s a
        # J_b w + J_s M_s^-1 posture: the base's share of one column and the joints' of another.
        free = solved[:, m + 2]
        free[:6] = solved[:6, m + 1]
        # Matrices this small are multiplied with `dot`: it takes half the time of `@`.
        mu = self._reactions(Y.T.dot(Y), -bias - solved[:, :m].T.dot(free))
        offset = Ls.dot(k + p + Y.dot(mu))
        joint_map = Ls.dot(Y)
        problem = LoadProblem(J[:, :6].T, base_wrench, joint_map, offset, M[6:, 6:])
        forces = self._share(problem)
        return offset - joint_map.dot(forces), forces

    def _reactions(
        self, mobility: Float[np.ndarray, "m m"], right: Float[np.ndarray, " m"]
    ) -> Float[np.ndarray, " m"]:
        """mu; the smallest where contacts are redundant."""
        if not self._redundant:
            factor, solved, info = lapack.dposv(mobility, right, lower=1)
            if info == 0 and well_determined(mobility, factor, _RANK):
                return np.asarray(solved)
        values, vectors = np.linalg.eigh(mobility)
        # At least as many as at the stance, which a foot that leans a little must not change.
        lost = max(self._redundant, int(np.sum(values <= _RANK * values[-1])))
        on = vectors[:, lost:]
        return np.asarray(on.dot(on.T.dot(right) / values[lost:]))
