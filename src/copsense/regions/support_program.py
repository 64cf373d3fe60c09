"""SupportProgram: how far a point of the plane may lie in a direction, forces going along."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from jaxtyping import Float

from copsense.errors import InfeasibleError, InvalidInputError
from copsense.limits import LimitRows
from copsense.load_problem import LoadProblem
from copsense.qp import least_relaxation, linear_minimum

_NOTHING = 1e-9  # of the weight: conflicts of limits that rounding explains
_PROOF = 1e-10  # of the weight, or of a unit of z: what a linear program's solution may leave
_SHORTEST = 1e-3  # norm of a row under which it is not scaled up
_UNSOLVED = (
    "the linear program of a region could not be solved: its limits are too far apart in size. "
    "Bring them nearer to the robot's weight and torques."
)


class SupportProgram:
    """The feasible forces f and points z, as linear programs.

    With the balance ``base_map f - slope z = base_wrench`` solved by (f / weight, z) = x0 + N y,
    what remains is A y <= b with the limits, which z may move too, and |z| <= box.
    """

    def __init__(
        self,
        problem: LoadProblem,
        rows: LimitRows,
        weight: float,
        slope: Float[np.ndarray, "nb r"],
        torque_slope: Float[np.ndarray, "n r"] | None,
        box: float,
    ) -> None:
        """Solve the balance and scale the rows.

        Args:
            problem: the load where z is zero.
            rows: the limits.
            weight: what forces are measured by [N].
            slope: d base_wrench/dz.
            torque_slope: d torque_offset/dz; None for zero.
            box: how far z is followed along each of its axes.
        """
        r = slope.shape[1]
        A, bound = rows.over_forces(problem)
        self.names: tuple[str, ...] = rows.all_names
        # Of the torque rows s tau <= t, z moves tau_0.
        moved = np.zeros((len(A), r))
        if torque_slope is not None and len(rows.joint):
            moved[len(A) - len(rows.joint) :] = rows.sign[:, None] * torque_slope[rows.joint]
        E = np.hstack([problem.base_map, -slope / weight])
        self.x0: Float[np.ndarray, " v"] = np.linalg.lstsq(
            E, problem.base_wrench / weight, rcond=None
        )[0]
        self.N: Float[np.ndarray, "v z"] = scipy.linalg.null_space(E)
        self.r: int = r
        self.weight: float = weight
        cut = np.hstack([np.zeros((r, E.shape[1] - r)), np.eye(r)])
        full = np.vstack([np.hstack([A, moved / weight]), cut, -cut])
        self.scale: Float[np.ndarray, " k"] = np.maximum(np.linalg.norm(full, axis=1), _SHORTEST)
        self.A: Float[np.ndarray, "k z"] = np.ascontiguousarray(full @ self.N / self.scale[:, None])
        self.b: Float[np.ndarray, " k"] = (
            np.append(bound / weight, np.full(2 * r, box)) - full @ self.x0
        ) / self.scale

    def farthest(self, direction: Float[np.ndarray, " r"]) -> Float[np.ndarray, " r"]:
        """The feasible z that lies farthest along a direction.

        Raises:
            InfeasibleError: no forces within the limits, wherever z is.
        """
        cost = -direction @ self.N[-self.r :]
        y = linear_minimum(cost, self.A, self.b)
        if y is None:
            self._relax()
            y = linear_minimum(cost, self.A, self.b)
        if y is None:
            raise InvalidInputError(_UNSOLVED)
        return np.asarray(self.x0[-self.r :] + self.N[-self.r :] @ y)

    def _relax(self) -> None:
        """Relax the limits by what rounding takes, or report which are in conflict."""
        soft = 1.0 / self.scale
        soft[len(self.names) :] = 0.0  # the box is not one of the limits
        found = least_relaxation(self.A, self.b, soft)
        if found is None:
            raise InvalidInputError(_UNSOLVED)
        least, multipliers = found
        if least <= _NOTHING:
            self.b = self.b + (least + _PROOF) * soft
            return
        pressing = np.flatnonzero(multipliers > _NOTHING)
        names = dict.fromkeys(self.names[i] for i in pressing if i < len(self.names))
        raise InfeasibleError(least * self.weight, tuple(names))
