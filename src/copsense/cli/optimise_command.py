"""``copsense optimise``: the posture that does best within constraints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.criterion_options import one_criterion_options, read_criterion
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written, progress_bar
from copsense.cli.stance_memory import remembered_stance, written
from copsense.cli.stance_options import read_stance, stance_options
from copsense.cli.units import Unit, read_quantity, split_assignment
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.stance import Stance

_UNITS: dict[str, Unit | None] = {
    "travel": "m",
    "sideways": "m",
    "push": "N",
    "torque": "Nm",
    "margin": None,
    "gain": None,
}
_OVER = "NAME, NAME=LOW:HIGH or NAME=+-WIDTH, such as com_z, pitch=-10:10 or feet=+-30mm"
_WITHIN = "NAME=LOW:HIGH, such as com_z=0.45:0.5 or l_knee=-90:-2"
_RESERVE = "PART=SIZE, such as knee=2deg, or one size for all"
_REQUIRE = "QUANTITY=VALUE, such as travel=40mm, push=20N or torque=15Nm"


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense optimise icub --reserve knee=2deg --plot before_after.png\n"
    "  copsense optimise icub --over com --export before_after.html\n"
    "  copsense optimise icub --over com --over turn --over feet=+-30mm --save-stance wide.toml\n"
    "  copsense optimise icub --objective torque --require travel=45mm --within l_knee=-90:-5\n"
    "  copsense optimise icub --over com --pareto torque --points 5 --plot front.png\n"
    "  copsense optimise icub --over com --family joints --limits friction=0.33,torque=model",
)
@stance_options
@one_criterion_options
@click.option(
    "--objective",
    default="travel",
    show_default=True,
    metavar="NAME",
    help="travel (of the CoM to a limit, any way), sideways (the same to the sides alone), margin "
    "(share of the limits that is left) or push (the least that is not borne) are made large; gain "
    "(|dCoP/dCoM|) or torque (norm) small.",
)
@click.option(
    "--over",
    multiple=True,
    metavar="NAME[=LOW:HIGH]",
    help="A coordinate that may vary, and its range: as --at names them (degrees, metres, or with "
    "units), or com, turn (of the base), joints (off the limbs in contact) or feet; =+-WIDTH to "
    "either side of where it is. Repeatable; default com and turn. Limbs in contact follow. none, "
    "with --family: the criterion's weights alone; with --objective sideways they are those of "
    "copsense design.",
)
@click.option(
    "--within",
    multiple=True,
    metavar="NAME=LOW:HIGH",
    help="Where a coordinate or a joint that follows must stay. Repeatable.",
)
@click.option(
    "--reserve",
    multiple=True,
    metavar="PART=SIZE",
    help="How far inside their limits joints must stay, by part of their names (knee=2deg), or for "
    "all that turn (2deg). Repeatable.",
)
@click.option(
    "--distance",
    metavar="LOW:HIGH",
    help="Least and largest horizontal distance of any two contacts [m].",
)
@click.option(
    "--require",
    multiple=True,
    metavar="QUANTITY=VALUE",
    help="The least travel, margin or push, or the largest gain or torque, that is allowed. "
    "Repeatable.",
)
@click.option(
    "--family",
    metavar="NAME",
    help="Criteria whose weights vary too, instead of --criterion: length, joints or mix, as "
    "copsense design has them.",
)
@click.option("--frame", help="The frame that is pushed; default the base.")
@click.option(
    "--starts",
    type=click.IntRange(1, 1000),
    default=4,
    show_default=True,
    help="Postures that the search begins from: the stance, and the best of a sample.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the sample."
)
@click.option(
    "--iterations",
    type=click.IntRange(1),
    default=600,
    show_default=True,
    help="Iterations of the solver from each start, at most.",
)
@click.option(
    "--pareto", metavar="NAME", help="Trade the objective against this quantity: the Pareto front."
)
@click.option(
    "--points",
    type=click.IntRange(2, 1000),
    default=7,
    show_default=True,
    help="Postures on the front.",
)
@click.option(
    "--plot",
    "picture",
    type=click.Path(),
    help="Draw the robot before and after, or the front: .png, .svg or .pdf.",
)
@click.option(
    "--export",
    type=click.Path(),
    help="Write the robot before and after as a film in 3-D, in one self-contained page: .html.",
)
@click.option("--force", is_flag=True, help="Overwrite the picture and the page.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def optimise(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    objective: str,
    over: tuple[str, ...],
    within: tuple[str, ...],
    reserve: tuple[str, ...],
    distance: str | None,
    require: tuple[str, ...],
    family: str | None,
    frame: str | None,
    starts: int,
    seed: int,
    iterations: int,
    pareto: str | None,
    points: int,
    picture: str | None,
    export: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Optimise the posture of ROBOT, contacts in place, within constraints.

    Travels, margins and pushes are measured to --limits (default: contacts that do not pull or
    slip, centres of pressure in their soles). Self-collisions are not looked at: see the picture.
    --save-stance writes the best stance. In Python: copsense.optimise.
    """
    from copsense.files import check_output
    from copsense.optimisation import optimise as best_stance
    from copsense.optimisation import pareto_front
    from copsense.robots.stance_file import check_stance_output

    kept, overwrite = options.pop("save_stance"), options.pop("force_stance")
    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=force)
    if export is not None:
        from copsense.extras import require as require_extra

        check_output(export, suffixes=(".html",), overwrite=force)
        require_extra("viser", "a film in 3-D")
        if pareto is not None:
            raise InvalidInputError(
                "a front has a posture for each point, and --export shows one before and after. "
                "Leave --pareto out, and give --require to choose the point."
            )
    if kept is not None:
        check_stance_output(kept, overwrite=overwrite)
        if pareto is not None:
            raise InvalidInputError(
                "a front has a stance for each point, and --save-stance writes one. Leave --pareto "
                "out, and give --require to choose the point."
            )
    allowed = read_limits(limits)
    if family is not None and criteria:
        raise InvalidInputError(
            "--criterion says how the load is shared, and --family lets it vary. Give one of them."
        )
    chosen = None if family is not None else read_criterion(criteria, characteristic_length)
    stance = read_stance(robot, **options)
    asked: dict[str, Any] = {
        "over": read_over(over, stance) if over else None,
        "within": read_within(within, stance),
        "reserve": _reserve(reserve, stance),
        "distance": None if distance is None else _distance(distance),
        "require": _required(require),
        "family": family,
        "frame": frame,
        "starts": starts,
        "seed": seed,
        "iterations": iterations,
    }
    with progress_bar(None, "optimise", "iteration") as update:
        asked["progress"] = update
        if pareto is None:
            found: Any = best_stance(stance, chosen, allowed, objective=objective, **asked)
        else:
            found = pareto_front(
                stance, (objective, pareto), chosen, allowed, points=points, **asked
            )
    echo_notes(note for note in found.notes if note not in stance.robot.notes)
    if picture is not None:
        from copsense.plots import save_figure

        save_figure(found.plot(), picture, overwrite=force)
    if export is not None:
        found.show().save(export, overwrite=force)
    if as_json:
        files = {"plot": picture, "export": export}
        echo_json(found.to_dict() | {what: file for what, file in files.items() if file})
    else:
        click.echo(str(found))
        echo_written(picture, export)
    if kept is not None:
        file = remembered_stance()
        source, folders = (file.source, file.package_dirs) if file else (robot or "", ())
        folders = options["package_dirs"] or folders
        written(found.stance, kept, source, overwrite, folders, [found.criterion])


def read_over(
    texts: Sequence[str], stance: Stance
) -> dict[str, tuple[float, float] | float | None]:
    """``NAME``, ``NAME=LOW:HIGH`` and ``NAME=+-WIDTH`` options, in SI; ``none`` for nothing.

    Raises:
        UnknownNameError: no such coordinate.
        InvalidInputError: a range that is not understood, a name twice, or ``none`` beside another.
    """
    if "none" in texts:
        if len(texts) > 1:
            raise InvalidInputError(
                "none is given beside a coordinate that varies. Drop one of them."
            )
        return {}
    found: dict[str, tuple[float, float] | float | None] = {}
    for text in texts:
        name, equals, span = text.partition("=")
        if name in found:
            raise InvalidInputError(f"{name} is named twice. Name each coordinate once.")
        if not equals:
            found[name] = None
        elif span.startswith("+-"):
            found[name] = read_quantity(span.removeprefix("+-"), _unit(name, stance))
        else:
            found[name] = _span(text, span, _unit(name, stance), _OVER)
    return found


def read_within(texts: Sequence[str], stance: Stance) -> dict[str, tuple[float, float]]:
    """``NAME=LOW:HIGH`` options, in SI.

    Raises:
        UnknownNameError: no such coordinate.
        InvalidInputError: a range that is not understood, or a name twice.
    """
    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, span = split_assignment(text, _WITHIN)
        if name in found:
            raise InvalidInputError(f"{name} is named twice. Name each coordinate once.")
        found[name] = _span(text, span, _unit(name, stance), _WITHIN)
    return found


def _unit(name: str, stance: Stance) -> Unit:
    from copsense.batch import PostureChart

    if name in ("com", "feet"):
        return "m"
    if name in ("turn", "joints"):
        return "rad"
    return PostureChart(stance, [name], compiled=False).units[0]


def _span(text: str, span: str, unit: Unit, form: str) -> tuple[float, float]:
    try:
        low, high = span.split(":")
    except ValueError:
        raise InvalidInputError(f"{text!r} is not understood. Give {form}.") from None
    return read_quantity(low, unit), read_quantity(high, unit)


def _reserve(texts: Sequence[str], stance: Stance) -> dict[str, float]:
    found: dict[str, float] = {}
    units = {name: stance.robot.joint_unit(name) for name in stance.robot.dof_names}
    for text in texts:
        part, equals, size = text.rpartition("=")
        part = part if equals else "rest"
        own = [unit for name, unit in units.items() if part.lower() in name.lower()]
        if part in found:
            raise InvalidInputError(f"the reserve of {part} is given twice. Give it once.")
        try:
            found[part] = read_quantity(size, own[0] if own else "rad")
        except InvalidInputError as error:
            raise InvalidInputError(f"--reserve {text}: {error} Write {_RESERVE}.") from None
    return found


def _distance(text: str) -> tuple[float, float]:
    return _span(text, text, "m", "LOW:HIGH, such as 0.1:0.2 or 100mm:200mm")


def _required(texts: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in texts:
        name, value = split_assignment(text, _REQUIRE)
        if name in found:
            raise InvalidInputError(f"the required {name} is given twice. Give it once.")
        unit = _UNITS.get(name)
        try:
            found[name] = float(value) if unit is None else read_quantity(value, unit)
        except ValueError:
            raise InvalidInputError(f"{text!r} is not understood. Give {_REQUIRE}.") from None
    return found
