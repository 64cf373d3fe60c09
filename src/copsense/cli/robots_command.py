"""``copsense robots``: the robots known by name."""

from __future__ import annotations

from typing import Any

import click

from copsense.cli.printing import echo_json
from copsense.errors import CopsenseError, MissingExtraError


@click.command(epilog="\b\nExamples:\n  copsense robots\n  copsense robots --json")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with every joint's name.")
def robots(as_json: bool) -> None:
    """List the robots known by name: joints, mass and contact frames.

    Any other robot is given by the path of its URDF, MJCF or SDF.
    """
    from copsense.robots import PRESETS, load_robot

    rows: list[dict[str, Any]] = []
    lacking: dict[str, list[str]] = {}  # what to do -> for which robots
    for preset in PRESETS.values():
        row: dict[str, Any] = {
            "name": preset.name,
            "summary": preset.summary,
            "contacts": [{"frame": c.frame, "kind": c.kind} for c in preset.contacts],
        }
        try:
            robot = load_robot(preset.name)
            row |= {"mass": robot.mass, "joints": list(robot.joint_names), "missing": None}
        except CopsenseError as error:
            row |= {"mass": None, "joints": [], "missing": str(error)}
            remedy = str(error)
            if isinstance(error, MissingExtraError):
                remedy = f'pip install "copsense[{error.extra}]"'
            lacking.setdefault(remedy, []).append(preset.name)
        rows.append(row)
    if as_json:
        echo_json({"robots": rows})
        return
    width = max(len(row["name"]) for row in rows)
    click.echo(f"{'name':{width}}  joints  mass [kg]  contact frames")
    for row in rows:
        if row["missing"]:
            continue
        frames = ", ".join(c["frame"] for c in row["contacts"])
        kind = row["contacts"][0]["kind"]
        click.echo(
            f"{row['name']:{width}}  {len(row['joints']):6}  {row['mass']:9.2f}  {frames} ({kind})"
        )
    for remedy, names in lacking.items():
        click.echo(f"not installed: {', '.join(names)}\n  {remedy}")
