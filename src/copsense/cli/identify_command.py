"""``copsense identify``: which criterion explains what a robot measured of itself."""

from __future__ import annotations

import click

from copsense.cli.log_options import (
    encoders_option,
    log_options,
    rate_option,
    read_shown,
    read_subject,
)
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import echo_json, echo_notes, progress_bar
from copsense.cli.units import read_quantity


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense identify com-sinusoid.mat --robot icub.urdf --family joints\n"
    "  copsense identify sway.nc --robot icub --family length --family mix --json",
)
@log_options
@click.option(
    "--family",
    "families",
    multiple=True,
    metavar="NAME",
    help="What to identify: length (L of a minimum wrench), joints (torque weights of hips, knees, "
    "ankles), stiffness (of joints on position servos) or mix (of torques and wrenches). "
    "Repeatable; default all.",
)
@click.option("--at-rest", is_flag=True, help="Leave the recorded motion's inertia out.")
@click.option(
    "--skip",
    default="3s",
    show_default=True,
    metavar="TIME",
    help="The log's beginning, which is left out.",
)
@encoders_option
@rate_option
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
    encoders: str | None,
    rate: str | None,
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

    after = read_quantity(skip, "s")
    spread = 0.0 if encoders is None else read_quantity(encoders, "rad")
    subject = read_subject(robot, contacts, package_dirs)
    log = read_shown(file, map_file, subject, rate)
    with progress_bar(None, "identifying", "row") as advance:
        found = identify_log(
            log,
            subject.robot,
            families or None,
            contacts=subject.feet,
            inertia=not at_rest,
            skip=after,
            postures=postures,
            encoders=spread,
            progress=advance,
        )
    if as_json:
        echo_json(found.to_dict())
        return
    click.echo(str(found))
    for finding in found.findings:
        click.echo(f"found: {finding.message}")
    echo_notes((*subject.robot.notes, *found.notes))
