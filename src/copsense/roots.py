"""Roots: where functions that are known with their slopes at a few places first fall below zero.

Between two places a function is the cubic through its values and slopes there (Hermite), whose
error falls with the fourth power of their distance. Where the function can be evaluated in
between, the root is refined with it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from jaxtyping import Float

_MOST_STEPS = 100  # of the refinement of one root; bisection alone needs half of them
_DIP = 1e-9  # of a function's largest value: how far it must fall to count as below zero in between

Evaluate = Callable[[float], tuple[Float[np.ndarray, " r"], Float[np.ndarray, " r"]]]


class Track:
    """Functions of one variable x >= 0, known with their slopes at places that rise.

    Places are added at the end as a search walks outwards, and in between as a root is refined, so
    that what one function's root takes helps the next.
    """

    def __init__(self, evaluate: Evaluate | None = None) -> None:
        """Begin without a place.

        Args:
            evaluate: x -> values and slopes there (r,) each; None where there is nothing but the
                places that are added, between which the cubics decide.
        """
        self._evaluate = evaluate
        self.places: list[float] = []
        self._values: list[np.ndarray] = []
        self._slopes: list[np.ndarray] = []

    def add(
        self, x: float, values: Float[np.ndarray, " r"], slopes: Float[np.ndarray, " r"]
    ) -> None:
        """Take in what the functions are at a place; slopes that are not known are NaN."""
        i = bisect_left(self.places, x)
        self.places.insert(i, x)
        self._values.insert(i, values)
        self._slopes.insert(i, slopes)

    def values_at(self, x: float) -> Float[np.ndarray, " r"]:
        """What the functions are at a place that was added."""
        return self._at(x)[0]

    def first_zero(
        self, rows: np.ndarray | None = None, *, after: float = 0.0, tolerance: float = 1e-9
    ) -> tuple[float, int] | None:
        """Where one of the functions first falls below zero, and which.

        Args:
            rows: which functions to look at; default all.
            after: look at the places from here on.
            tolerance: of the root, where the functions can be evaluated.

        Returns:
            x and the function's index; x is the first place where a function is below zero there
            already. None if none falls below zero.
        """
        places = self.places[bisect_left(self.places, after) :]
        if not places:
            return None
        wanted = np.arange(len(self._values[0])) if rows is None else rows
        begin = self._at(places[0])[0][wanted]
        if np.any(begin < 0):
            return places[0], int(wanted[int(np.argmin(begin))])
        for a, b in pairwise(places):
            found = self._within(a, b, wanted, tolerance)
            if found:
                return found
        return None

    def _within(
        self, a: float, b: float, rows: np.ndarray, tolerance: float
    ) -> tuple[float, int] | None:
        """The first zero between two places, at the first of which no function is below zero."""
        falling = rows[self._at(b)[0][rows] < 0]
        if not len(falling):
            dip = self._dip(a, b, rows)
            if dip is None:
                return None
            place, row = dip
            if self._evaluate is None:
                return self._root(a, b, row, upper=place), row
            if place not in self.places:
                self.add(place, *self._evaluate(place))
            falling = rows[self._at(place)[0][rows] < 0]
            if not len(falling):
                return None
            b = place
        best: tuple[float, int] | None = None
        while len(falling):
            x, row = min((self._root(a, b, int(i)), int(i)) for i in falling)
            if self._evaluate is None:
                return x, row
            x, near = self._refine(a, b, row, x, tolerance)
            best = min(best, (x, row)) if best else (x, row)
            # Of the others only one that is below zero there already may come before.
            b = min(near, b)
            falling = falling[(self._at(b)[0][falling] < 0) & (falling != row)]
        return best

    def _refine(
        self, a: float, b: float, row: int, guess: float, tolerance: float
    ) -> tuple[float, float]:
        """A root between two places by evaluation, and a place evaluated within the tolerance.

        Each evaluation halves the cubic's interval, or better: it becomes an end of it.
        """
        assert self._evaluate is not None
        step = b - a
        for _ in range(_MOST_STEPS):
            if guess not in self.places:
                self.add(guess, *self._evaluate(guess))
            value = float(self._at(guess)[0][row])
            if value == 0.0:
                return guess, guess
            a, b = (guess, b) if value > 0 else (a, guess)
            better = self._root(a, b, row)
            if abs(better - guess) > 0.5 * step:
                better = (a + b) / 2  # where slopes jump the cubic may not help
            step = abs(better - guess)
            if step <= tolerance:
                return better, guess
            guess = better
        return guess, guess

    def _root(self, a: float, b: float, row: int, *, upper: float | None = None) -> float:
        """The first zero of a function's cubic between two places."""
        h = b - a
        (v0, s0), (v1, s1) = (
            (float(values[row]), h * float(slopes[row]))
            for values, slopes in (self._at(a), self._at(b))
        )
        if v0 <= 0 or h <= 0:
            return a
        end = 1.0 if upper is None else (upper - a) / h
        root = _cubic_root(v0, s0, v1, s1, end)
        return a + h * root

    def _dip(self, a: float, b: float, rows: np.ndarray) -> tuple[float, int] | None:
        """Where a cubic between two places that are not below zero is lowest, if below zero."""
        h = b - a
        (v0, s0), (v1, s1) = self._at(a), self._at(b)
        v0, v1, s0, s1 = v0[rows], v1[rows], h * s0[rows], h * s1[rows]
        # Only what falls at the one end and rises to the other can dip in between.
        for i in np.flatnonzero((v0 > 0) & (s0 < 0) & (s1 > 0)):
            c, d = 3 * (v1[i] - v0[i]) - 2 * s0[i] - s1[i], 2 * (v0[i] - v1[i]) + s0[i] + s1[i]
            lowest = _lowest(s0[i], c, d)
            value = v0[i] + lowest * (s0[i] + lowest * (c + lowest * d))
            if value < -_DIP * max(v0[i], v1[i]):
                return float(a + h * lowest), int(rows[i])
        return None

    def _at(self, x: float) -> tuple[np.ndarray, np.ndarray]:
        i = bisect_left(self.places, x)
        return self._values[i], self._slopes[i]


def first_zero(
    x: Float[np.ndarray, " N"],
    values: Float[np.ndarray, "N *r"],
    slopes: Float[np.ndarray, "N *r"] | None = None,
) -> float:
    """Least x >= 0 at which a function falls to zero; else the last x.

    Args:
        x: rising.
        values: of one or more functions there, positive at x = 0.
        slopes: their derivatives; without them the functions are straight between the places.
    """
    track = Track()
    v = np.reshape(values, (len(x), -1))
    s = np.full(v.shape, np.nan) if slopes is None else np.reshape(slopes, v.shape)
    for place, here, slope in zip(x, v, s, strict=True):
        # To fall to zero is enough, so that what stays on it counts.
        track.add(float(place), np.where(here == 0, -np.finfo(float).tiny, here), slope)
    begin = int(np.searchsorted(x, 0.0, side="right")) - 1
    found = track.first_zero(after=float(x[max(begin, 0)]))
    return float(x[-1]) if found is None else max(found[0], 0.0)


def _cubic_root(v0: float, s0: float, v1: float, s1: float, end: float) -> float:
    """The first zero in (0, end] of the cubic with values v and slopes s at 0 and 1."""
    straight = v0 / (v0 - v1) if v1 < 0 else end
    if not np.isfinite(s0 + s1):
        return straight
    d, c = 2 * (v0 - v1) + s0 + s1, 3 * (v1 - v0) - 2 * s0 - s1
    roots = np.roots([d, c, s0, v0])
    real = roots.real[np.abs(roots.imag) <= 1e-12 * np.maximum(1.0, np.abs(roots))]
    inside = real[(real > 0) & (real <= end)]
    return float(inside.min()) if len(inside) else straight


def _lowest(b: float, c: float, d: float) -> float:
    """Where between 0 and 1 the cubic ... + b u + c u^2 + d u^3 is lowest; it falls, then rises."""
    root = np.sqrt(max(c * c - 3 * b * d, 0.0))
    # The larger root of b + 2 c u + 3 d u^2, written so that it does not cancel.
    u = -b / (c + root) if c + root > 0 else (root - c) / (3 * d) if d else 0.5
    return float(min(max(u, 0.0), 1.0))
