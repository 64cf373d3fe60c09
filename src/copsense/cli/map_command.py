"""``copsense map``: a whole space of postures into a Zarr store, here or on a cluster."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.criterion_options import criterion_options, read_criteria
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.place_options import reject_varied
from copsense.cli.printing import (
    PICTURES,
    echo_json,
    echo_notes,
    progress_bar,
    waiting,
)
from copsense.cli.stance_options import read_stance, stance_options
from copsense.cli.uncertainty_option import read_uncertainty, uncertainty_option
from copsense.cli.units import read_quantity
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.extras import require

if TYPE_CHECKING:
    from copsense.maps import Axis, MapSummary
    from copsense.maps.sampling import Sampling
    from copsense.stance import Stance


@click.command(
    "map",
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense map icub --over com_y=-50mm:50mm:101 --over com_z=0.47:0.5:61 "
    "--output icub.zarr --plot icub.png\n"
    "  copsense map icub --over com_y=-50mm:50mm --over pitch=-5:5 --samples 4096 "
    "--output sample.zarr\n"
    "  copsense map icub --over com_y=-50mm:50mm:101 --limits friction=0.33 --local 2 "
    "--output within.zarr",
)
@stance_options
@criterion_options
@click.option(
    "--over",
    multiple=True,
    required=True,
    metavar="NAME=START:STOP[:COUNT]",
    help="A coordinate and its range, absolute, world axes: com_x, com_y, com_z, base_x, base_y, "
    "base_z [m]; roll, pitch, yaw or a joint [deg; m if prismatic]; CONTACT:x, CONTACT:y [m], "
    "CONTACT:yaw [deg]. Other units may be named: -30mm:30mm. With COUNT a grid. Repeatable.",
)
@click.option("--samples", type=int, metavar="N", help="A quasi-random sample instead of a grid.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the sample.")
@click.option(
    "--sequence",
    type=click.Choice(["sobol", "halton"]),
    default="sobol",
    show_default=True,
    help="Low-discrepancy sequence of the sample.",
)
@click.option(
    "--output", required=True, type=click.Path(), metavar="FILE.zarr", help="The store to write."
)
@click.option(
    "--configurations", is_flag=True, help="Store the configurations too (float64, nq a posture)."
)
@click.option(
    "--chunk",
    type=int,
    metavar="N",
    help="Postures that are evaluated, written and resumed as one.  [default: 4096, or 16384 in a "
    "map of 262144 or more, 128 with an uncertainty]",
)
@click.option(
    "--threads", type=int, default=1, show_default=True, help="Chunks evaluated at a time."
)
@click.option(
    "--scheduler",
    metavar="tcp://HOST:PORT",
    help="Evaluate on the workers of this Dask scheduler; they must see the output.",
)
@click.option("--local", type=int, metavar="N", help="Evaluate on N Dask workers started here.")
@uncertainty_option
@click.option("--plot", type=click.Path(), metavar="FILE", help="Draw the map: .png, .svg or .pdf.")
@click.option("--plot-over", metavar="NAME,NAME", help="Coordinates to draw over; default first 2.")
@click.option(
    "--marginal",
    type=click.Choice(["worst", "median"]),
    default="worst",
    show_default=True,
    help="How the picture reduces the coordinates not drawn over.",
)
@click.option("--force", is_flag=True, help="Overwrite the picture; a store is never overwritten.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def map_command(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    over: tuple[str, ...],
    samples: int | None,
    seed: int,
    sequence: str,
    output: str,
    configurations: bool,
    chunk: int | None,
    threads: int,
    scheduler: str | None,
    local: int | None,
    uncertainty: str | None,
    plot: str | None,
    plot_over: str | None,
    marginal: Any,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Map the sensitivity of ROBOT over a space of postures, contacts in place.

    ROBOT is a name from `copsense robots`, the path of a URDF, MJCF or SDF, or a stance file
    (.toml). Evaluates a grid or a sample chunk by chunk into a Zarr store (xarray.open_zarr opens
    it); the same command resumes a map that was stopped. A posture that cannot be reached or
    evaluated is a row with its reason, and makes the exit code 1.
    """
    require("zarr", "a map's store")  # its extra brings what else a map needs

    from copsense.analysis.verdicts import unknown_soles
    from copsense.batch import BatchKernel, PostureChart
    from copsense.files import check_output
    from copsense.maps import MapPlan
    from copsense.maps.heights import check_heights, height_advice
    from copsense.maps.map_lines import map_lines, place_text
    from copsense.maps.map_statistics import summarise
    from copsense.maps.mapping import fill_map
    from copsense.maps.sampling import sampling_of
    from copsense.maps.store import check_store

    check_store(output)
    if plot is not None:
        check_output(plot, suffixes=PICTURES, overwrite=force)
        if len(over) < 2:
            raise InvalidInputError("--plot draws over two coordinates. Give --over twice.")
    elif plot_over is not None:
        raise InvalidInputError("--plot-over is for a picture. Give --plot FILE too.")
    chosen = read_criteria(criteria, characteristic_length)
    within = read_limits(limits)
    unsure = read_uncertainty(uncertainty)
    reject_varied([text.partition("=")[0] for text in over], options)
    stance = read_stance(robot, **options)
    sampling = sampling_of(read_axes(stance, over), samples, seed, sequence)
    check_heights(stance, sampling)  # before a minute of compiling
    pair = _pair(plot_over, sampling.names)
    plan = MapPlan(stance, tuple(chosen), sampling, within, chunk, configurations, unsure)
    echo_notes(note for note in plan.notes if note not in stance.robot.notes)
    if blind := [c.name for c in stance.contacts if c.kind != "point" and c.sole is None]:
        echo_notes([unknown_soles(", ".join(blind))])
    kernel = BatchKernel(stance, plan.criteria, plan.limits)
    with waiting("compiling"):
        PostureChart(stance, sampling.names).compile()
        kernel.compile()
    if not Path(output).exists():
        if kernel.fallback_reason:
            _note(
                f"postures are evaluated one at a time, milliseconds each: {kernel.fallback_reason}"
            )
        else:
            for name, why in kernel.by_reference.items():
                _note(f"{name} is evaluated one posture at a time, milliseconds each: {why}")
        _note(height_advice(stance, sampling))
    done = 0
    with progress_bar(len(sampling), "map") as update:

        def progress(count: int) -> None:
            nonlocal done
            done += count
            update(count)

        try:
            store = fill_map(
                plan,
                output,
                threads=threads,
                scheduler=scheduler,
                workers=local,
                progress=progress,
            )
        except KeyboardInterrupt:
            click.echo(
                f"\nstopped: {done} of {len(sampling)} postures are in {output}. Run the same "
                "command again to resume.",
                err=True,
            )
            click.get_current_context().exit(130)
    with progress_bar(2 * len(sampling), "summary") as update:
        summary = summarise(store, update)
    if plot is not None:
        _draw(stance, sampling, summary, plot, pair, marginal, force)
    if as_json:
        echo_json(summary.to_dict() | {"plot": plot, "notes": list(plan.notes)})
    else:
        click.echo("\n".join(map_lines(summary)))
        click.echo(f"written: {summary.path}" + (f", {plot}" if plot else ""))
    if all(row.counts["unreachable"] == summary.postures for row in summary.criteria.values()):
        own = dict(zip(sampling.names, PostureChart(stance, sampling.names).values, strict=True))
        _note(
            f"no posture was reached. Coordinates are absolute, and the stance has "
            f"{place_text(own, summary)}. The store holds nothing else: rm -r {output}"
        )
    click.get_current_context().exit(1 if _failures(summary) else 0)


def _note(text: str) -> None:
    if text:
        click.echo(f"note: {text}", err=True)


def read_axes(stance: Stance, texts: tuple[str, ...]) -> list[Axis]:
    """``NAME=START:STOP[:COUNT]`` options, in SI; a bare number is in metres or degrees."""
    from copsense.batch import PostureChart
    from copsense.maps import Axis

    ranges = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            start, stop, *count = numbers.split(":")
            if len(count) > 1:
                raise ValueError
            points = int(count[0]) if count else None
        except ValueError:
            raise InvalidInputError(
                f"{text!r} is not understood. Give NAME=START:STOP:COUNT, such as "
                "com_y=-0.03:0.03:41 or com_y=-30mm:30mm:41, or NAME=START:STOP with --samples."
            ) from None
        if name in ranges:
            raise InvalidInputError(f"--over names {name} twice. Give each coordinate once.")
        ranges[name] = start, stop, points
    units = PostureChart(stance, tuple(ranges)).units
    return [
        Axis(name, read_quantity(start, unit), read_quantity(stop, unit), points)
        for (name, (start, stop, points)), unit in zip(ranges.items(), units, strict=True)
    ]


def _pair(text: str | None, known: tuple[str, ...]) -> tuple[str, str] | None:
    """The two coordinates of ``NAME,NAME``, asked for before the work starts."""
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in known:
            raise UnknownNameError("coordinate of the map", name, known)
    if len(set(names)) != 2 or len(names) != 2:
        raise InvalidInputError(
            f"--plot-over is {text!r}. Give two coordinates of the map, such as "
            f"--plot-over {known[0]},{known[-1]}."
        )
    return names[0], names[1]


def _draw(
    stance: Stance,
    sampling: Sampling,
    summary: MapSummary,
    plot: str,
    names: tuple[str, str] | None,
    how: Any,
    force: bool,
) -> None:
    from copsense.maps import load_map, marginal, worst_stances
    from copsense.plots import plot_map, save_figure
    from copsense.skeleton import skeleton

    dataset = load_map(summary.path)
    robust = ["robust_com_travel"] * ("robust_com_travel" in dataset)
    gain = ["largest_com_gain"] * any(c.kind != "point" for c in stance.contacts)
    marginals = [
        marginal(dataset, names, quantity, how)
        for quantity in ("least_com_travel", *robust, *gain)  # CoPs of points stand still
    ]
    worst = {
        name: [
            skeleton(here)
            for here in worst_stances(
                stance, sampling, [w for w in row.worst_travel[:3] if math.isfinite(w.value)]
            )
        ]
        for name, row in summary.criteria.items()
    }
    save_figure(plot_map(marginals, worst), plot, overwrite=force)


def _failures(summary: MapSummary) -> int:
    kinds = ("unreachable", "rejected", "unsolved")
    return sum(row.counts[kind] for row in summary.criteria.values() for kind in kinds)
