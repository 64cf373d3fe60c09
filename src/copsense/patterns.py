"""Patterns: values said of names, where a name with a star is of every one that it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TypeVar

from copsense.errors import InvalidInputError, UnknownNameError

Value = TypeVar("Value")


def by_name(
    given: Mapping[str, Value], names: Sequence[str], kind: str, where: str
) -> dict[str, tuple[str, Value]]:
    """What is said of each name, and the name or pattern that says it; names left out are too.

    A name itself comes before a pattern, ``"*hip*"``, and a pattern before the star alone, which
    is of the rest.

    Args:
        given: name or pattern -> value.
        names: the valid ones.
        kind: what a message calls one of them, such as ``"joint"``.
        where: whose values they are, as a message begins.

    Raises:
        UnknownNameError: what fits no name.
        InvalidInputError: two patterns fit one name and say different values of it.
    """
    found: dict[str, tuple[str, Value]] = {}
    for key in sorted(given, key=lambda key: ("*" in key, key == "*")):
        fits = [name for name in names if fnmatchcase(name, key)]
        if not fits and key != "*":
            raise UnknownNameError(kind, key, names)
        for name in fits:
            by, value = found.setdefault(name, (key, given[key]))
            if "*" in by and by != key and key != "*" and value != given[key]:
                raise InvalidInputError(
                    f"{where}: {by!r} and {key!r} both fit {name}, with different values. Name it "
                    "itself, or give patterns that do not overlap."
                )
    return found
