"""``--limits``: what the wrenches must respect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.option_lists import SHARING, F, with_options
from copsense.cli.printing import echo_notes
from copsense.cli.stance_memory import remembered_stance
from copsense.cli.units import Unit, read_quantity
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.limits import Limits
    from copsense.robots import StanceFile

# What a number means where it is not a force; it may be written with its unit.
_UNITS: dict[str, Unit | None] = {
    "friction": None,
    "cop-margin": "m",
    "torsion": "m",
    "torque": "Nm",
}
# What may be written, likewise.
_EXAMPLES = {
    "friction": "0.33",
    "cop-margin": "0.005, 5mm",
    "torsion": "0.02, 20mm",
    "torque": "30Nm, torque=model",
}


def limits_option(command: F) -> F:
    """The option itself, to decorate a command with."""
    option = click.option(
        "--limits",
        metavar="NAME=VALUE,...",
        help="Inequalities that the wrenches must respect, solved as a QP: normal-force [N], "
        "friction, sides, cop-margin [m], torsion [m, or cone], torque [N m, or model]. "
        "Those not named keep their default (normal-force=0, cop-margin=0, contacts' own "
        "friction); off switches one off. Example: friction=0.33,torque=model.",
    )
    return with_options([option], command, SHARING)


def read_limits(text: str | None) -> Limits | None:
    """The limits that ``--limits`` describes, or the stance file's, or None."""
    from copsense.limits import LIMIT_NAMES, Limits

    if text is None:
        return limits_of(remembered_stance())
    values: dict[str, Any] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if name in ("off", "none"):
            raise InvalidInputError(
                f"--limits {name} is not a limit. Leave --limits out for none at all, or switch "
                "one off by name, such as friction=off."
            )
        if name not in LIMIT_NAMES:
            raise UnknownNameError("limit", name, LIMIT_NAMES)
        if LIMIT_NAMES[name] in values:
            raise InvalidInputError(f"the limit {name} is given twice. Give it once.")
        values[LIMIT_NAMES[name]] = _limit_value(name, value)
    return Limits(**values)


def limits_of(file: StanceFile | None) -> Limits | None:
    """The limits of a stance file, which are said, or None."""
    kept = None if file is None else file.limits
    if file is not None and kept is not None:
        echo_notes([f"limits from {file.path}: {_said(kept)}."])
    return kept


def _said(limits: Limits) -> str:
    """Limits in the words of ``--limits``: those that are not the usual ones."""
    from copsense.limits import LIMIT_NAMES, Limits

    usual, parts = Limits(), []
    for word, name in LIMIT_NAMES.items():
        value = getattr(limits, name)
        if isinstance(value, Mapping):
            parts += [f"{word} of {of} {each}" for of, each in value.items()]
        elif value != getattr(usual, name):
            parts.append(f"{word}={'off' if value is None else value}")
    return ", ".join(parts) or "the usual ones (contacts push, and keep their own friction)"


def _limit_value(name: str, value: str) -> float | int | str | None:
    from copsense.limits import LIMIT_WORDS

    if value == "off" and name != "sides":
        return None
    if value in LIMIT_WORDS.get(name, ()):
        return value
    try:
        if name == "sides":
            return int(value)
        unit = _UNITS.get(name, "N")
        return float(value) if unit is None else read_quantity(value, unit)
    except ValueError:
        if name == "sides":
            remedy = "Write a whole number from 3, such as sides=8"
        else:
            remedy = f"Write, say, {name}={_EXAMPLES.get(name, '5, 5N')} or {name}=off"
        raise InvalidInputError(
            f"the limit {name}={value!r} is not understood. {remedy}."
        ) from None
