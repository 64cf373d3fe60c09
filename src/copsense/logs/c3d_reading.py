"""C3dFile: the force plates of a C3D file, as wrenches in the laboratory's axes."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.apart import read_apart
from copsense.logs.channel import Channel, LogFile, Progress, reading

_BEGINNING = 1 << 18  # bytes: the header's first byte says where parameters begin, in 512 bytes


class C3dFile(LogFile):
    """A C3D file with force plates.

    A plate's wrench is what it does to the foot (the reaction, which is what C3D files hold), in
    the laboratory's axes about their origin.
    """

    format: ClassVar[str] = "C3D"

    def __init__(self, path: Path) -> None:
        """Read the file: plates need all of it."""
        super().__init__(path)
        require("ezc3d", "reading a C3D file")
        _check_whole(path)
        held = read_apart(
            "c3d_plates", path, "C3D file", "Cut it to the trial, or leave its markers out."
        )
        self.rate: float = float(held.pop("rate"))
        self._wrenches: dict[str, Float[np.ndarray, "N 6"]] = held
        if not held or not self.rate > 0:
            raise LogReadError(
                f"{path} has no force plate that can be read. Its parameters need FORCE_PLATFORM "
                "with CORNERS, ORIGIN and CHANNEL."
            )
        self.layout: str = "force plates"
        self.add(Channel("time", 1, meaning="time"))
        for name in held:
            self.add(Channel(name, 6, (), "time", "wrench", "world"))

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """All rows."""
        rows = len(next(iter(self._wrenches.values())))
        every = {"time": (np.arange(rows) / self.rate)[:, None]} | self._wrenches
        yield {key: every[key] for key in keys}
        advance(self.path.stat().st_size)


def _check_whole(path: Path) -> None:
    """Reject what the C++ reader would take memory for without end: sizes beyond the file's.

    The header's words: parameters' block, magic 0x50, points, analogue numbers a frame, first and
    last frame; the first word of the parameters: reserved, number of blocks, processor.
    """
    with reading(path, "C3D file"), path.open("rb") as file:
        data, size = file.read(_BEGINNING), path.stat().st_size
    if len(data) < 1024 or data[1] != 0x50:
        raise LogReadError(f"{path} is not a C3D file: its header is not one. Give another file.")
    begin = (data[0] - 1) * 512
    if begin < 512 or begin + 512 > size or data[begin + 3] - 83 not in (1, 2, 3):
        raise LogReadError(f"{path} is damaged: its parameters are not where its header says.")
    order = ">" if data[begin + 3] - 83 == 3 else "<"
    points, analogue, first, last = struct.unpack(f"{order}4H", data[2:10])
    (scale,) = struct.unpack(f"{order}f", data[12:16])
    (block,) = struct.unpack(f"{order}H", data[16:18])
    width = 4 if scale < 0 else 2
    frames = max(0, last - first + 1)
    need = (block - 1) * 512 + frames * width * (4 * points + analogue)
    if frames < 1 or block < 2 or need > size:
        raise LogReadError(
            f"{path} is cut short: its header says {frames} frames, {need} bytes, and it has "
            f"{size}. Copy it again."
        )
