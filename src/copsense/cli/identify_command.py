"""``copsense identify``: which criterion explains what a robot measured of itself."""

from __future__ import annotations

from pathlib import Path

import click

from copsense.cli.printing import echo_json, echo_notes, progress_bar
from copsense.cli.units import read_quantity


@click.command(
    epilog="\b\nExamples:\n"
    "  copsense identify com-sinusoid.mat --robot icub.urdf --family joints\n"
    "  copsense identify sway.nc --robot icub --family length --family mix --json"
)
@click.argument("file", type=click.Path())
@click.option(
    "--robot",
    required=True,
    help="Whose log it is: a preset, a URDF or MJCF file, or a stance file (.toml).",
)
@click.option(
    "--family",
    "families",
    multiple=True,
    metavar="NAME",
    help="What to identify: length (L of a minimum wrench), joints (torque weights of hips, knees, "
    "ankles), stiffness (of joints on position servos) or mix (of torques and wrenches). "
    "Repeatable; default all.",
)
@click.option(
    "--map",
    "map_file",
    metavar="MAP.toml",
    help="Which signal is what, as copsense log --save-map writes it; default what is recognised.",
)
@click.option(
    "--contact",
    "contacts",
    multiple=True,
    metavar="FRAME",
    help="Contact frame; default the preset's, or those that the sensors serve. Repeatable.",
)
@click.option(
    "--package-dir",
    "package_dirs",
    multiple=True,
    type=click.Path(file_okay=False),
    help="Folder in which package:// meshes are looked up. Repeatable.",
)
@click.option("--at-rest", is_flag=True, help="Leave the recorded motion's inertia out.")
@click.option(
    "--skip",
    default="3s",
    show_default=True,
    metavar="TIME",
    help="The log's beginning, which is left out.",
)
@click.option(
    "--postures",
    type=click.IntRange(min=20),
    default=500,
    show_default=True,
    help="How many rows are evaluated at most, evenly chosen.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def identify(
    file: str,
    robot: str,
    families: tuple[str, ...],
    map_file: str | None,
    contacts: tuple[str, ...],
    package_dirs: tuple[str, ...],
    at_rest: bool,
    skip: str,
    postures: int,
    as_json: bool,
) -> None:
    """Identify which criterion explains the forces or torques in FILE, a robot's own log.

    Of each family the parameters that explain the measurements best, with 95 % intervals, what the
    measurements do not see, and the cross-validated error beside minimum torque and minimum wrench.
    A common scale of weights or stiffnesses is never visible. In Python:
    copsense.identification.identify_log.
    """
    from copsense.identification import identify_log
    from copsense.logs import read_log
    from copsense.logs.comparing import log_robot

    after = read_quantity(skip, "s")
    on, known = log_robot(robot, package_dirs)
    named = {contact.name: contact for contact in known}
    feet = [named.get(name, name) for name in contacts] or list(known)
    path = Path(file)
    size = path.stat().st_size if path.is_file() else None
    wanted = list(contacts) or list(named)
    with progress_bar(size, f"reading {path.name}", "B") as advance:
        log = read_log(file, map_file, robot=on, contacts=wanted, advance=advance)
    with progress_bar(None, "identifying", "row") as advance:
        found = identify_log(
            log,
            on,
            families or None,
            contacts=feet or None,
            inertia=not at_rest,
            skip=after,
            postures=postures,
            progress=advance,
        )
    if as_json:
        echo_json(found.to_dict())
        return
    click.echo(str(found))
    echo_notes(on.notes)
