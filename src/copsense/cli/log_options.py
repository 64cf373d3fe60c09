"""Log options: a robot's own log, whose it is, and what of it stands for what."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from copsense.cli.option_lists import F, package_dirs_option, with_options
from copsense.cli.printing import progress_bar
from copsense.cli.stance_memory import remember_robot
from copsense.cli.units import read_quantity

if TYPE_CHECKING:
    from copsense.contact import Contact
    from copsense.logs import LogMap
    from copsense.logs.log import Log
    from copsense.robot import Robot


def _remember(context: click.Context, parameter: click.Parameter, value: str) -> str:
    """The criteria of a stance file are those of the command."""
    remember_robot(context, parameter, value)
    return value


_OPTIONS = (
    click.argument("file", type=click.Path()),
    click.option(
        "--robot",
        "--stance",
        "robot",
        required=True,
        callback=_remember,
        help="Whose log it is: a preset, a URDF, MJCF or SDF file, or a stance file (.toml).",
    ),
    click.option(
        "--map",
        "map_file",
        metavar="MAP.toml",
        help="Which signal is what, as copsense log --save-map writes it; default what the layout "
        "or the names of the signals say.",
    ),
    click.option(
        "--contact",
        "contacts",
        multiple=True,
        metavar="FRAME",
        help="Contact frame; default the preset's, or those that the sensors serve. Repeatable.",
    ),
    package_dirs_option,
)


def encoders_option(command: F) -> F:
    """The option --encoders."""
    return click.option(
        "--encoders",
        metavar="ANGLE",
        help="Standard deviation of each encoder's constant error, such as 0.5deg, which the "
        "intervals then include; default none.",
    )(command)


def rate_option(command: F) -> F:
    """The option --rate."""
    return click.option(
        "--rate",
        metavar="FREQUENCY",
        help="Rows a second, each the mean of the samples around it, such as 100Hz; default all.",
    )(command)


class LogSubject(NamedTuple):
    """Whose log a command reads.

    Attributes:
        robot: the robot.
        feet: its contacts, or names of frames; None for those that the sensors serve.
        wanted: names of contacts to look for in the log.
    """

    robot: Robot
    feet: list[Contact | str] | None
    wanted: list[str]


def log_options(command: F) -> F:
    """A command with FILE, --robot, --map, --contact and --package-dir."""
    return with_options(_OPTIONS, command)


def read_subject(
    robot: str, contacts: tuple[str, ...], package_dirs: tuple[str, ...]
) -> LogSubject:
    """The robot and contacts that the options name."""
    from copsense.logs.aligned_log import log_robot

    on, known = log_robot(robot, package_dirs)
    named = {contact.name: contact for contact in known}
    feet = [named.get(name, name) for name in contacts] or list(known)
    return LogSubject(on, feet or None, list(contacts) or list(named))


def read_shown(
    file: str, mapping: str | LogMap | None, subject: LogSubject, rate: str | None
) -> Log:
    """The log, with a bar while it is read; rate as `rate_option` gives it."""
    from copsense.logs import read_log

    path = Path(file)
    hertz = None if rate is None else read_quantity(rate, "Hz")
    size = path.stat().st_size if path.is_file() else None
    with progress_bar(size, f"reading {path.name}", "B") as advance:
        return read_log(
            file, mapping, robot=subject.robot, contacts=subject.wanted, rate=hertz, advance=advance
        )
