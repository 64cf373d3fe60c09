"""``copsense push``: how hard a robot that stands still can be pushed, by direction."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.limit_options import read_limits
from copsense.cli.load_options import read_point
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written
from copsense.cli.stance_options import read_stance, stance_options


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense push icub --plot push.png\n"
    "  copsense push icub --at l_hand --limits friction=0.6,torque=model --json\n"
    "  copsense push icub --com-y 0.03 --joint torso_pitch=10 --payload l_hand=2\n"
    "  copsense push talos --at torso_2_link --point 0:0:0.2",
)
@partial(stance_options, coordinates=False)  # --at is the frame that is pushed
@criterion_options
@click.option("--at", "frame", metavar="FRAME", help="The frame that is pushed; default the base.")
@click.option(
    "--point",
    metavar="X:Y:Z",
    help="Where in the frame the push acts [m]; default its origin.",
)
@click.option("--plot", "picture", type=click.Path(), help="Draw the pushes: .png, .svg or .pdf.")
@click.option("--force", is_flag=True, help="Overwrite the picture.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def push(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    frame: str | None,
    point: str | None,
    picture: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Largest slow horizontal push on ROBOT at a frame, in every direction, and the weakest one.

    For any equilibrium within the limits, and for each criterion's own wrenches. Without --limits
    the contacts may not pull or slip (where they know their friction), and each centre of pressure
    stays in its sole. Directions are in the world: +x forward, +y left. In Python:
    copsense.pushes.push_limits.
    """
    from copsense.files import check_output
    from copsense.pushes import push_limits

    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=force)
    within, chosen = read_limits(limits), read_criteria(criteria, characteristic_length)
    where = (0.0, 0.0, 0.0) if point is None else read_point(point, "--point")
    stance = read_stance(robot, **options)
    found = push_limits(stance, frame, chosen, within, point=where)
    echo_notes(note for note in found.notes if note not in stance.robot.notes)
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(found.plot(), picture, overwrite=force)
    if as_json:
        echo_json(found.to_dict() | ({} if picture is None else {"plot": picture}))
        return
    click.echo(str(found))
    echo_written(picture)
