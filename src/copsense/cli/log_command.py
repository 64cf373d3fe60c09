"""``copsense log``: a robot's own log beside what every criterion says."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.log_options import (
    encoders_option,
    log_options,
    rate_option,
    read_shown,
    read_subject,
)
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written, progress_bar
from copsense.cli.units import read_quantity
from copsense.errors import CopsenseError, InvalidInputError

if TYPE_CHECKING:
    from copsense.cli.log_options import LogSubject
    from copsense.logs import Log, LogMap


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense log com-sinusoid.mat --robot icub.urdf --plot log.png\n"
    "  copsense log com-sinusoid.mat --robot icub.urdf --report swaying\n"
    "  copsense log walk.mcap --robot g1 --map g1.toml --contact left_ankle_roll_link "
    "--contact right_ankle_roll_link --json\n"
    "  copsense log run.csv --robot icub --save-map run.toml",
)
@log_options
@click.option(
    "--save-map",
    metavar="MAP.toml",
    help="Write down what was recognised, and use it; not after an error.",
)
@criterion_options
@click.option(
    "--base",
    type=click.Choice(["feet", "recorded"]),
    default="feet",
    show_default=True,
    help="What puts the base in place: the joints from the first foot on, or the log's own pose.",
)
@click.option(
    "--skip",
    default="3s",
    show_default=True,
    metavar="TIME",
    help="The log's beginning, which is left out of the slopes.",
)
@encoders_option
@rate_option
@click.option(
    "--postures",
    type=click.IntRange(min=20),
    default=5000,
    show_default=True,
    help="How many rows are evaluated at most, evenly chosen.",
)
@click.option("--plot", "picture", type=click.Path(), help="Draw it: .png, .svg or .pdf.")
@click.option(
    "--report",
    type=click.Path(),
    metavar="FOLDER",
    help="Write a page on it, report.html, with its figures and data, into a folder.",
)
@click.option("--force", is_flag=True, help="Overwrite the picture, the mapping and the report.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def log(
    file: str,
    robot: str,
    map_file: str | None,
    save_map: str | None,
    contacts: tuple[str, ...],
    package_dirs: tuple[str, ...],
    criteria: tuple[str, ...],
    characteristic_length: float,
    base: str,
    skip: str,
    encoders: str | None,
    rate: str | None,
    postures: int,
    picture: str | None,
    report: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Compare FILE, what a robot recorded of itself, with what every criterion says.

    FILE is CSV, Parquet, MATLAB (v5 or v7.3; robometry, Simulink), a ROS 1 or 2 bag, MCAP, C3D, a
    Eurobench folder, or a recording of copsense balance. Load shares, centres of pressure and
    torques stand beside the criteria at the recorded postures, at rest and with the recorded
    motion's inertia. In Python: copsense.logs.read_log and compare_log.
    """
    from copsense.files import check_output
    from copsense.logs import compare_log
    from copsense.logs.opening import open_log_file
    from copsense.logs.recognition import recognise

    for path, suffixes in ((picture, PICTURES), (save_map, (".toml",))):
        if path is not None:
            check_output(path, suffixes=suffixes, overwrite=force)
    if map_file is not None and save_map is not None:
        raise InvalidInputError("--map and --save-map both say what is mapped. Give one.")
    if report is not None:
        from copsense.log_report import write_log_report
        from copsense.reports import check_report_folder

        check_report_folder(report, overwrite=force)
    after = read_quantity(skip, "s")
    spread = 0.0 if encoders is None else read_quantity(encoders, "rad")
    chosen = read_criteria(criteria, characteristic_length)
    subject = read_subject(robot, contacts, package_dirs)
    echo_notes(subject.robot.notes)
    mapping: str | LogMap | None = map_file
    if save_map is not None:
        mapping = recognise(open_log_file(file), subject.robot, subject.wanted)
    found = read_shown(file, mapping, subject, rate)
    with progress_bar(min(postures, len(found.times)), "comparing") as advance:
        comparison = compare_log(
            found,
            subject.robot,
            chosen,
            contacts=subject.feet,
            base=base,  # type: ignore[arg-type]
            skip=after,
            postures=postures,
            encoders=spread,
            advance=advance,
        )
    if save_map is not None and not isinstance(mapping, str | None):
        mapping.save(save_map, overwrite=force)  # only now: an error leaves nothing behind
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(comparison.plot(), picture, overwrite=force)
    page = None
    if report is not None:
        command = f"copsense {shlex.join(sys.argv[1:])}"
        page = str(write_log_report(comparison, report, overwrite=force, command=command))
    if as_json:
        places = (("plot", picture), ("map", save_map), ("report", page))
        written = {k: v for k, v in places if v is not None}
        echo_json(
            comparison.to_dict()
            | {"hip_ankle_weight_ratio": _hips(found, subject, after, spread)}
            | written
        )
        return
    click.echo(str(comparison))
    for finding in comparison.findings:
        click.echo(f"found: {finding.message}")
    echo_notes(comparison.notes)
    echo_written(picture, save_map, page)


def _hips(log: Log, subject: LogSubject, skip: float, encoders: float) -> dict[str, object] | None:
    """The weight of the hips in shares of the ankles', in motion; None where nothing says it."""
    from copsense.identification import hip_ankle_ratio

    try:
        found = hip_ankle_ratio(
            log, subject.robot, contacts=subject.feet, skip=skip, encoders=encoders
        )
    except CopsenseError:
        return None
    return {**vars(found)}
