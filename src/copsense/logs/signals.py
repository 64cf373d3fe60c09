"""Signals: columns of one log file, each on its clock, at whichever times are asked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.logs.channel import LogFile, Progress
from copsense.logs.collecting import TooLargeError, collect
from copsense.logs.finding import Finding
from copsense.logs.log_map import TIME_UNITS
from copsense.logs.one_clock import Clock, on_clock, ordered
from copsense.logs.selection import Column, one_column

_THINNED = (100.0, 20.0, 5.0)  # Hz, one after the other, where a log is too large for memory
_ROWS_OF_FILE = ""  # the clock of a file that has none


class Signals:
    """Columns of a file that are wanted, and their numbers once they are read."""

    def __init__(self, file: LogFile, time: str, time_unit: str, rows_a_second: float) -> None:
        """Take a file and its mapping's clock: a reference, its unit, or a rate [Hz] without."""
        self.file = file
        self.findings: list[Finding] = []
        self.notes: list[str] = []
        self._time: str = one_column(file, time).key if time else ""
        self._time_unit, self._rows_a_second = time_unit, rows_a_second
        self._data: dict[str, Float[np.ndarray, "N k"]] = {}
        self._clock_of: dict[str, str] = {}
        self._clocks: dict[str, Clock] = {}

    def want(self, columns: Iterable[Column]) -> None:
        """Add columns to those that will be read.

        Raises:
            InvalidInputError: a signal has no clock.
        """
        for column in columns:
            clock = self._clock_of[column.key] = self._clock_for(column.key)
            if clock:
                self._clock_of[clock] = clock

    def read(self, rate: float | None, advance: Progress) -> None:
        """Read what is wanted.

        Args:
            rate: rows a second, each the mean of the samples around it; None for all, or 100,
                20 or 5 Hz where these are too many for memory.
            advance: called with the bytes read.
        """
        if rate is not None and _ROWS_OF_FILE in self._clock_of.values():
            raise InvalidInputError(
                f"{self.file.path.name} has no clock, and cannot be thinned. Leave the rate out."
            )
        for key, clock in self._clock_of.items():  # for a reader to keep rows together
            own = self.file.channels[key]
            meaning = "time" if key == clock else own.meaning
            self.file.channels[key] = replace(own, clock=clock, meaning=meaning)
        self._data = self._collected(rate, advance)
        self._clocks = {clock: self._clock(clock) for clock in set(self._clock_of.values())}
        self.notes += self.file.notes

    def clock(self, column: Column) -> Clock:
        """The clock of a column that was read."""
        return self._clocks[self._clock_of[column.key]]

    def at(
        self, key: str, times: Float[np.ndarray, " N"], later: float = 0.0
    ) -> Float[np.ndarray, "N k"]:
        """A channel at times, linear between its samples; NaN in gaps and outside.

        Args:
            key: of the channel.
            times: [s].
            later: how much later these clocks say the same [s].
        """
        clock = self._clocks[self._clock_of[key]]
        return on_clock(clock, self._data[key][clock.rows], times + later if later else times)

    def _clock_for(self, key: str) -> str:
        """Key of a channel's clock: its own, or the mapping's."""
        own = self.file.channels[key].clock
        # A mapping's clock is for signals that have none, and takes the place of a guess.
        if own in ("", self._time) and self._time:
            return self._time
        if own or self._rows_a_second:
            return own
        raise InvalidInputError(
            f"the signal {key!r} of {self.file.path.name} has no clock. Give [time] key, or "
            "rate_Hz where its rows are at equal steps."
        )

    def _collected(
        self, rate: float | None, advance: Progress
    ) -> dict[str, Float[np.ndarray, "N k"]]:
        tries: tuple[float | None, ...] = (None, *_THINNED) if rate is None else (rate,)
        if _ROWS_OF_FILE in self._clock_of.values():
            tries = tries[:1]
        for hertz in tries:
            rates = {}
            if hertz is not None:
                rates = {c: hertz * self._second(c) for c in set(self._clock_of.values()) if c}
            # The error is let go at once: it would keep what was read so far in memory.
            try:
                found = collect(self.file, sorted(self._clock_of), self._clock_of, rates, advance)
            except TooLargeError:
                if hertz == tries[-1]:
                    raise
                continue
            if hertz != tries[0]:
                self.notes.append(
                    f"too large for memory: read at {hertz:g} Hz, each row the mean of the samples "
                    "around it"
                )
            return found
        raise AssertionError  # the last try returns or raises

    def _second(self, clock: str) -> float:
        """A unit of a clock in seconds."""
        unit = self.file.channels[clock].unit_time
        return TIME_UNITS[self._time_unit if clock == self._time else unit]

    def _clock(self, clock: str) -> Clock:
        what = "the log" if clock in (_ROWS_OF_FILE, self._time) else clock
        if clock == _ROWS_OF_FILE:
            key = next(k for k, c in self._clock_of.items() if c == clock)
            times = np.arange(len(self._data[key])) / self._rows_a_second
        else:
            times = self._data[clock][:, 0] * self._second(clock)
        found = ordered(clock, times, what)
        self.findings += found.findings
        return found
