"""The options that put known forces and payloads on a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from copsense.cli.option_lists import F, with_options
from copsense.cli.units import read_quantity, split_assignment
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.loads import Load
    from copsense.stance import Stance

_LOAD = "FRAME=FX:FY:FZ[:MX:MY:MZ] in N and Nm, world axes, such as l_hand=0:0:-20"
_PAYLOAD = "FRAME=KG, such as l_hand=2.5"


def load_options(command: F) -> F:
    """Forces and payloads on the robot."""
    options = [
        click.option(
            "--load",
            "loads",
            multiple=True,
            metavar="FRAME=FX:FY:FZ[:MX:MY:MZ]",
            help="A known force, and moment, on the robot at a frame, in world axes, whatever the "
            "posture [N, Nm]. Repeatable.",
        ),
        click.option(
            "--payload",
            "payloads",
            multiple=True,
            metavar="FRAME=KG",
            help="A mass fixed to a frame, which counts as the robot's own: its CoM and weight are "
            "those of both. Repeatable.",
        ),
    ]
    return with_options(options, command)


def put_loads(stance: Stance, loads: tuple[str, ...], payloads: tuple[str, ...]) -> Stance:
    """The stance under the loads and payloads that the options describe.

    A payload moves the CoM, so the robot shifts until it is where it was, over the same point.
    """
    for text in payloads:
        frame, mass = split_assignment(text, _PAYLOAD)
        try:
            kilograms = read_quantity(mass, "kg")
        except ValueError:
            raise InvalidInputError(
                f"--payload {text!r} is not understood. Give {_PAYLOAD}."
            ) from None
        from copsense.posture import carry_payload

        stance = carry_payload(stance, frame, kilograms)
    if loads:
        stance = stance.with_loads([_read_load(text) for text in loads])
        assert stance.applied is not None  # the frames are looked up here
    return stance


def read_point(text: str, option: str) -> tuple[float, float, float]:
    """``X:Y:Z`` as lengths [m]."""
    parts = text.split(":")
    if len(parts) != 3:
        raise InvalidInputError(
            f"{option} {text!r} is not understood. Give X:Y:Z in metres, such as 0:0:0.2."
        )
    x, y, z = (read_quantity(part, "m") for part in parts)
    return x, y, z


def _read_load(text: str) -> Load:
    from copsense.loads import Load

    frame, numbers = split_assignment(text, _LOAD)
    try:
        parts = numbers.split(":")
        values = [read_quantity(part, "N" if i < 3 else "Nm") for i, part in enumerate(parts)]
    except ValueError:
        values = []
    if len(values) not in (3, 6):
        raise InvalidInputError(f"--load {text!r} is not understood. Give {_LOAD}.")
    x, y, z, *moment = values
    mx, my, mz = moment or (0.0, 0.0, 0.0)
    return Load(frame, (x, y, z), (mx, my, mz))
