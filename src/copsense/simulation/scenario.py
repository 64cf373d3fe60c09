"""Scenario: what a robot does in a run and what disturbs it, as one value."""

from __future__ import annotations

from dataclasses import dataclass, field

from copsense.arrays import (
    check_name,
    check_type,
    checked_tuple,
    finite_number,
    whole_number,
)
from copsense.content import ShortRepr
from copsense.controllers.target import Hold, PathReference, Signal
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.simulation.disturbance import FrictionChange, ModelError, Motors, Noise, Push
from copsense.simulation.odometry import FootOdometry
from copsense.stance import Stance

LONGEST = 3600.0  # s


@dataclass(frozen=True, eq=False, repr=False)
class Scenario(ShortRepr):
    """What the robot has to do and what disturbs it.

    Attributes:
        duration: [s].
        reference: distance of CoM y from its start as a function of time (`Hold`, `Sine`,
            `Ramp`), or a `PathReference` along any path.
        pushes: forces on links.
        motors: delay, bandwidth and limits of the torques.
        noise: of the sensors.
        friction: changes of the ground's friction, sorted by time.
        model_error: how the simulated robot differs from the controller's model.
        odometry: the foot from which the base's state is estimated, see `FootOdometry`; None for
            the true state.
        control_period: time between two calls of the controller [s], a multiple of the physics'
            time step.
        seed: of everything random.
        name: what results call it.
    """

    duration: float = 1.0
    reference: Signal | PathReference = field(default_factory=Hold)
    pushes: tuple[Push, ...] = ()
    motors: Motors = field(default_factory=Motors)
    noise: Noise = field(default_factory=Noise)
    friction: tuple[FrictionChange, ...] = ()
    model_error: ModelError = field(default_factory=ModelError)
    odometry: str | None = None
    control_period: float = 1e-3
    seed: int = 0
    name: str = "scenario"

    def __post_init__(self) -> None:
        """Validate the parts that do not depend on the robot."""
        finite_number(self.duration, "the duration of a scenario [s]", positive=True)
        finite_number(self.control_period, "the control period [s]", positive=True)
        object.__setattr__(self, "seed", whole_number(self.seed, "the seed", least=0))
        if self.duration > LONGEST:
            raise InvalidInputError(
                f"a scenario of {self.duration:g} s is too long. Give at most {LONGEST:g} s."
            )
        kinds = {"motors": Motors, "noise": Noise, "model_error": ModelError}
        for name, kind in kinds.items():
            remedy = f"Give copsense.simulation.{kind.__name__}(...)."
            check_type(getattr(self, name), kind, f"a scenario's {name}", remedy)
        check_name(self.name, "the name of a scenario")
        remedy = "Give Push((0, 40, 0), start=0.5), or several."
        pushes = checked_tuple(self.pushes, Push, "push", remedy)
        object.__setattr__(self, "pushes", pushes)
        remedy = "Give FrictionChange(0.2, start=1.0), or several."
        changes = checked_tuple(self.friction, FrictionChange, "friction change", remedy)
        object.__setattr__(self, "friction", tuple(sorted(changes, key=lambda c: c.start)))
        for what, events in (("push", self.pushes), ("change of friction", self.friction)):
            for event in events:
                if event.start >= self.duration:
                    raise InvalidInputError(
                        f"a {what} starts at {event.start:g} s, after the end of the scenario at "
                        f"{self.duration:g} s. Make the scenario longer, or start sooner."
                    )
        if not hasattr(self.reference, "at"):
            raise InvalidInputError(
                f"{self.reference!r} is not a reference. Give Hold(), Sine(amplitude, "
                "frequency), Ramp(distance) or a PathReference."
            )

    def steps_per_control(self, time_step: float) -> int:
        """Physics steps between two calls of the controller.

        Raises:
            InvalidInputError: the control period is not a multiple of the time step.
        """
        ratio = self.control_period / time_step
        steps = round(ratio)
        if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
            raise InvalidInputError(
                f"the control period of {self.control_period:g} s is not a multiple of the "
                f"physics' time step of {time_step:g} s. Give {max(steps, 1) * time_step:g} s, or "
                "change the time step."
            )
        return steps

    def friction_at_start(self, stance: Stance, usual: float) -> dict[str, float]:
        """Coulomb coefficient of the ground under each contact when the scenario starts.

        A change of friction at time zero replaces a contact's own coefficient, as it does in the
        simulation.

        Args:
            stance: gives the contacts, by whose names the coefficients are returned.
            usual: coefficient of contacts without one of their own, `PhysicsSettings.friction`.
        """
        found = {c.name: usual if c.friction is None else c.friction for c in stance.contacts}
        for change in self.friction:
            if change.start <= 0:
                names = found if change.contact is None else [change.contact]
                found |= dict.fromkeys(names, change.friction)
        return found

    def check_stance(self, stance: Stance) -> None:
        """Reject joints, frames and contacts that the robot does not have.

        Raises:
            UnknownNameError: no such joint, frame or contact; the message lists the valid names.
        """
        robot = stance.robot
        self.motors.limits(robot)
        for change in self.friction:
            if change.contact is not None and change.contact not in stance.contact_names:
                raise UnknownNameError(
                    "contact whose friction changes", change.contact, stance.contact_names
                )
        if self.odometry is not None:
            FootOdometry(stance, self.odometry)
        for push in self.pushes:
            if push.frame not in robot.frame_names:
                raise UnknownNameError(
                    f"frame to push in robot {robot.name!r}", push.frame, robot.frame_names
                )
