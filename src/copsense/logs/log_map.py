"""LogMap: which signal of a log file is what; written once to TOML and used again.

    [time]
    key = "t"
    [joints]
    positions = "q_*"            # columns by a pattern, or one array with `names`, or a table
    unit = "deg"
    [[wrenches]]
    contact = "l_sole"
    force_z = "lfForceZ"         # or wrench = "FT_left", six numbers

A reference is the key of a signal, or ``key[3]`` or ``key[label]`` for one of its columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import tomli_w

from copsense.arrays import check_keys, finite_array, finite_number
from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.files import check_output, read_toml, write_beside
from copsense.logs.log import SENSOR_KINDS, SensorKind
from copsense.robots.stance_tables import list_of, table_of

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
Rotation = Literal["xyzw", "wxyz", "rpy", "rpy_deg", "ypr", "matrix"]
ROTATIONS: tuple[Rotation, ...] = get_args(Rotation)
COMPONENTS = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")

# One text (an array, or a pattern with * for the joint's name), or joint -> reference.
Columns = str | Mapping[str, str]


@dataclass(frozen=True)
class JointsMap:
    """Where the joints are.

    Attributes:
        positions: the array, a pattern such as ``"q_*"``, or joint -> reference.
        velocities: the same of velocities, or empty.
        torques: the same of torques, or empty.
        names: joints of an array's columns; empty where the file says them.
        unit: of positions and velocities: ``"rad"``, ``"deg"``, or empty for what the file says,
            and radians otherwise. Slides are in metres.
        rename: joint in the log -> joint of the robot.
        ignore: joints of the log that are left out.
    """

    positions: Columns
    velocities: Columns = ""
    torques: Columns = ""
    names: tuple[str, ...] = ()
    unit: str = ""
    rename: Mapping[str, str] = field(default_factory=dict)
    ignore: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the mappings; check the unit."""
        freeze(self, "positions", "velocities", "torques", "rename")
        if self.unit not in ("", "rad", "deg"):
            raise UnknownNameError("unit of joints", self.unit, ("rad", "deg"))


@dataclass(frozen=True)
class WrenchMap:
    """Where a force sensor's numbers are.

    Attributes:
        contact: name of the contact, or of its frame in the robot's model.
        keys: component (``force_x`` ... ``moment_z``) -> reference; or ``wrench`` -> six columns.
        name: of the sensor; default the contact's.
        frame: as in `WrenchSeries`.
        kind: as in `WrenchSeries`.
        sign: -1 where the log holds what the robot does to the environment.
        offset: six numbers that are taken off what was read, before the sign [N, Nm].
        file: another file that holds the sensor, such as the laboratory's force plates, seen from
            the log; empty for the log itself.
        starts: how long after the log's first sample that file's first one is [s].
    """

    contact: str
    keys: Mapping[str, str]
    name: str = ""
    frame: str = ""
    kind: SensorKind = "sole"
    sign: float = 1.0
    offset: tuple[float, ...] = (0.0,) * 6
    file: str = ""
    starts: float = 0.0

    def __post_init__(self) -> None:
        """Check components, kind, sign and offset."""
        object.__setattr__(self, "name", self.name or self.contact)
        freeze(self, "keys")
        for key in self.keys:
            if key not in (*COMPONENTS, "wrench"):
                raise UnknownNameError("component of a wrench", key, (*COMPONENTS, "wrench"))
        if "wrench" not in self.keys and "force_z" not in self.keys:
            raise InvalidInputError(
                f"the sensor {self.name!r} has no normal force. Map wrench (six numbers) or "
                "force_z."
            )
        if "wrench" in self.keys and len(self.keys) > 1:
            raise InvalidInputError(
                f"the sensor {self.name!r} maps the whole wrench and components of it too. Give "
                "one of them."
            )
        if self.kind not in SENSOR_KINDS:
            raise UnknownNameError("kind of force sensor", self.kind, SENSOR_KINDS)
        if self.sign not in (-1, 1):
            raise InvalidInputError(f"the sign of {self.name!r} is {self.sign}. Give 1 or -1.")
        six = finite_array(self.offset, f"the offset of {self.name!r}", (6,), "force, moment")
        object.__setattr__(self, "offset", tuple(six.tolist()))
        finite_number(self.starts, f"when the file of {self.name!r} starts [s]")


@dataclass(frozen=True)
class BaseMap:
    """Where the pose of the base is.

    Attributes:
        position: three columns [m].
        rotation: the columns that turn the base into the world.
        representation: ``"xyzw"`` or ``"wxyz"`` (quaternions), ``"rpy"`` or ``"rpy_deg"`` (fixed
            axes x, y, z), ``"ypr"`` (the same three, yaw first) or ``"matrix"`` (row by row).
        frame: frame of the robot's model; empty for its root link.
    """

    position: str | tuple[str, ...]
    rotation: str | tuple[str, ...]
    representation: Rotation = "xyzw"
    frame: str = ""

    def __post_init__(self) -> None:
        """Check the representation."""
        if self.representation not in ROTATIONS:
            raise UnknownNameError("representation of rotations", self.representation, ROTATIONS)


@dataclass(frozen=True)
class LogMap:
    """Which signal of a log file is what.

    Attributes:
        joints: where the joints are.
        wrenches: the force sensors.
        base: where the base is, or None.
        time: reference to the clock of signals that have none of their own; empty where all have.
        time_unit: of that clock: ``"s"``, ``"ms"``, ``"us"`` or ``"ns"``.
        rate: rows a second of a file without a clock [Hz]; zero where it has one.
        origin: how it came about, for messages.
    """

    joints: JointsMap
    wrenches: tuple[WrenchMap, ...] = ()
    base: BaseMap | None = None
    time: str = ""
    time_unit: str = "s"
    rate: float = 0.0
    origin: str = "a mapping"

    def __post_init__(self) -> None:
        """Check the clock's unit, and that sensors have distinct names."""
        if self.time_unit not in TIME_UNITS:
            raise UnknownNameError("unit of time", self.time_unit, TIME_UNITS)
        names = [w.name for w in self.wrenches]
        if len(set(names)) != len(names):
            raise InvalidInputError(
                f"two sensors of the mapping have one name ({', '.join(names)}). Give each its own."
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain data of this mapping, for TOML: `from_dict` reads it back."""
        joints = {
            "positions": _plain(self.joints.positions),
            "velocities": _plain(self.joints.velocities),
            "torques": _plain(self.joints.torques),
            "names": list(self.joints.names),
            "unit": self.joints.unit,
            "rename": dict(self.joints.rename),
            "ignore": list(self.joints.ignore),
        }
        data: dict[str, Any] = {
            "time": _given({"key": self.time, "unit": self.time_unit if self.time else ""})
            | ({"rate_Hz": self.rate} if self.rate else {}),
            "joints": _given(joints),
            "wrenches": [
                _given({"name": w.name, "contact": w.contact, "frame": w.frame, "kind": w.kind})
                | dict(w.keys)
                | ({"sign": int(w.sign)} if w.sign != 1 else {})
                | ({"offset": list(w.offset)} if any(w.offset) else {})
                | ({"file": w.file, "starts": w.starts} if w.file else {})
                for w in self.wrenches
            ],
        }
        if self.base is not None:
            data["base"] = _given(
                {
                    "position": _plain(self.base.position),
                    "rotation": _plain(self.base.rotation),
                    "representation": self.base.representation,
                    "frame": self.base.frame,
                }
            )
        return _given(data)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], origin: str = "a mapping") -> LogMap:
        """The mapping that `to_dict` wrote, or a person.

        Raises:
            UnknownNameError: an unknown key.
            InvalidInputError: something is missing, or of the wrong kind.
        """
        check_keys(data, ("time", "joints", "wrenches", "base"), "a log's mapping")
        time = table_of(data.get("time", {}), "time")
        check_keys(time, ("key", "unit", "rate_Hz"), "[time]")
        joints = table_of(data.get("joints", {}), "joints")
        check_keys(joints, tuple(JointsMap.__dataclass_fields__), "[joints]")
        if "positions" not in joints:
            raise InvalidInputError(
                f"{origin} does not say where the joint positions are. Give positions under "
                '[joints]: an array, a pattern such as "q_*", or a table of joint = column.'
            )
        base = table_of(data["base"], "base") if "base" in data else None
        if base is not None:
            check_keys(base, tuple(BaseMap.__dataclass_fields__), "[base]")
            if "position" not in base or "rotation" not in base:
                raise InvalidInputError(
                    f"{origin}: [base] needs position and rotation. Give both, or leave it out."
                )
        given = list_of(data.get("wrenches", []), "wrenches")
        try:
            rate = float(time.get("rate_Hz", 0.0))
            return cls(
                JointsMap(**{k: _own(v) for k, v in joints.items()}),
                tuple(_wrench(w) for w in given),
                None if base is None else BaseMap(**{k: _own(v) for k, v in base.items()}),
                str(time.get("key", "")),
                str(time.get("unit", "s")),
                rate,
                origin,
            )
        except (TypeError, ValueError) as error:
            if isinstance(error, InvalidInputError):
                raise
            raise InvalidInputError(f"{origin} cannot be read: {error}.") from None

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the mapping as TOML.

        Raises:
            OutputError: the file exists, or cannot be written.
        """
        target = check_output(path, suffixes=(".toml",), overwrite=overwrite)
        text = tomli_w.dumps(self.to_dict())
        write_beside(target, lambda place: place.write_text(text, encoding="utf-8"))
        return target

    @classmethod
    def load(cls, path: str | Path) -> LogMap:
        """Read a mapping in TOML.

        Raises:
            InvalidInputError: there is no such file, or it is not a mapping.
        """
        remedy = (
            "Give a .toml file, or leave it out: many layouts are recognised, and --save-map "
            "writes what was."
        )
        return cls.from_dict(read_toml(path, "mapping", remedy), str(path))


def _wrench(data: Mapping[str, Any]) -> WrenchMap:
    own = ("name", "contact", "frame", "kind", "sign", "offset", "file", "starts")
    check_keys(data, (*own, *COMPONENTS, "wrench"), "[[wrenches]]")
    if not data.get("contact"):
        raise InvalidInputError(
            "a sensor of [[wrenches]] does not say which contact it serves. Give contact: the "
            "frame of the foot in the robot's model."
        )
    keys = {k: _text(v, k) for k, v in data.items() if k not in own}
    return WrenchMap(keys=keys, **{k: _own(v) for k, v in data.items() if k in own})


def _text(value: object, what: str) -> str:
    if not isinstance(value, str):
        raise InvalidInputError(f"{what} of a log's mapping is {value!r}. Give a signal's key.")
    return value


def _own(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    return list(value) if isinstance(value, tuple) else value


def _given(data: dict[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in data.items() if v not in ("", [], {}, ())}
