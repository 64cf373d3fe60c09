"""Scenario: everything that happens to a robot in a rollout, as one value."""

from __future__ import annotations

from dataclasses import dataclass, field

from copsense.arrays import finite_number
from copsense.controllers.target import Hold, PathReference, Signal
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.robot import Robot
from copsense.simulation.disturbance import Motors, Noise, Push

_LONGEST = 3600.0  # s


@dataclass(frozen=True, eq=False)
class Scenario:
    """What the robot is asked to do and what disturbs it.

    Attributes:
        duration: [s].
        reference: distance of CoM y from its start as a function of time (`Hold`, `Sine`,
            `Ramp`), or a `PathReference` along any path.
        pushes: forces on links.
        motors: delay, bandwidth and limits of the torques.
        noise: of the joint sensors.
        control_period: time between two calls of the controller [s], a multiple of the physics'
            time step.
        seed: of everything random.
        name: how it is called in results.
    """

    duration: float = 1.0
    reference: Signal | PathReference = field(default_factory=Hold)
    pushes: tuple[Push, ...] = ()
    motors: Motors = field(default_factory=Motors)
    noise: Noise = field(default_factory=Noise)
    control_period: float = 1e-3
    seed: int = 0
    name: str = "scenario"

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        finite_number(self.duration, "the duration of a scenario [s]", positive=True)
        finite_number(self.control_period, "the control period [s]", positive=True)
        if self.duration > _LONGEST:
            raise InvalidInputError(
                f"a scenario of {self.duration:g} s cannot be run. Give at most {_LONGEST:g} s."
            )
        pushes = (self.pushes,) if isinstance(self.pushes, Push) else tuple(self.pushes)
        object.__setattr__(self, "pushes", pushes)
        if not hasattr(self.reference, "at"):
            raise InvalidInputError(
                f"the reference {self.reference!r} is none. Give Hold(), Sine(amplitude, "
                "frequency), Ramp(distance) or a PathReference."
            )

    def steps_per_control(self, time_step: float) -> int:
        """Physics steps between two calls of the controller.

        Raises:
            InvalidInputError: the control period is no multiple of the time step.
        """
        ratio = self.control_period / time_step
        steps = round(ratio)
        if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
            raise InvalidInputError(
                f"the control period of {self.control_period:g} s is no multiple of the physics' "
                f"time step of {time_step:g} s. Give {max(steps, 1) * time_step:g} s, or change "
                "the time step."
            )
        return steps

    def check_robot(self, robot: Robot) -> None:
        """Refuse a scenario for joints or frames that the robot lacks.

        Raises:
            UnknownNameError: the message names the missing one and those there are.
        """
        self.motors.limits(robot)
        for push in self.pushes:
            if push.frame not in robot.frame_names:
                raise UnknownNameError(
                    f"frame to push in robot {robot.name!r}", push.frame, robot.frame_names
                )
