"""PosturePath: stances along a curve on the constraint manifold, with the curve's exact tangent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_number
from copsense.errors import CopsenseError, InvalidInputError
from copsense.posture import Posture, PostureCost, contact_error, pull_back, solve_posture
from copsense.stance import Stance

_MOST_POSTURES = 1_000_000  # of one sweep; more would fill the memory before they are done


@dataclass(frozen=True, eq=False)
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
    """

    stances: tuple[Stance, ...]
    coordinate: str
    unit: str
    values: Float[np.ndarray, " N"]
    tangents: Float[np.ndarray, "N nv"]
    failures: Mapping[int, str] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.stances)

    def joint_rates(self, joint: str) -> Float[np.ndarray, " N"]:
        """d joint / d coordinate at each posture (N,)."""
        return self.tangents[:, self.stances[0].robot.velocity_index(joint)]


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
    if com_x is None and stance.robot.base_nv == 6:
        com_x = float(np.mean([world.translation[0] for world in stance.placements]))
    if com_x is not None:
        com_x = finite_number(com_x, "com_x [m]")

    def request(y: float) -> dict[str, Any]:
        return {"com": (com_x, y, None), "cost": cost}

    values = _grid(start, stop, count)
    column = 0 if com_x is None else 1
    return _sweep(stance, "com_y", "m", values, float(stance.com[1]), request, column, progress)


def lateral_posture(
    stance: Stance, y: float, *, near: Stance | None = None
) -> tuple[Stance, Float[np.ndarray, " nv"]]:
    """The posture of a stance's lateral path at one CoM y, and dq/dy there.

    Args:
        stance: the posture that the path stays nearest to; its CoM x is held.
        y: world y of the CoM [m].
        near: where to start the search; default `stance`.
    """
    planar = stance.robot.base_nv != 6
    com = (None if planar else float(stance.com[0]), y, None)
    found = solve_posture(near or stance, com=com, reference=stance.q)
    return found.stance, found.tangents[:, 0 if planar else 1]


def joint_sweep(
    stance: Stance,
    joint: str,
    start: float,
    stop: float,
    count: int,
    *,
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
        cost: weights of the deviations from `stance`.
        progress: called with 1 after each posture.
    """
    robot = stance.robot
    now = robot.joint_position(stance.q, joint)

    def request(position: float) -> dict[str, Any]:
        return {"joints": {joint: position}, "cost": cost}

    return _sweep(
        stance, joint, robot.joint_unit(joint), _grid(start, stop, count), now, request, 0, progress
    )


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
        project: move each onto the manifold instead of refusing one that has moved a contact.
        strict: raise at a configuration that cannot be used; False lists it in
            `PosturePath.failures`.

    Raises:
        InvalidInputError: no configuration, a bad one, or one with a contact over 1e-9 away.
    """
    stances: list[Stance] = []
    failures: dict[int, str] = {}
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


def _grid(start: float, stop: float, count: int) -> Float[np.ndarray, " N"]:
    start, stop = finite_number(start, "a sweep's start"), finite_number(stop, "a sweep's stop")
    if int(count) != count or not 1 <= count <= _MOST_POSTURES:
        raise InvalidInputError(
            f"a sweep of {count} postures cannot be made. Give a count from 1 to {_MOST_POSTURES}."
        )
    return np.linspace(start, stop, int(count))


def _sweep(
    stance: Stance,
    coordinate: str,
    unit: str,
    values: np.ndarray,
    now: float,
    request: Callable[[float], dict[str, Any]],
    column: int,
    progress: Callable[[int], object] | None,
) -> PosturePath:
    """Solve outwards from the value nearest to `now`, each posture started from its neighbour."""
    middle = int(np.argmin(np.abs(values - now)))
    found: dict[int, Posture | str] = {}
    for order in (range(middle, len(values)), range(middle - 1, -1, -1)):
        near: Posture | None = None
        if order.start == middle - 1 and isinstance(found.get(middle), Posture):
            near = found[middle]  # type: ignore[assignment]
        for i in order:
            try:
                start = near.stance if near else stance
                near = solve_posture(start, reference=stance.q, **request(float(values[i])))
                found[i] = near
            except CopsenseError as error:
                found[i] = str(error)
            if progress:
                progress(1)
    stances, tangents, failures = [], [], {}
    for i in range(len(values)):
        result = found[i]
        if isinstance(result, Posture):
            stances.append(result.stance)
            tangents.append(result.tangents[:, column])
        else:
            failures[i] = result
            stances.append(stance)
            tangents.append(np.zeros(stance.robot.model.nv))
    return PosturePath(tuple(stances), coordinate, unit, values, np.array(tangents), failures)
