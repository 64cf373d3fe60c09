"""What callers give, or a clear error: arrays, as read-only copies, numbers, and other objects."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from typing import Any, TypeVar, cast, overload

import numpy as np

from copsense.errors import InvalidInputError, UnknownNameError

Array = TypeVar("Array", bound=np.ndarray)


def read_only(array: Array) -> Array:
    """The same array, which can no longer be written to."""
    array.setflags(write=False)
    return array


def owned(array: np.ndarray) -> np.ndarray:
    """A read-only copy of an array; itself where no one can write to it."""
    if array.base is None and not array.flags.writeable:
        return array
    return read_only(np.array(array))


class array_property(cached_property[Array]):  # noqa: N801 (a decorator, as cached_property)
    """A property that is computed once and hands out a read-only array.

    Two threads that ask first at the same time may both compute it, as in Python 3.12 and later.
    """

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> array_property[Array]: ...
    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> Array: ...
    def __get__(
        self, instance: object, owner: type[Any] | None = None
    ) -> array_property[Array] | Array:
        """The array, kept in the instance, where it is found before this is asked again."""
        if instance is None:
            return self
        assert self.attrname is not None
        return cast(
            Array, instance.__dict__.setdefault(self.attrname, read_only(self.func(instance)))
        )


def is_finite(array: np.ndarray) -> bool:
    """Whether every number is finite; for the small arrays of a control loop.

    NumPy takes three times as long for a few dozen numbers.
    """
    return all(map(math.isfinite, array.ravel().tolist()))


def check_type(value: object, kind: type | tuple[type, ...], noun: str, remedy: str) -> None:
    """Reject what is not of a type.

    Args:
        value: what the caller gave.
        kind: the type it must have, or several.
        noun: what the message calls that, such as ``"a stance"``.
        remedy: a sentence that says what to give.

    Raises:
        InvalidInputError: it is not one; the message shows the beginning of it.
    """
    if not isinstance(value, kind):
        raise InvalidInputError(f"{reprlib.repr(value)} is not {noun}. {remedy}")


def checked_tuple(value: Any, kind: type, noun: str, remedy: str) -> tuple[Any, ...]:
    """Values of one type as a tuple; one that is alone, and is not a text, counts as a list of it.

    Args:
        value: what the caller gave.
        kind: the type of each.
        noun: what the message calls one, such as ``"loop"``.
        remedy: a sentence that says what to give.

    Raises:
        InvalidInputError: it is not a list, or holds something else.
    """
    if isinstance(value, kind) and kind is not str:
        return (value,)
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise InvalidInputError(f"{reprlib.repr(value)} is not a list of {noun}s. {remedy}")
    found = tuple(value)
    for each in found:
        check_type(each, kind, f"a {noun}", remedy)
    return found


def check_name(value: object, what: str) -> None:
    """Reject a name that is not text, or is empty.

    Raises:
        InvalidInputError: it is not one.
    """
    if not isinstance(value, str) or not value:
        raise InvalidInputError(f"{what} is {reprlib.repr(value)}. Give a text.")


def check_keys(data: Mapping[str, Any], keys: Collection[str], what: str) -> None:
    """Reject a key that a table does not have.

    Raises:
        UnknownNameError: it has another one.
    """
    for key in data:
        if key not in keys:
            raise UnknownNameError(f"key of {what}", str(key), keys)


def checked_positions(value: Mapping[str, float] | None, what: str) -> dict[str, float]:
    """Joint -> position as a dictionary of its own, empty for None.

    Raises:
        InvalidInputError: it is not a mapping.
    """
    if value is None:
        return {}
    remedy = 'Give joint -> position, such as {"l_knee": -0.35} (rad, or m).'
    check_type(value, Mapping, f"a mapping of {what}", remedy)
    return dict(value)


def finite_array(
    value: object, what: str, shape: tuple[int | None, ...], meaning: str = ""
) -> np.ndarray:
    """A read-only copy of an array of finite numbers.

    Args:
        value: what the caller gave.
        what: how the message calls it, such as ``"the tangent"``.
        shape: the shape it must have; None leaves a size free.
        meaning: what its entries are, for the message.

    Raises:
        InvalidInputError: not numbers, another shape, or NaN or infinity.
    """
    sizes = ", ".join("any" if n is None else str(n) for n in shape)
    need = f"Give finite numbers of shape ({sizes}{',' if len(shape) == 1 else ''})"
    need += f": {meaning}." if meaning else "."
    try:
        if np.iscomplexobj(np.asarray(value)):
            raise TypeError
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(f"{what} is not an array of numbers. {need}") from None
    fits = array.ndim == len(shape) and all(
        n is None or n == size for n, size in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InvalidInputError(f"{what} has shape {array.shape}. {need}")
    if not np.all(np.isfinite(array)):
        where = [", ".join(map(str, index)) for index in np.argwhere(~np.isfinite(array))[:6]]
        raise InvalidInputError(f"{what} is not finite at index {'; '.join(where)}. {need}")
    array.flags.writeable = False
    return array


def finite_number(value: object, what: str, *, positive: bool = False) -> float:
    """One finite number, positive if asked.

    Raises:
        InvalidInputError: it is not one.
    """
    need = "a positive finite number" if positive else "a finite number"
    try:
        # A string or a flag is a mistake, though Python would read a number from it.
        wrong = isinstance(value, bool | np.bool_ | str)
        number = math.nan if wrong else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or (positive and number <= 0):
        raise InvalidInputError(f"{what} is {value!r}. Give {need}.")
    return number


def whole_number(value: object, what: str, *, least: int = 1) -> int:
    """One whole number, not below `least`.

    Raises:
        InvalidInputError: it is not one.
    """
    try:
        number = int(value)  # type: ignore[call-overload]
        fits = bool(number == value) and number >= least
    except (TypeError, ValueError, OverflowError):
        fits = False
    if not fits:
        raise InvalidInputError(f"{what} is {value!r}. Give a whole number from {least}.")
    return int(number)
