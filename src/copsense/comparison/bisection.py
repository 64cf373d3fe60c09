"""Bisection: between which two values of a disturbance a robot first fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from copsense.errors import InvalidInputError

_FINEST = 1_000_000  # steps of a bisection


@dataclass(frozen=True)
class Bracket:
    """The interval in which something first fails.

    Attributes:
        survived: the most severe value that was survived; NaN if none was.
        failed: the mildest value that was not; NaN if every one was.
        runs: number of values tried.
    """

    survived: float
    failed: float
    runs: int

    @property
    def ends(self) -> tuple[float, float]:
        """Lower and upper end of the known values."""
        known = [x for x in (self.survived, self.failed) if math.isfinite(x)]
        return min(known), max(known)


def count_steps(mild: float, severe: float, step: float) -> int:
    """Number of steps from one end of a bisection to the other.

    Raises:
        InvalidInputError: there are so many that a step vanishes in rounding.
    """
    count = abs(severe - mild) / step
    if not count <= _FINEST:
        raise InvalidInputError(
            f"a bisection from {mild:g} to {severe:g} in steps of {step:g} is finer than any "
            f"simulation. Give {abs(severe - mild) / _FINEST:.1g} or more."
        )
    return max(1, math.ceil(count - 1e-9))


def bisect(survives: Callable[[float], bool], mild: float, severe: float, step: float) -> Bracket:
    """Bisect over mild, mild + step, ..., severe, assuming that `survives` changes only once.

    Args:
        survives: whether a value is survived.
        mild: the end that should survive; tried last, and only if no other value did.
        severe: the end that should fail; tried first.
        step: between the values; the last step is shortened to end at `severe`.

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
