"""Target: where the centre of mass and the posture should be, and how that moves with time.

A signal (`Hold`, `Sine`, `Ramp`) says how far along a path the robot should be at each time; a
`PathReference` turns that into the path's posture and centre of mass.
"""

from __future__ import annotations

import math
import reprlib
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import check_type, finite_number
from copsense.content import ShortRepr
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.freedom import held_com_axes
from copsense.magnitudes import in_metres
from copsense.path import COM_COORDINATES, PosturePath, com_sweep, lateral_sweep
from copsense.stance import Stance, check_stance

_SPACING = 2e-3  # m between the postures of a lateral reference
_COARSE = 10  # times as far apart are those that find out whether it can be reached
_SLACK = 1e-9
# Singular values of what contacts hold twice: by rounding, and how many times that is the same.
_TWICE, _AS_NEAR = 1e-10, 10.0


@dataclass(frozen=True, eq=False, repr=False)
class Target(ShortRepr):
    """What the robot should do at one instant.

    Attributes:
        com: centre of mass (3,), world [m].
        com_velocity: its velocity (3,) [m/s].
        com_acceleration: its acceleration (3,) [m/s^2].
        posture: configuration (nq,).
        velocity: its velocity (nv,).
        acceleration: derivative of `velocity` (nv,).
    """

    com: Float[np.ndarray, " 3"]
    com_velocity: Float[np.ndarray, " 3"]
    com_acceleration: Float[np.ndarray, " 3"]
    posture: Float[np.ndarray, " nq"]
    velocity: Float[np.ndarray, " nv"]
    acceleration: Float[np.ndarray, " nv"]


@runtime_checkable
class Signal(Protocol):
    """A distance along a path as a function of time."""

    def at(self, time: float) -> tuple[float, float, float]:
        """Value, rate and second derivative at a time [s]."""

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest value it ever takes."""


@dataclass(frozen=True)
class Hold:
    """Stay at a place.

    Attributes:
        value: where [m along the path].
    """

    value: float = 0.0

    def __post_init__(self) -> None:
        """Reject what is not a number."""
        finite_number(self.value, "the value held")

    def at(self, time: float) -> tuple[float, float, float]:
        """Value, rate and second derivative."""
        return self.value, 0.0, 0.0

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest value."""
        return self.value, self.value

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative [m/s^2]."""
        return 0.0


@dataclass(frozen=True)
class Sine:
    """Sway: amplitude * sin(2 pi frequency t).

    Attributes:
        amplitude: [m along the path]; negative starts to the other side.
        frequency: [Hz].
    """

    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        """Reject what is not a motion."""
        finite_number(self.amplitude, "the amplitude of a sine")
        finite_number(self.frequency, "the frequency of a sine [Hz]", positive=True)

    def at(self, time: float) -> tuple[float, float, float]:
        """Value, rate and second derivative."""
        w, a = 2 * math.pi * self.frequency, self.amplitude
        s, c = math.sin(w * time), math.cos(w * time)
        return a * s, a * w * c, -a * w * w * s

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest value."""
        return -abs(self.amplitude), abs(self.amplitude)

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative [m/s^2]."""
        return abs(self.amplitude) * (2 * math.pi * self.frequency) ** 2


@dataclass(frozen=True)
class Ramp:
    """Go to a place at constant speed and stay there; the start and the end are rounded off.

    Attributes:
        distance: where to [m along the path]; its sign says to which side.
        speed: on the way [m/s].
        rounding: time of constant acceleration at either end [s].
    """

    distance: float
    speed: float = 5e-3
    rounding: float = 0.5

    def __post_init__(self) -> None:
        """Reject a ramp without speed."""
        finite_number(self.distance, "the distance of a ramp [m]")
        finite_number(self.speed, "the speed of a ramp [m/s]", positive=True)
        finite_number(self.rounding, "the rounding of a ramp [s]", positive=True)

    @property
    def duration(self) -> float:
        """When it arrives [s]."""
        if abs(self.distance) < self.speed * self.rounding:  # never at full speed
            return 2 * math.sqrt(abs(self.distance) * self.rounding / self.speed)
        return abs(self.distance) / self.speed + self.rounding

    def at(self, time: float) -> tuple[float, float, float]:
        """Value, rate and second derivative."""
        sign, a = math.copysign(1.0, self.distance), self.speed / self.rounding
        end = self.duration
        if time >= end:
            return self.distance, 0.0, 0.0
        rise = min(self.rounding, end / 2)
        if time < rise:
            return sign * a * time**2 / 2, sign * a * time, sign * a
        if time < end - rise:
            covered = a * rise**2 / 2 + a * rise * (time - rise)
            return sign * covered, sign * a * rise, 0.0
        left = end - time
        return self.distance - sign * a * left**2 / 2, sign * a * left, -sign * a

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest value."""
        return min(0.0, self.distance), max(0.0, self.distance)

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative [m/s^2]."""
        return self.speed / self.rounding if self.distance else 0.0


class PathReference:
    """A path on the constraint manifold, followed in time.

    Between the path's postures it interpolates with their exact tangents (cubic Hermite), so that
    the reference is smooth and stays on the manifold to the fourth order of their spacing.

    Attributes:
        path: the postures.
        signal: where along the path's coordinate to be at each time.
    """

    def __repr__(self) -> str:
        """The signal and the path."""
        return f"PathReference({self.signal!r} along {self.path!r})"

    def __init__(self, path: PosturePath, signal: Signal) -> None:
        """Prepare the interpolation.

        Raises:
            InvalidInputError: a path of fewer than two postures, or one that does not rise.
            UnreachablePostureError: the signal leaves the part of the path that can be reached.
        """
        remedy = "Make one with copsense.lateral_sweep, joint_sweep or path_through."
        check_type(path, PosturePath, "a path of postures", remedy)
        _check_signal(signal)
        self.path = path
        self.signal = signal
        values = np.asarray(path.values, dtype=float)
        if len(values) < 2 or not np.all(np.diff(values) > 0):
            raise InvalidInputError(
                "a reference needs a path of two or more postures whose coordinate rises. Give a "
                "finer sweep, from the lower to the higher value."
            )
        low, high = signal.extent
        if low < values[0] - _SLACK or high > values[-1] + _SLACK:
            raise InvalidInputError(
                f"the signal goes from {low:g} to {high:g}, the path's {path.coordinate} only from "
                f"{values[0]:g} to {values[-1]:g}. Make the path longer or the signal smaller."
            )
        for i, reason in path.failures.items():
            if low - _SLACK <= values[i] <= high + _SLACK:
                raise UnreachablePostureError(
                    f"the reference cannot be followed at {path.coordinate} = {values[i]:g}: "
                    f"{reason}"
                )
        self._values: list[float] = values.tolist()
        stances = path.stances
        self._model = stances[0].robot.model
        self._q = [s.q for s in stances]
        # Of each interval: what the basis below weighs, for the CoM and then the configuration.
        com = np.array([s.com for s in stances])
        ends = np.array(
            [
                np.concatenate([s.com_jacobian @ t, t])
                for s, t in zip(stances, path.tangents, strict=True)
            ]
        )
        h = np.diff(values)[:, None]
        steps = [pin.difference(self._model, a, b) for a, b in pairwise(self._q)]
        start = np.hstack([com[:-1], np.zeros_like(steps)])
        across = np.hstack([np.diff(com, axis=0), steps])
        self._shapes = np.stack([start, h * ends[:-1], across, h * ends[1:]], axis=1)

    def at(self, time: float) -> Target:
        """The target at a time [s], its arrays read-only."""
        value, rate, second = self.signal.at(time)
        values = self._values
        i = min(max(bisect_right(values, value) - 1, 0), len(values) - 2)
        h = values[i + 1] - values[i]
        u = (value - values[i]) / h
        # Cubic Hermite basis; its derivatives by the coordinate, and so by time.
        a, b, c = ((1 - u) * (1 - 3 * u) / h, 6 * u * (1 - u) / h, u * (3 * u - 2) / h)
        squared = rate**2 / h**2
        basis = np.array(
            (
                1.0, u * (1 - u) ** 2, u * u * (3 - 2 * u), u * u * (u - 1),
                0.0, a * rate, b * rate, c * rate,
                0.0, a * second + (6 * u - 4) * squared, b * second + (6 - 12 * u) * squared,
                c * second + (6 * u - 2) * squared,
            )
        ).reshape(3, 4)  # fmt: skip
        found = basis.dot(self._shapes[i])
        found.setflags(write=False)
        posture = pin.integrate(self._model, self._q[i], found[0, 3:])
        posture.setflags(write=False)
        com, moved = found[:, :3], found[1:, 3:]
        return Target(com[0], com[1], com[2], posture, moved[0], moved[1])


def lateral_reference(stance: Stance, signal: Signal) -> PathReference:
    """Sway the centre of mass sideways, quasi-statically ([Romano2016] Section V).

    The signal is the distance [m] of CoM y from where the stance has it; CoM x is held, and height
    and posture follow the path of `copsense.lateral_sweep`.

    Raises:
        UnreachablePostureError: the robot cannot lean that far.
    """
    check_stance(stance)
    _check_signal(signal)
    low, high = signal.extent
    if low == high == 0:
        return PathReference(_path_to_hold(stance), signal)
    start, ground = float(stance.com[1]), min(p.translation[2] for p in stance.placements)
    if max(abs(low), abs(high)) > stance.com[2] - ground:
        raise UnreachablePostureError(
            f"the reference leans from {low:g} m to {high:g} m, farther than the CoM of "
            f"{stance.robot.name!r} is high ({stance.com[2] - ground:.2f} m). "
            f"{in_metres(max(abs(low), abs(high)))}"
        )
    low, high = min(low, -_SPACING), max(high, _SPACING)
    count = math.ceil((high - low) / _SPACING) + 1
    if count > 5 * _COARSE:
        # A few postures are enough to see that a lean is far out of reach.
        few = lateral_sweep(
            stance, start + low, start + high, count // _COARSE + 1, com_x=float(stance.com[0])
        )
        for i in (0, len(few) - 1):
            if i in few.failures:
                raise UnreachablePostureError(few.failures[i])
    path = lateral_sweep(stance, start + low, start + high, count, com_x=float(stance.com[0]))
    return PathReference(path.shifted(-start), signal)


def _path_to_hold(stance: Stance) -> PosturePath:
    """To hold still needs a path, whichever: sideways, or along what else the contacts leave.

    Legs of too few joints may stand where they cannot sway.
    """
    held = held_com_axes(stance)
    names = [COM_COORDINATES[i] for i in (1, 0, 2) if i not in held] or ["com_y"]
    own = dict(zip(COM_COORDINATES, stance.com.tolist(), strict=True))
    paths = []
    for name in names:
        at, still = own[name], {n: own[n] for n in names if n not in (name, "com_z")}
        path = com_sweep(stance, name, at - _SPACING, at + _SPACING, 3, held=still).shifted(-at)
        if not path.failures and all(_repeats_alike(stance, there) for there in path.stances):
            return path
        paths.append(path)
    return paths[0]


def _repeats_alike(stance: Stance, there: Stance) -> bool:
    """Whether the contacts hold as much twice at another posture; else loads jump on the way."""
    here, moved = (
        float(np.linalg.svd(s.constraints, compute_uv=False)[stance.rank :].max(initial=0.0))
        for s in (stance, there)
    )
    return there.rank == stance.rank and moved <= _AS_NEAR * here + _TWICE


def _check_signal(signal: object) -> None:
    """Reject what does not say where to be at a time, and how far it goes."""
    if not (hasattr(signal, "at") and hasattr(signal, "extent")):
        raise InvalidInputError(
            f"{reprlib.repr(signal)} is not a signal. Give Hold(), Sine(amplitude, frequency) or "
            "Ramp(distance)."
        )
