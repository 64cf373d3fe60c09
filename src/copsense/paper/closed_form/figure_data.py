"""The data of Figs. 3a, 3b, 4 and 5 of [Romano2016], computed; nothing is drawn here.

Delta xi = pi/2 - xi, so that a positive Delta xi brings the CoM towards the right foot, as in the
paper's text. Where a foot carries no load its CoP has a pole: samples near it are left out and the
curve continues in another segment, so no array holds a NaN or an infinity.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError, UnknownNameError, UnloadedContactError
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.family import FourBarSolution
from copsense.paper.closed_form.four_bar_criteria import solve_four_bar

_LEFT, _RIGHT = 0, 1
_BOTH = ("minimum-wrench", "minimum-torque")


@dataclass(frozen=True, eq=False)
class Segment:
    """A stretch of a curve without a pole in it.

    Attributes:
        delta_xi: pi/2 - xi, rising [rad].
        values: the curve's quantity there.
    """

    delta_xi: Float[np.ndarray, "n"]
    values: Float[np.ndarray, "n"]

    def __post_init__(self) -> None:
        """Own read-only copies."""
        for name in ("delta_xi", "values"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


@dataclass(frozen=True)
class Curve:
    """One line of a figure.

    Attributes:
        label: what it shows.
        unit: of the values, "1" if none.
        segments: from left to right.
    """

    label: str
    unit: str
    segments: tuple[Segment, ...]


@dataclass(frozen=True)
class FigureData:
    """The curves of one figure.

    Attributes:
        name: the figure's number in the paper.
        title: what it shows.
        curves: its lines.
    """

    name: str
    title: str
    curves: tuple[Curve, ...]

    def curve(self, label: str) -> Curve:
        """The curve of that label.

        Raises:
            UnknownNameError: there is none.
        """
        for curve in self.curves:
            if curve.label == label:
                return curve
        raise UnknownNameError(
            f"curve of figure {self.name}", label, (c.label for c in self.curves)
        )


@dataclass(frozen=True)
class Sampling:
    """Where the figures are sampled.

    The paper's text gives no range; 25 degrees show the poles of criterion 2, at ±21.9 degrees for
    ``FourBar()``.

    Attributes:
        half_range: largest Delta xi to either side [rad], below pi/2.
        count: samples, two at least.
        least_load: a CoP is left out where its foot carries less than this part of m g.
    """

    half_range: float = math.radians(25.0)
    count: int = 401
    least_load: float = 0.02

    def __post_init__(self) -> None:
        """Reject a range, a count or a load that leaves nothing to sample."""
        if finite_number(self.half_range, "half_range [rad]", positive=True) >= math.pi / 2:
            raise InvalidInputError(
                f"half_range must be below pi/2 (legs on the ground); got {self.half_range!r}. "
                "Give it in radians."
            )
        if self.count < 2:
            raise InvalidInputError(f"count must be 2 or more; got {self.count!r}.")
        if finite_number(self.least_load, "least_load", positive=True) >= 0.5:
            raise InvalidInputError(
                f"least_load must be below 1/2, each foot's load at the centre; got "
                f"{self.least_load!r}."
            )


_DEFAULT = Sampling()


def figure_3a(four_bar: FourBar, sampling: Sampling = _DEFAULT) -> FigureData:
    """CoPs of both feet and the CoM under criterion 1, [Romano2016, Fig. 3a] [m]."""
    return _cop_figure(four_bar, sampling, "3a", "minimum-wrench")


def figure_3b(four_bar: FourBar, sampling: Sampling = _DEFAULT) -> FigureData:
    """CoPs of both feet and the CoM under criterion 2, [Romano2016, Fig. 3b] [m]."""
    return _cop_figure(four_bar, sampling, "3b", "minimum-torque")


def figure_4(four_bar: FourBar, sampling: Sampling = _DEFAULT) -> FigureData:
    """Right foot's vertical force in parts of m g, both criteria, [Romano2016, Fig. 4]."""

    def load(found: FourBarSolution) -> float:
        return float(found.wrenches[_RIGHT, 1] / found.four_bar.weight)

    # The force passes through zero without a pole: no foot, nothing to leave out.
    curves = [_curve(four_bar, sampling, name, name, "1", load) for name in _BOTH]
    return FigureData("4", "vertical force on the right foot over m g", tuple(curves))


def figure_5(four_bar: FourBar, sampling: Sampling = _DEFAULT) -> FigureData:
    """Norm of the right foot's sensitivity, both criteria, [Romano2016, Fig. 5] [m/rad]."""

    def norm(found: FourBarSolution) -> float:
        return float(abs(found.sensitivity[_RIGHT]))

    curves = [_curve(four_bar, sampling, name, name, "m/rad", norm, foot=_RIGHT) for name in _BOTH]
    return FigureData("5", "norm of the right foot's CoP sensitivity", tuple(curves))


def _cop_figure(four_bar: FourBar, sampling: Sampling, name: str, criterion: str) -> FigureData:
    """Both CoPs, each from its foot's point, and the CoM from the centre of the feet."""

    def com(found: FourBarSolution) -> float:
        return float(found.com[0] - found.four_bar.rod_length / 2)

    curves = (
        _curve(
            four_bar, sampling, criterion, "left CoP", "m", lambda f: float(f.cop[0]), foot=_LEFT
        ),
        _curve(
            four_bar, sampling, criterion, "right CoP", "m", lambda f: float(f.cop[1]), foot=_RIGHT
        ),
        _curve(four_bar, sampling, criterion, "CoM", "m", com),
    )
    return FigureData(name, f"CoP of each foot and CoM, {criterion}", curves)


def _curve(
    four_bar: FourBar,
    sampling: Sampling,
    criterion: str,
    label: str,
    unit: str,
    value: Callable[[FourBarSolution], float],
    *,
    foot: int | None = None,
) -> Curve:
    """Sample a value; with `foot`, cut where that foot's load is small or changes its sign."""
    segments: list[Segment] = []
    angles: list[float] = []
    values: list[float] = []
    sign = 0.0

    def close() -> None:
        if angles:
            segments.append(Segment(np.array(angles), np.array(values)))
        angles.clear()
        values.clear()

    for delta in np.linspace(-sampling.half_range, sampling.half_range, sampling.count):
        try:
            found = solve_four_bar(four_bar, math.pi / 2 - delta, criterion)
        except UnloadedContactError:
            close()
            continue
        if foot is not None:
            load = float(found.wrenches[foot, 1] / four_bar.weight)
            if np.sign(load) != sign or abs(load) < sampling.least_load:
                close()
            sign = float(np.sign(load))
            if abs(load) < sampling.least_load:
                continue
        angles.append(float(delta))
        values.append(value(found))
    close()
    return Curve(label, unit, tuple(segments))
