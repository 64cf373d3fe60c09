"""PosturePath: stances along a curve on the constraint manifold, with the curve's exact tangent.

`LateralPath` is the same for a search: its postures are solved when they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import (
    check_name,
    check_type,
    checked_tuple,
    finite_array,
    finite_number,
    read_only,
    whole_number,
)
from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.errors import (
    CopsenseError,
    InvalidInputError,
    UnknownNameError,
    UnreachablePostureError,
)
from copsense.freedom import check_com_moves, held_com_axes
from copsense.posture import PostureCost, contact_error, pull_back, solve_posture
from copsense.reach import SWEPT, check_within_reach
from copsense.stance import Stance, check_at_rest, check_stance

COM_COORDINATES = ("com_x", "com_y", "com_z")  # of the centre of mass in the world [m]
_MOST_POSTURES = 1_000_000  # of one sweep; more would fill the memory before they are done


# A value of a path's coordinate, and a stance to start from -> the posture there and its tangent.
PostureSolver = Callable[[float, Stance], tuple[Stance, Float[np.ndarray, " nv"]]]


@dataclass(frozen=True, eq=False, repr=False)
class PosturePath:
    """Stances along a curve on the constraint manifold, parametrised by a named coordinate.

    Attributes:
        stances: the postures, in order.
        coordinate: name of the coordinate, such as ``"com_y"`` or ``"l_hip_roll"``.
        unit: its unit, ``"m"``, ``"rad"`` or ``"1"``.
        values: the coordinate at each posture (N,).
        tangents: dq/dcoordinate at each posture (N, nv), with J t = 0.
        failures: index of a posture that could not be reached -> the reason; the stance kept
            there is the one that the path began with.
        solver: value of the coordinate, a stance to start from -> the posture there and its
            tangent, for `at`; None where the path is only a list of configurations.
    """

    stances: tuple[Stance, ...]
    coordinate: str
    unit: str
    values: Float[np.ndarray, " N"]
    tangents: Float[np.ndarray, "N nv"]
    failures: Mapping[int, str] = field(default_factory=dict)
    solver: PostureSolver | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Own the arrays and the reasons.

        Raises:
            InvalidInputError: no stance, or arrays of another size than stances and robot have.
        """
        remedy = "Give one or more stances, or make a path with copsense.lateral_sweep."
        stances = checked_tuple(self.stances, Stance, "stance", remedy)
        if not stances:
            raise InvalidInputError(f"a path holds no stance. {remedy}")
        object.__setattr__(self, "stances", stances)
        check_name(self.coordinate, "the coordinate of a path")
        check_name(self.unit, "the unit of a path")
        count, nv = len(stances), stances[0].robot.model.nv
        for name, shape in (("values", (count,)), ("tangents", (count, nv))):
            found = finite_array(getattr(self, name), f"the array of {name} of a path", shape)
            object.__setattr__(self, name, found)
        remedy = "Give the index of a posture -> why it was not reached."
        check_type(self.failures, Mapping, "a mapping of failures", remedy)
        freeze(self, "failures")

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.stances)

    def __iter__(self) -> Iterator[tuple[Stance, Float[np.ndarray, " nv"]]]:
        """Each stance with the path's tangent there."""
        return iter(zip(self.stances, self.tangents, strict=True))

    def __repr__(self) -> str:
        """Robot, coordinate, its range, and how many postures were not reached."""
        failed = f", {len(self.failures)} not reached" if self.failures else ""
        return (
            f"PosturePath({self.stances[0].robot.name!r}, {len(self)} postures, {self.coordinate} "
            f"from {self.values[0]:.4g} to {self.values[-1]:.4g} {self.unit}{failed})"
        )

    @property
    def continuous(self) -> bool:
        """Whether `at` gives the postures in between."""
        return self.solver is not None

    def at(self, value: float) -> tuple[Stance, Float[np.ndarray, " nv"]]:
        """The stance and the tangent at a value of the coordinate, exact there.

        Raises:
            UnreachablePostureError: no posture was found there.
            InvalidInputError: the path is a list of configurations, with nothing in between.
        """
        i = int(np.argmin(np.abs(self.values - value)))
        if self.values[i] == value:
            if i in self.failures:
                raise UnreachablePostureError(self.failures[i])
            return self.stances[i], self.tangents[i]
        if self.solver is None:
            raise InvalidInputError(
                f"the path is a list of configurations: it has no posture at {self.coordinate} = "
                f"{value:g}. Ask at one of its values, or make the path with lateral_sweep or "
                "joint_sweep."
            )
        known = [k for k in range(len(self)) if k not in self.failures]
        nearest = min(known, key=lambda k: abs(self.values[k] - value), default=i)
        return self.solver(value, self.stances[nearest])

    def reached(self) -> PosturePath:
        """The part around the middle posture that was reached, as far to one side as the other.

        Raises:
            UnreachablePostureError: the middle itself was not.
        """
        middle = len(self) // 2
        if middle in self.failures:
            raise UnreachablePostureError(self.failures[middle])
        far = min((abs(i - middle) for i in self.failures), default=len(self))
        part = slice(max(middle - far + 1, 0), middle + far)
        return replace(
            self,
            stances=self.stances[part],
            values=self.values[part],
            tangents=self.tangents[part],
            failures={},
        )

    def shifted(self, by: float) -> PosturePath:
        """The same path with `by` added to its coordinate."""
        solver = self.solver and _Shifted(self.solver, by)
        return replace(self, values=self.values + by, solver=solver)

    def joint_rates(self, joint: str) -> Float[np.ndarray, " N"]:
        """d joint / d coordinate at each posture (N,)."""
        return self.tangents[:, self.stances[0].robot.velocity_index(joint)]


def check_path(path: object, *, search: bool = False) -> None:
    """Reject what is not a path of postures.

    Args:
        path: what the caller gave.
        search: whether a `LateralPath` serves too.

    Raises:
        InvalidInputError: it is something else, such as a stance.
    """
    kinds = (PosturePath, LateralPath) if search else (PosturePath,)
    remedy = "Make one with copsense.lateral_sweep, joint_sweep or path_through."
    check_type(path, kinds, "a path of postures", remedy)


@one_blas_thread()
def lateral_sweep(
    stance: Stance,
    start: float,
    stop: float,
    count: int,
    *,
    com_x: float | None = None,
    cost: PostureCost | None = None,
    progress: Callable[[int], object] | None = None,
) -> PosturePath:
    """Sweep the centre of mass sideways: CoM y from `start` to `stop`, CoM x held, height free.

    Args:
        stance: the posture that every other stays nearest to.
        start: first world y of the centre of mass [m].
        stop: last world y [m].
        count: number of postures.
        com_x: world x where the CoM is held; default over the mean of the contacts (a planar
            robot has none to hold).
        cost: weights of the deviations from `stance`.
        progress: called with 1 after each posture.

    Returns:
        A path whose coordinate is ``com_y`` [m]. A posture out of reach is listed in
        `PosturePath.failures`.
    """
    held = {} if com_x is None else {"com_x": com_x}
    return com_sweep(stance, "com_y", start, stop, count, held=held, cost=cost, progress=progress)


def com_sweep(
    stance: Stance,
    coordinate: str,
    start: float,
    stop: float,
    count: int,
    *,
    held: Mapping[str, float] | None = None,
    cost: PostureCost | None = None,
    progress: Callable[[int], object] | None = None,
) -> PosturePath:
    """Sweep the centre of mass along a world axis.

    What is level and not swept is held over the mean of the contacts (or stays where it is, where
    they let no motion change it), the height is free.

    Args:
        stance: the posture that every other stays nearest to.
        coordinate: ``"com_x"``, ``"com_y"`` or ``"com_z"``.
        start: its first value, in the world [m].
        stop: its last [m].
        count: number of postures.
        held: coordinate -> where the CoM is held instead, or held as well [m]; or joint -> where
            it is held [rad, or m].
        cost: weights of the deviations from `stance`.
        progress: called with 1 after each posture.

    Returns:
        A path over the coordinate [m]. A posture out of reach is listed in `PosturePath.failures`.

    Raises:
        UnknownNameError: a coordinate of another name, or a joint that the robot has not.
        InvalidInputError: the coordinate is held as well as swept, a value is not a number, or a
            planar robot is to move out of its plane.
    """
    check_stance(stance)
    check_at_rest(stance, "a path of postures")
    if coordinate not in COM_COORDINATES:
        raise UnknownNameError("coordinate of the CoM", str(coordinate), COM_COORDINATES)
    fixed = _held(stance, coordinate, held)
    middle = np.mean([world.translation for world in stance.placements], axis=0)
    level = COM_COORDINATES[0 if stance.robot.base_nv == 6 else 1 : 2]
    fast = [COM_COORDINATES[axis] for axis in held_com_axes(stance)]
    for name in level:
        if name != coordinate and name not in fast:  # where contacts hold it, it stays
            fixed.setdefault(name, float(middle[COM_COORDINATES.index(name)]))
    values = _grid(start, stop, count)
    asked = [(coordinate, values[0]), (coordinate, values[-1])]
    asked += [(name, fixed[name]) for name in held or {} if name in COM_COORDINATES]
    for name, value in asked:
        away = float(value - middle[COM_COORDINATES.index(name)])
        check_within_reach(stance.robot, away, f"{name}, from the contacts,", SWEPT, value)
    axis = COM_COORDINATES.index(coordinate)
    check_com_moves(stance, axis)
    solver = _Along(stance, coordinate, fixed, cost)
    return _sweep(stance, coordinate, "m", values, float(stance.com[axis]), solver, progress)


def lateral_posture(
    stance: Stance, y: float, *, near: Stance | None = None
) -> tuple[Stance, Float[np.ndarray, " nv"]]:
    """The posture of a stance's lateral path at one CoM y, and dq/dy there.

    Args:
        stance: the posture that the path stays nearest to; its CoM x is held.
        y: world y of the CoM [m].
        near: where to start the search; default `stance`.
    """
    return _level(stance, "com_y")(y, near or stance)


def level_posture(
    stance: Stance, coordinate: str, value: float
) -> tuple[Stance, Float[np.ndarray, " nv"]]:
    """The same of a stance's path along either level axis of the CoM, the other one held.

    Args:
        stance: the posture that the path stays nearest to.
        coordinate: ``"com_x"`` or ``"com_y"``.
        value: of it, in the world [m].
    """
    return _level(stance, coordinate)(value, stance)


class LateralPath:
    """The lateral path of a stance for a search: CoM y to either side, CoM x held; or forwards.

    A posture is solved when it is asked for, and kept: analyses that share the path share them.

    Attributes:
        stance: the posture that every other stays nearest to, in the middle of the path.
        coordinate: ``"com_y"``, or ``"com_x"`` of a path forwards and back, CoM y held.
        values: of it where a search looks first (2 * samples + 1,), rising [m].
    """

    continuous = True

    def __init__(
        self, stance: Stance, reach: float = 0.15, samples: int = 15, *, coordinate: str = "com_y"
    ) -> None:
        """Lay out where to look; nothing is solved yet.

        Args:
            stance: where the path begins.
            reach: how far the path goes to either side [m].
            samples: postures to either side that a search looks at first.
            coordinate: along which level axis.

        Raises:
            InvalidInputError: no length, or no posture.
            UnknownNameError: another coordinate.
        """
        check_stance(stance)
        check_at_rest(stance, "a path of postures")
        reach = finite_number(reach, "the reach [m]", positive=True)
        check_within_reach(stance.robot, reach, "the reach of a path", SWEPT)
        samples = whole_number(samples, "the samples of a search")
        self.stance = stance
        steps = np.linspace(-reach, reach, 2 * samples + 1)
        self._solver = _level(stance, coordinate)
        self.coordinate: str = coordinate
        middle = float(stance.com[COM_COORDINATES.index(coordinate)])
        self.values: Float[np.ndarray, " p"] = read_only(middle + steps)
        self._found: dict[float, tuple[Stance, np.ndarray] | str] = {}

    def __repr__(self) -> str:
        """Robot, range, and how many postures are solved so far."""
        low, high = self.values[0], self.values[-1]
        return (
            f"LateralPath({self.stance.robot.name!r}, {self.coordinate} from {low:.4g} to "
            f"{high:.4g} m, {len(self._found)} postures solved so far)"
        )

    def __len__(self) -> int:
        """Number of postures that a search looks at first."""
        return len(self.values)

    def at(self, value: float) -> tuple[Stance, Float[np.ndarray, " nv"]]:
        """The stance and the tangent at a value of the coordinate [m].

        Raises:
            UnreachablePostureError: no posture was found there.
        """
        value = float(value)
        if value not in self._found:
            solved = [y for y, found in self._found.items() if not isinstance(found, str)]
            nearest = min(solved, key=lambda y: abs(y - value), default=None)
            near = self.stance if nearest is None else self._found[nearest][0]
            assert isinstance(near, Stance)
            try:
                self._found[value] = self._solver(value, near)
            except CopsenseError as error:
                self._found[value] = str(error)
        found = self._found[value]
        if isinstance(found, str):
            raise UnreachablePostureError(found)
        return found


@one_blas_thread()
def joint_sweep(
    stance: Stance,
    joint: str,
    start: float,
    stop: float,
    count: int,
    *,
    held: Mapping[str, float] | None = None,
    cost: PostureCost | None = None,
    progress: Callable[[int], object] | None = None,
) -> PosturePath:
    """Sweep one joint with the contacts in place, the rest staying nearest to `stance`.

    Args:
        stance: the posture that every other stays nearest to.
        joint: name of a one-degree-of-freedom joint.
        start: its first position [rad, or m for a prismatic joint].
        stop: its last position.
        count: number of postures.
        held: coordinate of the CoM [m], or another joint [rad, or m], -> where it is held.
        cost: weights of the deviations from `stance`.
        progress: called with 1 after each posture.

    Raises:
        InvalidInputError: the joint is held as well as swept, or a value is not a number.
        UnknownNameError: a joint is not in the model.
    """
    check_stance(stance)
    check_at_rest(stance, "a path of postures")
    robot = stance.robot
    now = robot.joint_position(stance.q, joint)
    fixed = _held(stance, joint, held)
    values = _grid(start, stop, count)
    for end in (values[0], values[-1]):
        robot.checked_position(joint, float(end))
    solver = _Along(stance, joint, fixed, cost)
    return _sweep(stance, joint, robot.joint_unit(joint), values, now, solver, progress)


@one_blas_thread()
def path_through(
    stance: Stance,
    configurations: Iterable[ArrayLike],
    *,
    project: bool = False,
    strict: bool = True,
) -> PosturePath:
    """Make a path of a list of configurations, parametrised by their index.

    A list has no tangent of its own. The one given is the central difference of the neighbours
    (one-sided at the ends), projected onto the admissible motions: exactly admissible, and as
    near to the curve's own tangent as the list is fine.

    Args:
        stance: says where the contacts are.
        configurations: the configurations (nq,), in order.
        project: move each onto the manifold instead of rejecting one that has moved a contact.
        strict: raise at a configuration that cannot be used; False lists it in
            `PosturePath.failures`.

    Raises:
        InvalidInputError: no configuration, a bad one, or one with a contact over 1e-9 away.
    """
    check_stance(stance)
    check_at_rest(stance, "a path of postures")
    stances: list[Stance] = []
    failures: dict[int, str] = {}
    check_type(configurations, Iterable, "a list of configurations", "Give one (nq,) each.")
    for number, q in enumerate(configurations):
        try:
            stances.append(_placed(stance, q, number, project=project))
        except CopsenseError as error:
            if strict:
                raise
            failures[number] = str(error)
            stances.append(stance)
    if not stances:
        raise InvalidInputError("the list of configurations is empty. Give at least one.")
    last = len(stances) - 1
    tangents = np.zeros((len(stances), stance.robot.model.nv))
    for i, here in enumerate(stances):
        a, b = max(i - 1, 0), min(i + 1, last)
        # A posture that failed is not used as a neighbour.
        a, b = (i if a in failures else a), (i if b in failures else b)
        secant = pin.difference(stance.robot.model, stances[a].q, stances[b].q) / max(b - a, 1)
        basis = here.admissible_motions
        tangents[i] = basis @ (basis.T @ secant)
    values = np.arange(len(stances), dtype=float)
    return PosturePath(tuple(stances), "index", "1", values, tangents, failures)


def _placed(stance: Stance, q: ArrayLike, number: int, *, project: bool) -> Stance:
    """A configuration of a list with the contacts in place, or an error that says its number."""
    found = stance.at(q, check=False)
    error = float(np.abs(contact_error(found, stance.placements)).max())
    if project:
        found = pull_back(found, stance.placements)
    elif error > 1e-9:
        raise InvalidInputError(
            f"configuration {number} has a contact {error:.2e} (m or rad) away from the "
            "stance's. Give configurations with the contacts in place, or project=True."
        )
    return stance.at(found.q)


def _held(stance: Stance, swept: str, held: Mapping[str, float] | None) -> dict[str, float]:
    """What a sweep holds, coordinates of the CoM and joints alike, checked."""
    robot, found = stance.robot, {}
    for name in (swept, *(held or {})):
        if name == "com_x" and robot.base_nv != 6:
            raise InvalidInputError(
                f"robot {robot.name!r} lives in a plane: its CoM has no x to choose. Sweep com_y "
                "or com_z."
            )
        if name not in COM_COORDINATES and name not in robot.dof_names:
            raise UnknownNameError(
                "coordinate of the CoM or joint", str(name), (*COM_COORDINATES, *robot.dof_names)
            )
    for name, value in (held or {}).items():
        if name == swept:
            raise InvalidInputError(f"{name} is both swept and held. Leave it out of held.")
        if name in COM_COORDINATES:
            found[name] = finite_number(value, f"{name} [m]")
        else:
            found[name] = robot.checked_position(name, value)
    return found


def _grid(start: float, stop: float, count: int) -> Float[np.ndarray, " N"]:
    start, stop = finite_number(start, "a sweep's start"), finite_number(stop, "a sweep's stop")
    try:
        whole = int(count)
        fits = whole == count and 1 <= whole <= _MOST_POSTURES
    except (TypeError, ValueError, OverflowError):
        fits = False
    if not fits:
        raise InvalidInputError(
            f"a sweep of {count} postures cannot be made. Give a count from 1 to {_MOST_POSTURES}."
        )
    return np.linspace(start, stop, whole)


@dataclass(frozen=True, eq=False)
class _Along:
    """Postures of a path; a class and not a closure, so that a path can be sent away.

    Attributes:
        stance: the posture that every other stays nearest to.
        coordinate: what varies, a coordinate of the CoM or a joint.
        held: coordinates and joints that do not -> where they are [m, rad].
        cost: weights of the deviations.
    """

    stance: Stance
    coordinate: str
    held: Mapping[str, float]
    cost: PostureCost | None

    def __post_init__(self) -> None:
        freeze(self, "held")

    def __call__(self, value: float, near: Stance) -> tuple[Stance, Float[np.ndarray, " nv"]]:
        asked = {**self.held, self.coordinate: value}
        x, y, z = (asked.get(name) for name in COM_COORDINATES)
        joints = {name: at for name, at in asked.items() if name not in COM_COORDINATES}
        found = solve_posture(
            near, com=(x, y, z), joints=joints, reference=self.stance.q, cost=self.cost
        )
        # Columns: the coordinates of the CoM that are asked for, then the joints.
        columns = [*(name for name in COM_COORDINATES if name in asked), *joints]
        return found.stance, found.tangents[:, columns.index(self.coordinate)]


def _level(stance: Stance, coordinate: str) -> _Along:
    """Postures of a level path: the other level coordinate held where the stance has it.

    Where contacts hold that one, it stays within rounding, and is not asked for as well.
    """
    if coordinate not in COM_COORDINATES[:2]:
        raise UnknownNameError("level coordinate of the CoM", coordinate, COM_COORDINATES[:2])
    other = 1 - COM_COORDINATES.index(coordinate)
    # A planar robot has no x to hold.
    level = stance.robot.base_nv == 6 and other not in held_com_axes(stance)
    held = {COM_COORDINATES[other]: float(stance.com[other])} if level else {}
    return _Along(stance, coordinate, held, None)


@dataclass(frozen=True, eq=False)
class _Shifted:
    """Postures of a path whose coordinate was shifted."""

    solver: PostureSolver
    by: float

    def __call__(self, value: float, near: Stance) -> tuple[Stance, Float[np.ndarray, " nv"]]:
        return self.solver(value - self.by, near)


def _sweep(
    stance: Stance,
    coordinate: str,
    unit: str,
    values: np.ndarray,
    now: float,
    solver: PostureSolver,
    progress: Callable[[int], object] | None,
) -> PosturePath:
    """Solve outwards from the value nearest to `now`, each posture started from its neighbour."""
    middle = int(np.argmin(np.abs(values - now)))
    found: dict[int, tuple[Stance, np.ndarray]] = {}
    failures: dict[int, str] = {}
    for order in (range(middle, len(values)), range(middle - 1, -1, -1)):
        near = found[middle][0] if middle in found else stance
        for i in order:
            try:
                found[i] = solver(float(values[i]), near)
                near = found[i][0]
            except CopsenseError as error:
                failures[i] = str(error)
            if progress:
                progress(1)
    unreached = (stance, np.zeros(stance.robot.model.nv))
    postures = [found.get(i, unreached) for i in range(len(values))]
    return PosturePath(
        tuple(here for here, _ in postures),
        coordinate,
        unit,
        values,
        np.array([tangent for _, tangent in postures]),
        dict(sorted(failures.items())),
        solver,
    )
