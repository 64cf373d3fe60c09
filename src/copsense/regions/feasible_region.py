"""The region where some static equilibrium within limits exists."""

from __future__ import annotations

import numpy as np

from copsense.arrays import finite_number
from copsense.blas import one_blas_thread
from copsense.errors import InvalidInputError
from copsense.limits import Limits, check_limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.magnitudes import in_metres
from copsense.reach import robot_reach
from copsense.regions.refinement import Point, refine
from copsense.regions.region import BOX, MERGE, ComRegion, region_between
from copsense.regions.support_program import SupportProgram
from copsense.regions.weight_line import com_axes, gravity_slope
from copsense.stance import Stance, check_stance

FINEST = 1e-7  # m: tolerances below this ask more than the linear programs resolve


@one_blas_thread()
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
    check_stance(stance)
    check_limits(limits)
    if finite_number(tolerance, "the tolerance [m]", positive=True) < FINEST:
        raise InvalidInputError(
            f"the tolerance is {tolerance:g} m, finer than linear programs resolve. Give "
            f"{FINEST:g} or more; vertices are exact where the region has few."
        )
    if tolerance > robot_reach(stance.robot) / 10:
        raise InvalidInputError(
            f"the tolerance is {tolerance:g} m, coarser than a region of {stance.robot.name!r} is "
            f"wide. {in_metres(tolerance)}"
        )
    axes, load = com_axes(stance), LoadProblem.of(stance)
    slope = np.zeros((len(load.base_wrench), axes.shape[1]))
    # Joints without a motor stand among the base's rows and feel no change.
    slope[: stance.robot.base_nv] = gravity_slope(stance) @ axes
    rows, weight = limit_rows(stance, limits), stance.robot.weight
    program = SupportProgram(load, rows, weight, slope, None, BOX)

    def farthest(direction: Point) -> Point:
        return np.asarray(stance.com[:2] + axes @ program.farthest(direction @ axes))

    inner, outer = refine(farthest, tolerance - 2 * MERGE)
    return region_between(stance, inner, outer, interval=axes.shape[1] == 1)
