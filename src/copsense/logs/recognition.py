"""Recognition: the mapping of a log file whose layout is known, or whose names say enough."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from copsense.errors import InvalidInputError
from copsense.logs.c3d_reading import C3dFile
from copsense.logs.channel import Channel, LogFile, Meaning
from copsense.logs.log_map import COMPONENTS, TIME_UNITS, BaseMap, JointsMap, LogMap, WrenchMap
from copsense.logs.matlab_reading import MatlabFile
from copsense.logs.recording_reading import RecordingFile
from copsense.robot import Robot

_TIMES = ("time", "t", "timestamp", "timestamps", "time_s", "stamp", "seconds")
_PATTERNS = ("{}", "{}_pos", "{}_position", "q_{}", "pos_{}", "position_{}", "{}/position")
_RATES = ("{}_vel", "{}_velocity", "dq_{}", "vel_{}", "velocity_{}", "{}/velocity")
_TORQUES = ("{}_torque", "{}_tau", "{}_effort", "tau_{}", "torque_{}", "effort_{}", "{}/effort")
_OF_JOINTS: tuple[Meaning, ...] = ("velocities", "torques")
_SHORT = ("fx", "fy", "fz", "mx", "my", "mz")
# The public log of a swaying iCub (Ramadoss and others, ICRA 2021), see docs/logs.md.
_BASE_ESTIMATOR = {
    "estimatorJointsTime",
    "estimatorJointsPos",
    "estimatorJointsOrdering",
    "lfForceZ",
    "rfForceZ",
}


def recognise(file: LogFile, robot: Robot | None, contacts: Sequence[str] = ()) -> LogMap:
    """The mapping that a file's layout, or its names, give.

    Args:
        file: the log file.
        robot: whose log it is: its joints and frames identify columns by their names.
        contacts: names or frames of the contacts that force sensors may serve.

    Raises:
        InvalidInputError: nothing says where the joints are; the message lists what there is.
    """
    if isinstance(file, RecordingFile):
        return _recording(file)
    if isinstance(file, MatlabFile) and file.channels.keys() | file.texts >= _BASE_ESTIMATOR:
        return _base_estimator(file)
    positions = _first(file.meaning("positions"), robot)
    if positions is not None:
        return _described(file, positions, robot, contacts)
    found = _by_names(file, robot, contacts)
    if found is not None:
        return found
    if isinstance(file, C3dFile):
        raise InvalidInputError(
            f"{file.path.name} holds force plates and no joints. Give the robot's own log, and "
            f'in its mapping file = "{file.path.name}" under [[wrenches]] (docs/logs.md).'
        )
    held = ", ".join(
        f"{c.key} ({c.width})" if c.width > 1 else c.key for c in list(file.channels.values())[:30]
    )
    more = " ..." if len(file.channels) > 30 else ""
    raise InvalidInputError(
        f"{file.path.name} does not say which of its signals are the joints' positions. Give a "
        f"mapping (--map MAP.toml, see docs/logs.md). It holds: {held}{more}."
    )


def _recording(file: RecordingFile) -> LogMap:
    base = None
    if "configuration/position" in file.channels:
        base = BaseMap("configuration/position", "configuration/rotation")
    return LogMap(
        JointsMap(
            "joint_position",
            "joint_velocity" if "joint_velocity" in file.channels else "",
            "torque" if "torque" in file.channels else "",
        ),
        tuple(
            WrenchMap(c.key.partition("/")[2], {"wrench": c.key}) for c in file.meaning("wrench")
        ),
        base,
        origin="one of copsense's own recordings",
    )


def _base_estimator(file: MatlabFile) -> LogMap:
    base = None
    if {"linkBasePos", "linkBaseRot"} <= file.channels.keys():
        base = BaseMap("linkBasePos", "linkBaseRot", "rpy")
    return LogMap(
        JointsMap("estimatorJointsPos", names=file.texts["estimatorJointsOrdering"], unit="rad"),
        (
            WrenchMap("l_sole", {"force_z": "lfForceZ"}, name="left foot"),
            WrenchMap("r_sole", {"force_z": "rfForceZ"}, name="right foot"),
        ),
        base,
        "estimatorJointsTime",
        origin="the layout of paper_ramadoss_2021_icra_proprioceptive-base-estimator",
    )


def _described(
    file: LogFile, positions: Channel, robot: Robot | None, contacts: Sequence[str]
) -> LogMap:
    """A file whose format says what its channels are."""
    others = {
        meaning: next((c.key for c in file.meaning(meaning) if c.labels == positions.labels), "")
        for meaning in _OF_JOINTS
    }
    sensors = []
    for channel in file.meaning("wrench"):
        sensor = _sensor(channel, robot, contacts)
        if sensor is not None:
            sensors.append(sensor)
        else:
            file.notes.append(
                f"{channel.key} is a wrench"
                + (f" in {channel.frame}" if channel.frame else "")
                + ", and nothing says which contact it serves: it is not used. Map it under "
                "[[wrenches]]."
            )
    base = None
    place = next(iter(file.meaning("base position")), None)
    if place is not None:
        turn = next(c for c in file.meaning("base rotation") if c.clock == place.clock)
        width = file.channels[turn.key].width
        frame = place.frame if robot is not None and place.frame in robot.frame_names else ""
        base = BaseMap(place.key, turn.key, "rpy" if width == 3 else "xyzw", frame)
    return LogMap(
        JointsMap(
            positions.key, others["velocities"], others["torques"], positions.labels, positions.unit
        ),
        tuple(sensors),
        base,
        origin=f"the layout of {file.layout or file.format} files",
    )


def _first(channels: Iterable[Channel], robot: Robot | None) -> Channel | None:
    """Of several channels of joints, the one with most of the robot's."""
    known = set(robot.joint_names) if robot is not None else set()
    found = [c for c in channels if c.labels]
    return max(found, key=lambda c: (len(known & set(c.labels)), len(c.labels)), default=None)


def _sensor(channel: Channel, robot: Robot | None, contacts: Sequence[str]) -> WrenchMap | None:
    """The contact that a sensor's frame, or its name, belongs to."""
    name = channel.frame or channel.key
    if name == "world" and "/" not in channel.key:
        return None  # a force plate: nothing says who stands on it
    if robot is None:
        return WrenchMap(name, {"wrench": channel.key}) if name in contacts else None
    if name in contacts:
        return WrenchMap(name, {"wrench": channel.key})
    if name in robot.frame_names:
        joint = int(robot.frame(name).parentJoint)
        below = [c for c in contacts if joint in robot.model.supports[_joint(robot, c)]]
        if len(below) == 1:
            return WrenchMap(below[0], {"wrench": channel.key}, name=name, frame=name, kind="leg")
        return None
    near = [c for c in contacts if _side(c) and _side(c) == _side(channel.key)]
    if len(near) == 1:
        return WrenchMap(near[0], {"wrench": channel.key}, name=channel.key.partition("/")[0])
    return None


def _joint(robot: Robot, contact: str) -> int:
    return int(robot.frame(contact).parentJoint) if contact in robot.frame_names else 0


def _side(name: str) -> str:
    """Left or right, as names say it."""
    match = re.search(r"(?:^|[^a-z])(l|left|r|right)(?:[^a-z]|$)|^ft([lr])\b", name.lower())
    return "" if match is None else (match[1] or match[2])[0]


def _by_names(file: LogFile, robot: Robot | None, contacts: Sequence[str]) -> LogMap | None:
    """A table whose headings are the robot's joints, and its contacts' forces."""
    if robot is None:
        return None
    keys = {key for key, c in file.channels.items() if c.width == 1}
    positions = _joints_in(keys, _PATTERNS, robot)
    if not positions:
        return None
    time, unit = _time_in(file)
    if not time and not any(c.clock for c in file.channels.values()):
        raise InvalidInputError(
            f"{file.path.name} has no column that looks like its time ({', '.join(_TIMES)}). Give "
            "a mapping with [time] key, or rate_Hz where the rows are at equal steps."
        )
    sensors = []
    for contact in contacts or robot.frame_names:
        for names in (_SHORT, COMPONENTS):
            found = {
                component: key
                for component, short in zip(COMPONENTS, names, strict=True)
                for key in (f"{contact}_{short}", f"{contact} {short}", f"{contact}/{short}")
                if key in keys
            }
            if "force_z" in found:
                sensors.append(WrenchMap(contact, found))
                break
    place = tuple(f"base_{a}" for a in "xyz")
    turn = tuple(f"base_q{a}" for a in "xyzw")
    base = BaseMap(place, turn) if keys >= {*place, *turn} else None
    return LogMap(
        JointsMap(
            positions,
            _joints_in(keys, _RATES, robot) or "",
            _joints_in(keys, _TORQUES, robot) or "",
        ),
        tuple(sensors),
        base,
        time,
        unit,
        origin=f"the headings of {file.path.name}",
    )


def _time_in(file: LogFile) -> tuple[str, str]:
    """Heading and unit of a table's clock, ``time`` or such as ``Time [ms]``; or nothing."""
    for key, channel in file.channels.items():
        name, _, rest = re.sub(r"[(\[]", "[", key.lower()).partition("[")
        unit = rest.rstrip(" )]") if rest else channel.unit_time
        if name.strip() in _TIMES and unit in TIME_UNITS:
            return key, unit
    return "", "s"


def _joints_in(keys: set[str], patterns: Sequence[str], robot: Robot) -> dict[str, str]:
    """Joint -> heading, by the pattern that fits most joints."""
    found = [{j: p.format(j) for j in robot.joint_names if p.format(j) in keys} for p in patterns]
    return max(found, key=len)
