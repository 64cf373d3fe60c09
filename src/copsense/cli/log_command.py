"""``copsense log``: a robot's own log beside what every criterion says."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written, progress_bar
from copsense.cli.units import read_quantity
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.logs.log import Log
    from copsense.robot import Robot


@click.command(
    epilog="\b\nExamples:\n"
    "  copsense log com-sinusoid.mat --robot icub.urdf --plot log.png\n"
    "  copsense log walk.mcap --robot g1 --map g1.toml --contact left_ankle_roll_link "
    "--contact right_ankle_roll_link --json\n"
    "  copsense log run.csv --robot icub --save-map run.toml"
)
@click.argument("file", type=click.Path())
@click.option(
    "--robot",
    required=True,
    help="Whose log it is: a preset, a URDF, MJCF or SDF file, or a stance file (.toml).",
)
@click.option(
    "--map",
    "map_file",
    metavar="MAP.toml",
    help="Which signal is what; default what the layout or the names of the signals say.",
)
@click.option("--save-map", metavar="MAP.toml", help="Write down what was recognised, and use it.")
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
@click.option(
    "--rate",
    metavar="FREQUENCY",
    help="Rows a second, each the mean of the samples around it, such as 100Hz; default all.",
)
@click.option(
    "--postures",
    type=click.IntRange(min=20),
    default=5000,
    show_default=True,
    help="How many rows are evaluated at most, evenly chosen.",
)
@click.option("--plot", "picture", type=click.Path(), help="Draw it: .png, .svg or .pdf.")
@click.option("--force", is_flag=True, help="Overwrite the picture and the mapping.")
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
    rate: str | None,
    postures: int,
    picture: str | None,
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
    from copsense.logs.comparing import log_robot

    for path, suffixes in ((picture, PICTURES), (save_map, (".toml",))):
        if path is not None:
            check_output(path, suffixes=suffixes, overwrite=force)
    if map_file is not None and save_map is not None:
        raise InvalidInputError("--map and --save-map both say what is mapped. Give one.")
    after = read_quantity(skip, "s")
    hertz = None if rate is None else read_quantity(rate, "Hz")
    chosen = read_criteria(criteria, characteristic_length)
    on, known = log_robot(robot, package_dirs)
    echo_notes(on.notes)
    named = {c.name: c for c in known}
    feet = [named.get(name, name) for name in contacts] or list(known)
    wanted = list(contacts) or list(named)
    found = _read(file, on, wanted, map_file, save_map, hertz, force)
    with progress_bar(min(postures, len(found.times)), "comparing") as advance:
        comparison = compare_log(
            found,
            on,
            chosen,
            contacts=feet or None,
            base=base,  # type: ignore[arg-type]
            skip=after,
            postures=postures,
            advance=advance,
        )
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(comparison.plot(), picture, overwrite=force)
    if as_json:
        written = {k: v for k, v in (("plot", picture), ("map", save_map)) if v is not None}
        echo_json(comparison.to_dict() | written)
        return
    click.echo(str(comparison))
    for finding in comparison.findings:
        click.echo(f"found: {finding.message}")
    echo_notes(comparison.notes)
    echo_written(picture, save_map)


def _read(
    file: str,
    robot: Robot,
    contacts: list[str],
    map_file: str | None,
    save_map: str | None,
    rate: float | None,
    force: bool,
) -> Log:
    """The log, with a bar while it is read, and the mapping written where asked for."""
    from copsense.logs import read_log
    from copsense.logs.opening import open_log_file
    from copsense.logs.recognition import recognise

    chosen = map_file
    if save_map is not None:
        recognised = recognise(open_log_file(file), robot, contacts)
        recognised.save(save_map, overwrite=force)
        chosen = save_map
    path = Path(file)
    size = path.stat().st_size if path.is_file() else None
    with progress_bar(size, f"reading {path.name}", "B") as advance:
        return read_log(file, chosen, robot=robot, contacts=contacts, rate=rate, advance=advance)
