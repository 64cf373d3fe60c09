"""The options that say which robot stands where, and the stance they describe."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.contact_options import contact_options, possible_frames, read_contacts
from copsense.cli.drive_options import drive_options, read_drives
from copsense.cli.limit_options import limits_option
from copsense.cli.load_options import load_options, put_loads
from copsense.cli.option_lists import (
    POSTURE,
    STANCE_FILE,
    F,
    options_named,
    package_dirs_option,
    with_options,
)
from copsense.cli.place_options import course_options, place_options, put_in_place
from copsense.cli.printing import echo_notes
from copsense.cli.robot_argument import robot_argument
from copsense.cli.stance_memory import (
    remember_robot,
    remember_stance,
    remembered_stance,
    written,
)
from copsense.cli.units import ANGLE, LENGTH, read_positions, read_quantity
from copsense.errors import InvalidInputError
from copsense.listing import listed

if TYPE_CHECKING:
    from copsense.stance import Stance


_ROBOT = robot_argument(required=False, is_eager=True, callback=remember_robot)


def stance_options(command: F, *, coordinates: bool = True) -> F:
    """The robot, how it stands, where its CoM is put, and what it must respect.

    Args:
        command: to be decorated.
        coordinates: whether it takes ``--at`` of `place_options`.
    """
    placed = place_options(command, coordinates=coordinates)
    return _ROBOT(standing_options(placed))


def swept_stance_options(command: F) -> F:
    """The same for a command that sweeps the CoM or a joint: a value holds, a range sweeps."""
    return _ROBOT(standing_options(course_options(command)))


_POSTURE = click.option(
    "--posture",
    multiple=True,
    metavar="JOINT=POSITION",
    help="Joint position that the posture stays nearest to: degrees, or metres for a "
    "prismatic joint, or with its unit (20deg, 0.35rad, 25mm). Repeatable.",
)


def standing_options(command: F, posture: Callable[[Any], Any] | None = None) -> F:
    """How a robot stands, and what it must respect.

    Args:
        command: to be decorated.
        posture: the command's own ``--posture``.
    """
    files = [
        click.option(
            "--stance",
            "stance_file",
            metavar="FILE",
            expose_value=False,
            is_eager=True,
            callback=remember_stance,
            help="A stance file (.toml) as ROBOT: robot, contacts, configuration, loads "
            "and drives, and the limits and criteria to use unless options give others.",
        ),
        click.option(
            "--save-stance",
            metavar="FILE",
            help="Write the stance down, with the limits and criteria, for --stance and "
            "copsense.load_stance.",
        ),
        click.option("--force-stance", is_flag=True, help="Overwrite that file."),
    ]
    standing = [
        posture or _POSTURE,
        click.option(
            "--base-yaw",
            type=ANGLE,
            metavar="ANGLE",
            help="Heading of the base (degrees, or 3.14rad), so that the robot faces +x; a "
            "preset has its own.",
        ),
        click.option(
            "--base-rpy",
            metavar="ROLL:PITCH:YAW",
            help="Orientation of the base to start from (degrees, or with units), where its z axis "
            "is not up; instead of --base-yaw.",
        ),
        click.option(
            "--width", type=LENGTH, metavar="LENGTH", help="Distance between two feet [m]."
        ),
    ]
    for options, section in (
        ([drive_options, load_options, limits_option], None),
        (standing, POSTURE),
        ([contact_options, package_dirs_option], None),
        (files, STANCE_FILE),
    ):
        command = with_options(options, command, section)
    return command


def read_stance(
    robot: str | None,
    contacts: tuple[str, ...],
    contact_at: Any,
    soles: Any,
    level_soles: bool,
    sole: tuple[str, ...],
    sole_height: float | None,
    offsets: tuple[str, ...],
    turns: tuple[str, ...],
    grounds: tuple[str, ...],
    planes: tuple[str, ...],
    frictions: tuple[str, ...],
    package_dirs: tuple[str, ...],
    posture: tuple[str, ...],
    base_yaw: float | None,
    base_rpy: str | None,
    width: float | None,
    locked: tuple[str, ...],
    loads: tuple[str, ...],
    payloads: tuple[str, ...],
    body_loads: tuple[str, ...],
    spring_loads: tuple[str, ...],
    com_x: float | None = None,
    com_y: float | None = None,
    com_z: float | None = None,
    joints: tuple[str, ...] = (),
    at: tuple[str, ...] = (),
    save_stance: str | None = None,
    force_stance: bool = False,
    **drives: tuple[str, ...],
) -> Stance:
    """The stance that the options of `stance_options` describe; lengths [m], angles [rad].

    The robot's notes are printed.
    """
    from copsense.description import check_package_dirs
    from copsense.robot import Robot
    from copsense.robots import PRESETS, load_robot, load_stance, soles_read

    def finished(standing: Stance, source: str | Path, folders: Iterable[str | Path]) -> Stance:
        """Loaded, moved, and written down where that is asked for."""
        loaded = put_loads(standing, loads, payloads, body_loads, spring_loads)
        moved = put_in_place(loaded, com_x, com_y, com_z, joints, at)
        return written(moved, save_stance, source, force_stance, folders)

    file = remembered_stance()
    if file is not None:
        standing = {
            "contacts": contacts,
            "contact_at": contact_at,
            "soles": None if soles == "collision" else soles,
            "level_soles": level_soles,
            "sole": sole,
            "sole_height": sole_height,
            "offsets": offsets,
            "turns": turns,
            "grounds": grounds,
            "planes": planes,
            "frictions": frictions,
            "package_dirs": package_dirs,
            "posture": posture,
            "base_yaw": base_yaw,
            "base_rpy": base_rpy,
            "width": width,
            "locked": locked,
            **drives,
        }
        beside = [] if robot is None else [f"ROBOT ({robot})"]
        beside += options_named(
            name for name, value in standing.items() if value not in (None, (), False)
        )
        if beside:
            raise InvalidInputError(
                f"the stance file {file.path} says which robot stands where, and so does "
                f"{listed(beside)}. Leave the file or the rest out."
            )
        stance = file.stance()
        echo_notes(stance.robot.notes)
        return finished(stance, file.source, file.package_dirs)
    if robot is None:
        raise click.UsageError(
            "no robot is named. Give ROBOT (a preset, or a URDF, MJCF, SDF or stance file), or "
            "--stance FILE.",
            click.get_current_context(silent=True),
        )
    check_package_dirs(package_dirs)  # a preset looks none up
    contact_at = place_at_height(contact_at, sole_height)
    # A preset is passed by name, so that its feet and posture come along.
    source = (
        robot
        if robot in PRESETS
        else load_robot(robot, package_dirs=package_dirs, frames=possible_frames(contacts))
    )
    if isinstance(source, Robot):
        echo_notes(source.notes)  # at once: what is not used may be why it does not stand
    named = any(":" in text for text in contacts)
    model = load_robot(source) if posture or named else None
    # Which unit a bare number has depends on the joint.
    positions = read_positions(posture, model) if model is not None else {}
    frames = model.frame_names if model is not None else ()
    stance = load_stance(
        source,
        contacts=read_contacts(
            robot,
            contacts,
            frames,
            sole=sole,
            sole_height=sole_height,
            offsets=offsets,
            turns=turns,
            grounds=grounds,
            planes=planes,
            frictions=frictions,
        ),
        contact_at=contact_at,
        soles=soles,
        level_soles=level_soles,
        package_dirs=package_dirs,
        posture=positions,
        base_rpy=_read_rpy(base_yaw, base_rpy),
        width=width,
        drives=read_drives(load_robot(source), **drives) if any(drives.values()) else None,
        locked=locked,
    )
    if not isinstance(source, Robot):
        echo_notes(stance.robot.notes)
    echo_notes(soles_read(stance))
    return finished(stance, robot, package_dirs)


def place_at_height(contact_at: Any, sole_height: float | None) -> Any:
    """``--contact-at``, where ``--sole-height`` may say it instead: at the frame, and moved.

    Raises:
        InvalidInputError: both say where the contacts are.
    """
    if sole_height is not None and contact_at == "sole":
        raise InvalidInputError(
            "--sole-height and --contact-at sole both say where the contacts are. Give one."
        )
    return contact_at if sole_height is None else "frame"


def _read_rpy(yaw: float | None, text: str | None) -> tuple[float, float, float] | None:
    """``--base-yaw`` or ``--base-rpy`` as roll, pitch, yaw [rad]."""
    if text is None:
        return None if yaw is None else (0.0, 0.0, yaw)
    if yaw is not None:
        raise InvalidInputError("--base-rpy holds the yaw as well as --base-yaw. Give one.")
    try:
        roll, pitch, yaw = (read_quantity(angle, "rad") for angle in text.split(":"))
    except ValueError:
        raise InvalidInputError(
            f"the orientation {text!r} is not understood. Give ROLL:PITCH:YAW (degrees), such as "
            "90:0:0."
        ) from None
    return roll, pitch, yaw
