"""Disturbances: pushes, imperfect motors, noisy sensors and other ground, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import check_name, check_type, finite_array, finite_number
from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.magnitudes import doubt_payload
from copsense.robot import Robot
from copsense.stance import Stance


@dataclass(frozen=True)
class Push:
    """A constant force on a link for a while.

    Attributes:
        force: world axes (3,) [N].
        start: when it begins [s].
        duration: how long it lasts [s].
        frame: the frame of the robot at whose origin it acts; default the base's own frame.
    """

    force: tuple[float, float, float]
    start: float = 0.5
    duration: float = 0.1
    frame: str = "root_joint"

    def __post_init__(self) -> None:
        """Validate force, start and duration."""
        force = finite_array(self.force, "the force of a push", (3,), "world x, y, z [N]")
        object.__setattr__(self, "force", tuple(float(c) for c in force))
        check_name(self.frame, "the frame of a push")
        finite_number(self.duration, "the duration of a push [s]", positive=True)
        if finite_number(self.start, "the start of a push [s]") < 0:
            raise InvalidInputError(f"a push starts at {self.start} s. Give 0 or more.")

    @property
    def impulse(self) -> float:
        """Size of force times duration [N s]."""
        return float(np.linalg.norm(self.force)) * self.duration

    def share(self, time: float, step: float) -> float:
        """Share of a step during which the push acts, so that the steps add up to its impulse.

        Args:
            time: when the step begins [s].
            step: how long it lasts [s].
        """
        end = min(time + step, self.start + self.duration)
        return round(max(0.0, end - max(time, self.start)) / step, 9)


@dataclass(frozen=True)
class Motors:
    """Imperfect motors, between the commanded torques and those applied.

    Attributes:
        delay: [s]; a command takes effect this much later.
        bandwidth: of a first-order low-pass [Hz], or None for immediate torques.
        limit: greatest torque of every joint [Nm], joint -> limit (others unlimited),
            ``"model"`` for `Robot.effort_limits`, or None.
    """

    delay: float = 0.0
    bandwidth: float | None = None
    limit: float | Mapping[str, float] | str | None = None

    def __post_init__(self) -> None:
        """Validate delay and bandwidth; limits are owned here and validated with the robot."""
        if self.limit is not None and not isinstance(self.limit, str | Mapping):
            finite_number(self.limit, "the torque limit [Nm]", positive=True)
        freeze(self, "limit")
        if not 0 <= finite_number(self.delay, "the delay of the motors [s]") <= 1:
            raise InvalidInputError(
                f"the delay of the motors is {self.delay} s. Give a time from 0 to 1."
            )
        if self.bandwidth is not None:
            finite_number(self.bandwidth, "the bandwidth of the motors [Hz]", positive=True)

    def limits(self, robot: Robot) -> Float[np.ndarray, " n"]:
        """Greatest torque of each joint (n,), infinite where there is no limit.

        Raises:
            UnknownNameError: a joint is not the robot's.
            InvalidInputError: a limit is not positive.
        """
        names, limit = robot.torque_names, self.limit
        if limit is None:
            return np.full(len(names), np.inf)
        if isinstance(limit, str):
            if limit != "model":
                raise UnknownNameError("torque limit", limit, ("model",), "Or give numbers.")
            return robot.effort_limits
        if isinstance(limit, Mapping):
            for joint, value in limit.items():
                if joint not in names:
                    raise UnknownNameError(
                        f"joint in the torque limits of robot {robot.name!r}", joint, names
                    )
                finite_number(value, f"the torque limit of joint {joint!r}", positive=True)
            return np.array([float(limit.get(joint, np.inf)) for joint in names])
        return np.full(len(names), finite_number(limit, "the torque limit [Nm]", positive=True))


@dataclass(frozen=True)
class Noise:
    """Gaussian noise of the sensors. The base is known exactly, or estimated by odometry.

    Attributes:
        position: standard deviation of joint positions [rad, m].
        velocity: standard deviation of joint velocities [rad/s, m/s].
        force: standard deviation of measured contact forces [N].
        moment: standard deviation of measured contact moments [Nm].
    """

    position: float = 0.0
    velocity: float = 0.0
    force: float = 0.0
    moment: float = 0.0

    def __post_init__(self) -> None:
        """Validate the standard deviations."""
        for name in ("position", "velocity", "force", "moment"):
            if finite_number(getattr(self, name), f"the {name} noise") < 0:
                raise InvalidInputError(
                    f"the {name} noise is {getattr(self, name)}. Give a standard deviation, 0 or "
                    "more."
                )


@dataclass(frozen=True)
class FrictionChange:
    """A new friction of the ground from some time on.

    Attributes:
        friction: Coulomb coefficient from then on.
        start: [s].
        contact: name of the contact whose ground changes; default all.
    """

    friction: float
    start: float = 0.0
    contact: str | None = None

    def __post_init__(self) -> None:
        """Validate coefficient and start."""
        if finite_number(self.friction, "the friction of the ground") < 0:
            raise InvalidInputError(
                f"the friction of the ground is {self.friction}. Give a coefficient, 0 or more."
            )
        if self.contact is not None:
            check_name(self.contact, "the contact whose friction changes")
        if finite_number(self.start, "the start of a change of friction [s]") < 0:
            raise InvalidInputError(
                f"a change of friction starts at {self.start} s. Give 0 or more."
            )


@dataclass(frozen=True)
class ModelError:
    """How the simulated robot differs from the model that the controller uses.

    Attributes:
        mass: relative error of every link's mass and inertia; 0.05 is 5 % heavier.
        payload: frame -> point mass fixed at its origin [kg].
    """

    mass: float = 0.0
    payload: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Own the payload; validate the masses."""
        remedy = 'Give frame -> mass, such as {"l_hand": 2.0} [kg].'
        check_type(self.payload, Mapping, "a mapping of payloads", remedy)
        for frame in self.payload:
            check_name(frame, "the frame of a payload")
        freeze(self, "payload")
        if not finite_number(self.mass, "the error of the mass") > -1:
            raise InvalidInputError(
                f"the error of the mass is {self.mass:g}: no mass would be left. Give more than -1."
            )
        for frame, mass in self.payload.items():
            finite_number(mass, f"the payload at {frame!r} [kg]", positive=True)

    def __bool__(self) -> bool:
        """Whether the robot differs at all."""
        return bool(self.mass or self.payload)

    def applied(self, stance: Stance) -> Stance:
        """The stance of the simulated robot.

        Raises:
            UnknownNameError: the robot has no such frame for a payload.
        """
        robot = stance.robot
        for frame in self.payload:
            if frame not in robot.frame_names:
                raise UnknownNameError(
                    f"frame for a payload on robot {robot.name!r}", frame, robot.frame_names
                )
        model = robot.model.copy()
        for i in range(1, model.njoints):
            inertia = model.inertias[i]
            scale = 1.0 + self.mass
            model.inertias[i] = pin.Inertia(
                scale * inertia.mass, inertia.lever, scale * inertia.inertia
            )
        for name, mass in self.payload.items():
            doubt_payload(mass, robot.name, robot.mass, f"the payload at {name!r}")
            frame = robot.frame(name)
            point = pin.Inertia(mass, frame.placement.translation, np.zeros((3, 3)))
            model.inertias[frame.parentJoint] += point
        return Stance(replace(robot, model=model), stance.q, stance.contacts, loads=stance.loads)
