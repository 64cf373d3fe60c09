"""Sampling: which postures a map visits, any stretch of them without the ones before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float

from copsense.arrays import check_name, checked_tuple, finite_number, whole_number
from copsense.errors import InvalidInputError, UnknownNameError

_BITS = 30  # of SciPy's Sobol points: 2^30 of them
_MOST = 2**40  # postures of a grid: a year of one machine
_SEQUENCES = ("sobol", "halton")


@dataclass(frozen=True)
class Axis:
    """A coordinate of a posture chart and its range.

    Attributes:
        name: of the coordinate, as `copsense.batch.PostureChart` takes it.
        start: first value [m or rad].
        stop: last value.
        count: values on a grid, evenly spaced, both ends among them; None for a sample.
    """

    name: str
    start: float
    stop: float
    count: int | None = None

    def __post_init__(self) -> None:
        """Validate the name and the range."""
        check_name(self.name, "the name of a coordinate")
        start = finite_number(self.start, f"the start of {self.name}")
        stop = finite_number(self.stop, f"the end of {self.name}")
        count = self.count
        if count is not None and not _divides(count, start == stop):
            raise InvalidInputError(
                f"{self.name} runs from {start:g} to {stop:g} in {count} values. Give a whole "
                "number of 2 or more, or 1 where both ends are the same."
            )
        if count is None and not start < stop:
            raise InvalidInputError(
                f"the range of {self.name} is empty: {start:g} to {stop:g}. Give START < STOP."
            )

    def at(self, index: np.ndarray) -> np.ndarray:
        """Values of a grid's points by their index along this axis."""
        last = max((self.count or 1) - 1, 1)
        # Both ends are met exactly, and a value depends on its index alone.
        return np.asarray(self.start * ((last - index) / last) + self.stop * (index / last))


def _divides(count: object, single: bool) -> bool:
    """Whether a range can have so many values: one where its ends are the same, or more."""
    try:
        return (whole_number(count, "count") == 1) == single
    except InvalidInputError:
        return False


class _Axes:
    """What a grid and a sample have in common."""

    axes: tuple[Axis, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(axis.name for axis in self.axes)

    @property
    def ends(self) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        """Least and largest value of each coordinate."""
        both = np.array([(axis.start, axis.stop) for axis in self.axes], dtype=float)
        return both.min(axis=1), both.max(axis=1)

    def __len__(self) -> int:
        """Number of postures."""
        raise NotImplementedError

    def _check(self, counted: bool) -> None:
        remedy = 'Give Axis("com_y", -0.05, 0.05, 11), or several.'
        axes = checked_tuple(self.axes, Axis, "coordinate", remedy)
        object.__setattr__(self, "axes", axes)
        if not self.axes or len(set(self.names)) != len(self.names):
            raise InvalidInputError(
                f"a map needs coordinates of distinct names, got {', '.join(self.names) or 'none'}."
                " Give each once, and at least one."
            )
        for axis in self.axes:
            if (axis.count is not None) != counted:
                what = "a grid needs a count" if counted else "a sample takes no count"
                raise InvalidInputError(
                    f"{what} for {axis.name}. Give NAME=START:STOP:COUNT for a grid, or "
                    "NAME=START:STOP and a number of samples."
                )


@dataclass(frozen=True)
class Grid(_Axes):
    """Every combination of evenly spaced values; the last axis runs fastest.

    Attributes:
        axes: the coordinates, each with its count.
    """

    axes: tuple[Axis, ...]

    def __post_init__(self) -> None:
        """Validate the axes: distinct names, each with a count."""
        self._check(counted=True)
        if math.prod(self.shape) > _MOST:
            raise InvalidInputError(
                f"a grid of {' x '.join(map(str, self.shape))} has more than {_MOST} postures. "
                "Give smaller counts, or a sample."
            )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(int(axis.count or 1) for axis in self.axes)

    def __len__(self) -> int:
        """Number of postures."""
        return math.prod(self.shape)

    def values(self, start: int, stop: int) -> Float[np.ndarray, "N k"]:
        """Coordinates of postures start to stop, one row each."""
        index = np.unravel_index(np.arange(start, stop), self.shape)
        return np.column_stack([axis.at(i) for axis, i in zip(self.axes, index, strict=True)])


@dataclass(frozen=True)
class Sample(_Axes):
    """A seeded quasi-random sample: a low-discrepancy sequence, shifted at random modulo 1.

    The shift ([CranleyPatterson1976], doi:10.1137/0713071) is all that the seed decides, so a
    longer sample begins with the shorter one's postures.

    Attributes:
        axes: the coordinates, without counts.
        count: number of postures.
        seed: of the shift.
        sequence: ``"sobol"`` or ``"halton"``.
    """

    axes: tuple[Axis, ...]
    count: int
    seed: int = 0
    sequence: Literal["sobol", "halton"] = "sobol"

    def __post_init__(self) -> None:
        """Validate the axes, without counts, and the numbers."""
        self._check(counted=False)
        if self.sequence not in _SEQUENCES:
            raise UnknownNameError("low-discrepancy sequence", self.sequence, _SEQUENCES)
        most = 2**_BITS
        if whole_number(self.count, "the number of postures of a sample") > most:
            raise InvalidInputError(
                f"a sample has {self.count} postures. Give a whole number from 1 to {most}."
            )
        whole_number(self.seed, "the seed", least=0)

    def __len__(self) -> int:
        """Number of postures."""
        return int(self.count)

    def values(self, start: int, stop: int) -> Float[np.ndarray, "N k"]:
        """Coordinates of postures start to stop, one row each."""
        points = self._sobol(start, stop) if self.sequence == "sobol" else self._halton(start, stop)
        unit = (points + self._shift) % 1.0
        low = np.array([axis.start for axis in self.axes])
        high = np.array([axis.stop for axis in self.axes])
        return np.asarray(low + unit * (high - low))

    def _halton(self, start: int, stop: int) -> Float[np.ndarray, "N k"]:
        from scipy.stats import qmc

        engine = qmc.Halton(len(self.axes), scramble=False)
        return np.asarray(engine.fast_forward(start).random(stop - start))

    def _sobol(self, start: int, stop: int) -> Float[np.ndarray, "N k"]:
        """The sequence is linear over the bits of a point's number: x_i = xor of x_(2^b)."""
        index = np.arange(start, stop)
        points = np.zeros((stop - start, len(self.axes)), dtype=np.int64)
        for b, x in enumerate(self._powers):
            points ^= (index >> b & 1)[:, None] * x
        return points / 2.0**_BITS

    @cached_property
    def _powers(self) -> list[np.ndarray]:
        """Sobol points number 1, 2, 4, ... times 2^bits (k,); points before them are skipped."""
        from scipy.stats import qmc

        engine, found = qmc.Sobol(len(self.axes), scramble=False, bits=_BITS), []
        for b in range(max(len(self) - 1, 1).bit_length()):
            skipped = 2**b - engine.num_generated
            if skipped:
                engine.fast_forward(skipped)
            found.append(np.array(engine.random(1)[0] * 2.0**_BITS, dtype=np.int64))
        return found

    @cached_property
    def _shift(self) -> Float[np.ndarray, " k"]:
        return np.random.default_rng(int(self.seed)).random(len(self.axes))


Sampling: TypeAlias = Grid | Sample


def sampling_of(axes: Sequence[Axis], samples: int | None, seed: int, sequence: str) -> Sampling:
    """A grid of these axes, or where a number of samples is given, a sample."""
    if samples is None:
        return Grid(tuple(axes))
    return Sample(tuple(axes), samples, seed, sequence)  # type: ignore[arg-type]
