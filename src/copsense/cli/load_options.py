"""The options that put known forces, springs and payloads on a robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from copsense.cli.option_lists import LOADS, F, with_options
from copsense.cli.units import Unit, read_numbers, read_quantity, split_assignment
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.loads import AnyLoad
    from copsense.stance import Stance

_LOAD = "FRAME=FX:FY:FZ[:MX:MY:MZ] in N and Nm, such as l_hand=0:0:-20 or l_hand@0:0:0.1=0:0:-20"
_SPRING = (
    "FRAME=KX:KY:KZ:X:Y:Z[:FX:FY:FZ] in N/m, metres and N, such as l_hand=500:0:500:0.2:0.3:0.6"
)
_PAYLOAD = "FRAME=KG, such as l_hand=2.5 or l_hand@0:0:0.1=2.5"
_POINT = "X:Y:Z in metres, such as 0:0:0.2"
_AT = "FRAME@X:Y:Z is a point in the frame [m]. Repeatable."


def load_options(command: F) -> F:
    """Forces, springs and payloads on the robot."""
    options = [
        click.option(
            "--load",
            "loads",
            multiple=True,
            metavar="FRAME=FX:FY:FZ[:MX:MY:MZ]",
            help="A known force, and moment, on the robot at a frame, in world axes, whatever the "
            f"posture [N, Nm]: l_hand=0:0:-20. {_AT}",
        ),
        click.option(
            "--body-load",
            "body_loads",
            multiple=True,
            metavar="FRAME=FX:FY:FZ[:MX:MY:MZ]",
            help="The same in the frame's axes, turning with the link, such as a thruster. "
            "Repeatable.",
        ),
        click.option(
            "--spring-load",
            "spring_loads",
            multiple=True,
            metavar="FRAME=KX:KY:KZ:X:Y:Z[:FX:FY:FZ]",
            help="A rope or a handrail that yields: stiffness along the world's axes [N/m], the "
            "anchor in the world [m], and the force when the frame is there [N]: "
            f"l_hand=500:0:500:0.2:0.3:0.6. {_AT}",
        ),
        click.option(
            "--payload",
            "payloads",
            multiple=True,
            metavar="FRAME=KG",
            help="A mass fixed to a frame, which counts as the robot's own: its CoM and weight are "
            f"those of both. {_AT}",
        ),
    ]
    return with_options(options, command, LOADS)


def put_loads(
    stance: Stance,
    loads: Sequence[str],
    payloads: Sequence[str],
    body_loads: Sequence[str] = (),
    spring_loads: Sequence[str] = (),
) -> Stance:
    """The stance under the loads and payloads that the options describe, beside its own.

    A payload moves the CoM, so the robot shifts until it is where it was, over the same point.
    """
    from copsense.loads import Load, SpringLoad

    for text in payloads:
        frame, point, (mass,) = _read("--payload", text, _PAYLOAD, ("kg",))
        from copsense.posture import carry_payload

        stance = carry_payload(stance, frame, mass, com=point)
    found: list[AnyLoad] = []
    units: tuple[Unit, ...] = ("N",) * 3 + ("Nm",) * 3
    for text in loads:
        frame, point, values = _read("--load", text, _LOAD, units, least=3)
        found.append(Load(frame, _three(values[:3]), _three(values[3:]), point))
    for text in body_loads:
        frame, point, values = _read("--body-load", text, _LOAD, units, least=3)
        load = Load(frame, _three(values[:3]), _three(values[3:]), point, fixed_to="body")
        found.append(load)
    units = ("N/m",) * 3 + ("m",) * 3 + ("N",) * 3
    for text in spring_loads:
        frame, point, values = _read("--spring-load", text, _SPRING, units, least=6)
        stiffness, anchor, force = (_three(values[i : i + 3]) for i in (0, 3, 6))
        found.append(SpringLoad(frame, anchor, stiffness, force, point))
    if found:
        stance = stance.with_loads([*stance.loads, *found])
        assert stance.applied is not None  # the frames are looked up here
    return stance


def read_point(text: str, option: str) -> tuple[float, float, float]:
    """``X:Y:Z`` as lengths [m]."""
    parts = text.split(":")
    if len(parts) != 3:
        raise InvalidInputError(f"{option} {text!r} is not understood. Give {_POINT}.")
    return _three([read_quantity(part, "m") for part in parts])


def read_frame(text: str, option: str) -> tuple[str, tuple[float, float, float]]:
    """``FRAME[@X:Y:Z]``: a frame and a point in it [m], its origin by default."""
    frame, at, point = text.rpartition("@")
    if not (at and frame) or ":" not in point:
        return text, (0.0, 0.0, 0.0)
    return frame, read_point(point, option)


def _read(
    option: str, text: str, form: str, units: Sequence[Unit], *, least: int | None = None
) -> tuple[str, tuple[float, float, float], list[float]]:
    """``FRAME[@X:Y:Z]=A:B:...``: frame, point and numbers in SI.

    What is left out from the `least` number on is zero; by default nothing may be.
    """
    name, value = split_assignment(text, f"{option} {form}")
    frame, point = read_frame(name, option)
    numbers = read_numbers(value, f"{option} {text!r}", form, units, least=least)
    return frame, point, numbers


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z
