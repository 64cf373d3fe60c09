"""``copsense plot``: the picture of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from copsense.cli.limit_options import limits_option, read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_written
from copsense.description import is_folder
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.sweeps import Sweep


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

    found, chosen = _read(Path(file)), read_limits(limits)
    if chosen is not None:
        found = found.with_limit_margins(chosen)
    path = Path(file).with_suffix(".png") if output is None else Path(output)
    check_output(path, suffixes=PICTURES, overwrite=force)
    save_figure(plot_results(found), path, overwrite=force)
    echo_written(path)


def _read(path: Path) -> Sweep:
    """The sweep at a path.

    Raises:
        InvalidInputError: there is none; a map or a recording is named as such.
    """
    from copsense.simulation import Recording
    from copsense.sweeps import Sweep

    if path.suffix == ".zarr" and is_folder(path):
        raise InvalidInputError(
            f"{path} is a map, and plot draws a sweep. Draw it by the command that made it, with a "
            f"picture: copsense map ... --output {path} --plot map.png."
        )
    try:
        return Sweep.load(path)
    except InvalidInputError:
        try:
            Recording.load(path)
        except InvalidInputError:
            pass
        else:
            raise InvalidInputError(
                f"{path} is a recording, and plot draws a sweep. Draw it as it is made, copsense "
                f"balance ... --plot run.png, or in Python: "
                f"copsense.simulation.Recording.load({str(path)!r}).plot()."
            ) from None
        raise
