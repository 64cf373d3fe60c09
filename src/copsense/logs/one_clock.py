"""One clock: signals with clocks of their own, on equal steps; gaps stay gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from copsense.errors import InvalidInputError
from copsense.listing import first_few
from copsense.logs.finding import Finding

_EVEN = 1e-3  # of a step: times that differ less from equal steps are equal steps
_GAP = 0.1  # s without a sample that are a gap, or
_STEPS = 5.0  # as many steps, whichever is longer
_AHEAD = 20.0  # times the length that a log's rows make up, from which a jump is not a gap
_BURST = 0.3  # steps that much shorter than usual are samples that were delivered late, together
_CLOSE = 0.9  # steps that late samples are spread by, of the usual one
_BACKWARDS = 0.5  # share of the rows that a clock may lose


@dataclass(frozen=True)
class Clock:
    """A signal's own clock, brought into order.

    Attributes:
        key: of the clock.
        times: (n,) that increase [s].
        rows: (n,) the rows of the signal that have these times.
        findings: what was wrong with it.
    """

    key: str
    times: Float[np.ndarray, " n"]
    rows: Int[np.ndarray, " n"]
    findings: tuple[Finding, ...]

    @property
    def step(self) -> float:
        """The usual time from sample to sample [s]."""
        return float(np.median(np.diff(self.times)))

    @property
    def gap(self) -> float:
        """From this time without a sample on it is a gap [s]."""
        return max(_GAP, _STEPS * self.step)


def ordered(key: str, times: Float[np.ndarray, " N"], what: str) -> Clock:
    """A clock's times in order: rows that are not later than all before them are left out.

    Raises:
        InvalidInputError: it has no two times, or runs backwards for good.
    """
    known = np.isfinite(times)
    latest = np.maximum.accumulate(np.where(known, times, -np.inf))
    later = np.concatenate([[True], times[1:] > latest[:-1]])
    keep = known & later
    rows = np.flatnonzero(keep)
    findings = []
    if not known.all():
        findings.append(
            Finding(
                "clock",
                what,
                f"{int((~known).sum())} rows of {what} have no time, and were left out.",
            )
        )
    back = np.flatnonzero(known & ~later)
    if len(back):
        worst = float(np.max(latest[back - 1] - times[back]))
        first = float(times[rows[0]]) if len(rows) else 0.0
        what_happened = (
            f"runs backwards, by up to {worst:.3g} s," if worst > 0 else "repeats its last time"
        )
        findings.append(
            Finding(
                "clock",
                what,
                f"the clock of {what} {what_happened} at {len(back)} of {len(times)} rows: they "
                "were left out.",
                float(times[back[0]]) - first,
                float(times[back[-1]]) - first,
            )
        )
        if worst > 0 and len(back) > _BACKWARDS * len(times):
            raise InvalidInputError(
                f"the clock of {what} ({key}) runs backwards: {len(back)} of {len(times)} rows are "
                "not later than those before them. Map another clock, or cut the log where it was "
                "set back."
            )
    if len(rows) < 2:
        raise InvalidInputError(
            f"the clock of {what} ({key}) has fewer than two times in order. Map another clock."
        )
    _check_jump(key, what, times[rows])
    own, late = _spread(times[rows])
    if late is not None:
        findings.append(
            Finding(
                "clock",
                what,
                f"{what} came in bursts, {len(late)} samples later than their turn, up to "
                f"{float(np.max(times[rows][late] - own[late])):.3g} s: their times were spread "
                "evenly before the burst.",
                float(own[late[0]] - own[0]),
                float(own[late[-1]] - own[0]),
            )
        )
    return Clock(key, own, rows, tuple(findings))


def _check_jump(key: str, what: str, times: Float[np.ndarray, " n"]) -> None:
    """Reject a clock that is set ahead by more than the log is long.

    Raises:
        InvalidInputError: it is.
    """
    steps = np.diff(times)
    if times[-1] - times[0] > _AHEAD * len(times) * float(np.median(steps)) + 1.0:
        at = int(np.argmax(steps))
        raise InvalidInputError(
            f"the clock of {what} ({key}) jumps ahead by {steps[at]:.4g} s after {at + 1} of "
            f"{len(times)} rows. Map another clock, or cut the log where it was set."
        )


def _spread(
    times: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, " k"] | None]:
    """Times of receipt as times of sampling, and the rows that moved; None where none was late.

    A sample is taken a step before the next, or earlier: t_i = min over j >= i of
    t_j - (j - i) step.
    """
    steps = np.diff(times)
    step = float(np.median(steps))
    short = steps < _BURST * step
    if not short.any() or np.median(steps[~short]) > 1.5 * step:
        return times, None
    ramp = np.arange(len(times)) * (_CLOSE * step)
    sampled = np.minimum.accumulate((times - ramp)[::-1])[::-1] + ramp
    late = np.flatnonzero(times - sampled > _EVEN * step)
    found = times.copy()
    found[late] = sampled[late]
    return found, late


def equal_steps(clock: Clock) -> Float[np.ndarray, " N"]:
    """The times themselves where their steps are equal, and otherwise equal steps through them.

    A last sample before its turn, as simulators record the end of a run, has no row.
    """
    times, step = clock.times, clock.step
    if len(times) > 2 and times[-1] - times[-2] < 0.75 * step:
        times = times[:-1]
    # How many steps each sample is after the one before; the median alone would drift.
    counts = np.maximum(1, np.round(np.diff(times) / step))
    at = np.concatenate([[0.0], np.cumsum(counts)])
    step, first = np.polyfit(at, times - times[0], 1)
    even = times[0] + first + at * step
    if np.abs(even - times).max() < _EVEN * step:
        return times if (counts == 1).all() else times[0] + first + np.arange(at[-1] + 1) * step
    return times[0] + np.arange(int((times[-1] - times[0]) / step + 1e-9) + 1) * step


def gaps(clock: Clock, what: str) -> list[Finding]:
    """Where a clock has no sample for long."""
    at = np.flatnonzero(np.diff(clock.times) > clock.gap)
    if not len(at):
        return []
    spans = [(float(clock.times[i]), float(clock.times[i + 1])) for i in at]
    first = float(clock.times[0])
    shown = first_few((f"{b - a:.3g} s at {a - first:.4g} s" for a, b in spans), 3)
    return [
        Finding(
            "gap",
            what,
            f"{what} has {len(spans)} gap(s): {shown}. Rows in them count as missing.",
            spans[0][0] - first,
            spans[-1][1] - first,
        )
    ]


def in_gap(clock: Clock, times: Float[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Which times lie in a gap of a clock."""
    right = np.clip(np.searchsorted(clock.times, times, side="right"), 1, len(clock.times) - 1)
    left, near = right - 1, _EVEN * clock.step
    wide = clock.times[right] - clock.times[left] > clock.gap
    inside = (times > clock.times[left] + near) & (times < clock.times[right] - near)
    return np.asarray(wide & inside)


def on_clock(
    clock: Clock, values: Float[np.ndarray, "n k"], times: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N k"]:
    """A signal at other times, linear between its samples; NaN in gaps and outside.

    Args:
        clock: its own.
        values: its rows, those of `Clock.rows`.
        times: where it is wanted, of the same origin [s].
    """
    own = clock.times
    if len(own) == len(times) and np.array_equal(own, times):
        return values
    right = np.clip(np.searchsorted(own, times, side="right"), 1, len(own) - 1)
    left = right - 1
    width = own[right] - own[left]
    # A time of its own, but for rounding, gives its own value to the last bit.
    share = ((times - own[left]) / width)[:, None]
    near = _EVEN * clock.step / width[:, None]
    # A time of its own, but for rounding, gives its own value to the last bit.
    between = values[left] + share * (values[right] - values[left])
    found = np.where(
        share <= near, values[left], np.where(share >= 1 - near, values[right], between)
    )
    slack = 0.5 * clock.step
    outside = (times < own[0] - slack) | (times > own[-1] + slack)
    found[outside | in_gap(clock, times)] = np.nan
    return np.asarray(found)
