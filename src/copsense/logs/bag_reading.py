"""BagFile: ROS 1 bags, ROS 2 bags (SQLite or MCAP) and single MCAP files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.channel import Channel, LogFile, Meaning, Progress, reading

_LOOKED_AT = 50  # messages of a topic from which its joints are known
_ROWS = 4096

_JOINTS: dict[str, Meaning] = {
    "position": "positions",
    "velocity": "velocities",
    "effort": "torques",
}
_POSES = {
    "nav_msgs/msg/Odometry": lambda m: m.pose.pose,
    "geometry_msgs/msg/PoseStamped": lambda m: m.pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: m.pose.pose,
}
_WRENCHES = {
    "geometry_msgs/msg/WrenchStamped": lambda m: m.wrench,
}
_STATES = "sensor_msgs/msg/JointState"
_TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


class BagFile(LogFile):
    """A bag: joint states, wrenches, odometry, poses and transforms; the rest is passed over."""

    format: ClassVar[str] = "bag"

    def __init__(self, path: Path) -> None:
        """Read the index, and of each topic its first messages."""
        super().__init__(path)
        require("rosbags", "reading a bag")
        self.layout: str = "ROS"
        passed = set()
        with self._opened() as reader:
            for topic in {c.topic: c for c in reader.connections}.values():
                if topic.msgtype == _STATES:
                    self._add_states(reader, topic)
                elif topic.msgtype in _WRENCHES:
                    first = self._first(reader, topic, 1)
                    frame = first[0].header.frame_id if first else ""
                    key = f"{topic.topic}/time"
                    self.add(Channel(key, 1, meaning="time"))
                    wrench = f"{topic.topic}/wrench"
                    self.add(Channel(wrench, 6, (), key, "wrench", frame.lstrip("/")))
                elif topic.msgtype in _POSES:
                    first = self._first(reader, topic, 1)
                    frame = getattr(first[0], "child_frame_id", "") if first else ""
                    self._add_pose(topic.topic, frame.lstrip("/"))
                elif topic.msgtype in _TRANSFORMS and not topic.topic.endswith("tf_static"):
                    pairs = {
                        (t.header.frame_id.lstrip("/"), t.child_frame_id.lstrip("/"))
                        for m in self._first(reader, topic, _LOOKED_AT)
                        for t in m.transforms
                    }
                    for parent, child in sorted(pairs):
                        self._add_pose(f"{topic.topic}/{parent}>{child}", child)
                else:
                    passed.add(topic.topic)
        if passed:
            self.notes.append(f"topics of other types, not read: {', '.join(sorted(passed))}.")
        if not self.channels:
            raise LogReadError(
                f"{path} has no JointState, WrenchStamped, Odometry or transform that can be read."
            )

    def _add_states(self, reader: Any, topic: Any) -> None:
        messages = self._first(reader, topic, _LOOKED_AT)
        names = tuple(dict.fromkeys(name for m in messages for name in m.name))
        if not names:
            self.notes.append(f"{topic.topic} names no joints, and was left out.")
            return
        key = f"{topic.topic}/time"
        self.add(Channel(key, 1, meaning="time"))
        for field, meaning in _JOINTS.items():
            if any(len(getattr(m, field)) for m in messages):
                place = f"{topic.topic}/{field}"
                self.add(Channel(place, len(names), names, key, meaning))

    def _add_pose(self, place: str, frame: str) -> None:
        key = f"{place}/time"
        self.add(Channel(key, 1, meaning="time"))
        self.add(Channel(f"{place}/position", 3, (), key, "base position", frame))
        self.add(Channel(f"{place}/rotation", 4, (), key, "base rotation", frame))

    def _first(self, reader: Any, topic: Any, count: int) -> list[Any]:
        found = []
        with reading(self.path, "bag"):
            for connection, _, raw in reader.messages([topic]):
                found.append(reader.deserialize(raw, connection.msgtype))
                if len(found) == count:
                    break
        return found

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Messages of some topics, in the bag's order."""
        clocks = {self.channels[k].clock or k for k in keys}
        topics = {_topic(c) for c in clocks}
        rows: dict[str, list[dict[str, Any]]] = {clock: [] for clock in clocks}
        with self._opened() as reader:
            wanted = [c for c in reader.connections if c.topic in topics]
            total = sum(c.msgcount for c in wanted)
            share, done = self._size() / max(1, total), 0
            with reading(self.path, "bag"):
                for connection, stamp, raw in reader.messages(wanted):
                    message = reader.deserialize(raw, connection.msgtype)
                    for clock, row in self._rows(connection, stamp, message):
                        if clock not in rows:
                            continue
                        rows[clock].append(row)
                        if len(rows[clock]) >= _ROWS:
                            yield self._block(clock, rows[clock], keys)
                            rows[clock] = []
                    done += 1
                    if done % _ROWS == 0:
                        advance(round(share * _ROWS))
        for clock, left in rows.items():
            if left:
                yield self._block(clock, left, keys)

    def _rows(
        self, connection: Any, stamp: int, message: Any
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """The rows of one message: clock, and key -> numbers."""
        topic, kind = connection.topic, connection.msgtype
        if kind in _TRANSFORMS:
            for t in message.transforms:
                names = (t.header.frame_id.lstrip("/"), t.child_frame_id.lstrip("/"))
                place = f"{topic}/{names[0]}>{names[1]}"
                p, r = t.transform.translation, t.transform.rotation
                yield f"{place}/time", _pose_row(place, _stamp(t, stamp), p, r)
            return
        time = _stamp(message, stamp)
        row: dict[str, Any] = {f"{topic}/time": time}
        if kind == _STATES:
            for field in _JOINTS:
                values = getattr(message, field)
                own = self.channels.get(f"{topic}/{field}")
                if own is None:
                    continue
                if len(values) == len(message.name) and tuple(message.name) == own.labels:
                    row[own.key] = values
                else:
                    by_name = dict(zip(message.name, values, strict=False))
                    row[own.key] = [by_name.get(name, np.nan) for name in own.labels]
        elif kind in _WRENCHES:
            w = _WRENCHES[kind](message)
            f, m = w.force, w.torque
            row[f"{topic}/wrench"] = [f.x, f.y, f.z, m.x, m.y, m.z]
        else:
            pose = _POSES[kind](message)
            row = _pose_row(topic, time, pose.position, pose.orientation)
        yield f"{topic}/time", row

    def _block(
        self, clock: str, rows: list[dict[str, Any]], keys: Sequence[str]
    ) -> dict[str, Float[np.ndarray, "n k"]]:
        own = [k for k in keys if k == clock or self.channels[k].clock == clock]
        return {
            key: np.array([row[key] for row in rows], float).reshape(len(rows), -1)
            for key in dict.fromkeys([*own, clock])
        }

    def _size(self) -> int:
        if self.path.is_dir():
            return sum(f.stat().st_size for f in self.path.iterdir() if f.is_file())
        return self.path.stat().st_size

    @contextmanager
    def _opened(self) -> Iterator[Any]:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        with reading(self.path, "bag"):
            reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
            reader.open()
        try:
            yield reader
        finally:
            reader.close()


def _stamp(message: Any, received: int) -> float:
    """Seconds of the header's stamp, or of the receipt where it has none."""
    header = getattr(message, "header", None)
    if header is not None and (header.stamp.sec or header.stamp.nanosec):
        return float(header.stamp.sec) + float(header.stamp.nanosec) * 1e-9
    return received * 1e-9


def _pose_row(place: str, time: float, position: Any, rotation: Any) -> dict[str, Any]:
    return {
        f"{place}/time": time,
        f"{place}/position": [position.x, position.y, position.z],
        f"{place}/rotation": [rotation.x, rotation.y, rotation.z, rotation.w],
    }


def _topic(clock: str) -> str:
    """The topic of a clock's key: of a transform, without its two frames."""
    place = clock.removesuffix("/time")
    head, arrow, _ = place.rpartition(">")
    return head.rpartition("/")[0] if arrow else place
