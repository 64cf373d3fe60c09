"""Trials: what a robot has to do in a case, each a value."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar

from copsense.arrays import finite_number
from copsense.comparison.bisection import count_steps
from copsense.comparison.plan_values import structure
from copsense.errors import InvalidInputError, UnknownNameError


def _check_side(side: str) -> None:
    if side not in ("left", "right"):
        raise UnknownNameError("side", side, ("left", "right"))


@dataclass(frozen=True)
class Lean:
    """A slow lateral lean until a contact tips.

    Attributes:
        reach: how far to lean [m]; None until the CoM is over the foot, or as far as possible.
        speed: of the CoM [m/s].
        side: ``"left"`` or ``"right"``.
    """

    reach: float | None = None
    speed: float = 5e-3
    side: str = "left"

    kind: ClassVar[str] = "lean"
    scores: ClassVar[tuple[str, ...]] = ("tip_excursion",)

    def __post_init__(self) -> None:
        """Validate reach, speed and side."""
        if self.reach is not None:
            finite_number(self.reach, "the reach of a lean [m]", positive=True)
        finite_number(self.speed, "the speed of a lean [m/s]", positive=True)
        _check_side(self.side)

    @property
    def seconds(self) -> float:
        """Motion to simulate, roughly [s]."""
        return (self.reach or 0.06) / self.speed + 1.0


@dataclass(frozen=True)
class PushToTip:
    """Lateral pushes on the base, bisected for the smallest that tips a contact.

    Attributes:
        resolution: the bisection ends when its ends are within twice this [N s].
        largest: impulse to try first [N s]; None for one that gives the CoM 0.5 m/s.
        duration: of each push [s].
        side: ``"left"`` or ``"right"``.
    """

    resolution: float = 0.05
    largest: float | None = None
    duration: float = 0.05
    side: str = "left"

    kind: ClassVar[str] = "push"
    scores: ClassVar[tuple[str, ...]] = ("tip_impulse",)

    def __post_init__(self) -> None:
        """Validate resolution, impulse, duration and side."""
        finite_number(self.resolution, "the resolution of a push [N s]", positive=True)
        if self.largest is not None:
            finite_number(self.largest, "the largest push [N s]", positive=True)
            count_steps(0.0, self.largest, 2 * self.resolution)
        finite_number(self.duration, "the duration of a push [s]", positive=True)
        _check_side(self.side)

    @property
    def seconds(self) -> float:
        """Motion to simulate, roughly [s]."""
        return 7.0


@dataclass(frozen=True)
class Sway:
    """A sinusoidal lateral sway, the same motion for every controller.

    The first 0.1 s is not scored, while the contacts settle; see `Recording.settled`.

    Attributes:
        amplitude: of CoM y [m]; a negative one starts to the right.
        frequency: [Hz].
        periods: number of periods.
    """

    amplitude: float = 0.02
    frequency: float = 0.1
    periods: float = 1.0

    kind: ClassVar[str] = "sway"
    scores: ClassVar[tuple[str, ...]] = (
        "smallest_margin",
        "com_error",
        "torque_norm",
        "torque_peak",
    )

    def __post_init__(self) -> None:
        """Validate amplitude, frequency and periods."""
        finite_number(self.amplitude, "the amplitude of a sway [m]")
        finite_number(self.frequency, "the frequency of a sway [Hz]", positive=True)
        finite_number(self.periods, "the periods of a sway", positive=True)

    @property
    def seconds(self) -> float:
        """Motion to simulate [s]."""
        return self.periods / self.frequency


@dataclass(frozen=True)
class Rest:
    """Standing still: measured wrenches and CoPs beside those of the statics.

    Attributes:
        duration: how long [s]; the last fifth is measured.
    """

    duration: float = 2.0

    kind: ClassVar[str] = "rest"
    scores: ClassVar[tuple[str, ...]] = ("wrench_error", "cop_error")

    def __post_init__(self) -> None:
        """Validate the duration."""
        finite_number(self.duration, "the duration of a rest [s]", positive=True)

    @property
    def seconds(self) -> float:
        """Motion to simulate [s]."""
        return self.duration


@dataclass(frozen=True)
class Falls:
    """Perturbed lateral pushes, counting those that end in a fall. Needs limits.

    The time of the push (within half a second), its side, and the noise of the joint sensors are
    drawn for each repeat.

    Attributes:
        velocity: that each push gives the CoM, impulse per mass [m/s].
        repeats: number of pushes.
        duration: of each push [s].
        position_noise: standard deviation of the joint positions [rad].
        velocity_noise: of the joint velocities [rad/s].
        watch: time after a push during which a fall counts [s].
        seed: of the random draws.
    """

    velocity: float = 0.14
    repeats: int = 20
    duration: float = 0.05
    position_noise: float = 1e-4
    velocity_noise: float = 1e-2
    watch: float = 2.0
    seed: int = 0

    kind: ClassVar[str] = "falls"
    scores: ClassVar[tuple[str, ...]] = ("fall_rate",)

    def __post_init__(self) -> None:
        """Validate the numbers."""
        for name in ("velocity", "duration", "watch"):
            finite_number(getattr(self, name), f"the {name} of the falls", positive=True)
        for name in ("repeats", "seed"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < (1 if name == "repeats" else 0):
                raise InvalidInputError(
                    f"the {name} of the falls is {value!r}. Give a whole number"
                    + (", 1 or more." if name == "repeats" else ".")
                )

    @property
    def seconds(self) -> float:
        """Motion to simulate, roughly [s]."""
        return self.repeats * (self.watch + 0.5)


# parameter -> (mild, severe, step); the resolution is half a step
_RANGES = {
    "delay": (0.0, 0.05, 1e-3),
    "bandwidth": (50.0, 0.5, 0.5),
    "velocity_noise": (0.0, 3.0, 0.1),
    "torque_limit": (60.0, 0.5, 0.5),
}


@dataclass(frozen=True)
class Breaking:
    """A sway under worse and worse motors or sensors, bisected for where a contact first tips.

    Attributes:
        parameter: ``"delay"`` [s] or ``"bandwidth"`` [Hz] of the torques, ``"velocity_noise"``
            of the joints [rad/s], or ``"torque_limit"`` of the legs [Nm].
        mild: a value that should be survived; None for the default.
        severe: a value that should not; None for the default.
        step: between the values tried; the resolution is half of it. None for the default.
        amplitude: of the sway [m].
        frequency: of the sway [Hz]; it lasts one period.
    """

    parameter: str = "delay"
    mild: float | None = None
    severe: float | None = None
    step: float | None = None
    amplitude: float = 0.02
    frequency: float = 0.2

    def __post_init__(self) -> None:
        """Set the default range and validate it."""
        if self.parameter not in _RANGES:
            raise UnknownNameError("parameter to break", self.parameter, _RANGES)
        for name, usual in zip(("mild", "severe", "step"), _RANGES[self.parameter], strict=True):
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)
            finite_number(getattr(self, name), f"{name} of the {self.parameter}")
        finite_number(self.step, f"the step of the {self.parameter}", positive=True)
        count_steps(self.mild, self.severe, self.step)  # type: ignore[arg-type]
        rises = _RANGES[self.parameter][0] < _RANGES[self.parameter][1]
        ends = (self.mild, self.severe) if rises else (self.severe, self.mild)
        if not 0 <= ends[0] < ends[1] or (ends[0] == 0 and not rises):  # type: ignore[operator]
            order = "0 or more, severe over mild" if rises else "over 0, severe under mild"
            raise InvalidInputError(
                f"the {self.parameter} does not get worse from mild = {self.mild:g} to severe = "
                f"{self.severe:g}. Give both {order}."
            )
        finite_number(self.amplitude, "the amplitude of a sway [m]")
        finite_number(self.frequency, "the frequency of a sway [Hz]", positive=True)

    @property
    def kind(self) -> str:
        """Its name in a plan."""
        return self.parameter

    @property
    def scores(self) -> tuple[str, ...]:
        """Names of the scores."""
        return (f"breaking_{self.parameter}",)

    @property
    def seconds(self) -> float:
        """Motion to simulate, roughly [s]."""
        return 5.0 / self.frequency


Trial = Lean | PushToTip | Sway | Rest | Falls | Breaking
"""A trial of a case; a new kind needs a type here and a function in `scoring`."""

KINDS: dict[str, type[Lean | PushToTip | Sway | Rest | Falls | Breaking]] = {
    "lean": Lean,
    "push": PushToTip,
    "sway": Sway,
    "rest": Rest,
    "falls": Falls,
    **dict.fromkeys(_RANGES, Breaking),
}


# What an option is measured in, in every trial that has it; those without a unit are left out.
_UNITS = {
    "amplitude": "m",
    "duration": "s",
    "frequency": "Hz",
    "largest": "Ns",
    "position_noise": "rad",
    "reach": "m",
    "resolution": "Ns",
    "speed": "m/s",
    "velocity": "m/s",
    "velocity_noise": "rad/s",
    "watch": "s",
}
_BROKEN = {"delay": "s", "bandwidth": "Hz", "velocity_noise": "rad/s", "torque_limit": "Nm"}


def option_unit(kind: str, option: str) -> str | None:
    """The SI unit of a trial's option, None where it has none, is a word, or is not known."""
    if kind in _BROKEN and option in ("mild", "severe", "step"):
        return _BROKEN[kind]
    return _UNITS.get(option)


def trial_named(kind: str, /, **options: object) -> Trial:
    """A trial by its name in plans and on the command line.

    Raises:
        UnknownNameError: no such trial, or no such option of it.
        InvalidInputError: an option's value is not valid.
    """
    if kind not in KINDS:
        raise UnknownNameError("disturbance", kind, KINDS)
    cls = KINDS[kind]
    known = [field.name for field in fields(cls) if field.name != "parameter"]  # given by the kind
    for name in options:
        if name not in known:
            raise UnknownNameError(f"option of the trial {kind!r}", name, known)
    if cls is Breaking:
        options = {"parameter": kind} | options
    return structure(options, cls)
