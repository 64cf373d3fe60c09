"""read_log: a log file, whatever its format, as a `Log`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.channel import LogFile, Progress, no_progress
from copsense.logs.collecting import TooLargeError, collect
from copsense.logs.finding import Finding, dated, stretches
from copsense.logs.log import Log, WrenchSeries
from copsense.logs.log_map import COMPONENTS, TIME_UNITS, BaseMap, LogMap
from copsense.logs.one_clock import Clock, equal_steps, gaps, in_gap, on_clock, ordered
from copsense.logs.opening import open_log_file
from copsense.logs.recognition import recognise
from copsense.logs.rotations import rotation_quaternions
from copsense.logs.selection import Column, joint_columns, one_column, several_columns
from copsense.robot import Robot

_DEAD = 0.5  # s for which a force sensor repeats one number until it counts as dead
_THINNED = 100.0  # Hz that a log is thinned to where it is too large for memory
_ROWS_OF_FILE = ""  # the clock of a file that has none


def read_log(
    path: str | Path,
    log_map: LogMap | str | Path | None = None,
    *,
    robot: Robot | None = None,
    contacts: Sequence[str] = (),
    rate: float | None = None,
    advance: Progress = no_progress,
) -> Log:
    """Read what a robot recorded.

    Args:
        path: CSV, Parquet, MATLAB, ROS bag, MCAP, C3D, Eurobench folder, or one of copsense's own
            recordings.
        log_map: which signal is what: a mapping, or its TOML file; default what the layout or the
            names of the signals say.
        robot: whose log it is; tells columns by the names of its joints, and which joints slide.
        contacts: names of the contacts that the force sensors serve.
        rate: rows a second, each the mean of the samples around it [Hz]; default all rows, or 100
            Hz where these are too many for memory.
        advance: called with the bytes read, for a progress bar.

    Raises:
        LogReadError: no such file, a damaged one, or one of another format.
        UnknownNameError: the mapping names a signal that the file has not.
        InvalidInputError: the mapping does not fit, or nothing says where the joints are.
        MissingExtraError: the format's reader is not installed.
    """
    if rate is not None:
        rate = finite_number(rate, "the rate of a log [Hz]", positive=True)
    file = open_log_file(path)
    chosen = log_map if isinstance(log_map, LogMap | None) else LogMap.load(log_map)
    if chosen is None:
        chosen = recognise(file, robot, contacts)
    return _Reading(file, chosen, robot, rate, advance).log()


class _Reading:
    """The steps from a file and its mapping to a log."""

    def __init__(
        self,
        file: LogFile,
        log_map: LogMap,
        robot: Robot | None,
        rate: float | None,
        advance: Progress,
    ) -> None:
        self.file, self.map, self.robot = file, log_map, robot
        self.rate, self.advance = rate, advance
        self.findings: list[Finding] = []
        self.notes: list[str] = [f"read by {log_map.origin}"]
        joints = log_map.joints
        self.columns = {
            what: joint_columns(file, spec, joints.names, what) if spec else {}
            for what, spec in (
                ("positions", joints.positions),
                ("velocities", joints.velocities),
                ("torques", joints.torques),
            )
        }
        self.sensors = [self._sensor(w.keys) for w in log_map.wrenches]
        self.base = self._base(log_map.base)

    def _sensor(self, given: Mapping[str, str]) -> dict[int, Column]:
        """Component 0..5 -> column."""
        if "wrench" in given:
            six = several_columns(self.file, given["wrench"], 6, "a wrench")
            return dict(enumerate(six))
        return {COMPONENTS.index(k): one_column(self.file, v) for k, v in given.items()}

    def _base(self, base: BaseMap | None) -> list[Column]:
        if base is None:
            return []
        size = {"xyzw": 4, "wxyz": 4, "matrix": 9}.get(base.representation, 3)
        place = several_columns(self.file, base.position, 3, "the base's position")
        return place + several_columns(self.file, base.rotation, size, "the base's rotation")

    def log(self) -> Log:
        """Read, bring onto one clock, and check."""
        used = {c.key for columns in self.columns.values() for c in columns.values()}
        used |= {c.key for sensor in self.sensors for c in sensor.values()}
        used |= {c.key for c in self.base}
        clocks = {key: self._clock_of(key) for key in used}
        clocks |= {clock: clock for clock in set(clocks.values()) if clock}
        for key, clock in clocks.items():  # as mapped, for a reader to keep rows together
            own = self.file.channels[key]
            meaning = "time" if key == clock else own.meaning
            self.file.channels[key] = replace(own, clock=clock, meaning=meaning)
        self.data = self._collected(clocks)
        self.clocks = {clock: self._clock(clock) for clock in set(clocks.values())}
        self.clock_of = clocks
        names = self._joint_names()
        first = self.clock_of[next(iter(self.columns["positions"].values())).key]
        main = self.clocks[first]
        times = equal_steps(main)
        self.findings += gaps(main, "the joints")
        if times is not main.times:
            self.notes.append(
                "the joints' clock has uneven steps: resampled linearly, to "
                f"{1 / (times[1] - times[0]):.4g} Hz"
            )
        positions = self._joints("positions", names, times)
        assert positions is not None
        wrenches = [self._wrench(i, times, first) for i in range(len(self.map.wrenches))]
        base = self._base_rows(times) if self.base else None
        start = float(times[0])
        times = times - start
        self.in_gap = in_gap(main, times + start)
        self._missing("the joints", positions, times)
        log = Log(
            self.file.path.name,
            times,
            tuple(self.map.joints.rename.get(n, n) for n in names),
            positions,
            tuple(self._checked(w, times) for w in wrenches),
            self._joints("velocities", names, times + start),
            self._joints("torques", names, times + start),
            base,
            self.map.base.frame if self.map.base is not None else "",
            start,
            tuple(self.findings),
            tuple(self.notes + self.file.notes),
        )
        twice = [n for n in log.joint_names if log.joint_names.count(n) > 1]
        if twice:
            raise InvalidInputError(
                f"two signals of the log are called {twice[0]!r}. Rename or ignore one of them."
            )
        return log

    def _clock_of(self, key: str) -> str:
        """Key of a channel's clock: its own, or the mapping's."""
        own = self.file.channels[key].clock
        # A mapping's clock is for signals that have none, and takes the place of a guess.
        if self.map.time and own in ("", self.map.time):
            return one_column(self.file, self.map.time).key
        if own or self.map.rate:
            return own
        if self.map.time:
            return one_column(self.file, self.map.time).key
        raise InvalidInputError(
            f"the signal {key!r} of {self.file.path.name} has no clock. Give [time] key, or "
            "rate_Hz where its rows are at equal steps."
        )

    def _collected(self, clocks: dict[str, str]) -> dict[str, np.ndarray]:
        keys = sorted(clocks)
        scale = {c: 1.0 / self._second(c) for c in clocks.values() if c}
        units = set(scale.values())
        rate = None if self.rate is None else self.rate / (units.pop() if len(units) == 1 else 1.0)
        try:
            return collect(self.file, keys, clocks, rate, self.advance)
        except TooLargeError:
            if self.rate is not None:
                raise
            self.rate = _THINNED
            self.notes.append(
                f"too large for memory: read at {_THINNED:g} Hz, each row the mean of the samples "
                "around it"
            )
            return self._collected(clocks)

    def _second(self, clock: str) -> float:
        """A unit of a clock in seconds."""
        channel = self.file.channels[clock]
        unit = self.map.time_unit if clock == _key(self.map.time) else channel.unit_time
        return TIME_UNITS[unit]

    def _clock(self, clock: str) -> Clock:
        what = "the log" if clock in ("", _key(self.map.time)) else clock
        if clock == _ROWS_OF_FILE:
            rows = len(next(r for k, r in self.data.items() if self.clock_of_key(k) == ""))
            times = np.arange(rows) / self.map.rate
        else:
            times = self.data[clock][:, 0] * self._second(clock)
        found = ordered(clock, times, what)
        self.findings += found.findings
        return found

    def clock_of_key(self, key: str) -> str:
        """Key of a collected channel's clock."""
        return self.file.channels[key].clock

    def _joint_names(self) -> list[str]:
        """The joints of the log, those to be ignored left out."""
        ignored = set(self.map.joints.ignore)
        known = self.columns["positions"]
        for name in ignored | set(self.map.joints.rename):
            if name not in known:
                raise UnknownNameError("joint in the log", name, known)
        names = [name for name in known if name not in ignored]
        if not names:
            raise InvalidInputError("every joint of the log is ignored. Leave some.")
        return names

    def _joints(
        self, what: str, names: Sequence[str], times: Float[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N nj"] | None:
        columns = self.columns[what]
        if not columns:
            return None
        found = np.full((len(times), len(names)), np.nan)
        for key in dict.fromkeys(c.key for c in columns.values()):
            at = [i for i, n in enumerate(names) if n in columns and columns[n].key == key]
            if at:
                rows = self._rows(key, times)
                found[:, at] = rows[:, [columns[names[i]].index for i in at]]
        if what != "torques":
            found[:, [i for i, n in enumerate(names) if self._turns(n)]] *= self._angle(columns)
        return found

    def _angle(self, columns: dict[str, Column]) -> float:
        unit = self.map.joints.unit
        if not unit:
            units = {self.file.channels[c.key].unit for c in columns.values()}
            unit = "deg" if units == {"deg"} else "rad"
        return math.pi / 180 if unit == "deg" else 1.0

    def _turns(self, joint: str) -> bool:
        """Whether a joint is an angle; it is where the robot does not say."""
        joint = self.map.joints.rename.get(joint, joint)
        if self.robot is None or joint not in self.robot.joint_names:
            return True
        return self.robot.joint_unit(joint) == "rad"

    def _rows(self, key: str, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N k"]:
        clock = self.clocks[self.clock_of[key]]
        return on_clock(clock, self.data[key][clock.rows], times)

    def _wrench(self, i: int, times: Float[np.ndarray, " N"], main: str) -> WrenchSeries:
        given, columns = self.map.wrenches[i], self.sensors[i]
        values = np.full((len(times), 6), np.nan)
        for component, column in columns.items():
            values[:, component] = self._rows(column.key, times)[:, column.index]
            values[:, component] -= given.offset[component]
        values *= given.sign
        clock = self.clock_of[next(iter(columns.values())).key]
        if clock != main:
            self.findings += gaps(self.clocks[clock], given.name)
        return WrenchSeries(given.name, given.contact, given.frame, given.kind, values)

    def _base_rows(self, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 7"]:
        assert self.map.base is not None
        read = np.column_stack([self._rows(c.key, times)[:, c.index] for c in self.base])
        turned = rotation_quaternions(read[:, 3:], self.map.base.representation)
        return np.hstack([read[:, :3], turned])

    def _missing(self, what: str, values: np.ndarray, times: np.ndarray) -> None:
        lost = ~np.isfinite(values).all(axis=1) & ~self.in_gap
        found = dated(
            "missing",
            what,
            f"{{rows}} rows of {what} are missing, of {len(times)}: {{where}}.",
            lost,
            times,
        )
        if found is not None:
            self.findings.append(found)

    def _checked(self, series: WrenchSeries, times: np.ndarray) -> WrenchSeries:
        """A sensor's rows without those in which it was dead."""
        values = np.array(series.values)
        measured = np.isfinite(values).any(axis=0)
        self._missing(f"the sensor {series.name!r}", values[:, measured], times)
        dead = _repeating(values[:, measured], times)
        found = dated(
            "dead sensor",
            series.name,
            f"the sensor {series.name!r} repeats one number at {{rows}} rows, {{where}}: it was "
            "dead, or the foot in the air, and these rows count as missing.",
            dead,
            times,
        )
        if found is not None:
            self.findings.append(found)
            values[dead] = np.nan
        return WrenchSeries(series.name, series.contact, series.frame, series.kind, values)


def _repeating(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Rows in stretches of `_DEAD` and longer in which no number changes at all."""
    dead = np.zeros(len(times), bool)
    if values.shape[1]:
        still = np.concatenate([[False], (np.diff(values, axis=0) == 0).all(axis=1)])
        for first, last in stretches(still):
            if times[last] - times[first - 1] >= _DEAD:
                dead[first - 1 : last + 1] = True
    return dead


def _key(reference: str) -> str:
    return reference.partition("[")[0]
