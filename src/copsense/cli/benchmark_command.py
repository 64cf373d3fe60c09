"""``copsense benchmark``: controllers compared in closed loop, beside the static prediction."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from copsense.cli.controller_options import control_period_option
from copsense.cli.criterion_options import criterion_options
from copsense.cli.limit_options import read_limits
from copsense.cli.printing import PICTURES, echo_json, echo_notes, echo_written
from copsense.cli.stance_memory import remember_stance, remembered_stance
from copsense.cli.units import Unit, read_quantity
from copsense.errors import InvalidInputError
from copsense.extras import require

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from copsense.comparison import Case, ControllerChoice, PostureChoice, Trial

_TRIALS = "lean, push, sway, rest, falls, delay, bandwidth, velocity_noise, torque_limit"


@click.command(
    epilog="\b\nExamples:\n"
    "  copsense benchmark --output table.csv --plot table.png\n"
    "  copsense benchmark icub talos --posture own --disturbance lean --jobs 2\n"
    "  copsense benchmark icub --limits friction=0.8,cop-margin=0.001 --disturbance falls\n"
    "  copsense benchmark --stance carrying.toml --disturbance push\n"
    "  copsense benchmark --plan plan.toml --output table.csv"
)
@click.argument("robots", nargs=-1, metavar="[ROBOT]...")
@click.option("--plan", "plan_file", type=click.Path(), help="Take the cases from a TOML file.")
@click.option(
    "--stance",
    "stance_file",
    metavar="FILE",
    is_eager=True,
    callback=remember_stance,
    help="A stance file (.toml) instead of ROBOTs; with its limits and criteria, unless options "
    "give others.",
)
@criterion_options
@click.option(
    "--posture",
    "postures",
    multiple=True,
    metavar="WORDS",
    help="own, straight, or knees=DEG and width=M with a comma between. Repeatable; default "
    "straight and knees=0.6rad for the robots whose knees are known, own for others.",
)
@click.option(
    "--disturbance",
    "disturbances",
    multiple=True,
    metavar="TRIAL[:OPTION=VALUE,...]",
    help=f"What the robot is put through: {_TRIALS}. Repeatable; default lean, push and sway. "
    "Example: sway:amplitude=39mm,frequency=0.05.",
)
@click.option(
    "--limits",
    metavar="NAME=VALUE,...",
    help="Limits of the controllers, as in `copsense balance`. Falls are counted with them only.",
)
@click.option(
    "--gains",
    type=click.Choice(["stiff", "public"]),
    default="stiff",
    show_default=True,
    help="Gains: stiff, or soft ones like those the authors published.",
)
@control_period_option
@click.option(
    "--contact", "contacts", multiple=True, metavar="FRAME", help="Contact frame. Repeatable."
)
@click.option("--repeats", type=int, metavar="N", help="Perturbed pushes of falls; default 20.")
@click.option("--seed", type=int, metavar="N", help="Of the falls' perturbations; default 0.")
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
def benchmark(
    robots: tuple[str, ...],
    plan_file: str | None,
    stance_file: str | None,
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

    require("mujoco", "a benchmark in closed loop")
    # A table that is resumed has its picture drawn again.
    redraw = force or (output is not None and Path(output).exists())
    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=redraw)
    if plan_file is None:
        if stance_file is not None and robots:
            raise InvalidInputError(
                f"--stance {stance_file} says which robot stands where, and so does "
                f"{', '.join(robots)}. Give one of them."
            )
        plan = _plan(robots or (stance_file or "icub",), **options)
    else:
        _check_alone(robots, options | {"stance_file": stance_file})
        plan = read_plan(plan_file)
    check_plan(plan)
    notes = _check_robots(plan)
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


def _check_alone(robots: tuple[str, ...], options: dict[str, Any]) -> None:
    """Reject options that a plan file decides."""
    context = click.get_current_context()
    given = [
        option.opts[0]
        for option in context.command.params
        if option.name in options
        and getattr(context.get_parameter_source(option.name), "name", "") == "COMMANDLINE"
    ]
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
    contacts: tuple[str, ...],
    repeats: int | None,
    seed: int | None,
    quick: bool,
) -> tuple[Case, ...]:
    """The cases that the options ask for."""
    from copsense.comparison import (
        Conditions,
        ControllerChoice,
        PostureChoice,
        RobotChoice,
        make_plan,
    )
    from copsense.simulation import Scenario

    usual_period = control_period == Scenario.control_period
    conditions = Conditions(values=None if usual_period else {"control_period": control_period})
    within = read_limits(limits)
    file = remembered_stance()
    chosen_criteria: list[str | Mapping[str, Any]] = list(dict.fromkeys(criteria))
    if not criteria and file is not None:
        chosen_criteria = [criterion.to_dict() for criterion in file.criteria]
    controllers: list[ControllerChoice] = [
        ControllerChoice(criterion, characteristic_length, gains, within)
        for criterion in chosen_criteria or ("minimum-wrench", "minimum-torque")
    ]
    trials = _trials(disturbances or ("lean", "push", "sway"), repeats, seed, quick)
    cases: list[Case] = []
    for source in dict.fromkeys(robots):
        robot = RobotChoice(source, contacts=contacts)
        chosen = [_posture(text) for text in dict.fromkeys(postures)]
        if not chosen and robot.is_stance:
            chosen = [PostureChoice()]
        if not chosen:
            usual = ("straight",) if quick else ("straight", "knees=0.6rad")
            chosen = [_posture(text) for text in usual]
            try:
                chosen[0].angles(source)
            except KeyError:  # its knees are not known
                chosen = [PostureChoice()]
        for posture in chosen:
            robot.check_own(posture)
            posture.angles(source)
        cases += make_plan([robot], chosen, controllers, trials, [conditions])
    return tuple(cases)


def _check_robots(plan: Sequence[Case]) -> list[str]:
    """Reject robots and frames that do not exist: a mistyped name is not a failed row.

    Returns:
        The robots' notes, which are printed.
    """
    from copsense.robots import PRESETS, load_robot, load_stance

    asked = ((c.robot.source, (*c.robot.contacts, *(c.robot.soles or ()))) for c in plan)
    notes: list[str] = []
    for source, frames in dict.fromkeys(asked):
        if source.endswith(".toml"):
            stance = load_stance(source)
            notes += [f"{stance.robot.name}: {note}" for note in stance.robot.notes]
        elif source not in PRESETS or frames:
            robot = load_robot(source, frames=frames)
            for frame in frames:
                robot.frame(frame)
            notes += [f"{robot.name}: {note}" for note in robot.notes]
    notes = list(dict.fromkeys(notes))
    echo_notes(notes)
    return notes


def _posture(text: str) -> PostureChoice:
    from copsense.comparison import PostureChoice

    if text in ("own", "straight"):
        return PostureChoice(text, 0.0 if text == "straight" else None)
    units: dict[str, Unit] = {"knees": "rad", "width": "m"}
    values: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        if name not in units:
            raise InvalidInputError(
                f"the posture {text!r} is not understood. Give own, straight, knees=DEG, width=M, "
                "or knees=40,width=0.2; joints by name in a plan file."
            )
        values[name] = read_quantity(value, units[name])
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
    click.echo(f"\nranking over {len(plan)} cases (mean rank; shared within the resolution)")
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
