"""``copsense design``: the criterion that lets the CoM travel farthest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.place_options import read_course
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written, progress_bar
from copsense.cli.stance_options import read_stance, swept_stance_options
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.design import Design, Score


_USUAL = "-0.09:0.09:37"  # of --com-y


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense design icub --family length --com-y -0.08:0.08:17\n"
    "  copsense design icub --family joints --limits friction=0.33,torque=model --plot design.png",
)
@swept_stance_options
@click.option(
    "--family",
    default="joints",
    show_default=True,
    metavar="NAME",
    help="What may be chosen: length (of minimum-wrench), joints (torque weights of hips, knees "
    "and ankles) or mix (of minimum-torque with minimum-wrench).",
)
@click.option(
    "--objective",
    default="travel",
    show_default=True,
    metavar="NAME",
    help="travel: the farthest CoM travel to the first limit; gain: the least |dCoP/dCoM|.",
)
@click.option(
    "--grid",
    type=click.IntRange(min=2),
    help="Values of each parameter; default 7, and fewer for more than three parameters, 343 "
    "candidates in all at most.",
)
@click.option(
    "--plot",
    "picture",
    type=click.Path(),
    help="Draw the gain and the travel of every candidate against its torques: .png, .svg or .pdf.",
)
@click.option("--force", is_flag=True, help="Overwrite the picture.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with the Pareto set.")
def design(
    robot: str | None,
    limits: str | None,
    family: str,
    objective: Any,
    com_x: str | None,
    com_y: str | None,
    com_z: str | None,
    joints: tuple[str, ...],
    grid: int | None,
    picture: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Design the weights of a criterion for ROBOT, and say what they gain over the paper's two.

    The CoM is swept from the posture, sideways unless another axis is given (default --com-y
    -0.09:0.09:37, its middle being where the travel begins); each candidate is judged by how far
    it goes before its own wrenches, unclipped, meet a limit.
    """
    from copsense.design import design_criterion, design_size, family_named, usual_grid
    from copsense.files import check_output
    from copsense.limits import Limits
    from copsense.path import COM_COORDINATES, com_sweep

    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=force)
    within = read_limits(limits) or Limits()
    course = read_course(com_x, com_y, com_z, joints)
    if not course.swept and com_y is None:
        course = read_course(com_x, _USUAL, com_z, joints)
    swept = [*course.swept]
    if len(swept) != 1 or swept[0] not in COM_COORDINATES:
        raise InvalidInputError(
            "a design sweeps the CoM along one axis: give one of --com-x, --com-y and --com-z as "
            "START:STOP:COUNT, and the others and --joint single values, which hold."
        )
    (moved,) = swept
    stance = read_stance(robot, **course.places, **options)
    start, stop, count = course.range_of(moved, stance.robot)
    chosen = family_named(stance, family)
    with progress_bar(max(count, 0), "postures") as update:
        held = course.held(stance.robot)
        path = com_sweep(stance, moved, start, stop, count, held=held, progress=update)
    values = usual_grid(chosen) if grid is None else grid
    with progress_bar(design_size(chosen, values), "candidates", "criterion") as update:
        found = design_criterion(
            path, within, chosen, objective=objective, grid=values, progress=update
        )
    echo_notes(note for note in found.notes if note not in stance.robot.notes)
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(found.plot(), picture, overwrite=force)
    if as_json:
        echo_json(found.to_dict())
    else:
        _print(found)
        if picture is not None:
            click.echo()
            echo_written(picture)


def _print(found: Design) -> None:
    from copsense.design import NO_LIMIT

    click.echo(f"{found.robot}: family {found.family}, objective {found.objective}")
    click.echo("criterion         travel [mm]  worst gain  torque norm [N m]  first limit")
    for row in (*found.baselines, found.score):
        click.echo(_line(row))
    for row in found.alternatives:
        chosen = ", ".join(f"{k} = {v:.3g}" for k, v in row.parameters.items())
        click.echo(_line(row) + f"  best of family length: {chosen}")
    chosen = ", ".join(f"{k} = {v:.4g}" for k, v in found.score.parameters.items())
    click.echo(f"\nbest: {chosen}; {found.verdict}")
    if found.at_bound:
        click.echo(
            f"at a bound of the family: {', '.join(found.at_bound)}; beyond it may be better still"
        )
    reach = found.score.range * 1e3
    click.echo(
        "worst gain: the largest |dCoP/dCoM| of any contact; it and the torque norm (rms) are over "
        f"the postures within {reach:.1f} mm of the middle"
    )
    if NO_LIMIT in (found.score.first_limit, *(s.first_limit for s in found.baselines)):
        click.echo(
            "note: the path ends before a limit is met, so travels of its length cannot be "
            "compared. Sweep farther.",
            err=True,
        )
    click.echo("\nPareto set (no other is better in both):")
    for row in found.pareto:
        chosen = ", ".join(f"{k} = {v:.3g}" for k, v in row.parameters.items())
        click.echo(_line(row) + f"  {chosen}")


def _line(row: Score) -> str:
    return (
        f"{row.criterion:16}  {row.travel * 1e3:11.1f}  {row.worst_gain:10.3f}"
        f"  {row.torque_norm:17.2f}  {row.first_limit}"
    )
