"""``copsense balance``: one robot, one controller, one scenario in closed loop."""

from __future__ import annotations

import json
import math
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.controller_options import (
    control_period_option,
    controller_options,
    read_gains,
    read_own_controller,
)
from copsense.cli.criterion_options import one_criterion_options, read_criterion
from copsense.cli.disturbance_options import (
    REFERENCES,
    disturbance_options,
    read_disturbances,
    read_signal,
)
from copsense.cli.limit_options import read_limits
from copsense.cli.option_lists import SectionedCommand
from copsense.cli.printing import (
    PICTURES,
    echo_json,
    echo_notes,
    echo_written,
    progress_bar,
)
from copsense.cli.stance_options import read_stance, stance_options
from copsense.cli.units import TIME
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.limits import Limits
    from copsense.simulation import Recording
    from copsense.stance import Stance


@click.command(
    cls=SectionedCommand,
    epilog="\b\nExamples:\n"
    "  copsense balance icub --reference sine:0.03:0.1 --output icub.nc --plot icub.png\n"
    "  copsense balance icub --reference sine:20mm:0.5 --export icub.html\n"
    "  copsense balance icub --push 0:40:0:0.5:0.1 --gain com-stiffness=100 --gain com-damping=20\n"
    "  copsense balance icub --controller my_balance:Balance --video icub.mp4",
)
@stance_options
@one_criterion_options
@disturbance_options
@click.option(
    "--reference",
    default="hold",
    show_default=True,
    metavar="SIGNAL",
    help=f"How far to the left the CoM goes: {REFERENCES}.",
)
@click.option(
    "--duration",
    type=TIME,
    metavar="TIME",
    help="How long; default one period of a sine, a ramp and 1 s, or 2 s.",
)
@controller_options
@click.option(
    "--feedforward",
    is_flag=True,
    help="The built-in controller knows the acceleration of the reference's posture too; the "
    "paper's knows that of the CoM.",
)
@control_period_option
@click.option(
    "--wrenches",
    type=click.Choice(["contacts", "sensors"]),
    default="contacts",
    show_default=True,
    help="Measure wrenches as the engine's contact forces, or by six-axis sensors over the feet.",
)
@click.option(
    "--repair-inertia",
    is_flag=True,
    help="Replace inertias that no body has, as a file may give its links, by a ball's, and say "
    "which. Masses and statics stay.",
)
@click.option(
    "--until",
    type=click.Choice(["tip", "fall"]),
    default="fall",
    show_default=True,
    help="End with the first foot that tips, or run on to a fall.",
)
@click.option("--output", type=click.Path(), help="Write the recording: .nc.")
@click.option("--plot", "picture", type=click.Path(), help="Draw it: .png, .svg or .pdf.")
@click.option("--video", type=click.Path(), help="Film it, off-screen: .mp4.")
@click.option(
    "--export",
    type=click.Path(),
    help="Write it as a film in 3-D, measured centres of pressure beside those predicted at rest "
    "and in motion, in one self-contained page: .html.",
)
@click.option("--force", is_flag=True, help="Overwrite the outputs.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def balance(
    robot: str | None,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    reference: str,
    duration: float | None,
    gains: str,
    feedforward: bool,
    gain: tuple[str, ...],
    controller: str | None,
    control_period: float,
    wrenches: Any,
    repair_inertia: bool,
    until: Any,
    output: str | None,
    picture: str | None,
    video: str | None,
    export: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Balance ROBOT in simulation under the momentum-based controller of [Romano2016].

    The criterion (one, default minimum-torque) shares the load among the contacts. The answer says
    how well the CoM was tracked, the smallest margins, which contact tipped first beside the
    static prediction, and whether the robot fell. Exit code 1 where it did not go to the end.
    Ctrl-C ends the run and keeps what was recorded.
    """
    from copsense.files import check_output
    from copsense.inertias import repair_inertias
    from copsense.simulation import Scenario
    from copsense.simulation import balance as run
    from copsense.simulation.balance_run import natural_duration

    if len(criteria) > 1:
        raise InvalidInputError(
            f"a robot balances under one criterion, got {', '.join(criteria)}. Give one, and run "
            "the command again for another."
        )
    if output is not None:
        check_output(output, suffixes=(".nc",), overwrite=force)
    if picture is not None:
        check_output(picture, suffixes=PICTURES, overwrite=force)
    if video is not None:
        from copsense.simulation.video import check_video

        check_output(video, suffixes=(".mp4",), overwrite=force)
        check_video()
    if export is not None:
        from copsense.extras import require

        check_output(export, suffixes=(".html",), overwrite=force)
        require("viser", "a film in 3-D")
    course = read_signal(reference)
    scenario = Scenario(
        natural_duration(course) if duration is None else duration,
        course,
        control_period=control_period,
        name=reference,
        **read_disturbances(options),
    )
    if feedforward and controller is not None:
        raise InvalidInputError(
            "--feedforward belongs to the built-in controller, and --controller names yours. Leave "
            "one of them out."
        )
    stance, allowed = read_stance(robot, **options), read_limits(limits)
    if repair_inertia:
        known = stance.robot.notes
        stance = replace(stance, robot=repair_inertias(stance.robot))
        echo_notes(note for note in stance.robot.notes if note not in known)
    scenario.check_stance(stance)
    criterion = read_criterion(criteria, characteristic_length)
    own = None if controller is None else read_own_controller(controller, gain, stance)
    total = round(scenario.duration / scenario.control_period)
    with progress_bar(total, "balancing", "step") as update, _interrupts() as stop:
        recording = run(
            stance,
            # Of a user's own controller the analysis knows what the user says.
            criterion if own is None or criteria else None,
            scenario,
            limits=allowed,
            gains=read_gains(gains, gain, stance.robot),
            feedforward=feedforward,
            controller=own,
            until=until,
            wrenches=wrenches,
            progress=update,
            stop=stop,
        )
    echo_notes(note for note in recording.notes if note not in stance.robot.notes)
    recording = recording.with_attributes(command="copsense " + shlex.join(sys.argv[1:]))
    if output is not None:
        recording.save(output, overwrite=force)
    if picture is not None:
        from copsense.plots import plot_rollout, save_figure

        save_figure(plot_rollout(recording), picture, overwrite=force)
    if video is not None:
        from copsense.simulation.video import write_video

        with progress_bar(None, "filming", "frame") as update:
            write_video(stance, recording, video, overwrite=force, progress=update)
    if export is not None:
        _export(recording, stance, criterion, allowed, export, force)
    if as_json:
        echo_json(recording.to_dict())
    else:
        _print(recording)
        echo_written(output, picture, video, export)
    codes = {"completed": 0, "stopped": 130}
    click.get_current_context().exit(codes.get(recording.end.kind, 1))


def _export(
    recording: Recording,
    stance: Stance,
    criterion: Criterion,
    limits: Limits | None,
    path: str,
    force: bool,
) -> None:
    """Write the page, the criterion that was applied among those that it shows."""
    from copsense.explore.export import frames_of
    from copsense.explore.playback import recording_run
    from copsense.explore.showing import paper_criteria_and, show

    run, criteria = recording_run(recording, stance), paper_criteria_and(criterion)
    with progress_bar(frames_of(run), "drawing", "frame") as update:
        page = show(run, criteria=criteria, limits=limits, advance=update)
    page.save(path, overwrite=force)


@contextmanager
def _interrupts() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed; the second one is that of anywhere."""
    pressed: list[int] = []

    def press(number: int, frame: object) -> None:
        if pressed:
            raise KeyboardInterrupt
        pressed.append(number)

    before = signal.signal(signal.SIGINT, press)
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, before)


def _print(recording: Recording) -> None:
    from copsense.simulation.sway_comparison import sway_slopes
    from copsense.sway_levers import STATIC_SHARE

    attributes, end, tip = recording.attrs, recording.end, recording.tip
    through = tip and recording.completed
    click.echo(
        f"{attributes['robot']} under {attributes['controller']}: {end.message.rstrip('.')}, "
        f"{end.time:.2f} s{', though a contact tipped, lifted or slipped' if through else ''}"
    )
    click.echo(
        f"  CoM y error {recording.tracking_error * 1e3:.3f} mm rms, "
        f"{recording.tracking_peak * 1e3:.3f} mm at most"
    )
    for name, margin in recording.smallest_margin.items():
        if math.isfinite(margin):
            click.echo(f"  smallest margin of {name}: {margin * 1e3:+.1f} mm")
    click.echo(f"  torque norm {recording.torque_norm:.1f} Nm, peak {recording.torque_peak:.1f} Nm")
    if tip:
        click.echo(
            f"  first {tip.kind} at {tip.time:.2f} s, CoM y {recording.tip_travel * 1e3:+.1f} mm "
            f"from the start: {tip.message}"
        )
    else:
        click.echo("  no contact tipped")
    if attributes.get("likely_cause"):
        click.echo(f"  likely cause: {attributes['likely_cause']}")
    if attributes.get("static_statement"):
        click.echo(f"  static prediction: {attributes['static_statement']}")
    if attributes.get("quasi_static_share", 0.0) > STATIC_SHARE:
        excess, share = attributes["quasi_static_excess"], attributes["quasi_static_share"]
        click.echo(
            f"  too fast for statics: in motion the centre of pressure goes up to "
            f"{excess * 1e3:.1f} mm ({share * 100:.0f} %) farther than the CoM. Statics are right "
            f"within {STATIC_SHARE * 100:.0f} % up to {_frequencies(attributes)}"
        )
    for contact, found in sway_slopes(recording).items():
        for key, what, unit in (("load", "load", "N/m"), ("cop_y", "CoP y", "mm/mm")):
            if not found[key]["at rest"]:  # a point's centre of pressure stays
                continue
            told = ", ".join(f"{where} {slope:.4g}" for where, slope in found[key].items())
            click.echo(f"  {what} of {contact} per CoM y [{unit}]: {told}")


def _frequencies(attributes: Mapping[str, Any]) -> str:
    """Up to where statics hold: the net CoP, and what else fails earlier."""
    net = attributes["quasi_static_frequency"]
    known = json.loads(attributes.get("static_frequencies", "{}"))
    least = min((f for f in known.values() if f is not None), default=net)
    names = [name for name, f in known.items() if f == least]
    if least > 0.99 * net:
        return f"{net:.3f} Hz"
    return f"{net:.3f} Hz in the net CoP, {least:.3f} Hz in the {names[0]}"
