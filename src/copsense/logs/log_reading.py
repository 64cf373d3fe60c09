"""read_log: a log file, whatever its format, as a `Log`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.channel import LogFile, Progress, no_progress
from copsense.logs.finding import Finding, dated, stretches
from copsense.logs.log import Log, WrenchSeries
from copsense.logs.log_map import COMPONENTS, BaseMap, LogMap, WrenchMap
from copsense.logs.one_clock import Clock, equal_steps, gaps, in_gap
from copsense.logs.opening import open_log_file
from copsense.logs.recognition import recognise
from copsense.logs.rotations import rotation_quaternions
from copsense.logs.selection import Column, joint_columns, one_column, several_columns
from copsense.logs.signals import Signals
from copsense.robot import Robot

_DEAD = 0.5  # s for which a force sensor repeats one number until it counts as dead
_LIVELY = 0.5  # share of the steps at which a number that is measured changes


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
        robot: whose log it is: the names of its joints identify columns, and it says which slide.
        contacts: names of the contacts that the force sensors serve.
        rate: rows a second, each the mean of the samples around it [Hz]; default all rows, or
            100, 20 or 5 Hz where these are too many for memory.
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
    return _Reading(file, chosen, robot).log(rate, advance)


class _Reading:
    """The steps from a file and its mapping to a log."""

    def __init__(self, file: LogFile, log_map: LogMap, robot: Robot | None) -> None:
        self.file, self.map, self.robot = file, log_map, robot
        self.signals = Signals(file, log_map.time, log_map.time_unit, log_map.rate)
        self.others: dict[str, Signals] = {}
        self.findings: list[Finding] = []
        joints = log_map.joints
        self.columns = {
            what: joint_columns(file, spec, joints.names, what) if spec else {}
            for what, spec in (
                ("positions", joints.positions),
                ("velocities", joints.velocities),
                ("torques", joints.torques),
            )
        }
        for columns in self.columns.values():
            self.signals.want(columns.values())
        self.sensors = [self._sensor(w) for w in log_map.wrenches]
        self.base = self._base(log_map.base)
        self.signals.want(self.base)

    def _sensor(self, given: WrenchMap) -> dict[int, Column]:
        """Component 0..5 -> column."""
        signals = self._signals(given)
        if "wrench" in given.keys:
            six = several_columns(signals.file, given.keys["wrench"], 6, "a wrench")
            found = dict(enumerate(six))
        else:
            found = {
                COMPONENTS.index(component): one_column(signals.file, reference)
                for component, reference in given.keys.items()
            }
        signals.want(found.values())
        return found

    def _signals(self, given: WrenchMap) -> Signals:
        """Where a sensor's signals are: in the log, or in a file of its own."""
        if not given.file:
            return self.signals
        if given.file not in self.others:
            file = open_log_file(self.file.path.parent / given.file)
            time = self.map.time if self.map.time in file.channels else ""
            self.others[given.file] = Signals(file, time, self.map.time_unit, 0.0)
        return self.others[given.file]

    def _base(self, base: BaseMap | None) -> list[Column]:
        if base is None:
            return []
        size = {"xyzw": 4, "wxyz": 4, "matrix": 9}.get(base.representation, 3)
        place = several_columns(self.file, base.position, 3, "the base's position")
        return place + several_columns(self.file, base.rotation, size, "the base's rotation")

    def log(self, rate: float | None, advance: Progress) -> Log:
        """Read, bring onto one clock, and check."""
        notes = [f"read by {self.map.origin}"]
        for signals in (self.signals, *self.others.values()):
            signals.read(rate, advance)
            self.findings += signals.findings
            notes += signals.notes
        names = self._joint_names()
        main = self.signals.clock(self.columns["positions"][names[0]])
        times = equal_steps(main)
        self.findings += gaps(main, "the joints")
        self.in_gap = in_gap(main, times)
        if times is not main.times:
            step = float(times[1] - times[0])
            notes.append(
                f"the joints' clock has uneven steps: resampled linearly, to {1 / step:.4g} Hz"
            )
        positions = self._joints("positions", names, times)
        assert positions is not None
        own = times - times[0]
        self._missing("the joints", positions, own)
        log = Log(
            self.file.path.name,
            own,
            tuple(self.map.joints.rename.get(n, n) for n in names),
            positions,
            tuple(self._wrench(i, times, main) for i in range(len(self.sensors))),
            self._joints("velocities", names, times),
            self._joints("torques", names, times),
            self._base_rows(times) if self.base else None,
            self.map.base.frame if self.map.base is not None else "",
            float(times[0]),
            tuple(self.findings),
            tuple(notes),
        )
        twice = [n for n in log.joint_names if log.joint_names.count(n) > 1]
        if twice:
            raise InvalidInputError(
                f"two signals of the log are called {twice[0]!r}. Rename or ignore one of them."
            )
        return log

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
                rows = self.signals.at(key, times)
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

    def _wrench(self, i: int, times: Float[np.ndarray, " N"], main: Clock) -> WrenchSeries:
        """What a sensor measured, without the rows in which it was dead."""
        given, columns = self.map.wrenches[i], self.sensors[i]
        signals, any_of = self._signals(given), next(iter(columns.values()))
        clock, later = signals.clock(any_of), 0.0
        if given.file:
            later = float(clock.times[0] - times[0]) - given.starts
        values = np.full((len(times), 6), np.nan)
        for component, column in columns.items():
            read = signals.at(column.key, times, later)[:, column.index]
            values[:, component] = given.sign * (read - given.offset[component])
        values[np.isinf(values)] = np.nan
        if clock is not main:
            self.findings += gaps(clock, given.name)
        measured = np.isfinite(values).any(axis=0)
        own = times - times[0]
        self._missing(f"the sensor {given.name!r}", values[:, measured], own)
        dead = _repeating(values[:, measured], own)
        found = dated(
            "dead sensor",
            given.name,
            f"the sensor {given.name!r} repeats one number at {{rows}} rows, {{where}}: it was "
            "dead, or the foot in the air, and these rows count as missing.",
            dead,
            own,
        )
        if found is not None:
            self.findings.append(found)
            values[dead] = np.nan
        for lone, stuck in _stuck(values, own).items():
            of_all = lone == "force_z" or given.kind == "leg"
            found = dated(
                "dead sensor",
                given.name,
                f"{lone} of the sensor {given.name!r} repeats one number at {{rows}} rows, "
                "{where}, while its other numbers change: it was dead, and these rows "
                + ("count as missing." if of_all else f"have no {lone}."),
                stuck,
                own,
            )
            assert found is not None
            self.findings.append(found)
            values[stuck, slice(None) if of_all else COMPONENTS.index(lone)] = np.nan
        return WrenchSeries(given.name, given.contact, given.frame, given.kind, values)

    def _base_rows(self, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 7"]:
        assert self.map.base is not None
        read = np.column_stack([self.signals.at(c.key, times)[:, c.index] for c in self.base])
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


def _stuck(values: Float[np.ndarray, "N 6"], times: np.ndarray) -> dict[str, np.ndarray]:
    """Component -> rows in which it alone repeats one number for `_DEAD` and longer.

    A component that seldom changes elsewhere has coarse steps, and one that is zero all along was
    not measured: neither is dead.
    """
    measured = [i for i in range(6) if np.nan_to_num(values[:, i]).any()]
    changes = np.diff(values, axis=0) != 0
    found = {}
    for i in measured:
        rows = _repeating(values[:, [i]], times)
        others = [k for k in measured if k != i]
        if not rows.any() or not others:
            continue
        meanwhile = changes[rows[1:]][:, others].any(axis=1)
        elsewhere = changes[~rows[1:], i]
        if meanwhile.mean() > _LIVELY and (not elsewhere.size or elsewhere.mean() > _LIVELY):
            found[COMPONENTS[i]] = rows
    return found


def _repeating(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Rows in stretches of `_DEAD` and longer in which no number changes at all."""
    dead = np.zeros(len(times), bool)
    if values.shape[1]:
        still = np.concatenate([[False], (np.diff(values, axis=0) == 0).all(axis=1)])
        for first, last in stretches(still):
            if times[last] - times[first - 1] >= _DEAD:
                dead[first - 1 : last + 1] = True
    return dead
