"""Intervals: how sure a rate, a correlation or a bisected value is."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from copsense.errors import InvalidInputError

_FINEST = 1_000_000  # steps of a bisection
_Z = 1.959963984540054  # of a two-sided 95 % interval


def wilson_interval(hits: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a rate of `hits` in `count`, Wilson 1927, doi:10.2307/2276774.

    Unlike the usual one it stays in [0, 1] and says something for no hits at all.
    """
    if count < 1:
        return 0.0, 1.0
    p, z2 = hits / count, _Z**2 / count
    middle = (p + z2 / 2) / (1 + z2)
    half = _Z / (1 + z2) * math.sqrt(p * (1 - p) / count + z2 / (4 * count))
    # No hits and all hits have an end in common with the rate; rounding must not pass it.
    low = 0.0 if hits == 0 else middle - half
    return low, 1.0 if hits == count else middle + half


def fisher_interval(correlation: float, count: int) -> tuple[float, float]:
    """The 95 % interval of Pearson's r over `count` cases, by Fisher's z; NaN under four."""
    if count < 4 or not abs(correlation) <= 1:
        return math.nan, math.nan
    if abs(correlation) == 1:
        return correlation, correlation
    z, half = math.atanh(correlation), _Z / math.sqrt(count - 3)
    return math.tanh(z - half), math.tanh(z + half)


@dataclass(frozen=True)
class Bracket:
    """Where something breaks.

    Attributes:
        survived: the most severe value survived, NaN where none was.
        failed: the mildest value that was not, NaN where every one was.
        runs: how many values were tried.
    """

    survived: float
    failed: float
    runs: int

    @property
    def ends(self) -> tuple[float, float]:
        """Lower and upper end; infinite where nothing broke, or everything did."""
        known = [x for x in (self.survived, self.failed) if math.isfinite(x)]
        return min(known), max(known)


def count_steps(mild: float, severe: float, step: float) -> int:
    """How many steps lead from one end of a bisection to the other.

    Raises:
        InvalidInputError: so many that a step is lost in rounding.
    """
    count = abs(severe - mild) / step
    if not count <= _FINEST:
        raise InvalidInputError(
            f"a bisection from {mild:g} to {severe:g} in steps of {step:g} is finer than any "
            f"simulation. Give {abs(severe - mild) / _FINEST:.1g} or more."
        )
    return max(1, math.ceil(count - 1e-9))


def bisect(survives: Callable[[float], bool], mild: float, severe: float, step: float) -> Bracket:
    """Bisect over mild, mild + step, ..., severe for where `survives` changes, taken as once.

    Args:
        survives: asked of a value.
        mild: the end that should survive; it is asked last, and only if nothing else did.
        severe: the end that should not; it is asked first.
        step: between the values; the last one is shortened to end at `severe`.

    Raises:
        InvalidInputError: the step is a millionth of the range or less.
    """
    direction = 1.0 if severe >= mild else -1.0
    count = count_steps(mild, severe, step)

    def value(k: int) -> float:
        # Rounded, so that 0.3 is tried and not 0.30000000000000004.
        return severe if k == count else round(mild + direction * k * step, 12)

    runs = 1
    if survives(value(count)):
        return Bracket(value(count), math.nan, runs)
    low, high = 0, count
    while high - low > 1:
        middle, runs = (low + high) // 2, runs + 1
        if survives(value(middle)):
            low = middle
        else:
            high = middle
    if low == 0:
        runs += 1
        if not survives(value(0)):
            return Bracket(math.nan, value(0), runs)
    return Bracket(value(low), value(high), runs)
