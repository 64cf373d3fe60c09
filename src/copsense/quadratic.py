"""Quadratic: a criterion's matrices, and its cost over the contact forces of a load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import lapack

from copsense.arrays import array_property
from copsense.changes import StanceChange
from copsense.content import ShortRepr
from copsense.errors import InvalidInputError
from copsense.load_problem import LoadProblem
from copsense.stance import Stance

_SINGULAR = 1e-12  # reciprocal condition of the joints' inertia under which it has no inverse


@dataclass(frozen=True, eq=False, repr=False)
class Quadratic(ShortRepr):
    """A criterion's matrices on a robot's contacts: W_tau = torque + inertia * M_j^-1, W_f.

    Attributes:
        torque: D, the constant part of W_tau (n, n).
        inertia: c, the factor of the inverse joint-space inertia in W_tau.
        wrench: W_f (m, m).
        pull: W_f f_ref (m,).
    """

    torque: Float[np.ndarray, "n n"]
    inertia: float
    wrench: Float[np.ndarray, "m m"]
    pull: Float[np.ndarray, " m"]

    @array_property
    def active(self) -> Bool[np.ndarray, " n"]:
        """Joints (n,) whose torque has a cost; the others are free to take any."""
        if self.inertia:
            return np.ones(len(self.torque), dtype=bool)
        return np.asarray(np.any(self.torque != 0, axis=1))

    @cached_property
    def has_torque(self) -> bool:
        """Whether any torque has a cost."""
        return bool(self.inertia or self.torque.any())

    @cached_property
    def has_wrench(self) -> bool:
        """Whether any wrench has a cost."""
        return bool(self.wrench.any() or self.pull.any())

    def padded(self, more: int) -> Quadratic:
        """The same where `more` forces without a cost stand behind the contacts' forces."""
        if not more:
            return self
        m = len(self.pull)
        wrench, pull = np.zeros((m + more, m + more)), np.zeros(m + more)
        wrench[:m, :m], pull[:m] = self.wrench, self.pull  # `np.pad` takes ten times as long
        return replace(self, wrench=wrench, pull=pull)

    def torque_weight(self, problem: LoadProblem) -> Float[np.ndarray, "n n"]:
        """W_tau = D + c M_j^-1.

        Raises:
            InvalidInputError: the weight follows an inertia that has no inverse.
        """
        if not self.inertia:
            return self.torque
        return self._weighed(problem, np.eye(len(self.torque)))

    def _weighed(
        self, problem: LoadProblem, columns: Float[np.ndarray, "n k"]
    ) -> Float[np.ndarray, "n k"]:
        """W_tau times some columns."""
        if not self.inertia:
            return np.asarray(self.torque.dot(columns))
        M = problem.joint_inertia
        factor, info = lapack.dpotrf(M)
        size = np.abs(M).sum(axis=0).max()
        if info or lapack.dpocon(factor, size)[0] < _SINGULAR:
            raise InvalidInputError(
                "a weight that follows the inertia needs every joint to move some mass when limits "
                "are on, and for control. Give constant weights instead."
            )
        found = self.inertia * lapack.dpotrs(factor, columns)[0]
        return np.asarray(found + self.torque.dot(columns) if self._has_constant else found)

    def over_forces(
        self, problem: LoadProblem
    ) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, " m"]]:
        """The cost over contact forces alone, 1/2 f' H f - g' f + const.

        With tau = tau_0 - A f: H = A' W_tau A + W_f and g = A' W_tau tau_0 + W_f f_ref.
        """
        if not self.has_torque:
            return self.wrench, self.pull
        # Matrices this small are multiplied with `dot`: it takes half the time of `@`.
        A = weighted = problem.joint_map
        if not self._plain:
            weighted = self._weighed(problem, A)
        H, g = A.T.dot(weighted), weighted.T.dot(problem.torque_offset)
        return (H + self.wrench, g + self.pull) if self.has_wrench else (H, g)

    def compliance(self, problem: LoadProblem) -> Float[np.ndarray, "a a"]:
        """P = W_tau^-1 over the active joints; no inverse of the inertia is formed."""
        if self.inertia:
            # P = (D + c M^-1)^-1 = M (D M + c 1)^-1, which holds for a singular M too.
            M = problem.joint_inertia
            return np.linalg.solve((self.torque @ M + self.inertia * np.eye(len(M))).T, M.T).T
        return self._constant_compliance

    def compliance_change(
        self,
        stance: Stance,
        problem: LoadProblem,
        multipliers: Float[np.ndarray, " nv"],
        change: StanceChange,
    ) -> Float[np.ndarray, "a p"]:
        """d(P nu_j) at fixed nu: zero unless the weight follows the inertia.

        Multipliers stand in the order of `Robot.by_drive`.
        """
        if not self.inertia:
            return np.zeros((int(self.active.sum()), change.directions.shape[1]))
        nb = stance.robot.unactuated_nv
        # With S = D M + c 1: dP nu = (1 - P D) dM S^-1 nu.
        M = problem.joint_inertia
        S = self.torque @ M + self.inertia * np.eye(len(M))
        inner = np.zeros_like(multipliers)
        inner[nb:] = np.linalg.solve(S, multipliers[nb:])
        moved = change.inertia(stance, inner)[nb:]
        return np.asarray(moved - self.compliance(problem) @ (self.torque @ moved))

    def torque_weight_change(
        self,
        stance: Stance,
        problem: LoadProblem,
        torques: Float[np.ndarray, " n"],
        change: StanceChange,
    ) -> Float[np.ndarray, "n p"]:
        """d(W_tau tau) at fixed tau: -c M^-1 dM M^-1 tau."""
        nb, M = stance.robot.unactuated_nv, problem.joint_inertia
        if not self.inertia:
            return np.zeros((len(torques), change.directions.shape[1]))
        inner = np.zeros(nb + len(torques))
        inner[nb:] = np.linalg.solve(M, torques)
        moved = change.inertia(stance, inner)[nb:]
        return np.asarray(-self.inertia * np.linalg.solve(M, moved))

    @cached_property
    def _has_constant(self) -> bool:
        return bool(self.torque.any())

    @cached_property
    def _plain(self) -> bool:
        """Whether W_tau is the identity."""
        return not self.inertia and np.array_equal(self.torque, np.eye(len(self.torque)))

    @array_property
    def _constant_compliance(self) -> Float[np.ndarray, "a a"]:
        on = self.active
        return np.asarray(np.linalg.inv(self.torque[np.ix_(on, on)]))
