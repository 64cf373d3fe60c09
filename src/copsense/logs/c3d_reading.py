"""C3dFile: the force plates of a C3D file, as wrenches in the laboratory's axes."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require
from copsense.logs.channel import Channel, LogFile, Progress

_MM = 1e-3


class C3dFile(LogFile):
    """A C3D file with force plates.

    A plate's wrench is what it does to the foot, in the laboratory's axes about their origin.
    """

    format: ClassVar[str] = "C3D"

    def __init__(self, path: Path) -> None:
        """Read the file: plates need all of it."""
        super().__init__(path)
        require("ezc3d", "reading a C3D file")
        _check_whole(path)
        plates, rate = self._plates()
        if not plates:
            raise LogReadError(
                f"{path} has no force plate that can be read. Its parameters need FORCE_PLATFORM "
                "with CORNERS, ORIGIN and CHANNEL."
            )
        self.rate: float = rate
        self._wrenches = [_wrench(plate) for plate in plates]
        self.layout = "force plates"
        self.add(Channel("time", 1, meaning="time"))
        for i in range(len(plates)):
            self.add(Channel(f"plate {i + 1}", 6, (), "time", "wrench", "world"))

    def _plates(self) -> tuple[list[Any], float]:
        from ezc3d import c3d

        try:
            data = c3d(str(self.path), extract_forceplat_data=True)
            plates = list(data["data"].get("platform", []))
            return plates, float(data["header"]["analogs"]["frame_rate"])
        # The binding hands on whatever its C++ raises.
        except Exception as error:
            raise LogReadError(f"{self.path} is not a whole C3D file: {error}.") from None

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """All rows."""
        rows = len(self._wrenches[0])
        every = {"time": (np.arange(rows) / self.rate)[:, None]}
        every |= {f"plate {i + 1}": w for i, w in enumerate(self._wrenches)}
        yield {key: every[key] for key in keys}
        advance(self.path.stat().st_size)


def _wrench(plate: Any) -> Float[np.ndarray, "N 6"]:
    """Force [N] and moment about the laboratory's origin [Nm] of the plate on the foot.

    ezc3d gives the moment about the middle of the plate's corners.
    """
    force = np.asarray(plate["force"], float).T
    length = _MM if "mm" in str(plate["unit_position"]).lower() else 1.0
    moment = np.asarray(plate["moment"], float).T
    moment = moment * (_MM if "mm" in str(plate["unit_moment"]).lower() else 1.0)
    middle = np.asarray(plate["corners"], float).reshape(3, -1).mean(axis=1) * length
    return np.hstack([force, moment + np.cross(middle, force)])


def _check_whole(path: Path) -> None:
    """Reject what the C++ reader would take memory for without end: sizes beyond the file's.

    The header's words: parameters' block, magic 0x50, points, analogue numbers a frame, first and
    last frame; the first word of the parameters: reserved, number of blocks, processor.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LogReadError(f"{path} cannot be opened: {error}.") from None
    if len(data) < 1024 or data[1] != 0x50:
        raise LogReadError(f"{path} is not a C3D file: its header is not one. Give another file.")
    begin = (data[0] - 1) * 512
    if begin < 512 or begin + 512 > len(data) or data[begin + 3] - 83 not in (1, 2, 3):
        raise LogReadError(f"{path} is damaged: its parameters are not where its header says.")
    order = ">" if data[begin + 3] - 83 == 3 else "<"
    points, analogue, first, last = struct.unpack(f"{order}4H", data[2:10])
    (scale,) = struct.unpack(f"{order}f", data[12:16])
    (block,) = struct.unpack(f"{order}H", data[16:18])
    size = 4 if scale < 0 else 2
    frames = max(0, last - first + 1)
    need = (block - 1) * 512 + frames * size * (4 * points + analogue)
    if frames < 1 or block < 2 or need > len(data):
        raise LogReadError(
            f"{path} is cut short: its header says {frames} frames, {need} bytes, and it has "
            f"{len(data)}. Copy it again."
        )
