"""``copsense sweep``: many postures and criteria, and a summary of them."""

from __future__ import annotations

import math
import shlex
import sys
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.place_options import Course, read_course
from copsense.cli.printing import (
    echo_json,
    echo_notes,
    echo_written,
    progress_bar,
)
from copsense.cli.stance_options import read_stance, swept_stance_options
from copsense.cli.units import TIME
from copsense.errors import InvalidInputError
from copsense.listing import listed

if TYPE_CHECKING:
    from copsense.path import PosturePath
    from copsense.stance import Stance


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense sweep icub --com-y -0.07:0.07:201 --output icub.nc\n"
    "  copsense sweep icub --com-y -30mm:30mm:61 --period 2s --output sway.nc\n"
    "  copsense sweep icub --com-y -0.05:0.05:51 --com-x 0.01 --joint torso_yaw=20\n"
    "  copsense sweep icub --joint l_knee=-30:-5:11 --criterion minimum-torque --output knee.csv",
)
@swept_stance_options
@criterion_options
@click.option(
    "--configurations",
    type=click.Path(),
    metavar="FILE",
    help="Evaluate these: a row (nq numbers) per posture, .csv or .npy; the first fixes the feet.",
)
@click.option(
    "--period",
    type=TIME,
    metavar="TIME",
    help="Sway along the whole path and back in this time, with the inertia that takes, instead of "
    "standing still at each posture.",
)
@click.option(
    "--output",
    type=click.Path(),
    help="Write netCDF (.nc, everything) or a table (.csv); print a summary alone if not given.",
)
@click.option("--force", is_flag=True, help="Overwrite the output.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def sweep(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    com_x: str | None,
    com_y: str | None,
    com_z: str | None,
    joints: tuple[str, ...],
    configurations: str | None,
    period: float | None,
    output: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Sweep the CoM or a joint of ROBOT, contacts in place, and evaluate every posture.

    ROBOT is a name from `copsense robots`, the path of a URDF, MJCF or SDF, or a stance file
    (.toml). A posture that fails is a row with its reason, and makes the exit code 1.
    """
    from copsense.files import check_output
    from copsense.sweeps import sweep as evaluate

    course = read_course(com_x, com_y, com_z, joints)
    _check_one_is_swept(course, configurations)
    if configurations is not None and course.holding:
        raise InvalidInputError(
            f"the rows of {configurations} say where every joint is, and so does "
            f"{', '.join(course.holding)}. Leave one of them out."
        )
    if output is not None:
        check_output(output, suffixes=(".nc", ".csv"), overwrite=force)
    chosen = read_criteria(criteria, characteristic_length)
    within = read_limits(limits)
    stance = read_stance(robot, **course.places, **options)
    path = _read_path(stance, course, configurations)
    with progress_bar(len(path), "criteria") as update:
        swept = evaluate(path, chosen, within, period=period, progress=update)
    swept = swept.with_attributes(command="copsense " + shlex.join(sys.argv[1:]))
    failures = swept.failed_rows
    if output is not None:
        swept.save(output, overwrite=force)
    answer = swept.to_dict()
    echo_notes(note for note in swept.notes if note not in path.stances[0].robot.notes)
    if as_json:
        echo_json(answer | {"output": output})
    else:
        _print(answer)
        echo_written(output)
    for posture, criterion, reason in failures[:5]:
        click.echo(f"failed: posture {posture}, {criterion}: {reason}", err=True)
    if len(failures) > 5:
        click.echo(f"failed: {len(failures) - 5} more; see the variable 'reason'", err=True)
    click.get_current_context().exit(1 if failures else 0)


def _check_one_is_swept(course: Course, configurations: str | None) -> None:
    """Reject none and several; the message names what was given.

    Raises:
        InvalidInputError: nothing is swept, or more than one thing.
    """
    swept = course.sweeping + [f"--configurations {configurations}"] * (configurations is not None)
    if len(swept) > 1:
        raise InvalidInputError(
            f"{listed(swept)} each sweep, and a sweep is along one. Give the others a single "
            "value, which holds, or leave them out."
        )
    if not swept and course.holding:
        raise InvalidInputError(
            f"nothing is swept: {listed(course.holding)} with a single value "
            f"{'holds' if len(course.holding) == 1 else 'hold'}. A range is START:STOP:COUNT, such "
            "as --com-y -30mm:30mm:61 or --joint l_knee=-30:-5:11."
        )
    if not swept:
        raise InvalidInputError(
            "say what to sweep, one of: --com-x, --com-y or --com-z START:STOP:COUNT [m], "
            "--joint NAME=START:STOP:COUNT, --configurations FILE. A single value holds."
        )


def _read_path(stance: Stance, course: Course, configurations: str | None) -> PosturePath:
    """The path that the options ask for."""
    from copsense.files import load_configurations
    from copsense.path import COM_COORDINATES, com_sweep, joint_sweep, path_through

    if configurations is not None:
        rows = load_configurations(configurations)
        return path_through(stance.at(rows[0]), rows, strict=False)
    (name,) = course.swept
    start, stop, count = course.range_of(name, stance.robot)
    make, held = com_sweep if name in COM_COORDINATES else joint_sweep, course.held(stance.robot)
    with progress_bar(max(count, 0), "postures") as update:
        return make(stance, name, start, stop, count, held=held, progress=update)


def _rounded(value: float) -> float:
    return round(value, 1) + 0.0  # no minus before a zero


_OPPOSITE = {
    "no limit active": "a limit active",
    "every contact planted": "a contact beyond its sole",
    "every contact pushes": "a contact that pulls",
}


def _nowhere(word: str, summary: dict[str, Any]) -> str:
    """What to say where something is so at no posture."""
    failed = summary["failed_rows"]
    if failed == summary["postures"] * len(summary["criteria"]):
        return "no posture was evaluated"
    return f"{_OPPOSITE[word]} at every posture" + (" that was evaluated" if failed else "")


def _print(summary: dict[str, Any]) -> None:
    unit, factor = summary["unit"], 1.0
    if unit == "rad":
        unit, factor = "deg", 180.0 / math.pi
    click.echo(f"{summary['robot']}: {summary['postures']} postures along {summary['coordinate']}")
    for name, row in summary["criteria"].items():
        word = "no limit active" if summary["limits"] else "every contact planted"
        if summary["without_sole"] and not summary["limits"]:
            word = "every contact pushes"
        if row["planted"] is None:
            planted = _nowhere(word, summary)
        else:
            low, high = (value * factor for value in row["planted"])
            where = f"at {low:+.4g} {unit} alone"  # of all the postures
            if low != high:
                where = f"from {low:+.4g} to {high:+.4g} {unit}"
            planted = f"{word} {where}"
        if row["smallest_margin"] is not None:
            planted += (
                f"; smallest margin on the way {_rounded(row['smallest_margin'] * 1e3):+.1f} mm"
            )
        click.echo(f"  {name}: {planted}")
        known = {k: f for k, f in (row["static_frequency"] or {}).items() if f is not None}
        if known:
            least = min(known, key=known.__getitem__)
            click.echo(
                f"    this sway: {1 / summary['period']:.3g} Hz; statics are within 5 % up to "
                f"{known[least]:.3f} Hz (least: {least})"
            )
    if summary["without_sole"]:
        from copsense.analysis.verdicts import unknown_soles

        echo_notes([unknown_soles(summary["without_sole"])])
