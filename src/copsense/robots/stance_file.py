"""Stance file: a stance written down in TOML, units in its keys, to be repeated anywhere.

    robot = "g1.urdf"                   # a preset, or a file seen from this one
    [posture_deg]
    l_knee = 40.0
    [[contacts]]
    frame = "l_foot"

stands up as `load_stance` would. What `save_stance` writes has the exact ``[configuration]``
instead, and whole contacts, and is not solved again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from copsense.arrays import check_keys, finite_array, finite_number
from copsense.drives import Drives
from copsense.errors import CopsenseError, InvalidInputError, ModelLoadError
from copsense.files import check_output, file_at, read_toml, write_beside
from copsense.loads import Load, SpringLoad
from copsense.robot import Robot
from copsense.robots.presets import PRESETS
from copsense.robots.stance_tables import (
    check_units,
    configuration_data,
    contact_data,
    drives_data,
    is_stance_file,
    list_of,
    load_data,
    read_configuration,
    read_contact,
    read_drives,
    read_loads,
    read_payload,
    read_positions,
    table_of,
    truth,
)
from copsense.stance import Stance, check_at_rest

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.limits import Limits

# How to stand up, where no configuration says it.
_STANDING = (
    "contact_at",
    "soles",
    "level_soles",
    "width_m",
    "base_rpy_deg",
    "posture_deg",
    "posture_rad",
    "posture_m",
    "com_x_m",
    "com_y_m",
    "com_z_m",
    "joints_deg",
    "joints_rad",
    "joints_m",
    "at_deg",
    "at_rad",
    "at_m",
)
_KEYS = (
    "robot",
    "package_dirs",
    "locked",
    *_STANDING,
    "configuration",
    "contacts",
    "loads",
    "spring_loads",
    "payloads",
    "drives",
    "limits",
    "criteria",
)
_SAME = 1e-12  # of an inertia: what reading a file twice may differ by


@dataclass(frozen=True, eq=False)
class StanceFile:
    """What a stance file says.

    Attributes:
        path: of the file; its folder is the one from which paths are said.
        data: its tables.
    """

    path: Path
    data: Mapping[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> StanceFile:
        """Read a file.

        Raises:
            ModelLoadError: no such file, or not TOML.
            UnknownNameError: a key that a stance file does not have.
        """
        where = Path(path)
        remedy = "Give a .toml file that copsense.robots.save_stance or --save-stance wrote."
        data = read_toml(where, "stance file", remedy, ModelLoadError)
        check_keys(data, _KEYS, "a stance file")
        if not isinstance(data.get("robot"), str):
            raise InvalidInputError(
                f'the stance file {where} names no robot. Write, say, robot = "icub", or the path '
                "of a URDF, MJCF or SDF from the file's own folder."
            )
        if is_stance_file(data["robot"]):
            raise InvalidInputError(
                f"the stance file {where} names another one, {data['robot']}, as its robot. Name a "
                "preset, or the path of a URDF, MJCF or SDF from the file's own folder."
            )
        return cls(where, data)

    @property
    def source(self) -> str | Path:
        """The robot: a preset's name, or a path as seen from here."""
        robot = str(self.data["robot"])
        return robot if robot in PRESETS else self.path.parent / robot

    @property
    def package_dirs(self) -> list[Path]:
        """Folders of its meshes' packages, as seen from here."""
        return [self.path.parent / str(each) for each in self.data.get("package_dirs", [])]

    @property
    def limits(self) -> Limits | None:
        """The limits in the file, or None where it has none."""
        from copsense.limits import Limits

        if "limits" not in self.data:
            return None
        with self._named_in_errors():
            table = table_of(self.data["limits"], "limits")
            return Limits.from_dict({k: None if v == "off" else v for k, v in table.items()})

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """The criteria in the file; none where it has none."""
        from copsense.criterion_text import criterion_from_data

        with self._named_in_errors():
            given = list_of(self.data.get("criteria", []), "criteria")
            return tuple(dict.fromkeys(map(criterion_from_data, given)))

    def stance(self) -> Stance:
        """The stance.

        Raises:
            CopsenseError: anything wrong with what the file says; the message names the file.
        """
        with self._named_in_errors():
            self._check_source()
            return self._stance()

    @contextmanager
    def _named_in_errors(self) -> Iterator[None]:
        try:
            yield
        except CopsenseError as error:
            error.add_note(f"The stance file is {self.path}.")
            raise

    def _check_source(self) -> None:
        """Reject a model that is not where the file says; it may have been moved without it.

        Raises:
            ModelLoadError: there is no such file.
        """
        robot, folder = str(self.data["robot"]), self.path.resolve().parent
        if robot not in PRESETS and not file_at(folder / robot):
            raise ModelLoadError(
                f"there is no robot at {robot!r}, seen from the folder {folder}. Move the stance "
                "file back to where it was written, or say in its line robot where that is."
            )

    def _stance(self) -> Stance:
        from copsense.batch import PostureChart, chart_posture
        from copsense.posture import carry_payload, move_stance
        from copsense.robots.standing import load_robot, load_stance

        data, folders = self.data, self.package_dirs
        contacts = [
            read_contact(table_of(each, "contacts"))
            for each in list_of(data.get("contacts", []), "contacts")
        ]
        drives = read_drives(table_of(data["drives"], "drives")) if "drives" in data else None
        locked = list(map(str, list_of(data.get("locked", []), "locked")))
        payloads = [read_payload(each) for each in list_of(data.get("payloads", []), "payloads")]
        loads = read_loads(data)
        if "configuration" in data:
            beside = [key for key in _STANDING if key in data]
            if beside:
                raise InvalidInputError(
                    f"{', '.join(beside)} {'says' if len(beside) == 1 else 'say'} how to stand up, "
                    "and the [configuration] where every joint is. Leave one out."
                )
            robot = load_robot(
                self.source,
                package_dirs=folders,
                frames=[contact.frame for contact in contacts],
                drives=drives,
                locked=locked,
            )
            for payload in payloads:
                robot = robot.with_payload(**payload)
            q = read_configuration(robot, table_of(data["configuration"], "configuration"))
            return Stance(robot, q, tuple(contacts), loads=tuple(loads))
        rpy = data.get("base_rpy_deg")
        stance = load_stance(
            self.source,
            contacts=contacts or None,
            posture=read_positions(data, "posture"),
            base_rpy=None if rpy is None else np.radians(finite_array(rpy, "base_rpy_deg", (3,))),
            width=None if "width_m" not in data else finite_number(data["width_m"], "width_m"),
            contact_at=data.get("contact_at"),
            soles=data.get("soles", "collision"),
            level_soles=truth(data.get("level_soles", False), "level_soles"),
            package_dirs=folders,
            drives=drives,
            locked=locked,
        )
        check_units(data, "posture", stance.robot.joint_unit)
        for payload in payloads:
            stance = carry_payload(stance, payload["frame"], payload["mass"], com=payload["com"])
        com = {
            key.removesuffix("_m"): finite_number(data[key], key)
            for key in ("com_x_m", "com_y_m", "com_z_m")
            if key in data
        }
        joints, at = read_positions(data, "joints"), read_positions(data, "at")
        loaded = stance.with_loads(loads) if loads else stance
        if not at:
            moved = move_stance(loaded, **com, joints=joints)
            check_units(data, "joints", stance.robot.joint_unit)
            return moved
        if com or joints:
            raise InvalidInputError(
                "[at_m], [at_deg] and [at_rad] say where the CoM and the joints are, and so do "
                "com_x_m, com_y_m, com_z_m and [joints_deg]. Leave one out: at takes their names."
            )
        chart = PostureChart(loaded, tuple(at), compiled=False)
        check_units(data, "at", dict(zip(at, chart.units, strict=True)).__getitem__)
        return chart_posture(loaded, at)


def check_stance_output(path: str | Path, *, overwrite: bool) -> Path:
    """A path that a stance file can be written to, as `copsense.files.check_output` says."""
    return check_output(path, suffixes=(".toml",), overwrite=overwrite, option="--force-stance")


def save_stance(
    stance: Stance,
    path: str | Path,
    *,
    robot: str | Path | None = None,
    package_dirs: Iterable[str | Path] = (),
    limits: Limits | None = None,
    criteria: Sequence[Criterion] = (),
    overwrite: bool = False,
) -> None:
    """Write a stance down: robot, contacts, configuration, loads, drives, limits, criteria.

    `copsense.load_stance(path)` and ``--stance path`` read it back, to the last bit but for the
    rounding of a quaternion.

    Args:
        stance: what to write.
        path: a ``.toml`` file.
        robot: the preset's name or the model's file; default where the robot came from.
        package_dirs: folders of its meshes' packages, if it needs any.
        limits: to be used where none are given.
        criteria: likewise.
        overwrite: replace a file that is there.

    Raises:
        OutputError: the file cannot be written, or is there already.
        InvalidInputError: where the robot came from is not known, or is another robot.
    """
    check_at_rest(stance, "a stance file")
    target = check_stance_output(path, overwrite=overwrite)
    data = stance_data(
        stance,
        target.resolve().parent,
        robot=robot,
        package_dirs=package_dirs,
        limits=limits,
        criteria=criteria,
    )
    text = tomli_w.dumps(data, multiline_strings=False)
    write_beside(target, lambda file: file.write_text(text, encoding="utf-8"))


def stance_data(
    stance: Stance,
    folder: Path,
    *,
    robot: str | Path | None = None,
    package_dirs: Iterable[str | Path] = (),
    limits: Limits | None = None,
    criteria: Sequence[Criterion] = (),
) -> dict[str, Any]:
    """What `save_stance` writes, as `StanceFile` holds it.

    Args:
        stance: what to write.
        folder: that of the file, from which paths are said.
        robot: as `save_stance` takes it.
        package_dirs: likewise.
        limits: likewise.
        criteria: likewise.

    Raises:
        InvalidInputError: where the robot came from is not known, or is another robot.
    """
    from copsense.criterion_text import criterion_data
    from copsense.robots.standing import load_robot

    source = _source_of(stance.robot) if robot is None else str(robot)
    folders = [str(each) for each in package_dirs]
    frames = [contact.frame for contact in stance.contacts]
    plain = load_robot(source, package_dirs=folders, frames=frames)
    data: dict[str, Any] = {"robot": source if source in PRESETS else _beside(source, folder)}
    if folders:
        data["package_dirs"] = [_beside(each, folder) for each in folders]
    own_drives, kept = plain.drives, set(stance.robot.joint_names)
    locked = [joint for joint in plain.joint_names if joint not in kept]
    if locked and kept.issubset(plain.joint_names):
        data["locked"] = locked
        plain = plain.with_drives(Drives()).keeping(kept)
    for payload in stance.robot.payloads:
        plain = plain.with_payload(payload.frame, payload.mass, com=payload.com)
    if not _same_model(plain, stance.robot):
        raise InvalidInputError(
            f"{source} is not the robot of this stance, or that was changed since it was read: its "
            "joints or masses differ. Give robot=, the file that holds it."
        )
    data["configuration"] = configuration_data(stance)
    if stance.robot.drives or own_drives:  # empty: none, whatever the robot's file says
        data["drives"] = drives_data(stance.robot.drives)
    if limits is not None:
        table = {k: "off" if v is None else v for k, v in limits.to_dict().items()}
        data["limits"] = table
    if criteria:
        data["criteria"] = [criterion_data(criterion) for criterion in criteria]
    data["payloads"] = [
        {"frame": p.frame, "mass_kg": p.mass, "com_m": list(p.com)} for p in stance.robot.payloads
    ]
    data["contacts"] = [contact_data(contact) for contact in stance.contacts]
    for key, kind in (("loads", Load), ("spring_loads", SpringLoad)):
        data[key] = [load_data(load) for load in stance.loads if isinstance(load, kind)]
    return {k: v for k, v in data.items() if k == "drives" or v not in ([], {})}


def _source_of(robot: Robot) -> str:
    if robot.name in PRESETS:
        return robot.name
    path = robot.description.path if robot.description else None
    if path is None:
        raise InvalidInputError(
            f"robot {robot.name!r} was not read from a file, so a stance file cannot say where to "
            "find it. Write it to a URDF, MJCF or SDF and give robot=."
        )
    return str(path)


def _beside(source: str, folder: Path) -> str:
    """A path as seen from the stance file's folder, where one leads there."""
    path = Path(source).resolve()
    try:
        return path.relative_to(folder, walk_up=True).as_posix()  # type: ignore[call-arg]
    except (TypeError, ValueError):  # walk_up is of Python 3.12
        import os

        return Path(os.path.relpath(path, folder)).as_posix()


def _same_model(one: Robot, other: Robot) -> bool:
    a, b = one.model, other.model
    return list(a.names) == list(b.names) and all(
        np.allclose(x.toDynamicParameters(), y.toDynamicParameters(), rtol=_SAME, atol=_SAME)
        for x, y in zip(a.inertias, b.inertias, strict=True)
    )
