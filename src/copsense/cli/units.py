"""Quantities as people type them: degrees for angles, metres for lengths, or the unit given.

One reader for every command: ``20`` is 20 degrees where an angle is meant and 20 metres where a
length is; ``20deg``, ``0.35rad``, ``0.1m``, ``10cm`` and ``25mm`` say it themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Literal

import click

from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.robot import Robot

    _ParamType = click.ParamType[Any]
else:  # not generic in click 8.1
    _ParamType = click.ParamType

Unit = Literal["rad", "m"]

# SI unit -> how it may be written -> size; the first is what a bare number means.
_WRITTEN: dict[str, dict[str, float]] = {
    "rad": {"deg": math.pi / 180.0, "rad": 1.0},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2},
}
_EXAMPLES = {
    "rad": "an angle, such as 20 (degrees), 20deg or 0.35rad",
    "m": "a length, such as 0.1 (metres), 0.1m or 100mm",
}


def read_quantity(text: str, unit: Unit) -> float:
    """A number with or without its unit, in SI.

    Args:
        text: such as ``"20"``, ``"20deg"`` or ``"25mm"``.
        unit: what is meant: ``"rad"`` (a bare number is in degrees) or ``"m"``.

    Raises:
        InvalidInputError: not a number, or one in a unit of another kind.
    """
    written = _WRITTEN[unit]
    usual = next(iter(written))
    for ending in sorted(written, key=len, reverse=True):
        if text.endswith(ending):
            try:
                return float(text.removesuffix(ending)) * written[ending]
            except ValueError:
                continue
    try:
        return float(text) * written[usual]
    except ValueError:
        raise InvalidInputError(f"{text!r} is not understood. Give {_EXAMPLES[unit]}.") from None


def read_range(text: str, unit: Unit) -> tuple[float, float, int]:
    """``START:STOP:COUNT``, start and stop in SI.

    Raises:
        InvalidInputError: not three parts, a bad quantity, or a count that is not whole.
    """
    try:
        start, stop, count = text.split(":")
        return read_quantity(start, unit), read_quantity(stop, unit), int(count)
    except ValueError:
        example = "-5:5:11, -5deg:5deg:11" if unit == "rad" else "-0.07:0.07:201, -70mm:70mm:201"
        raise InvalidInputError(
            f"the range {text!r} is not understood. Give START:STOP:COUNT, such as {example}."
        ) from None


def read_positions(texts: Iterable[str], robot: Robot) -> dict[str, float]:
    """``JOINT=POSITION`` options: joint -> position [rad, or m for a prismatic joint].

    Raises:
        UnknownNameError: the robot has no such joint.
        InvalidInputError: not an assignment, or a position in a unit that the joint has not.
    """
    form = "JOINT=POSITION, such as l_knee=-20 (degrees), l_knee=-0.35rad or slide=0.1 (metres)"
    return {
        name: read_quantity(value, robot.joint_unit(name)) for name, value in _pairs(texts, form)
    }


def read_assignments(texts: Iterable[str], form: str) -> dict[str, float]:
    """``NAME=NUMBER`` options as a dictionary.

    Args:
        texts: the options.
        form: how to write one, for the error message.

    Raises:
        InvalidInputError: not an assignment of a number.
    """
    values = {}
    for name, number in _pairs(texts, form):
        try:
            values[name] = float(number)
        except ValueError:
            raise InvalidInputError(
                f"{f'{name}={number}'!r} is not understood. Give {form}."
            ) from None
    return values


def _pairs(texts: Iterable[str], form: str) -> Iterator[tuple[str, str]]:
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise InvalidInputError(f"{text!r} is not understood. Give {form}.")
        yield name, value


class Quantity(_ParamType):
    """An option's value as a quantity in SI; a bad one is bad usage."""

    def __init__(self, unit: Unit) -> None:
        """Remember what is meant, ``"rad"`` or ``"m"``."""
        self.unit: Unit = unit
        self.name = "angle" if unit == "rad" else "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The SI number; a default that is a number already is kept."""
        if not isinstance(value, str):
            return value
        try:
            return read_quantity(value, self.unit)
        except InvalidInputError as error:
            self.fail(str(error), param, ctx)


LENGTH = Quantity("m")
ANGLE = Quantity("rad")
