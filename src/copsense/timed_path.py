"""TimedPath: a path of postures followed in time, whose inertia is carried too.

With t the tangent of the path, t' and t'' its derivatives along the coordinate s, and ds and dds
the coordinate's rate and second derivative in time,

    v = t ds        dv/dt = t dds + t' ds^2

and the load N = M dv/dt + C v + G is linear in dds and ds^2: M t and C(t) t + M t' beside gravity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.content import ShortRepr, freeze
from copsense.controllers.target import Signal, Sine
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.path import LateralPath, PosturePath, check_path
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium

_STEP = 2e-3  # of the coordinate [m, rad]: the differences' truncation and rounding are near 1e-9
_NEAR = 1.5  # times as far apart may a path's own postures be to serve for them
_OFFSETS = (-2, -1, 0, 1, 2)
_FEWEST = 3  # postures that say how a path bends


@dataclass(frozen=True, eq=False, repr=False)
class Instant(ShortRepr):
    """A path of postures at one value of its coordinate, in motion.

    Attributes:
        value: the path's coordinate s.
        rate: its rate ds in time [1/s of its unit].
        second: its second derivative dds in time.
        stance: the posture in motion; solve it as any other.
        tangent: t = dq/ds (nv,).
        bend: t' = dt/ds (nv,), componentwise.
        bend_rate: t'' = dt'/ds (nv,).
    """

    value: float
    rate: float
    second: float
    stance: Stance
    tangent: Float[np.ndarray, " nv"]
    bend: Float[np.ndarray, " nv"]
    bend_rate: Float[np.ndarray, " nv"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "tangent", "bend", "bend_rate")

    @property
    def load_by_second(self) -> Float[np.ndarray, " nv"]:
        """M t: how the load changes with the coordinate's second derivative."""
        return np.asarray(self.stance.mass_matrix @ self.tangent)

    @property
    def load_by_squared_rate(self) -> Float[np.ndarray, " nv"]:
        """C(t) t + M t': how the load changes with the square of the coordinate's rate."""
        moving = self.stance.moving(self.tangent, self.bend)
        return np.asarray(moving.balance - self.stance.at_rest().balance)

    def rates(
        self,
        equilibrium: StaticEquilibrium,
        *,
        second_rate: float = 0.0,
        squared_rate: float = 0.0,
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"]]:
        """Derivatives of forces and torques along the path, exact but for t' and t''.

        Args:
            equilibrium: of `stance`, by a `Criterion`; within limits those that press are held.
            second_rate: d(dds)/ds, how the second derivative changes along the path. Default: it
                is held, as the rate is.
            squared_rate: d(ds^2)/ds, likewise of the square of the rate.

        Returns:
            d forces / ds (m,), contact axes, and d torques / ds (n,).
        """
        squared = self.rate**2
        change = self.stance.motion_load_rate(
            self.bend * self.rate, self.bend * self.second + self.bend_rate * squared
        )
        if second_rate:
            change = change + second_rate * self.load_by_second
        if squared_rate:
            change = change + squared_rate * self.load_by_squared_rate
        forces, torques = equilibrium.derivative(self.tangent[:, None], change[:, None])
        return forces[: len(equilibrium.contact_forces), 0], torques[:, 0]


@dataclass(frozen=True, eq=False, repr=False)
class TimedPath:
    """A path of postures and where on it to be at each time.

    Attributes:
        path: the postures.
        signal: the coordinate relative to `start` as a function of time, such as `Sine` or `Ramp`
            of `copsense.controllers`: ``signal.at(time)`` is its value, rate and second derivative.
        start: the coordinate where the signal is zero; default that of the path's middle posture.
    """

    path: PosturePath | LateralPath
    signal: Signal
    start: float | None = None

    def __post_init__(self) -> None:
        """Reject what is not a path, or not a signal."""
        check_path(self.path, search=True)
        if not isinstance(self.signal, Signal):
            raise InvalidInputError(
                f"{self.signal!r} is not a signal: it has no at(time) -> (value, rate, second "
                "derivative) and no extent. Give a Sine, Ramp or Hold of copsense.controllers."
            )
        middle = float(self.path.values[len(self.path) // 2])
        start = middle if self.start is None else finite_number(self.start, "the start")
        object.__setattr__(self, "start", start)

    def __repr__(self) -> str:
        """The signal, where it starts, and the path."""
        return f"TimedPath({self.signal!r} from {self.start:g} along {self.path!r})"

    def at(self, time: float) -> Instant:
        """The posture in motion at a time [s].

        Raises:
            UnreachablePostureError: no posture there, or too few around it.
            InvalidInputError: a list of configurations has no posture at that value.
        """
        value, rate, second = self.signal.at(finite_number(time, "the time [s]"))
        assert self.start is not None
        return instant(self.path, self.start + value, rate, second)


@dataclass(frozen=True, eq=False, repr=False)
class Sway:
    """A path swayed along, s = centre + amplitude sin(2 pi t / period).

    Rate and second derivative, and so the wrenches, are the same on the way there and back: they
    are functions of the place alone.

    Attributes:
        path: the postures; `at` has to know those in between.
        period: [s].
        centre: the coordinate in the middle; default the middle of the path's values.
        amplitude: how far to either side; default as far as the path's values go.
    """

    path: PosturePath | LateralPath
    period: float
    centre: float | None = None
    amplitude: float | None = None

    def __post_init__(self) -> None:
        """Fill in the defaults."""
        check_path(self.path, search=True)
        if not self.path.continuous:
            raise InvalidInputError(
                "a list of configurations is not a curve to sway along: how it bends is not known. "
                "Make the path with lateral_sweep or joint_sweep, or follow the list with a "
                "TimedPath."
            )
        finite_number(self.period, "the period of a sway [s]", positive=True)
        low, high = float(np.min(self.path.values)), float(np.max(self.path.values))
        for name, usual in (("centre", (low + high) / 2), ("amplitude", (high - low) / 2)):
            given = getattr(self, name)
            value = usual if given is None else finite_number(given, f"the {name} of a sway")
            object.__setattr__(self, name, value)
        if not self.amplitude:
            raise InvalidInputError(
                f"the sway stays at {self.centre:g}: it has no amplitude. Give a path with a "
                "range, or an amplitude."
            )

    def __repr__(self) -> str:
        """Amplitude, centre, period and path."""
        return (
            f"Sway({self.amplitude:.4g} about {self.centre:.4g} in {self.period:g} s along "
            f"{self.path!r})"
        )

    @property
    def signal(self) -> Sine:
        """The same as a function of time, relative to the centre."""
        assert self.amplitude is not None
        return Sine(self.amplitude, 1.0 / self.period)

    def at(self, value: float) -> Instant:
        """The posture in motion as the sway passes a value of the coordinate, going up.

        Raises:
            InvalidInputError: the sway does not go that far.
            UnreachablePostureError: no posture there, or too few around it.
        """
        rate, second = self._rates(value)
        return instant(self.path, value, rate, second)

    def rates(
        self, at: Instant, equilibrium: StaticEquilibrium
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"]]:
        """d forces / ds and d torques / ds along the sway, its own slowing included."""
        assert self.centre is not None
        squared = self._frequency**2
        return at.rates(
            equilibrium,
            second_rate=-squared,
            squared_rate=-2 * squared * (at.value - self.centre),
        )

    @property
    def _frequency(self) -> float:
        return 2 * math.pi / self.period

    def _rates(self, value: float) -> tuple[float, float]:
        assert self.centre is not None
        assert self.amplitude is not None
        off, w = value - self.centre, self._frequency
        left = self.amplitude**2 - off**2
        if left < -1e-9 * max(self.amplitude, abs(off)) ** 2:
            raise InvalidInputError(
                f"the sway goes {self.amplitude:g} to either side of {self.centre:g}: it does not "
                f"pass {value:g}."
            )
        return w * math.sqrt(max(left, 0.0)), -w * w * off


def instant(path: PosturePath | LateralPath, value: float, rate: float, second: float) -> Instant:
    """A path at a value of its coordinate, in motion.

    Args:
        path: the postures.
        value: of its coordinate.
        rate: of the coordinate in time.
        second: its second derivative in time.

    Raises:
        UnreachablePostureError: no posture there, or too few around it.
        InvalidInputError: a list of configurations has no posture at that value.
    """
    stance, tangent = path.at(value)
    bend, bend_rate = _bends(path, value, stance, tangent)
    moving = stance.moving(tangent * rate, tangent * second + bend * rate**2)
    return Instant(float(value), rate, second, moving, tangent, bend, bend_rate)


def _bends(
    path: PosturePath | LateralPath, value: float, stance: Stance, tangent: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """t' and t'' by differences of the tangents around a posture; t' holds the feet at rest."""
    step, known = _neighbours(path, value)
    if len(known) < _FEWEST:
        raise UnreachablePostureError(
            f"how the path bends at {path.coordinate} = {value:g} is not known: fewer than "
            f"{_FEWEST} postures were found around it. Stay farther from where it ends."
        )
    offsets = np.array(sorted(known)) * step
    tangents = np.array([known[k] for k in sorted(known)])
    # The polynomial through the tangents: exact weights for whichever of them there are.
    weights = np.linalg.inv(np.vander(offsets / step, increasing=True))
    first, second = weights[1] @ tangents / step, 2 * weights[2] @ tangents / step**2
    # J t = 0 all along the path: J t' + d(J t)/dq t = 0.
    J = stance.constraints
    missing = J @ first + stance.motion_derivative(tangent) @ tangent
    return first - np.linalg.lstsq(J, missing, rcond=1e-9)[0], second


def _neighbours(
    path: PosturePath | LateralPath, value: float
) -> tuple[float, dict[int, Float[np.ndarray, " nv"]]]:
    """A step, and the tangents so many steps away from a value."""
    if isinstance(path, PosturePath):
        values = np.asarray(path.values)
        i, steps = int(np.argmin(np.abs(values - value))), np.diff(values)
        step = float(steps[0]) if len(steps) else 1.0
        even = np.ptp(steps) <= 1e-9 * abs(step) if len(steps) else True
        serves = not path.continuous or (even and abs(step) <= _NEAR * _STEP)
        if serves and values[i] == value:
            inside = [k for k in _OFFSETS if 0 <= i + k < len(values)]
            own = {k: path.tangents[i + k] for k in inside if i + k not in path.failures}
            if len(own) == len(_OFFSETS) or not path.continuous:
                return step, own
    found = {}
    for k in _OFFSETS:
        try:
            found[k] = path.at(value + k * _STEP)[1]
        except UnreachablePostureError:
            continue
    return _STEP, found
