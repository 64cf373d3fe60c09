"""``copsense inspect``: what a robot is, where its feet are, and the line that makes it stand."""

from __future__ import annotations

import click

from copsense.cli.printing import echo_json


@click.command(
    epilog="\b\nExamples:\n"
    "  copsense inspect robot.urdf\n"
    "  copsense inspect robot.urdf --package-dir ~/ros/share --json"
)
@click.argument("robot")
@click.option(
    "--package-dir",
    "package_dirs",
    multiple=True,
    type=click.Path(file_okay=False),
    help="Folder in which package:// meshes are looked up. Repeatable.",
)
@click.option("--root", metavar="BODY", help="Body of the robot, where an MJCF holds several.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def inspect(robot: str, package_dirs: tuple[str, ...], root: str | None, as_json: bool) -> None:
    """Inspect ROBOT: mass, joints, motors, feet and soles, and the `analyse` line to paste.

    ROBOT is a name from `copsense robots`, or the path of a URDF, MJCF or SDF. Feet are found by
    geometry: what reaches lowest at rest. The line has been tried: the robot stands by it. In
    Python: copsense.robots.inspect_robot.
    """
    from copsense.robots import inspect_robot

    found = inspect_robot(robot, package_dirs=package_dirs, root=root)
    if as_json:
        echo_json(found.to_dict())
    else:
        click.echo(str(found))
