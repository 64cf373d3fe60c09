"""``copsense plot``: the picture of a sweep."""

from __future__ import annotations

from pathlib import Path

import click

from copsense.cli.limit_options import limits_option, read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_written


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense plot icub.nc --output icub.png\n"
    "  copsense plot icub.nc --limits friction=0.3,torque=model",
)
@click.argument("file", type=click.Path())
@click.option(
    "--output",
    type=click.Path(),
    help="Picture to write: .png, .svg or .pdf. Default: FILE with .png.",
)
@limits_option
@click.option("--force", is_flag=True, help="Overwrite the output.")
def plot(file: str, output: str | None, limits: str | None, force: bool) -> None:
    """Draw a sweep written by `copsense sweep`: soles and CoPs, margins, load, CoM travel.

    With limits, or of a sweep within limits, the margins to them are drawn too, and where each
    criterion meets its first one: to the recorded wrenches, whatever the sweep was evaluated with.
    """
    from copsense.files import check_output
    from copsense.plots import plot_results, save_figure
    from copsense.sweeps import Sweep

    found, chosen = Sweep.load(file), read_limits(limits)
    if chosen is not None:
        found = found.with_limit_margins(chosen)
    path = Path(file).with_suffix(".png") if output is None else Path(output)
    check_output(path, suffixes=PICTURES, overwrite=force)
    save_figure(plot_results(found), path, overwrite=force)
    echo_written(path)
