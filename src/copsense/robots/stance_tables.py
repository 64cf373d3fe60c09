"""The tables of a stance file: what each says, and how it is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Literal, TypeGuard

import numpy as np
import pinocchio as pin

from copsense.arrays import check_keys, finite_array, finite_number
from copsense.contact import Contact, Plane
from copsense.drives import Coupling, Drives, Loop, Spring, Transmission
from copsense.errors import InvalidInputError
from copsense.loads import Load, SpringLoad
from copsense.robot import Robot
from copsense.stance import Stance


def is_stance_file(source: object) -> TypeGuard[str | Path]:
    """Whether what is given for a robot is the path of a stance file, by its ending."""
    return isinstance(source, str | Path) and str(source).endswith(".toml")


def configuration_data(stance: Stance) -> dict[str, Any]:
    """``[configuration]``: the base as in q, then each joint by name."""
    robot, q = stance.robot, stance.q
    base = robot.model.joints[1]
    data: dict[str, Any] = {"base": q[: base.nq].tolist()}
    for key, unit in (("joints_rad", "rad"), ("joints_m", "m")):
        data[key] = {}
        for name in robot.joint_names:
            joint = robot.model.joints[robot.joint_id(name)]
            if joint.nv == 1 and robot.joint_unit(name) == unit:
                data[key][name] = robot.joint_position(q, name)
    data["joints_q"] = {
        name: q[joint.idx_q : joint.idx_q + joint.nq].tolist()
        for name in robot.joint_names
        if (joint := robot.model.joints[robot.joint_id(name)]).nv != 1
    }
    return {key: value for key, value in data.items() if value != {}}


def read_configuration(robot: Robot, data: Mapping[str, Any]) -> np.ndarray:
    """The configuration (nq,) that ``[configuration]`` says."""
    check_keys(data, ("base", "joints_rad", "joints_m", "joints_q"), "a configuration")
    named = {**table_of(data.get("joints_rad", {}), "joints_rad")}
    named |= table_of(data.get("joints_m", {}), "joints_m")
    missing = set(robot.joint_names) - set(named) - set(data.get("joints_q", {}))
    if missing:
        raise InvalidInputError(
            f"the configuration leaves out {', '.join(sorted(missing))}. Give every joint that is "
            "not locked, or a [posture_deg] to stand near to."
        )
    q = np.array(robot.configuration(named))
    for name, values in table_of(data.get("joints_q", {}), "joints_q").items():
        joint = robot.model.joints[robot.joint_id(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = finite_array(values, name, (joint.nq,))
    nq = int(robot.model.joints[1].nq)
    meaning = "position [m], then the quaternion x, y, z, w" if nq == 7 else "x, y, cosine, sine"
    q[:nq] = finite_array(data.get("base"), "the base of the configuration", (nq,), meaning)
    return q


def read_positions(data: Mapping[str, Any], name: str) -> dict[str, float]:
    """``[NAME_deg]``, ``_rad`` and ``_m``: joint -> position [rad, or m].

    Raises:
        InvalidInputError: a joint in two of them, or no number.
    """
    found: dict[str, float] = {}
    for unit, size in (("deg", np.pi / 180), ("rad", 1.0), ("m", 1.0)):
        key = f"{name}_{unit}"
        for joint, value in table_of(data.get(key, {}), key).items():
            if joint in found:
                raise InvalidInputError(f"{key} says where joint {joint} is again. Say it once.")
            found[joint] = finite_number(value, f"{key}.{joint}") * float(size)
    return found


def check_units(
    data: Mapping[str, Any], name: str, unit_of: Callable[[str], Literal["rad", "m"]]
) -> None:
    """Reject metres of what turns, and angles of what slides, in ``[NAME_deg]``, ``_rad``, ``_m``.

    Args:
        data: the file.
        name: of the tables.
        unit_of: the unit of a joint or coordinate.

    Raises:
        InvalidInputError: the message names the table to write it in.
    """
    for unit in ("deg", "rad", "m"):
        key = f"{name}_{unit}"
        for what in data.get(key, {}):
            if (unit == "m") != (unit_of(what) == "m"):
                right = f"{name}_deg or {name}_rad" if unit == "m" else f"{name}_m"
                raise InvalidInputError(
                    f"{key} has {what}, which is {'an angle' if unit == 'm' else 'in metres'}. "
                    f"Write it in [{right}]."
                )


_CONTACT = (
    "frame",
    "kind",
    "name",
    "offset_m",
    "rpy_deg",
    "plane_point_m",
    "plane_normal",
    "sole_m",
    "friction",
    "torsional_friction_m",
)


def read_contact(data: Mapping[str, Any]) -> Contact:
    """The contact that a table of ``[[contacts]]`` says."""
    check_keys(data, _CONTACT, "a contact")
    what = f"contact {data.get('frame')!r}"
    plane = None
    if "plane_normal" in data or "plane_point_m" in data:
        plane = Plane(
            _three(data.get("plane_point_m", (0, 0, 0)), f"plane_point_m of {what}"),
            _three(data.get("plane_normal", (0, 0, 1)), f"plane_normal of {what}"),
        )
    rpy = np.radians(_three(data.get("rpy_deg", (0, 0, 0)), f"rpy_deg of {what}"))
    sole = data.get("sole_m")
    return Contact(
        _text(data, "frame", "a contact"),
        kind=data.get("kind", "surface"),
        name=str(data.get("name", "")),
        offset=_three(data.get("offset_m", (0, 0, 0)), f"offset_m of {what}"),
        rotation=pin.rpy.rpyToMatrix(rpy) if rpy.any() else np.eye(3),
        polygon=None if sole is None else finite_array(sole, f"sole_m of {what}", (None, 2)),
        plane=plane,
        friction=data.get("friction"),
        torsional_friction=data.get("torsional_friction_m"),
    )


def contact_data(contact: Contact) -> dict[str, Any]:
    """A contact as a table of ``[[contacts]]``, whole."""
    rpy = np.degrees(pin.rpy.matrixToRpy(np.array(contact.rotation)))
    plane = contact.plane
    found = {
        "frame": contact.frame,
        "kind": contact.kind,
        "name": contact.name,
        "offset_m": list(contact.offset),
        "rpy_deg": rpy.tolist() if np.abs(rpy).any() else None,
        "plane_point_m": None if plane is None else list(plane.point),
        "plane_normal": None if plane is None else list(plane.normal),
        "sole_m": None if contact.polygon is None else contact.polygon.tolist(),
        "friction": contact.friction,
        "torsional_friction_m": contact.torsional_friction,
    }
    return {key: value for key, value in found.items() if value is not None}


_LOAD_KEYS = {
    "force_N": "force",
    "moment_Nm": "moment",
    "point_m": "point",
    "anchor_m": "anchor",
    "stiffness_N_per_m": "stiffness",
}


def read_loads(data: Mapping[str, Any]) -> list[Load | SpringLoad]:
    """What ``[[loads]]`` and ``[[spring_loads]]`` say."""
    found: list[Load | SpringLoad] = []
    for key, kind in (("loads", Load), ("spring_loads", SpringLoad)):
        own = {f.name for f in fields(kind)}
        allowed = ["frame", "name", "fixed_to", *(k for k, v in _LOAD_KEYS.items() if v in own)]
        for each in list_of(data.get(key, []), key):
            table = table_of(each, key)
            check_keys(table, [k for k in allowed if k != "fixed_to" or "fixed_to" in own], key)
            values: dict[str, Any] = {}
            for k, v in table.items():
                name = _LOAD_KEYS.get(k, k)
                values[name] = _three(v, f"{k} of a load") if k in _LOAD_KEYS else str(v)
            if kind is SpringLoad and not {"anchor", "stiffness"} <= set(values):
                raise InvalidInputError(
                    "a spring load needs its anchor_m and its stiffness_N_per_m. Give both."
                )
            _text(table, "frame", "a load")
            found.append(kind(**values))
    return found


def load_data(load: Load | SpringLoad) -> dict[str, Any]:
    """A load as a table of its kind."""
    found: dict[str, Any] = {"frame": load.frame}
    for key, name in _LOAD_KEYS.items():
        if hasattr(load, name):
            found[key] = list(getattr(load, name))
    if isinstance(load, Load):
        found["fixed_to"] = load.fixed_to
    return found | {"name": load.name}


def read_payload(data: object) -> dict[str, Any]:
    """What a table of ``[[payloads]]`` says, as `Robot.with_payload` takes it."""
    table = table_of(data, "payloads")
    check_keys(table, ("frame", "mass_kg", "com_m"), "a payload")
    return {
        "frame": _text(table, "frame", "a payload"),
        "mass": finite_number(table.get("mass_kg"), "mass_kg of a payload"),
        "com": _three(table.get("com_m", (0, 0, 0)), "com_m of a payload"),
    }


def read_drives(data: Mapping[str, Any]) -> Drives:
    """The drives that ``[drives]`` says."""
    keys = ("motors", "held_Nm", "springs", "couplings", "loops", "transmissions")
    check_keys(data, keys, "drives")
    springs = {}
    for each in list_of(data.get("springs", []), "springs"):
        table = table_of(each, "springs")
        check_keys(table, ("joint", "stiffness", "rest"), "a spring")
        springs[_text(table, "joint", "a spring")] = Spring(
            finite_number(table.get("stiffness"), "stiffness of a spring"),
            finite_number(table.get("rest", 0.0), "rest of a spring"),
        )
    return Drives(
        motors=tuple(map(str, data["motors"])) if "motors" in data else None,
        springs=springs,
        held=table_of(data.get("held_Nm", {}), "held_Nm"),
        couplings=tuple(
            _made(Coupling, e) for e in list_of(data.get("couplings", []), "couplings")
        ),
        loops=tuple(_made(Loop, e) for e in list_of(data.get("loops", []), "loops")),
        transmissions=_all(Transmission, data, "transmissions"),
    )


def drives_data(drives: Drives) -> dict[str, Any]:
    """Drives as ``[drives]``."""
    found: dict[str, Any] = {} if drives.motors is None else {"motors": list(drives.motors)}
    found["held_Nm"] = dict(drives.held)
    found["springs"] = [
        {"joint": joint, "stiffness": s.stiffness, "rest": s.rest}
        for joint, s in drives.springs.items()
    ]
    for key in ("couplings", "loops", "transmissions"):
        found[key] = [_fields_of(each) for each in getattr(drives, key)]
    return {key: value for key, value in found.items() if value not in ([], {})}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _fields_of(value: Any) -> dict[str, Any]:
    found = {f.name: getattr(value, f.name) for f in fields(value)}
    return {
        key: each.tolist()
        if isinstance(each, np.ndarray)
        else list(each)
        if isinstance(each, tuple)
        else each
        for key, each in found.items()
        if each is not None
    }


def _all(kind: Any, data: Mapping[str, Any], key: str) -> tuple[Any, ...]:
    return tuple(_made(kind, each) for each in list_of(data.get(key, []), key))


def _made(kind: Any, data: object) -> Any:
    what = f"a {kind.__name__.lower()}"
    table = table_of(data, what)
    names = [f.name for f in fields(kind)]
    check_keys(table, names, what)
    missing = [f.name for f in fields(kind)[:2] if f.name not in table]
    if missing:
        raise InvalidInputError(f"{what} in the drives has no {missing[0]}. Give it.")
    values = {k: tuple(v) if isinstance(v, list) and k != "matrix" else v for k, v in table.items()}
    if "matrix" in values:
        values["matrix"] = finite_array(values["matrix"], f"the matrix of {what}", (None, None))
    return kind(**values)


def table_of(value: object, what: str) -> Mapping[str, Any]:
    """A value that is a table, or an error."""
    if not isinstance(value, Mapping):
        raise InvalidInputError(f"{what} is {value!r}. Write a table, [{what}] or [[{what}]].")
    return value


def list_of(value: object, what: str) -> list[Any]:
    """A value that is a list, or an error."""
    if not isinstance(value, list):
        raise InvalidInputError(f"{what} is {value!r}. Write a list, or [[{what}]].")
    return value


def truth(value: object, what: str) -> bool:
    """A value that is true or false, or an error."""
    if not isinstance(value, bool):
        raise InvalidInputError(f"{what} is {value!r}. Write true or false.")
    return value


def _text(data: Mapping[str, Any], key: str, what: str) -> str:
    value = data.get(key)
    if not isinstance(value, str) or not value:
        raise InvalidInputError(f'{what} has no {key}. Write {key} = "...".')
    return value


def _three(value: object, what: str) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in finite_array(value, what, (3,), "x, y, z"))
    return x, y, z
