"""Map statistics: a whole map in a few numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from copsense.content import ShortRepr, freeze
from copsense.json_data import json_data
from copsense.maps.columns import EVALUATED, FLAGS, STATE_WITHIN, STATUS
from copsense.maps.map_lines import map_lines
from copsense.maps.reduction import QUANTITIES, Part, Percentiles, fold
from copsense.maps.store import MapStore

LEVELS = (1.0, 5.0, 25.0, 50.0, 75.0, 95.0, 99.0)  # percent


@dataclass(frozen=True, repr=False)
class WorstPosture(ShortRepr):
    """A posture that is among the worst.

    Attributes:
        posture: its number.
        coordinates: where it is, by name [m, rad].
        value: of the quantity there [m, or 1 for a gain].
        contact: the contact that tips or unloads first there; empty for a gain, and where none can.
        tipping_edge: index of its sole's edge that it tips over; -1 where it tips over none.
        event: what it does: "tips" or "unloads"; already where the value is negative: "off its
            sole" is the centre of pressure then, or it "pulls". Empty where `contact` is.
    """

    posture: int
    coordinates: Mapping[str, float]
    value: float
    contact: str = ""
    tipping_edge: int = -1
    event: str = ""

    def __post_init__(self) -> None:
        """Own the coordinates."""
        freeze(self, "coordinates")


@dataclass(frozen=True, repr=False)
class FailedPosture(ShortRepr):
    """The first posture that was not evaluated, of those of one status.

    Attributes:
        posture: its number.
        coordinates: where it is, by name [m, rad].
        reason: why it was not.
    """

    posture: int
    coordinates: Mapping[str, float]
    reason: str

    def __post_init__(self) -> None:
        """Own the coordinates."""
        freeze(self, "coordinates")


@dataclass(frozen=True, repr=False)
class CriterionSummary(ShortRepr):
    """A map under one criterion.

    Attributes:
        counts: postures of each status.
        worst_travel: the least CoM travels, the worst first.
        worst_gain: the largest CoM gains, the worst first.
        travel_percentiles: percent -> the least CoM travel [m] that this share of the evaluated
            postures does not exceed.
        gain_percentiles: the same of the largest CoM gain.
        failed: status -> the first posture of it, with its reason.
        without_travel: evaluated postures where a centre of pressure is off its sole already, or a
            contact pulls: their travel is negative.
        counts_within: postures of each state within the limits, as of the column ``state_within``;
            empty without limits. Where one is unloaded, its wrenches within the limits leave a
            contact without load.
    """

    counts: Mapping[str, int]
    worst_travel: tuple[WorstPosture, ...]
    worst_gain: tuple[WorstPosture, ...]
    travel_percentiles: Mapping[float, float]
    gain_percentiles: Mapping[float, float]
    failed: Mapping[str, FailedPosture]
    without_travel: int = 0
    counts_within: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Own the mappings."""
        freeze(self, "counts", "travel_percentiles", "gain_percentiles", "failed", "counts_within")


@dataclass(frozen=True, repr=False)
class MapSummary(ShortRepr):
    """A map in a few numbers.

    Attributes:
        path: of the store.
        robot: its name.
        coordinates: what was mapped over.
        units: of these.
        postures: in all.
        chunks: in all.
        chunks_done: evaluated so far; the numbers are of these.
        criteria: by name.
        com_span: a length that the CoM's travel cannot exceed with the contacts in place [m];
            infinite where it is not known.
    """

    path: str
    robot: str
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    postures: int
    chunks: int
    chunks_done: int
    criteria: Mapping[str, CriterionSummary]
    com_span: float = math.inf

    def __post_init__(self) -> None:
        """Own the mapping."""
        freeze(self, "criteria")

    def __str__(self) -> str:
        """What ``copsense map`` prints."""
        return "\n".join(map_lines(self))

    @property
    def complete(self) -> bool:
        """Whether every chunk is done."""
        return self.chunks_done == self.chunks

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense map --json`` prints: plain data, None for what is infinite."""
        data: dict[str, Any] = {
            "robot": self.robot,
            "output": self.path,
            "coordinates": dict(zip(self.coordinates, self.units, strict=True)),
            "postures": self.postures,
            "complete": self.complete,
            "criteria": {
                name: {
                    "counts": row.counts,
                    "share": {k: n / self.postures for k, n in row.counts.items()},
                    "worst_travel": [asdict(w) for w in row.worst_travel],
                    "worst_gain": [asdict(w) for w in row.worst_gain],
                    "travel_percentiles": row.travel_percentiles,
                    "gain_percentiles": row.gain_percentiles,
                    "without_travel": row.without_travel,
                    "counts_within": row.counts_within,
                    "failed": {status: asdict(first) for status, first in row.failed.items()},
                }
                for name, row in self.criteria.items()
            },
        }
        return dict(json_data(data))


def summarise(store: MapStore, progress: Callable[[int], object] | None = None) -> MapSummary:
    """Fold the parts of the chunks that are done, and read their quantities twice.

    Args:
        store: the map.
        progress: called with the number of postures read since; each is read twice.
    """
    report = progress or (lambda _: None)
    total: Part | None = None
    first: dict[tuple[int, int], int] = {}  # chunk with the first posture of a status
    shares = Percentiles(len(QUANTITIES) * len(store.criteria), LEVELS)
    without = np.zeros(len(store.criteria), dtype=np.int64)
    states = FLAGS[STATE_WITHIN] if store.limited else ()
    within = np.zeros((len(store.criteria), len(states)), dtype=np.int64)

    def count(block: np.ndarray) -> None:
        shares.count(block)
        without[:] += (block[:, : len(without)] < 0).sum(axis=0)  # the first quantity is the travel

    runs = list(store.runs())
    for start, end in runs:
        parts = store.parts(start, end)
        for i, part in enumerate(parts, start):
            for j, code in np.argwhere(part.counts > 0):
                first.setdefault((int(j), int(code)), i)
        total = fold(parts if total is None else [total, *parts])
        report(_rows(store, start, end, count))
        if states:
            first_row, last_row = store.bounds(start)[0], store.bounds(end - 1)[1]
            codes = store.read(STATE_WITHIN, first_row, last_row)
            within += (codes[..., None] == np.arange(len(states))).sum(axis=0)
    for start, end in runs:
        report(_rows(store, start, end, shares.refine))
    levels = shares.found().reshape(len(QUANTITIES), len(store.criteria), len(LEVELS))
    criteria = {}
    for j, criterion in enumerate(store.criteria):
        worst: dict[str, tuple[WorstPosture, ...]] = dict.fromkeys(QUANTITIES, ())
        counts = np.zeros(len(STATUS), int)
        if total is not None:
            counts = total.counts[j]
            for k, name in enumerate(QUANTITIES):
                rows = zip(total.worst[k, j], total.values[k, j], strict=True)
                worst[name] = tuple(
                    _posture(store, name, j, int(p), float(v)) for p, v in rows if p >= 0
                )
        travel, gain = (dict(zip(LEVELS, row.tolist(), strict=True)) for row in levels[:, j])
        criteria[criterion] = CriterionSummary(
            dict(zip(STATUS, counts.tolist(), strict=True)),
            worst["least_com_travel"],
            worst["largest_com_gain"],
            travel,
            gain,
            {
                STATUS[code]: _failed(store, chunk, j, code)
                for (column, code), chunk in sorted(first.items())
                if column == j and code != EVALUATED
            },
            int(without[j]),
            dict(zip(states, within[j].tolist(), strict=True)),
        )
    return MapSummary(
        str(store.path),
        str(store.parameters["robot"]["name"]),
        store.names,
        tuple(store.units(name) for name in store.coordinates),
        len(store),
        len(store.done()),
        sum(end - start for start, end in runs),
        criteria,
        store.com_span,
    )


def _rows(store: MapStore, first: int, end: int, take: Callable[[np.ndarray], object]) -> int:
    """Hand on the quantities over a run of chunks, a column each of criterion and quantity."""
    block = store.evaluated(tuple(QUANTITIES), first, end)
    take(block.reshape(len(block), -1))
    return len(block)


def _posture(
    store: MapStore, quantity: str, criterion: int, row: int, value: float
) -> WorstPosture:
    if quantity != "least_com_travel":
        return WorstPosture(row, _place(store, row), value)
    tips, unloads, edges, load = (
        store.read(name, row, row + 1)[0, criterion]
        for name in ("com_travel", "unloading_travel", "tipping_edge", "load_share")
    )
    place, k = _place(store, row), int(np.argmin(np.minimum(tips, unloads)))
    if np.isposinf(value):
        return WorstPosture(row, place, value)
    contact, edge = store.contacts[k], int(edges[k])
    if load[k] < 0:
        return WorstPosture(row, place, value, contact, event="pulls")
    if unloads[k] < tips[k]:
        return WorstPosture(row, place, value, contact, event="unloads")
    return WorstPosture(row, place, value, contact, edge, "off its sole" if value < 0 else "tips")


def _failed(store: MapStore, chunk: int, criterion: int, code: int) -> FailedPosture:
    """The first posture of a status in a chunk that has one."""
    start, stop = store.bounds(chunk)
    status = store.read("status", start, stop)[:, criterion]
    row = start + int(np.flatnonzero(status == code)[0])
    reason = str(store.read("reason", row, row + 1)[0, criterion])
    return FailedPosture(row, _place(store, row), reason)


def _place(store: MapStore, row: int) -> dict[str, float]:
    return {
        name: float(store.read(column, row, row + 1)[0])
        for name, column in zip(store.names, store.coordinates, strict=True)
    }
