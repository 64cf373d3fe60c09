"""ShareWithinLimits: the load shared by a criterion, within what ground and motors allow."""

from __future__ import annotations

import daqp
import numpy as np
import scipy.linalg
from jaxtyping import Float

from copsense.controllers.sharing import LoadProblem, ShareByCriterion
from copsense.criterion import Criterion
from copsense.errors import UnsolvedError
from copsense.limits import Limits, limit_rows
from copsense.stance import Stance

_FEASIBLE = 1e-9  # share of the weight by which a row may be violated
_UNBOUNDED = 1e30
# How much dearer, per squared newton, a missed momentum rate is than the criterion's own cost.
_PRICE = 1e4


class ShareWithinLimits:
    """The forces of least cost within limits; near the brink, those that come nearest.

    Where the criterion's own choice respects the limits it is taken. Otherwise a quadratic program
    over the m - 6 free directions is solved; where no forces cause the wanted momentum rate within
    the limits, the rate gives way and the limits hold.

    Args:
        stance: robot and contacts.
        criterion: what to minimise.
        limits: what to respect; contact rows are constant, torque rows follow the posture.
    """

    def __init__(self, stance: Stance, criterion: Criterion, limits: Limits) -> None:
        """Read the rows once."""
        self.criterion, self.limits = criterion, limits
        self._free = ShareByCriterion(stance, criterion)
        self._quadratic = criterion.at(stance)
        rows = limit_rows(stance, limits)
        self._matrix, self._bound = rows.matrix, rows.bound
        self._limited = np.flatnonzero(np.isfinite(rows.torque))
        self._torque = rows.torque[self._limited]
        self._weight = stance.robot.weight

    def __call__(self, problem: LoadProblem) -> Float[np.ndarray, " m"]:
        """Forces (m,) within the limits.

        Raises:
            UnsolvedError: the solver failed.
        """
        A, b = self._rows(problem)
        forces = self._free(problem)
        if np.all(A @ forces <= b + _FEASIBLE * self._weight):
            return forces
        H, g = self._cost(problem)
        B = problem.base_map
        Z = scipy.linalg.qr(B.T)[0][:, 6:]
        # f = forces + Z y has the wanted momentum rate.
        if Z.shape[1]:  # one foot has no choice
            y = self._solve(Z.T @ H @ Z, Z.T @ (H @ forces - g), A @ Z, b - A @ forces)
            if y is not None:
                return forces + Z @ y
        price = _PRICE * float(np.abs(H).max())
        change = self._solve(
            H + price * B.T @ B,
            H @ forces - g,  # B' (B forces - base_wrench) = 0
            A,
            b - A @ forces,
        )
        if change is None:
            raise UnsolvedError(float(np.max(A @ forces - b) / self._weight))
        return forces + change

    def _rows(self, problem: LoadProblem) -> tuple[np.ndarray, np.ndarray]:
        if not len(self._limited):
            return self._matrix, self._bound
        J, offset = problem.joint_map[self._limited], problem.torque_offset[self._limited]
        # |offset - J f| <= limit, both ways.
        A = np.vstack([self._matrix, -J, J])
        return A, np.concatenate([self._bound, self._torque - offset, self._torque + offset])

    def _cost(self, problem: LoadProblem) -> tuple[np.ndarray, np.ndarray]:
        quadratic, A = self._quadratic, problem.joint_map
        W = quadratic.torque
        if quadratic.inertia:
            W = W + quadratic.inertia * np.linalg.inv(problem.joint_inertia)
        H = A.T @ W @ A + quadratic.wrench
        return H, A.T @ (W @ problem.torque_offset) + quadratic.pull

    def _solve(
        self, H: np.ndarray, h: np.ndarray, A: np.ndarray, b: np.ndarray
    ) -> np.ndarray | None:
        """minimise 1/2 y' H y + h' y subject to A y <= b; None where that cannot be."""
        size = float(np.abs(H).max())
        length = np.maximum(np.linalg.norm(A, axis=1), 1e-12)
        y, _, flag, _ = daqp.solve(
            np.ascontiguousarray(H / size),
            np.ascontiguousarray(h / size),
            np.ascontiguousarray(A / length[:, None]),
            np.ascontiguousarray(b / length),
            np.full(len(b), -_UNBOUNDED),
            np.zeros(len(b), dtype=np.int32),
            primal_tol=_FEASIBLE * self._weight,
        )
        return np.asarray(y) if flag >= 1 else None
