"""``copsense balance``: one robot, one controller, one scenario in closed loop."""

from __future__ import annotations

import math
import shlex
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click
from tqdm import tqdm

from copsense.cli.options import (
    criterion_options,
    echo_json,
    read_assignments,
    read_criteria,
    read_limits,
    read_stance,
    stance_options,
)
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.controllers import Signal
    from copsense.simulation import Push

_REFERENCES = "hold, sine:AMPLITUDE:FREQUENCY or ramp:DISTANCE[:SPEED] [m, Hz, m/s]"


@click.command(
    epilog="Example: copsense balance icub --criterion minimum-torque --reference sine:0.03:0.1 "
    "--duration 10 --output icub.nc --plot icub.png"
)
@stance_options
@criterion_options
@click.option(
    "--reference",
    default="hold",
    show_default=True,
    metavar="SIGNAL",
    help=f"How far to the left the CoM goes: {_REFERENCES}.",
)
@click.option(
    "--duration", type=float, metavar="S", help="Default: one period, the ramp and 1 s, or 2 s."
)
@click.option(
    "--push",
    "pushes",
    multiple=True,
    metavar="FX:FY:FZ[:START[:DURATION[:FRAME]]]",
    help="Push [N], world axes, at START [s] for DURATION [s] on a frame. Repeatable.",
)
@click.option(
    "--gains",
    type=click.Choice(["stiff", "public"]),
    default="stiff",
    show_default=True,
    help="Gains: stiff, or soft ones like those the authors published.",
)
@click.option("--delay", type=float, default=0.0, metavar="S", help="Delay of the torques [s].")
@click.option("--bandwidth", type=float, metavar="HZ", help="Bandwidth of the torques [Hz].")
@click.option(
    "--torque-limit",
    "torque_limits",
    multiple=True,
    metavar="[JOINT=]NM",
    help="Motors give no more: a number for all, model, or JOINT=NM. Repeatable.",
)
@click.option("--position-noise", type=float, default=0.0, metavar="RAD", help="Of the joints.")
@click.option("--velocity-noise", type=float, default=0.0, metavar="RAD/S", help="Of the joints.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random.")
@click.option(
    "--until",
    type=click.Choice(["tip", "fall"]),
    default="fall",
    show_default=True,
    help="End with the first foot that tips, or go on to a fall.",
)
@click.option("--output", type=click.Path(), help="Write the recording: .nc.")
@click.option("--plot", "picture", type=click.Path(), help="Draw it: .png, .svg or .pdf.")
@click.option("--force", is_flag=True, help="Overwrite the outputs.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def balance(
    robot: str,
    criteria: tuple[str, ...],
    characteristic_length: float,
    limits: str | None,
    reference: str,
    duration: float | None,
    pushes: tuple[str, ...],
    gains: str,
    delay: float,
    bandwidth: float | None,
    torque_limits: tuple[str, ...],
    position_noise: float,
    velocity_noise: float,
    seed: int,
    until: Any,
    output: str | None,
    picture: str | None,
    force: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Balance ROBOT in simulation under the momentum-based controller of [Romano2016].

    The criterion (one, default minimum-torque) shares the load among the contacts. The answer says
    how well the CoM was tracked, the smallest margins, which contact tipped first beside the
    static prediction, and whether the robot fell. Exit code 1 where it did not go to the end.
    """
    from copsense.controllers import STIFF, BalancingController, lateral_reference, public_gains
    from copsense.simulation import Motors, MujocoSimulator, Noise, Scenario, rollout
    from copsense.simulation.prediction import predict
    from copsense.storage import check_output, write_recording

    if len(criteria) > 1:
        raise InvalidInputError(
            f"a robot balances under one criterion, got {', '.join(criteria)}. Give one, and run "
            "the command again for another."
        )
    if output is not None:
        check_output(output, suffixes=(".nc",), overwrite=force)
    if picture is not None:
        check_output(picture, suffixes=(".png", ".svg", ".pdf"), overwrite=force)
    (criterion,) = read_criteria(criteria or ("minimum-torque",), characteristic_length)
    signal, natural = _read_signal(reference)
    motors = Motors(delay, bandwidth, _read_torque_limits(torque_limits))
    scenario = Scenario(
        natural if duration is None else duration,
        signal,
        tuple(_read_push(text) for text in pushes),
        motors,
        Noise(position_noise, velocity_noise),
        seed=seed,
        name=reference,
    )
    stance, allowed = read_stance(robot, **options), read_limits(limits)
    scenario.check_robot(stance.robot)
    simulator = MujocoSimulator(stance)
    chosen = STIFF if gains == "stiff" else public_gains(stance.robot)
    controller = BalancingController(stance, criterion, chosen, limits=allowed)
    path = lateral_reference(stance, signal)
    total = round(scenario.duration / scenario.control_period)
    with tqdm(total=total, desc="balancing", unit="ms", disable=None, leave=False) as bar:
        recording = rollout(
            simulator,
            controller,
            replace(scenario, reference=path),
            until=until,
            progress=bar.update,
        )
    recording = predict(path, criterion, allowed).attach(recording)
    recording.attrs["command"] = "copsense " + shlex.join(sys.argv[1:])
    if output is not None:
        write_recording(recording, output, overwrite=force)
    if picture is not None:
        from copsense.plots import plot_rollout, save_figure

        save_figure(plot_rollout(recording), picture, overwrite=force)
    summary = _summary(recording)
    if as_json:
        echo_json(summary)
    else:
        _print(summary, [path for path in (output, picture) if path])
    click.get_current_context().exit(0 if summary["end"]["kind"] == "completed" else 1)


def _read_signal(text: str) -> tuple[Signal, float]:
    """A reference and how long it naturally lasts [s]."""
    from copsense.controllers import Hold, Ramp, Sine

    kind, _, rest = text.partition(":")
    if kind not in ("hold", "sine", "ramp"):
        raise UnknownNameError("reference", kind, ("hold", "sine", "ramp"))
    try:
        numbers = [float(part) for part in rest.split(":")] if rest else []
        if kind == "hold" and not numbers:
            return Hold(), 2.0
        if kind == "sine" and len(numbers) == 2:
            sine = Sine(*numbers)
            return sine, 1.0 / sine.frequency
        if kind == "ramp" and len(numbers) in (1, 2):
            ramp = Ramp(*numbers)
            return ramp, ramp.duration + 1.0
    except ValueError as error:
        if isinstance(error, InvalidInputError):
            raise
    raise InvalidInputError(f"the reference {text!r} is not understood. Give {_REFERENCES}.")


def _read_push(text: str) -> Push:
    from copsense.simulation import Push

    try:
        x, y, z, *rest = text.split(":")
        force = float(x), float(y), float(z)
        extra: dict[str, Any] = {}
        if rest:
            extra["start"] = float(rest[0])
        if len(rest) > 1:
            extra["duration"] = float(rest[1])
        if len(rest) > 2:
            extra["frame"] = ":".join(rest[2:])
    except ValueError:
        raise InvalidInputError(
            f"the push {text!r} is not understood. Give FX:FY:FZ[:START[:DURATION[:FRAME]]], such "
            "as 0:40:0:0.5:0.1."
        ) from None
    return Push(force, **extra)


def _read_torque_limits(texts: tuple[str, ...]) -> Any:
    """A number or ``model`` for all, or joint -> limit."""
    if len(texts) == 1 and "=" not in texts[0]:
        if texts[0] == "model":
            return "model"
        try:
            return float(texts[0])
        except ValueError:
            raise InvalidInputError(
                f"the torque limit {texts[0]!r} is not understood. Give Nm, model or JOINT=NM."
            ) from None
    return read_assignments(texts) or None


def _summary(recording: Any) -> dict[str, Any]:
    """What a person wants to know of a run; tracking and torques are those before a tip."""
    attributes = recording.attrs
    tip_time = attributes["tip_time"]
    standing = recording.sel(time=slice(None, tip_time if math.isfinite(tip_time) else None))
    error = (standing["com"] - standing["com_target"]).sel(com_axis="y").values
    loaded = standing["margin"].min("time")
    torque = (standing["torque"] ** 2).sum("joint") ** 0.5
    tip_y = float(recording["tip_com"].sel(com_axis="y"))
    start = float(recording["com"].sel(com_axis="y")[0])
    return {
        "robot": attributes["robot"],
        "controller": attributes["controller"],
        "end": {
            "kind": attributes["end_kind"],
            "reason": attributes["end_reason"],
            "time": attributes["end_time"],
        },
        "com_error_rms": float((error**2).mean() ** 0.5),
        "com_error_peak": float(abs(error).max()),
        "smallest_margin": {
            str(name): float(value)
            for name, value in zip(loaded["contact"].values, loaded.values, strict=True)
        },
        "torque_norm_mean": float(torque.mean()),
        "torque_peak": float(abs(standing["torque"]).max()),
        "first_tip": None
        if not attributes["tip_kind"]
        else {
            "contact": attributes["tip_contact"],
            "reason": attributes["tip_reason"],
            "time": attributes["tip_time"],
            "com_y_from_start": tip_y - start,
        },
        "static_prediction": {
            "excursion": attributes["static_excursion"],
            "contact": attributes["static_contact"],
        },
    }


def _print(summary: dict[str, Any], written: list[str]) -> None:
    end, tip, static = summary["end"], summary["first_tip"], summary["static_prediction"]
    click.echo(
        f"{summary['robot']} under {summary['controller']}: {end['reason']}, {end['time']:.2f} s"
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
    if math.isfinite(static["excursion"]):
        click.echo(
            f"  static prediction: {static['contact']} tips at {static['excursion'] * 1e3:.1f} mm"
        )
    for path in written:
        click.echo(f"written: {path}")
