"""MatlabFile: the signals of a MATLAB file, as robometry, Simulink or a script wrote them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.logs.channel import ROWS, Channel, LogFile, Meaning, Progress, reading
from copsense.logs.matlab_tree import Leaf, read_tree

_CLOCKS = re.compile(r"^(timestamps?|times?|t|tout|time_?s|stamps?|.*[jJ]ointsTime)$")
# robometry (yarp-telemetry): what its channels are called -> what they are.
_JOINTS: dict[str, Meaning] = {
    "positions": "positions",
    "joint_positions": "positions",
    "encoders": "positions",
    "velocities": "velocities",
    "joint_velocities": "velocities",
    "velocity": "velocities",
    "torques": "torques",
    "joint_torques": "torques",
    "torque": "torques",
}
_WRENCHES = re.compile(r"(^|[._:])(FTs?|wrenches|cartesian_wrenches)([._:]|$)|_ft($|[._:])", re.I)


class MatlabFile(LogFile):
    """A MATLAB file, v5 or v7.3."""

    format: ClassVar[str] = "MATLAB"

    def __init__(self, path: Path) -> None:
        """Read what it holds; of v7.3 without the numbers."""
        super().__init__(path)
        leaves, notes, close = read_tree(path)
        # A v5 file is in memory now; of v7.3 only what is asked for will be.
        self._whole = leaves if close is None else None
        self.notes.extend(notes)
        self.texts: dict[str, tuple[str, ...]] = {x.key: x.texts for x in leaves if x.texts}
        self._read: dict[str, tuple[Leaf, int]] = {}
        numbers = [leaf for leaf in leaves if leaf.read is not None]
        groups = {leaf.group for leaf in numbers}
        layout = ""
        for group in sorted(groups):
            own = {leaf.field: leaf for leaf in numbers if leaf.group == group}
            if {"data", "timestamps"} <= own.keys():
                layout = "robometry"
                self._add_telemetry(group, own)
            elif "values" in own and group.rpartition(".")[2].startswith("signals"):
                layout = "Simulink structure"
                self._add_simulink(group, own["values"], numbers)
        self.layout: str = layout
        self._add_flat([leaf for leaf in numbers if leaf.key not in self._read])
        if close is not None:
            close()
        if not self._read:
            raise LogReadError(
                f"{path} holds no signal over time. {' '.join(self.notes[:3])}".strip()
            )

    def _add_telemetry(self, group: str, own: Mapping[str, Leaf]) -> None:
        """A channel of robometry: data (n, m, N) with timestamps (N)."""
        data, stamps = own["data"], own["timestamps"]
        rows = max(stamps.shape)
        axis = next((i for i in range(len(data.shape))[::-1] if data.shape[i] == rows), None)
        if axis is None:
            self.notes.append(
                f"{group}: data of shape {data.shape} and {rows} timestamps do not fit, and were "
                "left out."
            )
            return
        name = group.rpartition(".")[2]
        width = int(np.prod(data.shape)) // rows
        labels = self.texts.get(f"{group}.elements_names", ())
        if not labels:  # older files name the joints once, at the root
            root = group.partition(".")[0]
            labels = self.texts.get(f"{root}.description_list", ())
        meaning = _JOINTS.get(name.rpartition("::")[2], "")
        frame = ""
        if width == 6 and _WRENCHES.search(group):
            meaning, labels, frame = "wrench", (), name.rpartition("::")[2]
        if len(labels) != width:
            labels = ()
        units = {u.lower() for u in self.texts.get(f"{group}.units_of_measure", ())}
        unit = "deg" if units & {"deg", "degrees", "degree"} else ""
        self._keep(stamps, int(np.argmax(stamps.shape)), Channel(stamps.key, 1, meaning="time"))
        self._keep(data, axis, Channel(data.key, width, labels, stamps.key, meaning, frame, unit))

    def _add_simulink(self, group: str, values: Leaf, numbers: Sequence[Leaf]) -> None:
        """A structure with time: out.time (N), out.signals.values (N, k) or (k, 1, N)."""
        root = group.rpartition(".")[0]
        clock = next((x for x in numbers if x.key == f"{root}.time"), None)
        rows = max(clock.shape) if clock else max(values.shape)
        axes = [i for i, size in enumerate(values.shape) if size == rows]
        if not axes:
            self.notes.append(f"{values.key} does not fit its time, and was left out.")
            return
        axis = axes[0] if len(values.shape) < 3 else axes[-1]
        label = self.texts.get(f"{group}.label", ())
        width = int(np.prod(values.shape)) // rows
        labels = tuple(part.strip() for text in label for part in text.split(","))
        key = "" if clock is None else clock.key
        if clock is not None:
            time = Channel(clock.key, 1, meaning="time")
            self._keep(clock, int(np.argmax(clock.shape)), time)
        labels = labels if len(labels) == width else ()
        self._keep(values, axis, Channel(values.key, width, labels, key))

    def _add_flat(self, leaves: Sequence[Leaf]) -> None:
        """Arrays of a script: those as long as their structure's time, or as most are."""
        for group in sorted({leaf.group for leaf in leaves}):
            own = [leaf for leaf in leaves if leaf.group == group and max(leaf.shape) > 1]
            clocks = [x for x in own if _CLOCKS.match(x.field) and _is_vector(x)]
            lengths = Counter(max(leaf.shape) for leaf in own)
            clock = max(clocks, key=lambda c: lengths[max(c.shape)], default=None)
            if clock is None and not lengths:
                continue
            rows = max(clock.shape) if clock else lengths.most_common(1)[0][0]
            for leaf in own:
                axes = [i for i, size in enumerate(leaf.shape) if size == rows]
                if not axes:
                    continue
                if leaf is clock:
                    self._keep(leaf, axes[0], Channel(leaf.key, 1, meaning="time"))
                    continue
                width = int(np.prod(leaf.shape)) // rows
                key = clock.key if clock is not None else ""
                self._keep(leaf, axes[-1], Channel(leaf.key, width, (), key))

    def _keep(self, leaf: Leaf, axis: int, channel: Channel) -> None:
        if leaf.key not in self._read:
            self._read[leaf.key] = leaf, axis
            self.add(channel)

    def blocks(
        self, keys: Sequence[str], advance: Progress
    ) -> Iterator[Mapping[str, Float[np.ndarray, "n k"]]]:
        """Rows of some arrays, those of one clock together."""
        leaves, close = self._whole, None
        if leaves is None:
            leaves, _, close = read_tree(self.path)
        found = {leaf.key: leaf for leaf in leaves}
        clocks: dict[str, list[str]] = {}
        for key in dict.fromkeys(keys):
            own = self.channels[key]
            clocks.setdefault(key if own.meaning == "time" else own.clock, []).append(key)
        size = self.path.stat().st_size / max(1, len(clocks))
        try:
            for own_keys in clocks.values():
                parts = {key: (found[key], self._read[key][1]) for key in own_keys}
                for block, share in self._group(parts):
                    yield block
                    advance(round(size * share))
        finally:
            if close is not None:
                close()

    def _group(
        self, parts: Mapping[str, tuple[Leaf, int]]
    ) -> Iterator[tuple[dict[str, Float[np.ndarray, "n k"]], float]]:
        """Rows of arrays that have one clock, and which share of all rows they are."""
        rows = {leaf.shape[axis] for leaf, axis in parts.values()}
        if len(rows) != 1:
            raise LogReadError(
                f"{', '.join(parts)} of {self.path.name} have {sorted(rows)} rows. Map signals of "
                "one clock, or give each its own."
            )
        (total,) = rows
        for begin in range(0, total, ROWS):
            end, block = min(begin + ROWS, total), {}
            with reading(self.path, "MATLAB file"):
                for key, (leaf, axis) in parts.items():
                    assert leaf.read is not None
                    block[key] = leaf.read(axis, begin, end).reshape(end - begin, -1)
            yield block, (end - begin) / total


def _is_vector(leaf: Leaf) -> bool:
    return int(np.prod(leaf.shape)) == max(leaf.shape)
