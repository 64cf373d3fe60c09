"""Channels: what a log file holds, as every reader describes and streams it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from copsense.errors import CopsenseError, LogReadError, UnknownNameError

Meaning = Literal[
    "", "time", "positions", "velocities", "torques", "wrench", "base position", "base rotation"
]
# Called with the bytes of the file that were read since the last call.
Progress = Callable[[int], object]

ROWS = 65536  # a block has at most so many rows


@dataclass(frozen=True)
class Channel:
    """One signal of a log file: as many numbers a row.

    Attributes:
        key: its name in the file.
        width: numbers a row.
        labels: what each of them is called in the file, such as joints; empty where it is not said.
        clock: key of the channel that holds its times; empty where the file does not say.
        meaning: what it is, where the file's format says so.
        frame: frame of a wrench or pose, where the file says so.
        unit: where the file says so.
        unit_time: unit of a clock: ``"s"``, ``"ms"``, ``"us"`` or ``"ns"``.
    """

    key: str
    width: int
    labels: tuple[str, ...] = ()
    clock: str = ""
    meaning: Meaning = ""
    frame: str = ""
    unit: str = ""
    unit_time: str = "s"


class LogFile(ABC):
    """A log file that was opened far enough to say what it holds.

    Attributes:
        path: where it is.
        channels: key -> channel.
        notes: what of the file is not used, a sentence each.
        layout: how the file is laid out, where that was recognised, such as ``"robometry"``.
    """

    format: ClassVar[str] = ""

    def __init__(self, path: Path) -> None:
        """Start without channels."""
        self.path: Path = path
        self.channels: dict[str, Channel] = {}
        self.notes: list[str] = []
        self.layout: str = ""

    @abstractmethod
    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """The rows of some channels, a part of the file at a time.

        Within a block all channels of one clock have the same rows, their clock's among them.

        Args:
            keys: of the channels wanted.
            advance: called with the bytes read.

        Raises:
            LogReadError: the file ends early, or holds what no file of its format does.
        """

    def channel(self, key: str) -> Channel:
        """A channel by its key.

        Raises:
            UnknownNameError: there is none of this key.
        """
        if key not in self.channels:
            raise UnknownNameError(f"signal in {self.path.name}", key, self.channels)
        return self.channels[key]

    def meaning(self, meaning: Meaning) -> list[Channel]:
        """The channels of one meaning."""
        return [c for c in self.channels.values() if c.meaning == meaning]

    def add(self, channel: Channel) -> None:
        """Add a channel."""
        self.channels[channel.key] = channel


@contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Whatever a library stumbles over in a damaged file, as one error.

    Args:
        path: of the file.
        what: it should be, such as ``"Parquet file"``.

    Raises:
        LogReadError: anything but an error of copsense's was raised inside.
    """
    try:
        yield
    except CopsenseError:
        raise
    except Exception as error:
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise LogReadError(
            f"{path} is not a whole {what}: {said[0].rstrip('.')}. It may have been cut short; "
            "copy it again."
        ) from None


def no_progress(_: int) -> None:
    """Report to no one."""
