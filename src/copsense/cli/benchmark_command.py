"""``copsense benchmark``: controllers compared in closed loop, beside the static prediction."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from copsense.cli.controller_options import control_period_option
from copsense.cli.criterion_options import check_length_of, criterion_options
from copsense.cli.limit_options import limits_of, read_limits
from copsense.cli.option_lists import F, SectionedCommand
from copsense.cli.place_options import place_options
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written
from copsense.cli.robot_argument import robot_argument
from copsense.cli.stance_memory import remember_file, remembered_stance
from copsense.cli.stance_options import read_stance, standing_options
from copsense.cli.units import Unit, read_quantity
from copsense.errors import InvalidInputError
from copsense.extras import require
from copsense.listing import listed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from copsense.comparison import Case, ControllerChoice, PostureChoice, RobotChoice, Trial

_POSTURE_UNITS: dict[str, Unit] = {"knees": "rad", "width": "m"}
_TRIALS = "lean, push, sway, rest, falls, delay, bandwidth, velocity_noise, torque_limit"

_POSTURES = click.option(
    "--posture",
    "postures",
    multiple=True,
    metavar="WORDS",
    help="own, straight, or knees=DEG and width=M with a comma between, each a posture of its own; "
    "or JOINT=POSITION, of all of them. Repeatable; default straight and knees=0.6rad for the "
    "robots whose knees are known, own for others and beside options of a stance.",
)


def _standing_options(command: F) -> F:
    return standing_options(command, _POSTURES)


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense benchmark --output table.csv --plot table.png\n"
    "  copsense benchmark icub talos --posture own --disturbance lean --jobs 2\n"
    "  copsense benchmark icub --limits friction=0.8,cop-margin=0.001 --disturbance falls\n"
    "  copsense benchmark icub --com-y 0.01 --payload l_hand=1 --disturbance lean\n"
    "  copsense benchmark --stance carrying.toml --disturbance push\n"
    "  copsense benchmark --plan plan.toml --output table.csv",
)
@robot_argument("robots", nargs=-1, metavar="[ROBOT]...")
@click.option("--plan", "plan_file", type=click.Path(), help="Take the cases from a TOML file.")
@criterion_options
@click.option(
    "--disturbance",
    "disturbances",
    multiple=True,
    metavar="TRIAL[:OPTION=VALUE,...]",
    help=f"What the robot is put through: {_TRIALS}. Repeatable; default lean, push and sway. "
    "Example: sway:amplitude=39mm,frequency=0.05.",
)
@click.option(
    "--gains",
    type=click.Choice(["stiff", "public"]),
    default="stiff",
    show_default=True,
    help="Gains: stiff, or soft ones like those the authors published.",
)
@control_period_option
@click.option("--repeats", type=int, metavar="N", help="Perturbed pushes of falls; default 20.")
@click.option("--seed", type=int, metavar="N", help="Seed of the falls' perturbations; default 0.")
@click.option(
    "--jobs",
    type=click.IntRange(1),
    metavar="N",
    help="Processes, each with one BLAS thread; default one per core, up to 8.",
)
@click.option("--quick", is_flag=True, help="Coarser and faster: one posture, steps twice as wide.")
@click.option("--output", type=click.Path(), help="Table: .csv. An existing one is resumed.")
@click.option("--plot", "picture", type=click.Path(), help="Draw it: .png, .svg or .pdf.")
@click.option("--force", is_flag=True, help="Start the table again; overwrite the picture.")
@click.option("--json", "as_json", is_flag=True, help="Print ranking and agreement as JSON.")
@_standing_options
@place_options
def benchmark(
    robots: tuple[str, ...],
    plan_file: str | None,
    output: str | None,
    picture: str | None,
    jobs: int | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Compare balancing controllers of ROBOTs (default icub) in simulation.

    Every robot, posture and criterion is put through each disturbance. The table has a row per
    score, beside it the static prediction along the exact path and to first order; a run that
    fails is a row with its reason. A run that was stopped is resumed by the same command.
    Exit code 1 where a run failed.
    """
    from copsense.comparison import benchmark_summary, read_plan, run_benchmark
    from copsense.comparison.benchmark_run import check_plan, finished_scores
    from copsense.files import check_output
    from copsense.robots.stance_tables import is_stance_file

    require("mujoco", "a benchmark in closed loop")
    # A table that is resumed has its picture drawn again.
    redraw = force or (output is not None and Path(output).exists())
    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=redraw)
    if plan_file is None:
        if len(robots) == 1 and is_stance_file(robots[0]):
            remember_file(robots[0])
            robots = ()
        file = remembered_stance()
        if file is not None and robots:
            raise InvalidInputError(
                f"the stance file {file.path} says which robot stands where, and so does "
                f"{', '.join(robots)}. Give one of them."
            )
        plan = _plan(robots or (str(file.path) if file else "icub",), **options)
    else:
        _check_alone(robots, {*options, "stance_file"})
        plan = read_plan(plan_file)
    check_plan(plan)
    notes = _check_robots(plan) + (_unused(plan) if plan_file is not None else [])
    echo_notes(notes)
    kept = 0
    if output is not None:
        path = check_output(output, suffixes=(".csv",), overwrite=True)
        if path.exists() and not force:
            kept = len(finished_scores(path, plan))
            click.echo(f"{kept} of {len(plan)} cases are in {path} already.", err=True)
    processes = jobs or min(os.cpu_count() or 1, 8)
    try:
        with _bar() as update:
            table = run_benchmark(plan, output, jobs=processes, overwrite=force, progress=update)
    except KeyboardInterrupt:
        if output is not None and Path(output).exists():
            click.echo(
                f"\nthe cases that were done are kept in {output}; the same command"
                f"{' without --force' if force else ''} runs the others.",
                err=True,
            )
        raise
    if picture is not None:
        from copsense.plots import plot_benchmark, save_figure

        save_figure(plot_benchmark(table), picture, overwrite=redraw)
    if as_json:
        echo_json(benchmark_summary(table) | {"notes": notes})
    else:
        _print(plan, table)
        echo_written(output, picture)
    wrong = table[table["status"] == "failed"].drop_duplicates("key")
    for row in wrong.head(5).itertuples():
        label = " / ".join((row.robot, row.posture, row.controller, row.trial))
        click.echo(f"failed: {label}: {row.reason}", err=True)
    if len(wrong) > 5:
        click.echo(f"failed: {len(wrong) - 5} more; see the column 'reason'", err=True)
    click.get_current_context().exit(1 if len(wrong) else 0)


def _given(names: Collection[str]) -> list[str]:
    """The options of these names that the command line has."""
    context = click.get_current_context()
    return [
        option.opts[0]
        for option in context.command.params
        if option.name in names
        and context.get_parameter_source(option.name) is click.core.ParameterSource.COMMANDLINE
    ]


def _check_alone(robots: tuple[str, ...], names: Collection[str]) -> None:
    """Reject options that a plan file decides."""
    given = _given(names)
    if robots or given:
        raise InvalidInputError(
            f"a plan file says everything: leave {', '.join([*robots, *given])} out, or --plan."
        )


def _plan(
    robots: tuple[str, ...],
    criteria: tuple[str, ...],
    characteristic_length: float,
    postures: tuple[str, ...],
    disturbances: tuple[str, ...],
    limits: str | None,
    gains: str,
    control_period: float,
    repeats: int | None,
    seed: int | None,
    quick: bool,
    **standing: Any,
) -> tuple[Case, ...]:
    """The cases that the options ask for."""
    from copsense.comparison import Conditions, RobotChoice, make_plan
    from copsense.simulation import Scenario

    usual_period = control_period == Scenario.control_period
    conditions = Conditions(values=None if usual_period else {"control_period": control_period})
    controllers = {
        robot: _controllers(robot, criteria, characteristic_length, gains, limits)
        for robot in dict.fromkeys(robots)
    }
    trials = _trials(disturbances or ("lean", "push", "sway"), repeats, seed, quick)
    words = [text for text in dict.fromkeys(postures) if not _places_joints(text)]
    contacts = standing["contacts"]
    if len(words) < len(set(postures)) or _stands_apart(standing):
        placed = [text for text in postures if _places_joints(text)]
        stances = _stances(robots, words or ["own"], placed, standing)
        pairs = [(robot, [posture]) for robot, posture in stances]
    else:
        choices = [RobotChoice(source, contacts=contacts) for source in dict.fromkeys(robots)]
        pairs = [(robot, _usual(robot, words, quick)) for robot in choices]
    return tuple(
        case
        for robot, ways in pairs
        for case in make_plan([robot], ways, controllers[robot.source], trials, [conditions])
    )


def _controllers(
    robot: str,
    criteria: Sequence[str],
    characteristic_length: float,
    gains: str,
    limits: str | None,
) -> list[ControllerChoice]:
    """The controllers of a robot: what the options say, or its stance file, or the usual ones."""
    from copsense.comparison import ControllerChoice
    from copsense.robots import StanceFile
    from copsense.robots.stance_tables import is_stance_file

    file = remembered_stance()
    if file is None and is_stance_file(robot):
        file = StanceFile.read(robot)
    chosen: list[str | Mapping[str, Any]] = list(dict.fromkeys(criteria))
    if not chosen and file is not None and file.criteria:
        check_length_of(file)
        chosen = [criterion.to_dict() for criterion in file.criteria]
    within = limits_of(file) if limits is None else read_limits(limits)
    return [
        ControllerChoice(criterion, characteristic_length, gains, within)
        for criterion in chosen or ("minimum-wrench", "minimum-torque")
    ]


def _places_joints(text: str) -> bool:
    """Whether a ``--posture`` is JOINT=POSITION, and not words of a benchmark."""
    name, equals, _ = text.partition("=")
    return bool(equals) and name not in _POSTURE_UNITS


def _stands_apart(standing: Mapping[str, Any]) -> bool:
    """Whether options say more of how a robot stands than the frames of its contacts."""
    return bool(_given(standing.keys() - {"contacts"})) or any(
        ":" in text for text in standing["contacts"]
    )


def _stances(
    robots: Sequence[str],
    words: Sequence[str],
    placed: Sequence[str],
    standing: Mapping[str, Any],
) -> Iterator[tuple[RobotChoice, PostureChoice]]:
    """The one robot as the options of a stance let it stand, in each of the postures."""
    from copsense.comparison import PostureChoice, RobotChoice
    from copsense.robots import stance_data

    if len(robots) > 1:
        raise InvalidInputError(
            f"options of a stance are those of one robot, and {len(robots)} are named. Name one, "
            "or write stance files or a plan."
        )
    if standing["save_stance"] is not None and len(words) > 1:
        raise InvalidInputError(
            f"--save-stance writes one stance, and there are {len(words)} postures. Give one."
        )
    file, (source,) = remembered_stance(), robots
    for text in words:
        choice = _posture(text)
        if file is not None:
            RobotChoice(source).check_own(choice)
        angles = [f"{joint}={angle!r}rad" for joint, angle in choice.angles(source).items()]
        options = dict(standing, posture=(*angles, *placed))
        if choice.width is not None:
            if standing["width"] is not None:
                raise InvalidInputError(f"--width and --posture {text} both say it. Give one.")
            options["width"] = choice.width
        stance = read_stance(None if file else source, **options)
        tables = stance_data(
            stance,
            Path.cwd(),
            robot=file.source if file else source,
            package_dirs=file.package_dirs if file else standing["package_dirs"],
        )
        yield RobotChoice(source, tables=tables), PostureChoice(text)


def _usual(robot: RobotChoice, words: Sequence[str], quick: bool) -> list[PostureChoice]:
    """The postures that are asked for, or the usual ones of a robot."""
    from copsense.comparison import PostureChoice

    chosen = [_posture(text) for text in words]
    if not chosen and robot.is_stance:
        chosen = [PostureChoice()]
    if not chosen:
        usual = ("straight",) if quick else ("straight", "knees=0.6rad")
        chosen = [_posture(text) for text in usual]
        try:
            chosen[0].angles(robot.source)
        except KeyError:  # its knees are not known
            chosen = [PostureChoice()]
    for posture in chosen:
        robot.check_own(posture)
        posture.angles(robot.source)
    return chosen


def _check_robots(plan: Sequence[Case]) -> list[str]:
    """Reject robots and frames that do not exist: a mistyped name is not a failed row.

    Returns:
        The robots' notes.
    """
    from copsense.robots import PRESETS, load_robot, load_stance
    from copsense.robots.stance_tables import is_stance_file

    asked = (
        (c.robot.source, (*c.robot.contacts, *(c.robot.soles or ())))
        for c in plan
        if c.robot.tables is None  # else it stands already
    )
    notes: list[str] = []
    for source, frames in dict.fromkeys(asked):
        if is_stance_file(source):
            stance = load_stance(source)
            notes += [f"{stance.robot.name}: {note}" for note in stance.robot.notes]
        elif source not in PRESETS or frames:
            robot = load_robot(source, frames=frames)
            for frame in frames:
                robot.frame(frame)
            notes += [f"{robot.name}: {note}" for note in robot.notes]
    return list(dict.fromkeys(notes))


def _unused(plan: Sequence[Case]) -> list[str]:
    """A sentence for each stance file of a plan whose limits or criteria the plan replaces."""
    from copsense.robots import StanceFile
    from copsense.robots.stance_tables import is_stance_file

    notes = []
    for source in dict.fromkeys(c.robot.source for c in plan if is_stance_file(c.robot.source)):
        data = StanceFile.read(source).data
        said = listed([key for key in ("limits", "criteria") if data.get(key)])
        if said:
            notes.append(
                f"the {said} of {source} are not used: a plan says them under [controllers]."
            )
    return notes


def _posture(text: str) -> PostureChoice:
    from copsense.comparison import PostureChoice

    if text in ("own", "straight"):
        return PostureChoice(text, 0.0 if text == "straight" else None)
    values: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        if name not in _POSTURE_UNITS:
            raise InvalidInputError(
                f"the posture {text!r} is not understood. Give own, straight, knees=DEG, width=M, "
                "knees=40,width=0.2, or JOINT=POSITION."
            )
        values[name] = read_quantity(value, _POSTURE_UNITS[name])
    return PostureChoice(text, values.get("knees"), values.get("width"))


def _trials(
    texts: Sequence[str], repeats: int | None, seed: int | None, quick: bool
) -> dict[str, Trial]:
    from copsense.comparison import Breaking, Falls, Lean, PushToTip, Sway
    from copsense.comparison.trials import option_unit, trial_named

    found: dict[str, Trial] = {}
    for text in texts:
        kind, _, rest = text.partition(":")
        options: dict[str, Any] = {}
        for part in filter(None, rest.split(",")):
            name, equals, value = part.partition("=")
            if not (name and equals and value):
                raise InvalidInputError(
                    f"the disturbance {text!r} is not understood. Give TRIAL[:OPTION=VALUE,...], "
                    "such as lean:speed=0.01,side=right."
                )
            unit = option_unit(kind, name)
            options[name] = (
                _number_or_word(value) if unit is None else read_quantity(value, cast(Unit, unit))
            )
        if kind == "falls":
            options |= {"repeats": repeats} if repeats is not None else {}
            options |= {"seed": seed} if seed is not None else {}
        trial = trial_named(kind, **options)
        if quick:
            if isinstance(trial, Lean) and "speed" not in options:
                trial = replace(trial, speed=0.01)
            elif isinstance(trial, PushToTip) and "resolution" not in options:
                trial = replace(trial, resolution=0.1)
            elif isinstance(trial, Sway) and "frequency" not in options:
                trial = replace(trial, frequency=0.2)
            elif isinstance(trial, Breaking) and "step" not in options and trial.step:
                trial = replace(trial, step=2 * trial.step)
        found[text] = trial
    if (repeats, seed) != (None, None) and not any(isinstance(t, Falls) for t in found.values()):
        raise InvalidInputError(
            "--repeats and --seed are those of falls, and none are asked for. Give --disturbance "
            "falls too, or leave them out."
        )
    return found


def _number_or_word(text: str) -> float | int | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


@contextmanager
def _bar() -> Iterator[Any]:
    """A bar with the time left on standard error, where someone is there to see it."""
    from tqdm import tqdm

    shape = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
    with tqdm(
        total=1.0, desc="benchmark", bar_format=shape, disable=None, leave=False, smoothing=0.05
    ) as bar:
        yield lambda share: bar.update(min(share, 1.0 - bar.n))


def _print(plan: Sequence[Case], table: pd.DataFrame) -> None:
    from copsense.comparison import CAVEAT, agreement, rank_controllers, shown_unit

    for (robot, posture, conditions, trial), rows in table.groupby(
        ["robot", "posture", "conditions", "trial"], sort=False
    ):
        click.echo(f"{robot}, {posture}, {conditions}: {trial}")
        for score, group in rows.groupby("score", sort=False):
            unit, factor = shown_unit(group["unit"].iloc[0])
            click.echo(f"  {str(score).replace('_', ' ')} [{unit}]")
            for row in group.itertuples():
                click.echo(f"    {row.controller}: {_value(row, factor)}")
    tried = table.groupby(["robot", "posture", "conditions", "trial"])["controller"].agg(frozenset)
    among = ", each among the controllers of its own setting" if tried.nunique() > 1 else ""
    click.echo(f"\nranking over {len(plan)} cases (mean rank{among}; shared within the resolution)")
    for (trial, score), rows in rank_controllers(table).groupby(["trial", "score"], sort=False):
        alike = rows["settings"].nunique() == 1
        order = ", ".join(_ranked(row, alike) for row in rows.itertuples())
        click.echo(f"  {trial}, {str(score).replace('_', ' ')}: {order}")
    found = agreement(table)
    if not len(found):
        return
    click.echo("\nprediction against simulation")
    for row in found.itertuples():
        unit, factor = shown_unit(row.unit)
        r = "r needs 4 cases"
        if math.isfinite(row.correlation) and math.isfinite(row.low):
            r = f"r = {row.correlation:.4f} (95 % interval {row.low:.4f} to {row.high:.4f})"
        click.echo(
            f"  {row.score.replace('_', ' ')}, {row.prediction}: {row.cases} cases, error "
            f"{row.mean_error * factor:.3g} {unit} mean, {row.largest_error * factor:.3g} at most; "
            f"{r}"
        )
    click.echo(f"  {CAVEAT}")


def _ranked(row: Any, alike: bool) -> str:
    said = [] if alike else [f"over {row.settings} setting{'s' * (row.settings != 1)}"]
    said += [f"{row.failures} of {row.settings} not measured"] if row.failures else []
    return f"{row.controller} {row.mean_rank:.2g}" + (f" ({', '.join(said)})" if said else "")


_UNMEASURED = {"failed": "failed", "tipped": "not measured", "none": "nothing to measure"}


def _value(row: Any, factor: float) -> str:
    low, high = row.low * factor, row.high * factor
    if row.status in ("failed", "tipped", "none"):
        return f"{_UNMEASURED[row.status]}: {row.reason}"
    if row.status == "bound":
        text = f"at least {low:.4g}" if math.isfinite(low) else f"at most {high:.4g}"
        text += f" ({row.reason})"
    elif row.score == "fall_rate":
        text = f"{row.value:.2f} (95 % interval {low:.2f} to {high:.2f}; {row.reason})"
    else:
        text = f"{row.value * factor:.4g} ± {(high - low) / 2:.2g}"
    said = [
        f"{word} {value * factor:.4g}"
        for word, value in (("statics", row.predicted), ("first order", row.first_order))
        if math.isfinite(value)
    ]
    text += f", {', '.join(said)}" if said else ""
    if not row.contact:
        return text
    return f"{text}; {row.contact} {row.how}"
