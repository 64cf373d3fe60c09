"""The region where some static equilibrium within limits exists."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InfeasibleError, InvalidInputError
from copsense.limits import Limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.regions.refinement import Point, refine
from copsense.regions.region import BOX, MERGE, ComRegion, region_between
from copsense.regions.weight_line import com_axes, gravity_slope
from copsense.stance import Stance
from copsense.statics.qp import least_relaxation, linear_minimum

FINEST = 1e-7  # m: tolerances below this ask more than the linear programs resolve
_NOTHING = 1e-9  # of the weight: conflicts of limits that rounding explains
_PROOF = 1e-10  # of the weight, or m: what a linear program's solution may leave
_SHORTEST = 1e-3  # norm of a row under which it is not scaled up
_UNSOLVED = (
    "the linear program of a region could not be solved: its limits are too far apart in size. "
    "Bring them nearer to the robot's weight and torques."
)


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
    """The feasible forces and CoM positions, as linear programs.

    With c = c0 + axes z the balance J_b' f - S axes z = G_b(c0) is solved by
    (f / weight, z) = x0 + N y, and what remains is A y <= b with the limits and |z| <= BOX.
    """

    def __init__(self, stance: Stance, limits: Limits, axes: Float[np.ndarray, "2 r"]) -> None:
        robot, r = stance.robot, axes.shape[1]
        nb, weight, load = robot.base_nv, robot.weight, LoadProblem.of(stance)
        all_rows = limit_rows(stance, limits)
        rows, bound = all_rows.over_forces(load)
        self.names = all_rows.all_names
        slope = np.zeros((len(load.base_wrench), r))  # joints without a motor feel no change
        slope[:nb] = gravity_slope(stance) @ axes / weight
        E = np.hstack([load.base_map, -slope])
        self.x0 = np.linalg.lstsq(E, load.base_wrench / weight, rcond=None)[0]
        self.N = scipy.linalg.null_space(E)
        self.c0, self.axes, self.weight = stance.com[:2], axes, weight
        box = np.hstack([np.zeros((r, E.shape[1] - r)), np.eye(r)])
        full = np.vstack([np.hstack([rows, np.zeros((len(rows), r))]), box, -box])
        self.scale = np.maximum(np.linalg.norm(full, axis=1), _SHORTEST)
        self.A = np.ascontiguousarray(full @ self.N / self.scale[:, None])
        self.b = (np.append(bound / weight, np.full(2 * r, BOX)) - full @ self.x0) / self.scale

    def farthest(self, direction: Point) -> Point:
        """A feasible CoM position (2,) [m] that lies farthest along a horizontal direction."""
        r = self.axes.shape[1]
        cost = -direction @ self.axes @ self.N[-r:]
        y = linear_minimum(cost, self.A, self.b)
        if y is None:
            self._relax()
            y = linear_minimum(cost, self.A, self.b)
        if y is None:
            raise InvalidInputError(_UNSOLVED)
        return np.asarray(self.c0 + self.axes @ (self.x0[-r:] + self.N[-r:] @ y))

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
