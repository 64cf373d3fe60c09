"""Pushes: the horizontal forces at a point of a robot that its contacts can still answer at rest.

A push F at a frame takes J_e' F off the balance. Under a criterion the forces are affine in F, and
so are the rows of the limits, r_i . F <= s_i: its own pushes are their intersection, the largest
along u is ``min s_i / (r_i . u)+`` and the least of all directions ``min s_i / |r_i|``, across the
row that yields. What any equilibrium within the limits can answer is the projection of a
polyhedron, found by linear programs as a region of the CoM is.

The push is slow, the posture is held, and what is pushed stands still: how far a robot that steps,
leans or moves its arms can be pushed is another question.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, read_only
from copsense.blas import one_blas_thread
from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.loads import Load, apply_loads
from copsense.polygon import Polygon
from copsense.regions.refinement import refine
from copsense.regions.support_program import SupportProgram
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.statics import named_criteria, share_load, with_tie_breaks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ANY = "any equilibrium"
LARGEST = 10.0  # weights: pushes are followed this far
_FINE = 1e-4  # of the weight: how far the polygon of any equilibrium may lie inside the truth
_MERGE = 1e-7  # of the weight: vertices nearer to the line of their neighbours are left out
_STILL = 1e-9  # of a row's size: what rounding leaves of one that no push moves


@dataclass(frozen=True, eq=False, repr=False)
class PushRegion(ShortRepr):
    """The horizontal pushes that one way of sharing the load can answer.

    Attributes:
        name: of the criterion, or ``"any equilibrium"``.
        polygon: vertices (k, 2) of the set of pushes, world x and y [N]; none where the limits are
            broken without any push.
        first: what yields first across each edge (k,), such as ``"l_sole: CoP at the -x (back)
            edge"``; empty strings where it is not known.
    """

    name: str
    polygon: Float[np.ndarray, "k 2"]
    first: tuple[str, ...]

    def __post_init__(self) -> None:
        """Own the vertices."""
        object.__setattr__(self, "polygon", self._outline.vertices)

    @cached_property
    def _outline(self) -> Polygon:
        return Polygon(self.polygon)

    @property
    def stands(self) -> bool:
        """Whether the limits hold without any push."""
        return len(self._outline) > 2 and bool(self._outline.margins(np.zeros(2)) >= 0)

    def largest(self, direction: ArrayLike) -> float:
        """The largest push along a horizontal direction [N].

        Args:
            direction: (2,) world x, y; of any length.
        """
        u = finite_array(direction, "the direction of a push", (2,), "world x, y")
        length = float(np.linalg.norm(u))
        if not length > 0:
            raise InvalidInputError("the direction of a push is zero. Give world x and y.")
        return self._crossing(u / length)[0]

    def limited_by(self, direction: ArrayLike) -> str:
        """What limits the largest push along a direction; empty where it is not known."""
        u = finite_array(direction, "the direction of a push", (2,), "world x, y")
        edge = self._crossing(u / max(float(np.linalg.norm(u)), 1e-300))[1]
        return self.first[edge] if edge >= 0 else ""

    @cached_property
    def weakest(self) -> tuple[float, float, str]:
        """The least push that cannot be answered [N], its world direction [rad], what yields."""
        if not self.stands:
            return 0.0, 0.0, ""
        edge = int(np.argmin(self._outline.offsets))
        x, y = self._outline.normals[edge]
        return float(self._outline.offsets[edge]), float(np.arctan2(y, x)), self.first[edge]

    def _crossing(self, u: Float[np.ndarray, " 2"]) -> tuple[float, int]:
        if not self.stands:
            return 0.0, -1
        speed = self._outline.normals @ u
        ahead = speed > 1e-12
        reach = np.where(ahead, self._outline.offsets / np.where(ahead, speed, 1.0), np.inf)
        edge = int(reach.argmin())
        return float(reach[edge]), edge

    def to_dict(self) -> dict[str, Any]:
        """Plain data: the polygon, and the weakest direction."""
        force, angle, limited_by = self.weakest
        return {
            "polygon": self.polygon.tolist(),
            "weakest": {"force": force, "direction": angle, "limited_by": limited_by},
        }


@dataclass(frozen=True, eq=False, repr=False)
class Pushes(ShortRepr):
    """The largest pushes at a point of a robot that stands still.

    Attributes:
        stance: the stance.
        frame: what is pushed.
        point: where, in the world (3,) [m].
        limits: what must be respected.
        any: what some equilibrium within the limits can answer.
        criteria: what each criterion answers by its own wrenches, which no QP clips.
        notes: what to know about it, such as a tie-break that a criterion was given.
    """

    stance: Stance
    frame: str
    point: Float[np.ndarray, " 3"]
    limits: Limits
    any: PushRegion
    criteria: tuple[PushRegion, ...]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the array."""
        freeze(self, "point")

    @property
    def regions(self) -> tuple[PushRegion, ...]:
        """The set of any equilibrium, then those of the criteria."""
        return (self.any, *self.criteria)

    def to_dict(self) -> dict[str, Any]:
        """Plain data: forces [N], directions [rad], lengths [m]."""
        return {
            "robot": self.stance.robot.name,
            "frame": self.frame,
            "point": self.point.tolist(),
            "limits": self.limits.to_dict(),
            "regions": {region.name: region.to_dict() for region in self.regions},
            "notes": list(self.notes),
        }

    def plot(self) -> Figure:
        """A polar picture of the pushes, by direction."""
        from copsense.plots import plot_pushes

        figure = plot_pushes(self).get_figure(root=True)
        assert figure is not None
        return figure

    def __str__(self) -> str:
        """A table: along each axis, and the weakest direction."""
        x, y, z = self.point
        lines = [
            f"pushes on {self.frame} of {self.stance.robot.name} at ({x:.3f}, {y:.3f}, {z:.3f}) m, "
            "posture held, slowly; in N",
            f"{'':26} {'+x':>7} {'-x':>7} {'+y':>7} {'-y':>7} {'weakest':>9}  towards",
        ]
        for region in self.regions:
            along = [region.largest(u) for u in ((1, 0), (-1, 0), (0, 1), (0, -1))]
            force, angle, limited_by = region.weakest
            told = f"{_degrees(angle):+5d} deg" if region.stands else "does not stand"
            told += f": {limited_by}" if limited_by else ""
            numbers = " ".join(f"{value:7.1f}" for value in along)
            lines.append(f"{region.name:26} {numbers} {force:9.1f}  {told}")
        return "\n".join(lines)


def _degrees(angle: float) -> int:
    """A direction in whole degrees, each by one name: neither -0 nor -180."""
    return 180 - (180 - round(math.degrees(angle))) % 360


@one_blas_thread()
def push_limits(
    stance: Stance,
    frame: str | None = None,
    criteria: Sequence[Criterion] = (),
    limits: Limits | None = None,
    *,
    point: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Pushes:
    """The largest slow horizontal pushes at a point of a robot, by direction.

    Args:
        stance: robot, posture and contacts; loads on it stay.
        frame: name of the frame that is pushed; default the robot's base.
        criteria: ways of sharing the load to compare.
        limits: what must be respected; default ``Limits()``: contacts that do not pull or slip,
            centres of pressure in their soles.
        point: where in the frame the push acts [m].

    Raises:
        UnknownNameError: no such frame.
        InfeasibleError: no equilibrium within the limits even without a push.
        UndeterminedWrenchError: a criterion leaves several wrenches equally good.
        InvalidInputError: the robot lives in a plane, or limits that do not fit the stance.
    """
    check_stance(stance)
    check_at_rest(stance, "a slow push")
    robot = stance.robot
    given = named_criteria(criteria, "a comparison of pushes", policies=False)
    chosen, tied = with_tie_breaks([stance], given)
    if robot.base_nv != 6:
        raise InvalidInputError(
            f"robot {robot.name!r} lives in a plane: it cannot be pushed out of it. Use a robot "
            "with a free-floating base."
        )
    frame = robot.base_frame if frame is None else frame
    within = Limits() if limits is None else limits
    rows, problem = limit_rows(stance, within), LoadProblem.of(stance)
    slope, torque_slope, where = _taken(stance, frame, point)
    own = tuple(
        _criterion_pushes(stance, criterion, rows, problem, slope, torque_slope)
        for criterion in chosen.values()
    )
    best = _any_pushes(robot.weight, rows, problem, slope, torque_slope)
    notes = (*robot.notes, *tied)
    return Pushes(stance, frame, read_only(where.copy()), within, best, own, notes)


def _any_pushes(
    weight: float,
    rows: LimitRows,
    problem: LoadProblem,
    slope: Float[np.ndarray, "nb 2"],
    torque_slope: Float[np.ndarray, "n 2"],
) -> PushRegion:
    """What some equilibrium can answer; in weights while the programs run."""
    program = SupportProgram(problem, rows, weight, slope * weight, torque_slope * weight, LARGEST)
    inner, _ = refine(program.farthest, _FINE)
    polygon = Polygon.merged(inner, _MERGE).vertices * weight
    return PushRegion(ANY, polygon, ("",) * len(polygon))


@one_blas_thread()
def push_planes(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    frame: str,
    point: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[Float[np.ndarray, "r 2"], Float[np.ndarray, " r"]]:
    """The half-planes n . F <= b of slow horizontal pushes F that a criterion's wrenches answer.

    Args:
        stance: robot, posture and contacts.
        criterion: what shares the load.
        limits: what must be respected.
        frame: name of the frame that is pushed.
        point: where in the frame [m].

    Returns:
        n (r, 2) and b (r,) [N], in the rows of `limit_rows`; n is zero where no push matters.
    """
    rows, problem = limit_rows(stance, limits), LoadProblem.of(stance)
    slope, torque_slope, _ = _taken(stance, frame, point)
    return _planes(stance, criterion, rows, problem, slope, torque_slope)


def _taken(
    stance: Stance, frame: str, point: tuple[float, float, float]
) -> tuple[Float[np.ndarray, "nb 2"], Float[np.ndarray, "n 2"], Float[np.ndarray, " 3"]]:
    """What a newton along world x and y takes off the balance, and where it acts [m]."""
    robot = stance.robot
    unit = [
        apply_loads([Load(frame, tuple(e), point=point)], robot, stance.q) for e in np.eye(3)[:2]
    ]
    taken = robot.by_drive(np.column_stack([each.balanced for each in unit]))
    nb = robot.unactuated_nv
    return -taken[:nb], -taken[nb:], unit[0].points[0]


def _planes(
    stance: Stance,
    criterion: Criterion,
    rows: LimitRows,
    problem: LoadProblem,
    slope: Float[np.ndarray, "nb 2"],
    torque_slope: Float[np.ndarray, "n 2"],
) -> tuple[Float[np.ndarray, "r 2"], Float[np.ndarray, " r"]]:
    weight = stance.robot.weight

    def share(push: Float[np.ndarray, " 2"]) -> np.ndarray:
        return share_load(
            stance,
            criterion,
            replace(
                problem,
                base_wrench=problem.base_wrench + slope @ push,
                torque_offset=problem.torque_offset + torque_slope @ push,
            ),
        )[0]

    # A push of the weight along each axis gives the slopes without rounding to speak of.
    f0 = share(np.zeros(2))
    F = np.column_stack([share(weight * e) - f0 for e in np.eye(2)]) / weight
    A, bound = rows.over_forces(problem)
    normals, offsets = A @ F, bound - A @ f0
    joint = rows.joint
    if len(joint):
        normals[len(A) - len(joint) :] += rows.sign[:, None] * torque_slope[joint]
    size = np.linalg.norm(normals, axis=1)
    normals[size <= _STILL * np.maximum(np.linalg.norm(A, axis=1), 1.0)] = 0.0
    return normals, offsets


def _criterion_pushes(
    stance: Stance,
    criterion: Criterion,
    rows: LimitRows,
    problem: LoadProblem,
    slope: Float[np.ndarray, "nb 2"],
    torque_slope: Float[np.ndarray, "n 2"],
) -> PushRegion:
    """What a criterion's own wrenches answer: an intersection of half-planes."""
    weight = stance.robot.weight
    normals, offsets = _planes(stance, criterion, rows, problem, slope, torque_slope)
    size = np.linalg.norm(normals, axis=1)
    still = size == 0
    corners = LARGEST * weight * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if np.any(offsets[still] < -_STILL * weight):
        corners = corners[:0]
    left = Polygon(corners).within(normals[~still], offsets[~still])
    left = Polygon.merged(left.vertices, _MERGE * weight)
    # Which row each edge of the intersection is.
    names = np.array(rows.all_names, dtype=object)[~still]
    units, reach = normals[~still] / size[~still, None], offsets[~still] / size[~still]
    first = []
    for n, offset in zip(left.normals, left.offsets, strict=True) if len(left) > 2 else ():
        miss = np.hypot(*(units - n).T) + np.abs(reach - offset) / weight
        best = int(miss.argmin())
        first.append(str(names[best]) if miss[best] < 1e-6 else "")
    return PushRegion(criterion.name, left.vertices, tuple(first))
