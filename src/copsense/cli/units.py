"""Quantities as people type them: degrees for angles, metres for lengths, or the unit given.

One reader for every command: ``20`` is 20 degrees where an angle is meant and 20 metres where a
length is; ``20deg``, ``0.35rad``, ``0.1m``, ``10cm`` and ``25mm`` say it themselves. Times, speeds,
frequencies, forces and moments are read likewise, bare in SI, but what turns in degrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import click

from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.robot import Robot
    from copsense.stance import Stance

    _ParamType = click.ParamType[Any]
else:  # not generic in click 8.1
    _ParamType = click.ParamType

Unit = Literal["rad", "m", "s", "rad/s", "m/s", "Hz", "kg", "N", "Nm", "Ns", "N/m"]


class _Kind(NamedTuple):
    """What a unit measures: its name, an example, and how it may be written -> the number in SI.

    The first way to write it is what a bare number means.
    """

    name: str
    example: str
    written: dict[str, Callable[[float], float]]


def _hundredth(number: float) -> float:
    return number / 100.0  # not times 0.01: 13mm is to be the very number 0.013


def _thousandth(number: float) -> float:
    return number / 1000.0


_KINDS: dict[str, _Kind] = {
    "rad": _Kind("angle", "20 (degrees), 20deg or 0.35rad", {"deg": math.radians, "rad": float}),
    "m": _Kind(
        "length", "0.1 (metres), 0.1m or 100mm", {"m": float, "mm": _thousandth, "cm": _hundredth}
    ),
    "s": _Kind("time", "0.002 (seconds), 0.002s or 2ms", {"s": float, "ms": _thousandth}),
    "rad/s": _Kind(
        "rate",
        "1 (degree per second), 1deg/s or 0.02rad/s",
        {"deg/s": math.radians, "rad/s": float},
    ),
    "m/s": _Kind(
        "speed",
        "0.01 (m/s), 0.01m/s or 10mm/s",
        {"m/s": float, "mm/s": _thousandth, "cm/s": _hundredth},
    ),
    "Hz": _Kind("frequency", "0.5 (Hz) or 0.5Hz", {"Hz": float}),
    "kg": _Kind("mass", "2.5 (kg) or 2.5kg", {"kg": float}),
    "N": _Kind("force", "40 (N) or 40N", {"N": float}),
    "Nm": _Kind("moment", "30 (Nm) or 30Nm", {"Nm": float}),
    "Ns": _Kind("impulse", "2 (N s) or 2Ns", {"Ns": float}),
    "N/m": _Kind("stiffness", "500 (N/m) or 500N/m", {"N/m": float}),
}


def read_quantity(text: str, unit: Unit) -> float:
    """A number with or without its unit, in SI.

    Args:
        text: such as ``"20"``, ``"20deg"`` or ``"25mm"``.
        unit: what is meant, such as ``"rad"`` (a bare number is in degrees) or ``"m"``.

    Raises:
        InvalidInputError: not a number, or one in a unit of another kind.
    """
    kind = _KINDS[unit]
    usual = next(iter(kind.written))
    for ending in sorted(kind.written, key=len, reverse=True):
        if text.endswith(ending):
            try:
                return kind.written[ending](float(text.removesuffix(ending)))
            except ValueError:
                continue
    try:
        return kind.written[usual](float(text))
    except ValueError:
        article = "an" if kind.name[0] in "ai" else "a"
        raise InvalidInputError(
            f"{text!r} is not understood. Give {article} {kind.name}, such as {kind.example}."
        ) from None


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
        InvalidInputError: not an assignment, a position in a unit that the joint has not, or a
            joint twice.
    """
    form = "JOINT=POSITION, such as l_knee=-20 (degrees), l_knee=-0.35rad or slide=0.1 (metres)"
    found: dict[str, float] = {}
    for name, value in _pairs(texts, form):
        if name in found:
            raise InvalidInputError(f"the position of joint {name} is given twice. Give it once.")
        found[name] = read_quantity(value, robot.joint_unit(name))
    return found


def read_coordinates(texts: Iterable[str], stance: Stance) -> dict[str, float]:
    """``COORDINATE=VALUE`` options: coordinate of a posture chart -> value [m, rad].

    Raises:
        UnknownNameError: the stance has no such coordinate.
        InvalidInputError: not an assignment, a value in a unit that the coordinate has not, or a
            coordinate that is given twice.
    """
    from copsense.batch import PostureChart

    form = "COORDINATE=VALUE, such as com_y=30mm, pitch=2deg, l_knee=-20 or l_sole:x=0.02"
    pairs = list(_pairs(texts, form))
    if not pairs:
        return {}
    chart = PostureChart(stance, [name for name, _ in pairs], compiled=False)
    return {
        name: read_quantity(value, unit)
        for (name, value), unit in zip(pairs, chart.units, strict=True)
    }


def read_assignments(texts: Iterable[str], form: str, unit: Unit | None = None) -> dict[str, float]:
    """``NAME=NUMBER`` options as a dictionary.

    Args:
        texts: the options.
        form: how to write one, for the error message.
        unit: of the numbers; None for numbers without.

    Raises:
        InvalidInputError: not an assignment of a number.
    """
    values = {}
    for name, number in _pairs(texts, form):
        try:
            values[name] = float(number) if unit is None else read_quantity(number, unit)
        except ValueError:
            raise InvalidInputError(
                f"{f'{name}={number}'!r} is not understood. Give {form}."
            ) from None
    return values


def read_numbers(
    value: str,
    said: str,
    form: str,
    units: Sequence[Unit | None],
    *,
    least: int | None = None,
) -> list[float]:
    """``A:B:C`` as numbers in SI; None is the unit of a number without.

    Args:
        value: the numbers.
        said: the whole option, for the error message.
        form: how to write it.
        units: of each number.
        least: how many are needed; default all. Those left out are zero.

    Raises:
        InvalidInputError: too few or too many, or one that is not understood.
    """
    parts = value.split(":")
    if len(parts) not in {least or len(units), len(units)}:
        raise InvalidInputError(f"{said} is not understood. Give {form}.")
    try:
        numbers = [
            float(part) if unit is None else read_quantity(part, unit)
            for part, unit in zip(parts, units, strict=False)
        ]
    except InvalidInputError as error:
        raise InvalidInputError(f"{said}: {error}") from None
    except ValueError:
        raise InvalidInputError(f"{said} is not understood. Give {form}.") from None
    return numbers + [0.0] * (len(units) - len(numbers))


def split_assignment(text: str, form: str) -> tuple[str, str]:
    """``NAME=VALUE`` taken apart at the last equals sign: a frame's name may hold others.

    Args:
        text: the option.
        form: how to write one, for the error message.

    Raises:
        InvalidInputError: not an assignment.
    """
    name, equals, value = text.rpartition("=")
    if not (name and equals and value):
        raise InvalidInputError(f"{text!r} is not understood. Give {form}.")
    return name, value


def _pairs(texts: Iterable[str], form: str) -> Iterator[tuple[str, str]]:
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise InvalidInputError(f"{text!r} is not understood. Give {form}.")
        yield name, value


class Quantity(_ParamType):
    """An option's value as a quantity in SI; a bad one is bad usage."""

    def __init__(self, unit: Unit) -> None:
        """Remember what is meant, such as ``"rad"`` or ``"m"``."""
        self.unit: Unit = unit
        self.name: str = _KINDS[unit].name

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
TIME = Quantity("s")
