"""Load: a known force of the environment on a robot, beside its weight and its contacts.

A wrench w at a point takes J' w off what the torques and contacts must balance, N = G - J' w. How
that changes with the posture depends on what the wrench is fixed to.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import check_name, finite_array, owned, read_only
from copsense.content import FrozenMapping, ShortRepr
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.magnitudes import MagnitudeWarning, in_metres
from copsense.reach import robot_reach
from copsense.rigid_body import Attachment
from copsense.robot import Robot

FIXED_TO = ("world", "body")
Vector = tuple[float, float, float]
_WEIGHTS = 20.0  # of a robot, from which a force on it is doubted
_LEVERS = 5.0  # times weight and reach, from which a moment is


@dataclass(frozen=True)
class Load:
    """A known wrench on the robot at a point of a link.

    Attributes:
        frame: name of the frame in the robot's model.
        force: (3,) [N].
        moment: about the point (3,) [Nm].
        point: where it acts, in the frame [m].
        fixed_to: ``"world"``: force and moment are in world axes and keep their directions;
            ``"body"``: they are in the frame's axes and turn with the link.
        name: how it is called in results; default the frame's name.
    """

    frame: str
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)
    fixed_to: Literal["world", "body"] = "world"
    name: str = ""

    def __post_init__(self) -> None:
        """Check every field."""
        _own(self, {"force": "[N]", "moment": "[Nm]", "point": "[m]"})
        if self.fixed_to not in FIXED_TO:
            raise UnknownNameError("reference of a load", str(self.fixed_to), FIXED_TO)


@dataclass(frozen=True)
class SpringLoad:
    """A rope or a handrail that yields: force F - K (p - p0) on the robot, in world axes.

    Attributes:
        frame: name of the frame in the robot's model.
        anchor: p0, where it pulls with `force` (3,), in the world [m].
        stiffness: K along the world's x, y and z (3,) [N/m].
        force: F, at the anchor (3,) [N].
        point: p, where it acts, in the frame [m].
        name: how it is called in results; default the frame's name.
    """

    frame: str
    anchor: Vector
    stiffness: Vector
    force: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        """Check every field."""
        _own(self, {"anchor": "[m]", "stiffness": "[N/m]", "force": "[N]", "point": "[m]"})
        if min(self.stiffness) < 0:
            raise InvalidInputError(
                f"the stiffness of load {self.name!r} is {self.stiffness}. Give three numbers that "
                "are not negative [N/m]."
            )


AnyLoad = Load | SpringLoad


@dataclass(frozen=True, eq=False, repr=False)
class AppliedLoads(ShortRepr):
    """Loads on a robot at a configuration.

    Attributes:
        balanced: sum J' w, what they take off the balance (nv,) [N, Nm].
        wrenches: world axes, about each point (k, 6) [N, Nm].
        points: where they act, in the world (k, 3) [m].
        forces: joint of the model -> spatial force in the joint's axes.
        derivative: what the derivative of N = G - sum J' w has beside that of forces that turn
            with their joints (nv, nv).
    """

    balanced: Float[np.ndarray, " nv"]
    wrenches: Float[np.ndarray, "k 6"]
    points: Float[np.ndarray, "k 3"]
    forces: Mapping[int, pin.Force]
    derivative: Float[np.ndarray, "nv nv"]


def known_loads(loads: Iterable[AnyLoad]) -> tuple[AnyLoad, ...]:
    """Loads as a tuple, one alone among them.

    Raises:
        InvalidInputError: something else is among them.
    """
    alone = isinstance(loads, Load | SpringLoad | str) or not isinstance(loads, Iterable)
    given: tuple[AnyLoad, ...] = (loads,) if alone else tuple(loads)  # type: ignore[assignment]
    for load in given:
        if not isinstance(load, Load | SpringLoad):
            raise InvalidInputError(
                f"{load!r} is not a load. Give copsense.Load(frame, force) or SpringLoad(...)."
            )
    return given


def apply_loads(
    loads: Sequence[AnyLoad], robot: Robot, q: Float[np.ndarray, " nq"]
) -> AppliedLoads:
    """What loads do to a robot at a configuration.

    Raises:
        UnknownNameError: a load's frame is not in the model.
    """
    attachments = load_places(loads, robot)
    places, local = rigid_body.place(robot, q, attachments)
    nv = robot.model.nv
    balanced, derivative = np.zeros(nv), np.zeros((nv, nv))
    wrenches = np.zeros((len(loads), 6))
    forces: dict[int, pin.Force] = {}
    for k, (load, here) in enumerate(zip(loads, places, strict=True)):
        R, J = here.rotation, local[k]
        wrenches[k] = load_wrench(load, here)
        if isinstance(load, SpringLoad):
            across = R @ J[:3]
            derivative += across.T @ (np.array(load.stiffness)[:, None] * across)
        own = np.concatenate([R.T @ wrenches[k, :3], R.T @ wrenches[k, 3:]])
        balanced += J.T @ own
        if isinstance(load, SpringLoad) or load.fixed_to == "world":
            derivative -= turning(J, own)
        joint, placement = attachments[k]
        rigid_body.add_force(forces, joint, placement.act(pin.Force(own)))
    points = np.array([here.translation for here in places]).reshape(-1, 3)
    return AppliedLoads(
        read_only(balanced),
        read_only(wrenches),
        owned(points),
        FrozenMapping(forces),
        read_only(derivative),
    )


def doubt_loads(loads: Sequence[AnyLoad], applied: AppliedLoads, robot: Robot) -> None:
    """Warn of loads that no robot carries, and that another unit may explain."""
    reach = robot_reach(robot)
    for load, wrench in zip(loads, applied.wrenches, strict=True):
        force, moment = (float(np.linalg.norm(part)) for part in (wrench[:3], wrench[3:]))
        away = float(np.linalg.norm(load.point))
        said = []
        if force > _WEIGHTS * robot.weight:
            said.append(
                f"its force is {force:.4g} N, {force / robot.weight:.3g} times the weight of "
                f"{robot.name!r}. Forces are in newtons"
                + (
                    ", its anchor in metres, its stiffness in N/m."
                    if isinstance(load, SpringLoad)
                    else "."
                )
            )
        if moment > _LEVERS * robot.weight * reach:
            said.append(
                f"its moment is {moment:.4g} Nm, {moment / robot.weight:.3g} m times the weight of "
                f"{robot.name!r}. Moments are in Nm."
            )
        if away > 2 * reach:
            said.append(
                f"it acts {away:.4g} m from its frame, and {robot.name!r} reaches {reach:.2g} m. "
                f"{in_metres(away)}"
            )
        for each in said:
            warnings.warn(f"load {load.name!r}: {each}", MagnitudeWarning, stacklevel=3)


def load_places(loads: Sequence[AnyLoad], robot: Robot) -> list[Attachment]:
    """Where loads act on a robot.

    Raises:
        UnknownNameError: a load's frame is not in the model.
    """
    found = []
    for load in loads:
        frame = robot.frame(load.frame)
        place = frame.placement * pin.SE3(np.eye(3), np.array(load.point))
        found.append(Attachment(int(frame.parentJoint), place))
    return found


def load_wrench(load: AnyLoad, place: pin.SE3) -> Float[np.ndarray, " 6"]:
    """Wrench of a load about the point where it acts, in world axes [N, Nm].

    Args:
        load: the load.
        place: of that point and its frame's axes in the world.
    """
    if isinstance(load, SpringLoad):
        stretch = place.translation - np.array(load.anchor)
        force = np.array(load.force) - np.array(load.stiffness) * stretch
        return np.concatenate([force, np.zeros(3)])
    if load.fixed_to == "world":
        return np.concatenate([load.force, load.moment])
    R = place.rotation
    return np.concatenate([R @ np.array(load.force), R @ np.array(load.moment)])


def turning(
    local: Float[np.ndarray, "6 nv"], wrench: Float[np.ndarray, " 6"]
) -> Float[np.ndarray, "nv nv"]:
    """J_l' [F]x J_a + J_a' [m]x J_a: what a wrench that turns with its link has too much.

    Pinocchio turns forces with their joints; of one that is fixed in the world this is taken away.

    Args:
        local: Jacobian of the point in its link's axes, linear then angular.
        wrench: force and moment in the same axes.
    """
    linear, angular = local[:3], local[3:]
    found = linear.T @ pin.skew(wrench[:3]) @ angular
    if wrench[3:].any():
        found = found + angular.T @ pin.skew(wrench[3:]) @ angular
    return np.asarray(found)


def _own(load: AnyLoad, vectors: dict[str, str]) -> None:
    """Name a load and own its vectors."""
    if not isinstance(load.frame, str) or not load.frame:
        raise InvalidInputError("a load needs the frame it acts on. Give the name of a frame.")
    object.__setattr__(load, "name", load.name or load.frame)
    check_name(load.name, "the name of a load")
    for name, unit in vectors.items():
        what = f"the {name} of load {load.name!r}"
        vector = finite_array(getattr(load, name), what, (3,), f"x, y, z {unit}")
        object.__setattr__(load, name, tuple(float(c) for c in vector))
