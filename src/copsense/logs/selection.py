"""Selection: the references of a mapping, resolved to columns of a log file's channels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.channel import Channel, LogFile
from copsense.logs.log_map import Columns

_INDEXED = re.compile(r"^(.*)\[([^\[\]]+)\]$")


@dataclass(frozen=True)
class Column:
    """One column of a channel."""

    key: str
    index: int


def columns_of(file: LogFile, reference: str) -> list[Column]:
    """The columns that a reference means: all of a channel, or one of them.

    Raises:
        UnknownNameError: no such channel, or no such column in it.
    """
    if reference in file.channels:
        return [Column(reference, i) for i in range(file.channels[reference].width)]
    match = _INDEXED.match(reference)
    if match is None or match[1] not in file.channels:
        file.channel(reference)
    assert match is not None
    channel = file.channels[match[1]]
    if match[2] in channel.labels:
        return [Column(channel.key, channel.labels.index(match[2]))]
    if match[2].isdigit() and int(match[2]) < channel.width:
        return [Column(channel.key, int(match[2]))]
    valid = channel.labels or tuple(map(str, range(channel.width)))
    raise UnknownNameError(f"column of {channel.key}", match[2], valid)


def one_column(file: LogFile, reference: str) -> Column:
    """The column that a reference means.

    Raises:
        InvalidInputError: it means several.
    """
    found = columns_of(file, reference)
    if len(found) != 1:
        raise InvalidInputError(
            f"the signal {reference!r} has {len(found)} columns where one is needed. Name one, "
            f"such as {reference}[0]."
        )
    return found[0]


def several_columns(
    file: LogFile, reference: str | tuple[str, ...], count: int, what: str
) -> list[Column]:
    """As many columns as needed, of one reference or of one each.

    Raises:
        InvalidInputError: they are more or fewer.
    """
    given = (reference,) if isinstance(reference, str) else reference
    found = [column for each in given for column in columns_of(file, each)]
    if len(found) != count:
        raise InvalidInputError(
            f"{what} needs {count} columns, and {', '.join(given)} has {len(found)}. Name the "
            f"right signal, or {count} columns."
        )
    return found


def joint_columns(
    file: LogFile, columns: Columns, names: tuple[str, ...], what: str
) -> dict[str, Column]:
    """Joint -> column.

    Args:
        file: the log file.
        columns: an array, a pattern with ``*``, or joint -> reference.
        names: joints of an array's columns; empty for those that the file says.
        what: how messages call it, such as ``"positions"``.

    Raises:
        UnknownNameError: a reference to nothing.
        InvalidInputError: no name for an array's columns, or not as many as it has.
    """
    if isinstance(columns, Mapping):
        return {joint: one_column(file, each) for joint, each in columns.items()}
    if "*" in columns and columns not in file.channels:
        head, _, tail = columns.partition("*")
        fits = {
            key[len(head) : len(key) - len(tail)]: Column(key, 0)
            for key, channel in file.channels.items()
            if channel.width == 1
            and key.startswith(head)
            and key.endswith(tail)
            and len(key) > len(head) + len(tail)
        }
        if not fits:
            raise UnknownNameError(f"column for the {what}", columns, file.channels)
        return fits
    channel: Channel = file.channel(columns)
    labels = names or channel.labels
    if not labels:
        raise InvalidInputError(
            f"the {what} {columns!r} are {channel.width} numbers without names. Give names under "
            "[joints], in the columns' order."
        )
    if len(labels) != channel.width:
        raise InvalidInputError(
            f"the {what} {columns!r} have {channel.width} columns and {len(labels)} names. Give a "
            "name for each, in order."
        )
    return {name: Column(columns, i) for i, name in enumerate(labels)}
