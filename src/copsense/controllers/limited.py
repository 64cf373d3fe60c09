"""ShareWithinLimits: the load shared by a criterion, within what ground and motors allow."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.controllers.sharing import Choice, ShareByCriterion, allowed
from copsense.criterion import Criterion
from copsense.errors import UnsolvedError
from copsense.limits import Limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.qp import quick_optimum
from copsense.stance import Stance

_FEASIBLE = 1e-9  # share of the weight by which a row may be violated
# How much dearer, per squared newton, a missed momentum rate is than the criterion's own cost.
_PRICE = 1e4


class ShareWithinLimits:
    """The forces of least cost within limits; near their edge, those that come nearest.

    Where the criterion's own choice respects the limits it is taken. Otherwise a quadratic program
    over the m - 6 free directions is solved, and one for each tie-break over what is left free;
    where no forces cause the wanted momentum rate within the limits, the rate yields and the limits
    hold.

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
        choices = self._free.choices(problem, Z)
        if Z.shape[1]:  # one foot has no choice
            # f = forces + Z y has the wanted momentum rate.
            found = self._least(problem, choices, forces, Z)
            if found is not None:
                return found
        # Where it cannot be had within the limits, it yields; without motors other rows do not.
        if problem.response is not None:
            problem = problem.yielding()
            choices = self._free.choices(problem, Z)
            forces, Z = allowed(problem.base_map[6:], problem.base_wrench[6:])
        else:
            Z = np.eye(len(forces))
        B, w = problem.base_map[:6], problem.base_wrench[:6]
        first = choices[0]
        price = _PRICE * float(np.abs(first.H).max())
        dear = Choice(first.H + price * B.T.dot(B), first.g + price * B.T.dot(w), first.free)
        found = self._least(problem, [dear, *choices[1:]], forces, Z)
        if found is None:
            A, b = self._rows.over_forces(problem)
            raise UnsolvedError(float(np.max(A.dot(forces) - b) / self._weight))
        return found

    def _least(
        self,
        problem: LoadProblem,
        choices: list[Choice],
        forces: Float[np.ndarray, " m"],
        Z: Float[np.ndarray, "m z"],
    ) -> Float[np.ndarray, " m"] | None:
        """Of forces + Z y within the limits those of least cost; None where none are found.

        A tie-break whose own program is not solved leaves what those before it have found.
        """
        A, b = self._rows.over_forces(problem)
        left = b - A.dot(forces)
        for number, choice in enumerate(choices):
            flat = Z.T.dot(choice.free) if choice.free.shape[1] else None
            cost, slope = Z.T.dot(choice.H).dot(Z), Z.T.dot(choice.H.dot(forces) - choice.g)
            y = quick_optimum(cost, slope, A.dot(Z), left, self._weight, flat)
            if y is None:
                return forces if number else None
            # Along what is free these are one optimum of many: the next cost starts from it.
            forces, Z = forces + Z.dot(y), choice.free
            left = np.maximum(b - A.dot(forces), 0.0)
        return forces
