"""Disturbances: pushes, imperfect motors and noisy sensors, each a value of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_array, finite_number
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.robot import Robot


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
        """Refuse what is no push."""
        force = finite_array(self.force, "the force of a push", (3,), "world x, y, z [N]")
        object.__setattr__(self, "force", tuple(float(c) for c in force))
        finite_number(self.duration, "the duration of a push [s]", positive=True)
        if finite_number(self.start, "the start of a push [s]") < 0:
            raise InvalidInputError(f"a push starts at {self.start} s. Give a time from 0 on.")

    @property
    def impulse(self) -> float:
        """Size of force times duration [N s]."""
        return float(np.linalg.norm(self.force)) * self.duration

    def acts(self, time: float) -> bool:
        """Whether it acts at a time [s]."""
        return self.start <= time < self.start + self.duration


@dataclass(frozen=True)
class Motors:
    """Between the torques commanded and those applied.

    Attributes:
        delay: [s]; a command takes effect this much later.
        bandwidth: of a first-order low-pass [Hz], or None for immediate torques.
        limit: greatest torque of every joint [Nm], joint -> limit (others unlimited),
            ``"model"`` for the model's effort limits, or None.
    """

    delay: float = 0.0
    bandwidth: float | None = None
    limit: float | Mapping[str, float] | str | None = None

    def __post_init__(self) -> None:
        """Refuse what no motor is."""
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
            effort = np.asarray(robot.model.upperEffortLimit)[robot.base_nv :]
            return np.where(effort > 0, effort, np.inf)
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
    """Gaussian noise of the joint sensors; the base is known.

    Attributes:
        position: standard deviation of joint positions [rad, m].
        velocity: standard deviation of joint velocities [rad/s, m/s].
    """

    position: float = 0.0
    velocity: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a deviation that is none."""
        for name in ("position", "velocity"):
            if finite_number(getattr(self, name), f"the {name} noise") < 0:
                raise InvalidInputError(
                    f"the {name} noise is {getattr(self, name)}. Give a standard deviation, 0 or "
                    "more."
                )
