"""Content: values that own what they hold, compare by it, and write it as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from copsense.arrays import owned

_LONG = 200  # characters of a part's own representation that are too many to be a part

Key = TypeVar("Key")
Value = TypeVar("Value")


class FrozenMapping(Mapping[Key, Value]):
    """A mapping that cannot be written to; it can be pickled."""

    def __init__(self, items: Mapping[Key, Value]) -> None:
        """Copy the items."""
        self._items = dict(items)

    def __getitem__(self, key: Key) -> Value:
        """The value of a key."""
        return self._items[key]

    def __iter__(self) -> Iterator[Key]:
        """The keys."""
        return iter(self._items)

    def __len__(self) -> int:
        """Number of keys."""
        return len(self._items)

    def __repr__(self) -> str:
        """As a dictionary's."""
        return repr(self._items)


class ShortRepr:
    """A dataclass that reads in a few lines, whatever the size of its arrays."""

    def __repr__(self) -> str:
        """Its fields, arrays of more than a few numbers by their shape."""
        shown = (f"{f.name}={show(getattr(self, f.name))}" for f in fields(self) if f.repr)  # type: ignore[arg-type]
        return f"{type(self).__name__}({', '.join(shown)})"


class ByContent:
    """Values that are equal, and have one hash, where what they hold is."""

    @cached_property
    def _content(self) -> tuple[object, ...]:
        return (type(self).__name__, *(_key(value) for value in self._fields()))

    @cached_property
    def _hash(self) -> int:
        return hash(self._content)

    def _fields(self) -> tuple[object, ...]:
        raise NotImplementedError

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: hashes of text differ from process to process."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_content", "_hash")}

    def __eq__(self, other: object) -> bool:
        """Whether the other has the same content."""
        if self is other:
            return True
        return isinstance(other, ByContent) and self._content == other._content

    def __hash__(self) -> int:
        """A hash of the content."""
        return self._hash


def own(value: Any) -> Any:
    """Numbers as a read-only array or a float, a mapping with such values; the rest as it is.

    What is not a number stays, for the criterion that holds it to reject by its own name.
    """
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, Mapping):
        return FrozenMapping({name: own(each) for name, each in value.items()})
    try:
        array = owned(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        return value
    return array if array.ndim else float(array)


def freeze(value: object, *names: str) -> None:
    """Make fields of a frozen dataclass its own, while it is being made.

    Arrays, alone or in a tuple, become read-only copies, mappings `FrozenMapping`; the rest stays
    as it is.
    """
    for name in names:
        found = getattr(value, name)
        if found is None:
            continue
        if isinstance(found, np.ndarray):
            found = owned(found)
        elif isinstance(found, Mapping) and not isinstance(found, FrozenMapping):
            found = FrozenMapping(found)
        elif isinstance(found, tuple):
            found = tuple(owned(each) if isinstance(each, np.ndarray) else each for each in found)
        object.__setattr__(value, name, found)


def _key(value: object) -> object:
    """What is compared and hashed of a field."""
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0.0).tobytes()
    if isinstance(value, Mapping):
        return tuple(sorted((name, _key(each)) for name, each in value.items()))
    if isinstance(value, tuple):
        return tuple(_key(each) for each in value)
    return value if isinstance(value, str | int | float | ByContent | None) else repr(value)


def plain(value: Any) -> Any:
    """A field as numbers, text, lists and dictionaries."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    return value


def show(value: object) -> str:
    """A field in a few words."""
    if isinstance(value, np.ndarray):
        if value.size > 12 or value.dtype.kind not in "biuf":
            return f"<{' x '.join(map(str, value.shape))} numbers>"
        return "[" + ", ".join(f"{x:g}" for x in value.ravel()) + "]"
    if isinstance(value, tuple | list):
        more = f", ... {len(value)} in all" if len(value) > 3 else ""
        return "(" + ", ".join(map(show, value[:3])) + more + ")"
    if isinstance(value, Mapping):
        shown = [f"{name!r}: {show(each)}" for name, each in list(value.items())[:3]]
        more = f", ... {len(value)} in all" if len(value) > 3 else ""
        return "{" + ", ".join(shown) + more + "}"
    if isinstance(value, float):
        return f"{value:g}"
    text = repr(value)
    return text if len(text) <= _LONG else f"<{type(value).__name__}>"
