"""The region where some static equilibrium within limits exists."""

from __future__ import annotations

import numpy as np
import scipy.optimize
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InfeasibleError, InvalidInputError
from copsense.limits import Limits, limit_rows
from copsense.regions.balance import com_axes, gravity_slope
from copsense.regions.polygon import MERGE, Point, refine
from copsense.regions.region import BOX, ComRegion, region_between
from copsense.stance import Stance

FINEST = 1e-7  # m: tolerances below this ask more than the linear programs resolve
_NOTHING = 1e-9  # of the weight: conflicts of limits that rounding explains
_SHORTEST = 1e-3  # norm of a row under which it is not scaled up
_UNSOLVED = (
    "the linear program of a region could not be solved: its limits are too far apart in size. "
    "Bring them nearer to the robot's weight and torques."
)
_SOLVER = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def com_region(stance: Stance, limits: Limits, *, tolerance: float = 1e-4) -> ComRegion:
    """Where the CoM may be so that some static equilibrium within the limits exists.

    J, G_j and every contact stay at the stance's posture; see the module's text. The projection of
    all feasible (c, f) on c is refined between an inner and an outer polygon ([Bretl2008]), edge
    by edge, each by a linear program, until they are nowhere farther apart than the tolerance.
    Vertices of the inner one are vertices of the region, so that a region of few vertices comes
    out exact to the precision of the linear programs, some 1e-9 m.

    Args:
        stance: robot, posture and contacts; the contacts may be anywhere, walls included.
        limits: what the wrenches and torques must respect. Friction and soles only:
            ``torque=None``.
        tolerance: largest distance between the polygon and the region [m], `FINEST` at least.

    Raises:
        InfeasibleError: no equilibrium within the limits, wherever the CoM is; names the limits in
            conflict.
        InvalidInputError: a bad tolerance, or limits that do not fit the stance.
        UnknownNameError: a torque limit names no joint.
    """
    if finite_number(tolerance, "the tolerance [m]", positive=True) < FINEST:
        raise InvalidInputError(
            f"the tolerance is {tolerance:g} m, finer than linear programs resolve. Give "
            f"{FINEST:g} or more; vertices are exact where the region has few."
        )
    axes = com_axes(stance)
    problem = _Problem(stance, limits, axes)
    inner, outer = refine(problem.farthest, tolerance - 2 * MERGE)
    return region_between(stance, inner, outer, interval=axes.shape[1] == 1)


class _Problem:
    """The feasible forces and CoM positions, as linear programs over x = (f / weight, z).

    The CoM is c0 + axes z; |z| <= BOX.
    """

    def __init__(self, stance: Stance, limits: Limits, axes: Float[np.ndarray, "2 r"]) -> None:
        nb, weight = stance.robot.base_nv, stance.robot.weight
        self.axes, self.c0, self.weight = axes, stance.com[:2], weight
        A, b, self.names = _rows(stance, limits)
        m, r = len(stance.component_index), axes.shape[1]
        self.A = np.hstack([A, np.zeros((len(A), r))])
        self.b = b / weight
        # J_b' f - S axes z = G_b(c0)
        self.E = np.hstack([stance.jacobian[:, :nb].T, -gravity_slope(stance) @ axes / weight])
        self.e = stance.gravity[:nb] / weight
        self.bounds = [(None, None)] * m + [(-BOX, BOX)] * r
        self.scale = np.maximum(np.linalg.norm(A, axis=1), _SHORTEST)

    def farthest(self, direction: Point) -> Point:
        """A feasible CoM position (2,) [m] that lies farthest along a horizontal direction."""
        cost = np.zeros(self.A.shape[1])
        cost[-self.axes.shape[1] :] = -direction @ self.axes
        x = self._solve(cost)
        if x is None:
            self._relax()
            x = self._solve(cost)
        if x is None:
            raise InvalidInputError(_UNSOLVED)
        return np.asarray(self.c0 + self.axes @ x[-self.axes.shape[1] :])

    def _solve(self, cost: Float[np.ndarray, " v"]) -> Float[np.ndarray, " v"] | None:
        found = scipy.optimize.linprog(
            cost,
            self.A / self.scale[:, None],
            self.b / self.scale,
            self.E,
            self.e,
            self.bounds,
            method="highs-ds",
            options=_SOLVER,
        )
        return found.x if found.status == 0 else None

    def _relax(self) -> None:
        """Give way by what rounding takes, or say which limits are in conflict.

        minimise s subject to A f - s <= b: the least amount by which each limit gives way.
        """
        k, v = self.A.shape
        found = scipy.optimize.linprog(
            np.append(np.zeros(v), 1.0),
            np.hstack([self.A, -np.ones((k, 1))]),
            self.b,
            np.hstack([self.E, np.zeros((len(self.E), 1))]),
            self.e,
            [*self.bounds, (0, None)],
            method="highs-ds",
            options=_SOLVER,
        )
        if found.status != 0:
            raise InvalidInputError(_UNSOLVED)
        if found.fun <= _NOTHING:
            self.b = self.b + found.fun + _SOLVER["primal_feasibility_tolerance"]
            return
        pressing = np.flatnonzero(found.ineqlin.marginals < -_NOTHING)
        raise InfeasibleError(
            float(found.fun) * self.weight, tuple(dict.fromkeys(self.names[i] for i in pressing))
        )


def _rows(
    stance: Stance, limits: Limits
) -> tuple[Float[np.ndarray, "r m"], Float[np.ndarray, " r"], tuple[str, ...]]:
    """The limits as A f <= b over stacked forces, torques included, and what each row limits."""
    rows, nb = limit_rows(stance, limits), stance.robot.base_nv
    joints = np.flatnonzero(np.isfinite(rows.torque))
    Jj, Gj = stance.jacobian[:, nb:][:, joints].T, stance.gravity[nb:][joints]
    # s tau <= t for s = +1, -1, with tau = G_j - J_j' f: -s J_j' f <= t - s G_j.
    t = rows.torque[joints]
    A = np.vstack([rows.matrix, -Jj, Jj])
    b = np.concatenate([rows.bound, t - Gj, t + Gj])
    names = tuple(f"torque of {stance.robot.torque_names[i]}" for i in joints)
    return A, b, rows.names + names + names
