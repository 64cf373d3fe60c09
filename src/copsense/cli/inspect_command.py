"""``copsense inspect``: what a robot is, where its feet are, and the line that makes it stand."""

from __future__ import annotations

from typing import Any

import click

from copsense.cli.contact_options import contact_options, possible_frames, read_contacts
from copsense.cli.drive_options import drive_options, read_drives
from copsense.cli.option_lists import SectionedCommand, package_dirs_option
from copsense.cli.printing import echo_json
from copsense.cli.robot_argument import robot_argument
from copsense.cli.stance_options import place_at_height
from copsense.errors import InvalidInputError


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense inspect robot.urdf\n"
    "  copsense inspect robot.urdf --joints\n"
    "  copsense inspect robot.urdf --package-dir ~/ros/share --json\n"
    "  copsense inspect robot.urdf --passive l_ankle --loop l_rod_end=l_heel\n"
    "  copsense inspect robot.urdf --contact l_toe:point --contact r_toe:point",
)
@robot_argument()
@package_dirs_option
@click.option("--root", metavar="BODY", help="Body of the robot, where an MJCF holds several.")
@contact_options
@drive_options
@click.option(
    "--joints", is_flag=True, help="List each joint: range, motor and effort limit, spring, loop."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def inspect(
    robot: str,
    package_dirs: tuple[str, ...],
    root: str | None,
    contacts: tuple[str, ...],
    contact_at: Any,
    soles: Any,
    level_soles: bool,
    sole_height: float | None,
    passive: tuple[str, ...],
    motors: tuple[str, ...],
    springs: tuple[str, ...],
    couplings: tuple[str, ...],
    loops: tuple[str, ...],
    held: tuple[str, ...],
    transmissions: tuple[str, ...],
    locked: tuple[str, ...],
    joints: bool,
    as_json: bool,
    **touching: Any,
) -> None:
    """Inspect ROBOT: mass, joints, heading, feet and soles, and the `analyse` line to paste.

    ROBOT is a name from `copsense robots`, the path of a URDF, MJCF or SDF, or a stance file
    (.toml). Feet are found by geometry, what reaches lowest at rest, unless --contact names them.
    The line has been tried: the robot stands by it. It repeats the options of contacts and drives
    that are given here. In Python: copsense.robots.inspect_robot.
    """
    from copsense.robots import PRESETS, inspect_robot, load_robot
    from copsense.robots.stance_tables import is_stance_file

    whole = robot in PRESETS or is_stance_file(robot)  # its contacts come along
    given = _given({"contacts", "contact_at", "soles", "level_soles", "sole_height", *touching})
    if given and not contacts and not whole:
        raise InvalidInputError(
            f"{given[0].partition('=')[0]} says something of contacts, and which they are is not "
            "said. Name them too, --contact FRAME, or leave it out, and they are looked for."
        )
    drives = (passive, motors, springs, couplings, loops, held, transmissions)
    model = load_robot(
        robot, package_dirs=package_dirs, root=root, frames=possible_frames(contacts)
    )
    own = None
    if given:
        own = read_contacts(robot, contacts, model.frame_names, sole_height=sole_height, **touching)
    found = inspect_robot(
        robot if whole else model,  # read once
        package_dirs=package_dirs,
        root=root,
        contacts=own,
        contact_at=place_at_height(contact_at, sole_height),
        soles=soles,
        level_soles=level_soles,
        drives=read_drives(model, *drives) if any(drives) else None,
        locked=locked,
        given=[*given, *_given(set(_DRIVES))],
    )
    if as_json:
        echo_json(found.to_dict())
    else:
        click.echo(found.text(joints=joints))


_DRIVES = (
    "passive", "motors", "springs", "couplings", "loops", "held", "transmissions", "locked",
)  # fmt: skip


def _given(names: set[str]) -> list[str]:
    """The options of these names that were given, word by word."""
    context = click.get_current_context()
    words: list[str] = []
    for option in context.command.params:
        where = context.get_parameter_source(option.name or "")
        if option.name not in names or where is not click.core.ParameterSource.COMMANDLINE:
            continue
        value = context.params[option.name]
        if value is True:
            words.append(option.opts[0])
            continue
        values = value if isinstance(value, tuple) else (value,)
        # One word each, for a value may begin with a minus.
        words += [f"{option.opts[0]}={each}" for each in values]
    return words
