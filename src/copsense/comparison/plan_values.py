"""Building: values from the tables of a plan file, each field of the type that it says."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from copsense.errors import InvalidInputError, UnknownNameError

C = TypeVar("C")
_WORDS = {
    bool: "true or false",
    float: "a number",
    int: "a whole number",
    str: "a text",
}


def build(cls: type[C], values: Mapping[str, Any]) -> C:
    """A dataclass from a table of its fields.

    Raises:
        UnknownNameError: a field that it lacks.
        InvalidInputError: a value of another type than the field's.
    """
    known = [f.name for f in fields(cls) if f.init]  # type: ignore[arg-type]
    for name in values:
        if name not in known:
            raise UnknownNameError(f"field of {cls.__name__}", name, known)
    check_fields(cls, values)
    # TOML has lists where values have tuples.
    return cls(**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()})


def check_fields(cls: type, values: Mapping[str, Any]) -> None:
    """Refuse values that are not of the types that a class gives its fields.

    Raises:
        InvalidInputError: the message names the field and what it takes.
    """
    hints = get_type_hints(cls)
    for name, value in values.items():
        if name in hints and not _fits(value, hints[name]):
            words = dict.fromkeys(_told(hints[name]))
            raise InvalidInputError(f"{name} is {value!r}. Give {' or '.join(words)}.")


def as_table(value: object, what: str) -> dict[str, Any]:
    """A table of a plan file.

    Raises:
        InvalidInputError: it is none.
    """
    if not isinstance(value, Mapping):
        raise InvalidInputError(f"{what} is {value!r}. Give a table, {{ NAME = VALUE }}.")
    return dict(value)


def _fits(value: Any, hint: Any) -> bool:
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return any(_fits(value, part) for part in parts)
    if origin is Literal:
        return any(type(value) is type(part) and value == part for part in parts)
    if origin is tuple:
        if not isinstance(value, list | tuple):
            return False
        if parts[-1] is Ellipsis:
            return all(_fits(part, parts[0]) for part in value)
        return len(value) == len(parts) and all(map(_fits, value, parts))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(_fits(v, parts[1]) for v in value.values())
    if hint in (int, float):
        return isinstance(value, int if hint is int else int | float) and not isinstance(
            value, bool
        )
    return not isinstance(hint, type) or isinstance(value, hint)


def _told(hint: Any) -> list[str]:
    """What a type takes, in words; nothing of what a file cannot write."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return [word for part in parts for word in _told(part)]
    if origin is Literal:
        return [repr(part) for part in parts]
    if origin is tuple:
        inner = " and ".join(dict.fromkeys(w for part in parts for w in _told(part)))
        many = "" if parts[-1] is Ellipsis else f" of {len(parts)}"
        return [f"a list{many}" + (f", each {inner}" if inner else "")]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return [f"a table, each {' or '.join(_told(parts[1]))}"]
    if hint in (types.NoneType, Ellipsis):
        return []
    return [_WORDS.get(hint, f"a table of {getattr(hint, '__name__', hint)}")]
