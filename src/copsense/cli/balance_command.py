"""``copsense balance``: one robot, one controller, one scenario in closed loop."""

from __future__ import annotations

import math
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.controller_options import (
    controller_options,
    read_gains,
    read_own_controller,
)
from copsense.cli.criterion_options import one_criterion_options, read_criteria
from copsense.cli.disturbance_options import (
    REFERENCES,
    disturbance_options,
    read_disturbances,
    read_signal,
)
from copsense.cli.limit_options import read_limits
from copsense.cli.printing import PICTURES, echo_json, echo_written, progress_bar
from copsense.cli.stance_options import read_stance, stance_options
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.simulation import Recording

_TOO_FAST = 0.05  # share of the CoM's motion by which the centre of pressure may go farther


@click.command(
    epilog="\b\nExamples:\n"
    "  copsense balance icub --reference sine:0.03:0.1 --output icub.nc --plot icub.png\n"
    "  copsense balance icub --push 0:40:0:0.5:0.1 --gain com-stiffness=100 --gain com-damping=20\n"
    "  copsense balance icub --controller my_balance:Balance --video icub.mp4"
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
    "--duration", type=float, metavar="S", help="Default: one period, the ramp and 1 s, or 2 s."
)
@controller_options
@click.option(
    "--control-period",
    type=float,
    default=1e-3,
    show_default=True,
    metavar="S",
    help="Time between two steps of the controller [s], a multiple of the physics' 1 ms.",
)
@click.option(
    "--wrenches",
    type=click.Choice(["contacts", "sensors"]),
    default="contacts",
    show_default=True,
    help="Measure wrenches as the engine's contact forces, or by six-axis sensors over the feet.",
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
@click.option("--force", is_flag=True, help="Overwrite the outputs.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def balance(
    robot: str,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    reference: str,
    duration: float | None,
    gains: str,
    gain: tuple[str, ...],
    controller: str | None,
    control_period: float,
    wrenches: Any,
    until: Any,
    output: str | None,
    picture: str | None,
    video: str | None,
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
    (criterion,) = read_criteria(criteria or ("minimum-torque",), characteristic_length)
    course = read_signal(reference)
    scenario = Scenario(
        natural_duration(course) if duration is None else duration,
        course,
        control_period=control_period,
        name=reference,
        **read_disturbances(options),
    )
    stance, allowed = read_stance(robot, **options), read_limits(limits)
    scenario.check_stance(stance)
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
            controller=own,
            until=until,
            wrenches=wrenches,
            progress=update,
            stop=stop,
        )
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
    summary = _summary(recording)
    if as_json:
        echo_json(summary | {"notes": list(stance.robot.notes)})
    else:
        _print(summary)
        echo_written(output, picture, video)
    codes = {"completed": 0, "stopped": 130}
    click.get_current_context().exit(codes.get(summary["end"]["kind"], 1))


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


def _summary(recording: Recording) -> dict[str, Any]:
    """What a person wants to know of a run; tracking and torques are those before a tip."""
    attributes, end, tip = recording.attrs, recording.end, recording.tip
    torque = recording.before_first_tip["torque"]
    return {
        "robot": attributes["robot"],
        "controller": attributes["controller"],
        "end": {"kind": end.kind, "reason": end.message, "time": end.time},
        "com_error_rms": recording.tracking_error,
        "com_error_peak": recording.tracking_peak,
        "smallest_margin": recording.smallest_margin,
        "torque_norm_mean": float(((torque**2).sum("joint") ** 0.5).mean()),
        "torque_peak": float(abs(torque).max()),
        "first_tip": None
        if tip is None
        else {
            "contact": tip.contact,
            "reason": tip.message,
            "time": tip.time,
            "com_y_from_start": recording.tip_travel,
        },
        "static_prediction": {
            "excursion": attributes.get("static_excursion", math.nan),
            "contact": attributes.get("static_contact", ""),
            "how": attributes.get("static_how", ""),
            "reach": attributes.get("static_reach", math.nan),
            "statement": attributes.get("static_statement", ""),
        },
        "quasi_static": {
            name: attributes.get(f"quasi_static_{name}", math.nan)
            for name in ("lever", "excess", "share", "frequency")
        },
    }


def _print(summary: dict[str, Any]) -> None:
    end, tip, static = summary["end"], summary["first_tip"], summary["static_prediction"]
    through = tip and end["kind"] == "completed"
    click.echo(
        f"{summary['robot']} under {summary['controller']}: {end['reason'].rstrip('.')}, "
        f"{end['time']:.2f} s{', though a contact tipped, lifted or slipped' if through else ''}"
    )
    click.echo(
        f"  CoM y error {summary['com_error_rms'] * 1e3:.3f} mm rms, "
        f"{summary['com_error_peak'] * 1e3:.3f} mm at most"
    )
    for name, margin in summary["smallest_margin"].items():
        if math.isfinite(margin):
            click.echo(f"  smallest margin of {name}: {margin * 1e3:+.1f} mm")
    click.echo(
        f"  torque norm {summary['torque_norm_mean']:.1f} Nm, peak {summary['torque_peak']:.1f} Nm"
    )
    if tip:
        click.echo(
            f"  first tip at {tip['time']:.2f} s, CoM y {tip['com_y_from_start'] * 1e3:+.1f} mm "
            f"from the start: {tip['reason']}"
        )
    else:
        click.echo("  no contact tipped")
    if static["statement"]:
        click.echo(f"  static prediction: {static['statement']}")
    quasi = summary["quasi_static"]
    if quasi["share"] > _TOO_FAST:
        click.echo(
            f"  too fast for statics: in motion the centre of pressure goes up to "
            f"{quasi['excess'] * 1e3:.1f} mm ({quasi['share'] * 100:.0f} %) farther than the CoM. "
            f"Statics are right within {_TOO_FAST * 100:.0f} % up to {quasi['frequency']:.2f} Hz"
        )
