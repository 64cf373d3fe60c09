"""Values of a plan file: TOML tables become the package's own types, or one clear error."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, get_args, get_type_hints

from copsense.errors import InvalidInputError, UnknownNameError
from copsense.extras import require

# What msgspec calls the types that TOML can hold -> what a reader of the file calls them.
_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "str": "a text",
    "array": "a list",
    "object": "a table",
}


def structure(value: object, kind: Any, name: str = "") -> Any:
    """A value of a type, from what TOML can hold; nothing is coerced but whole numbers to floats.

    Args:
        value: a table, list, number, text or truth value.
        kind: the type wanted: a dataclass, or the type of a dataclass's field.
        name: what messages call the value; default nothing, as for a table of its own.

    Raises:
        MissingExtraError: msgspec is not installed.
        UnknownNameError: a table has a key for which its dataclass has no field.
        InvalidInputError: a value is of another type or is rejected by its dataclass; the message
            names the field.
    """
    require("msgspec", "reading a plan")
    import msgspec

    _check_names(value, kind)
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        if isinstance(error.__cause__, InvalidInputError):  # from the dataclass itself
            raise error.__cause__ from None
        message, _, path = str(error).partition(" - at `$")
        where = (name + path.rstrip("`")).lstrip(".") or "the value"
        if message.startswith("Invalid enum value"):
            given = re.findall(r"'([^']*)'", message)[-1]
            raise UnknownNameError(where, given, _names_at(kind, path)) from None
        raise InvalidInputError(f"{where} is not valid: {_plain(message)}.") from None


def _check_names(value: object, kind: Any) -> None:
    """Reject keys that no field is called; of a union's types at most one is a dataclass."""
    if isinstance(value, list | tuple):
        for part in value:
            _check_names(part, kind)
    table = next((k for k in (kind, *_parts(kind)) if is_dataclass(k)), None)
    if table is None or not isinstance(value, Mapping):
        return
    hints, known = get_type_hints(table), [f.name for f in fields(table) if f.init]
    for name, part in value.items():
        if name not in known:
            raise UnknownNameError(f"field of {table.__name__}", name, known)  # type: ignore[union-attr]
        _check_names(part, hints[name])


def _parts(kind: Any) -> list[Any]:
    """What a type is made of: the X of X | None and of tuple[X, ...]."""
    return [inner for part in get_args(kind) for inner in (part, *_parts(part))]


def _names_at(kind: Any, path: str) -> list[str]:
    """The names that a field accepts, of a path such as ``.limits.friction``."""
    for field in re.findall(r"\.(\w+)", path):
        table = next((k for k in (kind, *_parts(kind)) if is_dataclass(k)), None)
        kind = get_type_hints(table)[field] if table else kind
    return [part for part in _parts(kind) if isinstance(part, str)]


def _plain(message: str) -> str:
    """A message of msgspec in the words of a plan file."""

    def words(match: re.Match[str]) -> str:
        kinds = [_WORDS.get(kind, f"`{kind}`") for kind in match[1].split(" | ") if kind != "null"]
        return " or ".join(dict.fromkeys(kinds))

    text = re.sub(r"`([^`]+)`", words, message)
    return text[:1].lower() + text[1:]
