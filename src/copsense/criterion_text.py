"""Criterion text: a criterion in one word, as commands, stance files and plans write it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from copsense.criterion import CRITERIA, Criterion, criterion_named, weighted_torque
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.stiffness import stiffness

STIFFNESS, WEIGHTED = "stiffness", "weighted-torque"
_SOLE = ("fx", "fy", "fz", "mx", "my", "mz")
_EXAMPLES = ("weighted-torque:hip=2,knee=1,rest=1", "stiffness:hip=4000,rest=2000")
_FORMS = {
    STIFFNESS: (
        "Give numbers in Nm/rad: 'stiffness:2000' for all joints alike, or by part of the joints' "
        "names 'stiffness:hip=4000,ankle=1000,rest=2000'; and of soles 'mx=2800,my=700' (Nm/rad) "
        "or 'fz=1e5' (N/m)."
    ),
    WEIGHTED: (
        "Give the weight of each squared torque by part of the joints' names, such as "
        "'weighted-torque:hip=2,knee=1,ankle=0.5,rest=1'; joints not named count 1."
    ),
}


def criterion_from_text(text: str, characteristic_length: float = 1.0) -> Criterion:
    """The criterion that ``--criterion`` says.

    Args:
        text: a name of `copsense.criterion.CRITERIA`; ``"stiffness:hip=4000,rest=2000,mx=2800"``,
            see `copsense.stiffness.stiffness`; or ``"weighted-torque:hip=2,knee=1,rest=1"``, a
            weight on the squared torque of the joints with that part in their names (``rest``:
            the others; 1 where it is not given).
        characteristic_length: L [m] of the norm of wrenches, where the criterion has one.

    Raises:
        UnknownNameError: no such criterion.
        InvalidInputError: numbers that are not understood.
    """
    kind, colon, listed = text.partition(":")
    if not colon and kind not in _FORMS:
        if kind not in CRITERIA:
            raise UnknownNameError("criterion", kind, (*CRITERIA, *_EXAMPLES))
        return criterion_named(text, characteristic_length)
    if kind not in _READERS:
        raise UnknownNameError("criterion with numbers", kind, _READERS)
    return _READERS[kind](text, listed)


def criterion_from_data(data: object, characteristic_length: float = 1.0) -> Criterion:
    """The criterion that a file says.

    Args:
        data: a text, as `criterion_from_text` reads it, or a table of `Criterion.to_dict`.
        characteristic_length: L [m] of a text, as `criterion_from_text` takes it.

    Raises:
        UnknownNameError: no such criterion, or a key or kind of term that a table does not have.
        InvalidInputError: what is not understood, or is neither text nor table.
    """
    if isinstance(data, str):
        return criterion_from_text(data, characteristic_length)
    if not isinstance(data, Mapping):
        raise InvalidInputError(
            f"the criterion {data!r} in a file is neither a text nor a table. Write it as "
            f"--criterion takes it, such as 'minimum-torque' or {_EXAMPLES[0]!r}, or the table "
            "that Criterion.to_dict() gives."
        )
    return Criterion.from_dict(data)


def criterion_data(criterion: Criterion) -> str | dict[str, Any]:
    """What `criterion_from_data` reads back: the criterion's name where that says it all."""
    try:
        if criterion_from_text(criterion.name) == criterion:
            return criterion.name
    except (InvalidInputError, UnknownNameError):
        pass  # a name of its own
    return criterion.to_dict()


def _read_stiffness(text: str, listed: str) -> Criterion:
    sole = dict.fromkeys(_SOLE, math.inf)
    joints: dict[str, float] = {}
    for key, number in _entries(text, listed, STIFFNESS):
        if key in sole:
            sole[key] = number
        else:
            _put(joints, key, number, text, STIFFNESS)
    if not joints:
        raise InvalidInputError(f"{text!r} gives no joint a stiffness. {_FORMS[STIFFNESS]}")
    soft = any(map(math.isfinite, sole.values()))
    return stiffness(joints, list(sole.values()) if soft else None, name=text)


def _read_weighted(text: str, listed: str) -> Criterion:
    weights: dict[str, float] = {}
    for key, number in _entries(text, listed, WEIGHTED):
        if not (math.isfinite(number) and number > 0):
            raise InvalidInputError(
                f"the weight {key}={number:g} in {text!r} is not positive. {_FORMS[WEIGHTED]}"
            )
        _put(weights, key, number, text, WEIGHTED)
    if not weights:
        raise InvalidInputError(f"{text!r} gives no joint a weight. {_FORMS[WEIGHTED]}")
    return weighted_torque({"*": 1.0} | weights, name=text)


_READERS: dict[str, Callable[[str, str], Criterion]] = {
    STIFFNESS: _read_stiffness,
    WEIGHTED: _read_weighted,
}


def _entries(text: str, listed: str, kind: str) -> Iterator[tuple[str, float]]:
    """``KEY=NUMBER,...``; a number alone is of the rest."""
    for entry in filter(None, listed.split(",")):
        key, equals, value = entry.rpartition("=")
        try:
            yield key.strip() if equals else "rest", float(value)
        except ValueError:
            raise InvalidInputError(
                f"{entry!r} in {text!r} is not a {_MEANT[kind]}. {_FORMS[kind]}"
            ) from None


_MEANT = {STIFFNESS: "stiffness", WEIGHTED: "weight"}


def _put(joints: dict[str, float], key: str, number: float, text: str, kind: str) -> None:
    """Enter a number for the joints that a key means: those with it in their names."""
    pattern = "*" if key == "rest" else key if "*" in key else f"*{key}*"
    if not re.fullmatch(r"[\w.*-]+", key) or pattern in joints:
        raise InvalidInputError(
            f"{f'{key}={number:g}'!r} in {text!r} names no joints. {_FORMS[kind]}"
        )
    joints[pattern] = number
