"""ShareWithinLimits: the load shared by a criterion, within what ground and motors allow."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.controllers.sharing import ShareByCriterion, allowed
from copsense.criterion import Criterion
from copsense.errors import UnsolvedError
from copsense.limits import Limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.stance import Stance
from copsense.statics.qp import quick_optimum

_FEASIBLE = 1e-9  # share of the weight by which a row may be violated
# How much dearer, per squared newton, a missed momentum rate is than the criterion's own cost.
_PRICE = 1e4


class ShareWithinLimits:
    """The forces of least cost within limits; near their edge, those that come nearest.

    Where the criterion's own choice respects the limits it is taken. Otherwise a quadratic program
    over the m - 6 free directions is solved; where no forces cause the wanted momentum rate within
    the limits, the rate yields and the limits hold.

    Args:
        stance: robot and contacts.
        criterion: what to minimise.
        limits: what to respect; contact rows are constant, torque rows follow the posture.
    """

    def __init__(self, stance: Stance, criterion: Criterion, limits: Limits) -> None:
        """Read the rows once."""
        self.criterion = criterion
        self.limits = limits
        self._free = ShareByCriterion(stance, criterion)
        self._quadratic = criterion.at(stance)
        self._rows = limit_rows(stance, limits)
        self._weight = stance.robot.weight

    def __call__(self, problem: LoadProblem) -> Float[np.ndarray, " m"]:
        """Forces (m,) within the limits.

        Raises:
            UnsolvedError: the solver failed.
        """
        forces, Z = allowed(problem.base_map, problem.base_wrench)
        forces = self._free.among(problem, forces, Z)
        if self._rows.excess(problem, forces) <= _FEASIBLE * self._weight:
            return forces
        A, b = self._rows.over_forces(problem)
        H, g = self._quadratic.over_forces(problem)
        B, left, slope = problem.base_map, b - A.dot(forces), H.dot(forces) - g
        # f = forces + Z y has the wanted momentum rate.
        if Z.shape[1]:  # one foot has no choice
            y = quick_optimum(Z.T.dot(H).dot(Z), Z.T.dot(slope), A.dot(Z), left, self._weight)
            if y is not None:
                return forces + Z.dot(y)
        if problem.response is not None:
            return self._yielding(problem.yielding())
        price = _PRICE * float(np.abs(H).max())
        # B' (B forces - base_wrench) = 0 adds nothing to the slope.
        change = quick_optimum(H + price * B.T.dot(B), slope, A, left, self._weight)
        if change is None:
            raise UnsolvedError(float(np.max(-left) / self._weight))
        return forces + change

    def _yielding(self, problem: LoadProblem) -> Float[np.ndarray, " m"]:
        """The same for a robot whose other rows of the load cannot yield: no motor is there."""
        A, b = self._rows.over_forces(problem)
        H, g = self._quadratic.over_forces(problem)
        B, w = problem.base_map[:6], problem.base_wrench[:6]
        start, Z = allowed(problem.base_map[6:], problem.base_wrench[6:])
        price = _PRICE * float(np.abs(H).max())
        H, g = H + price * B.T.dot(B), g + price * B.T.dot(w)
        left, slope = b - A.dot(start), H.dot(start) - g
        change = quick_optimum(Z.T.dot(H).dot(Z), Z.T.dot(slope), A.dot(Z), left, self._weight)
        if change is None:
            raise UnsolvedError(float(np.max(-left) / self._weight))
        return start + Z.dot(change)
