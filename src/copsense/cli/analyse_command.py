"""``copsense analyse``: one posture, and which way of sharing the load keeps its feet planted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written
from copsense.cli.region_text import region_lines, save_regions
from copsense.cli.stance_options import read_stance, stance_options
from copsense.cli.uncertainty_option import read_uncertainty, uncertainty_option
from copsense.cli.units import TIME
from copsense.errors import InvalidInputError


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense analyse icub --com-y 0.03 --along l_hip_roll --plot icub.png\n"
    "  copsense analyse icub --com-y 30mm --joint l_knee=-20 --json\n"
    "  copsense analyse icub --period 2s\n"
    "  copsense analyse icub --uncertainty default --plot icub.png\n"
    "  copsense analyse icub --at com_y=30mm --at pitch=2deg --at l_sole:x=20mm\n"
    "  copsense analyse icub --load l_hand=0:0:-20 --spring-load r_hand=500:0:500:0.2:-0.3:0.6\n"
    "  copsense analyse icub --com-y 0.03 --payload l_hand=2 --save-stance carrying.toml\n"
    "  copsense analyse icub --limits friction=0.33,torque=model --regions regions.png",
)
@stance_options
@criterion_options
@click.option(
    "--along",
    metavar="JOINT",
    help="Report the sensitivity per this joint too (per degree, or per metre for a prismatic "
    "joint), along the lateral path of the CoM.",
)
@click.option(
    "--period",
    type=TIME,
    metavar="TIME",
    help="Say what a sideways sway of this period does to loads and centres of pressure, and up to "
    "which frequency statics are within 5 %.",
)
@uncertainty_option
@click.option("--check", is_flag=True, help="Compare the derivatives with finite differences.")
@click.option("--plot", "picture", type=click.Path(), help="Draw the stance: .png, .svg or .pdf.")
@click.option(
    "--regions",
    type=click.Path(),
    help="Draw the regions of the CoM that the limits leave, and report their areas: .png, .svg or "
    ".pdf. Needs --limits.",
)
@click.option("--force", is_flag=True, help="Overwrite the pictures.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def analyse(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    along: str | None,
    period: float | None,
    uncertainty: str | None,
    check: bool,
    picture: str | None,
    regions: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Analyse one posture of ROBOT: centre of pressure, margin and sensitivity of each contact.

    ROBOT is a name from `copsense robots`, the path of a URDF, MJCF or SDF, or a stance file
    (.toml). Lengths in the answer are along the contact's axes: x forward, y left, z the normal. In
    Python: copsense.analyse.
    """
    from copsense.analysis import analyse as analyse_stance
    from copsense.files import check_output

    for drawn in filter(None, (picture, regions)):
        check_output(drawn, suffixes=PICTURES, overwrite=force)
    if picture is not None and regions is not None and Path(picture) == Path(regions):
        raise InvalidInputError("--plot and --regions name one file. Give each its own.")
    within = read_limits(limits)
    if regions is not None and (within is None or not within.any):
        raise InvalidInputError(
            "regions of the CoM are those that limits leave. Give --limits too, such as "
            "--limits friction=0.33,torque=model."
        )
    chosen = read_criteria(criteria, characteristic_length)
    unsure = read_uncertainty(uncertainty)
    stance = read_stance(robot, **options)
    analysis = analyse_stance(
        stance, chosen, within, along, check=check, period=period, uncertainty=unsure
    )
    answer = analysis.to_dict()
    if regions is not None:
        assert within is not None
        found = save_regions(analysis.stance, chosen, within, regions, overwrite=force)
        answer["regions"] = {"plot": regions, "of": found.to_dict()}
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(analysis.plot(), picture, overwrite=force)
        answer["plot"] = picture
    if as_json:
        echo_json(answer)
        return
    click.echo(str(analysis))
    echo_notes(note for note in analysis.notes if note not in stance.robot.notes)  # printed already
    if check:
        click.echo("derivatives agree with finite differences to 1e-7 relative")
    if "regions" in answer:
        for line in region_lines(answer["regions"]["of"]):
            click.echo(line)
    echo_written(regions, picture)
