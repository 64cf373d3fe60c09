"""Options of what happens to a robot in closed loop: where to go, and what disturbs it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from copsense.cli.option_lists import F, with_options
from copsense.cli.units import TIME, Quantity, Unit, read_assignments, read_quantity
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.controllers import Signal
    from copsense.simulation import FrictionChange, Push


REFERENCES = "hold, sine:AMPLITUDE:FREQUENCY or ramp:DISTANCE[:SPEED] [m, Hz, m/s, or as 20mm]"


def disturbance_options(command: F) -> F:
    """What disturbs the robot; `read_disturbances` takes them out of the command's options."""
    options = [
        click.option(
            "--push",
            multiple=True,
            metavar="FX:FY:FZ[:START[:DURATION[:FRAME]]]",
            help="Push [N], world axes, at START [s] for DURATION [s] on a frame. Repeatable.",
        ),
        click.option(
            "--friction",
            multiple=True,
            metavar="MU[:START[:CONTACT]]",
            help="The ground's friction from START [s] on, under one contact or all. Repeatable.",
        ),
        click.option(
            "--unknown-payload",
            multiple=True,
            metavar="FRAME=KG",
            help="A mass on the robot that the controller does not know of. Repeatable.",
        ),
        click.option(
            "--mass-error",
            type=float,
            default=0.0,
            metavar="PERCENT",
            help="Every link is heavier by this than the controller believes.",
        ),
        click.option(
            "--delay", type=TIME, default=0.0, metavar="TIME", help="Delay of the torques [s]."
        ),
        click.option(
            "--bandwidth", type=Quantity("Hz"), metavar="HZ", help="Bandwidth of the torques [Hz]."
        ),
        click.option(
            "--torque-limit",
            multiple=True,
            metavar="[JOINT=]NM",
            help="Motors give no more: a number for all, model, or JOINT=NM. Repeatable.",
        ),
        click.option(
            "--position-noise",
            type=Quantity("rad"),
            default=0.0,
            metavar="ANGLE",
            help="Noise of the joint positions; 0.001rad is 1 mm on a prismatic joint.",
        ),
        click.option(
            "--velocity-noise",
            type=Quantity("rad/s"),
            default=0.0,
            metavar="RATE",
            help="Noise of the joint velocities, such as 1deg/s; likewise.",
        ),
        click.option(
            "--force-noise",
            type=Quantity("N"),
            default=0.0,
            metavar="N",
            help="Noise of the measured forces.",
        ),
        click.option(
            "--moment-noise",
            type=Quantity("Nm"),
            default=0.0,
            metavar="NM",
            help="Noise of the measured moments.",
        ),
        click.option(
            "--odometry",
            metavar="CONTACT",
            help="Estimate the base from the joints, taking this foot to stand still, or the one "
            "that carries most (loaded).",
        ),
        click.option(
            "--seed", type=int, default=0, show_default=True, help="Seed of everything random."
        ),
    ]
    return with_options(options, command)


def read_disturbances(options: dict[str, Any]) -> dict[str, Any]:
    """The fields of a `Scenario` that `disturbance_options` describe, taken out of the options."""
    from copsense.simulation import ModelError, Motors, Noise

    take = options.pop
    return {
        "pushes": tuple(_read_push(text) for text in take("push")),
        "friction": tuple(_read_friction(text) for text in take("friction")),
        "model_error": ModelError(
            take("mass_error") / 100.0,
            read_assignments(take("unknown_payload"), "FRAME=KG, such as chest=1", "kg"),
        ),
        "motors": Motors(
            take("delay"), take("bandwidth"), _read_torque_limits(take("torque_limit"))
        ),
        "noise": Noise(
            *(take(f"{name}_noise") for name in ("position", "velocity", "force", "moment"))
        ),
        "odometry": take("odometry"),
        "seed": take("seed"),
    }


def read_signal(text: str) -> Signal:
    """A reference: how far the CoM goes."""
    from copsense.controllers import Hold, Ramp, Sine

    kind, _, rest = text.partition(":")
    if kind not in ("hold", "sine", "ramp"):
        raise UnknownNameError("reference", kind, ("hold", "sine", "ramp"))
    parts = rest.split(":") if rest else []
    try:
        units: tuple[Unit, Unit] = ("m", "Hz" if kind == "sine" else "m/s")
        numbers = [read_quantity(part, unit) for part, unit in zip(parts, units, strict=False)]
    except InvalidInputError:
        numbers = []
    if len(numbers) == len(parts):
        if kind == "hold" and not numbers:
            return Hold()
        if kind == "sine" and len(numbers) == 2:
            return Sine(*numbers)
        if kind == "ramp" and len(numbers) in (1, 2):
            return Ramp(*numbers)
    raise InvalidInputError(f"the reference {text!r} is not understood. Give {REFERENCES}.")


def _read_push(text: str) -> Push:
    from copsense.simulation import Push

    try:
        x, y, z, *rest = text.split(":")
        force = read_quantity(x, "N"), read_quantity(y, "N"), read_quantity(z, "N")
        extra: dict[str, Any] = {}
        if rest:
            extra["start"] = read_quantity(rest[0], "s")
        if len(rest) > 1:
            extra["duration"] = read_quantity(rest[1], "s")
        if len(rest) > 2:
            extra["frame"] = ":".join(rest[2:])
    except ValueError:
        raise InvalidInputError(
            f"the push {text!r} is not understood. Give FX:FY:FZ[:START[:DURATION[:FRAME]]], such "
            "as 0:40:0:0.5:0.1."
        ) from None
    return Push(force, **extra)


def _read_friction(text: str) -> FrictionChange:
    from copsense.simulation import FrictionChange

    friction, _, rest = text.partition(":")
    start, _, contact = rest.partition(":")
    try:
        coefficient, since = float(friction), read_quantity(start or "0", "s")
    except ValueError:
        raise InvalidInputError(
            f"the friction {text!r} is not understood. Give MU[:START[:CONTACT]], such as 0.1:1.0."
        ) from None
    return FrictionChange(coefficient, since, contact or None)


def _read_torque_limits(texts: tuple[str, ...]) -> Any:
    """A number or ``model`` for all, or joint -> limit."""
    if len(texts) == 1 and "=" not in texts[0]:
        if texts[0] == "model":
            return "model"
        try:
            return read_quantity(texts[0], "Nm")
        except ValueError:
            raise InvalidInputError(
                f"the torque limit {texts[0]!r} is not understood. Give Nm, model or JOINT=NM."
            ) from None
    return read_assignments(texts, "NM, model or JOINT=NM, such as l_knee=20", "Nm") or None
