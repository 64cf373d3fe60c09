"""EurobenchFolder: the files that Eurobench's locomotion benchmark takes, a folder a trial.

``pos.csv`` (time, base_link_tx ... base_link_rx, joints), ``vel.csv``, ``trq.csv`` and the feet's
``ftl.csv`` and ``ftr.csv`` (time, force_x ... torque_z), semicolons between the columns.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.logs.channel import Channel, LogFile, Meaning, Progress
from copsense.logs.csv_reading import CsvFile

_JOINTS: dict[str, Meaning] = {"pos": "positions", "vel": "velocities", "trq": "torques"}
_FEET = ("ftl", "ftr")
_SIX = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
_BASE = "base_link_"


class EurobenchFolder(LogFile):
    """A folder with ``pos.csv`` and its companions."""

    format: ClassVar[str] = "Eurobench"

    def __init__(self, path: Path) -> None:
        """Read the headings."""
        super().__init__(path)
        self.layout: str = "Eurobench"
        self._files: dict[str, CsvFile] = {}
        self._columns: dict[str, tuple[str, ...]] = {}
        for name in (*_JOINTS, *_FEET):
            file = path / f"{name}.csv"
            if not file.is_file():
                if name == "pos":
                    raise LogReadError(
                        f"{path} is a folder without pos.csv. Give the folder of one Eurobench "
                        "trial, a ROS 2 bag with its metadata.yaml, or a file."
                    )
                self.notes.append(f"{path.name} has no {name}.csv.")
                continue
            table = self._files[name] = CsvFile(file)
            if "time" not in table.channels:
                raise LogReadError(f"{file} has no column named time. Give one, in seconds.")
            self.add(Channel(f"{name}/time", 1, meaning="time"))
            self._columns[f"{name}/time"] = ("time",)
            if name in _FEET:
                self._add(name, "wrench", _SIX, "wrench")
            else:
                joints = tuple(c for c in table.channels if c != "time" and _BASE not in c)
                self._add(name, "joints", joints, _JOINTS[name], joints)
        base = [f"{_BASE}{axis}" for axis in ("tx", "ty", "tz", "rx", "ry", "rz")]
        if all(column in self._files["pos"].channels for column in base):
            self._add("pos", "base_position", tuple(base[:3]), "base position")
            self._add("pos", "base_rotation", tuple(base[3:]), "base rotation")

    def _add(
        self,
        file: str,
        what: str,
        columns: tuple[str, ...],
        meaning: Meaning,
        labels: tuple[str, ...] = (),
    ) -> None:
        missing = [c for c in columns if c not in self._files[file].channels]
        if missing or not columns:
            raise LogReadError(
                f"{self.path / file}.csv lacks {', '.join(missing) or 'joints'}. Give the columns "
                f"time, {', '.join(columns[:3])} ..."
            )
        key = f"{file}/{what}"
        self._columns[key] = columns
        self.add(Channel(key, len(columns), labels, f"{file}/time", meaning))

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Rows of some files, one after the other."""
        for name, table in self._files.items():
            own = [key for key in dict.fromkeys(keys) if key.startswith(f"{name}/")]
            columns = [c for key in own for c in self._columns[key]]
            for block in table.blocks(columns, advance) if own else ():
                yield {key: np.hstack([block[c] for c in self._columns[key]]) for key in own}
        self.notes.extend([note for table in self._files.values() for note in table.notes])
