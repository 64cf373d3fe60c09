"""Collecting: some channels of a log file in memory, thinned while they are read if asked to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.logs.channel import LogFile, Progress

LARGEST = 5_000_000  # numbers that are kept in memory: 40 MB, of which there will be copies


def collect(
    file: LogFile,
    keys: Sequence[str],
    clocks: Mapping[str, str],
    rates: Mapping[str, float],
    advance: Progress,
) -> dict[str, Float[np.ndarray, "N k"]]:
    """Channels by key.

    Args:
        file: where they are.
        keys: of the channels, their clocks' among them.
        clocks: key -> key of the clock; a clock is its own.
        rates: clock -> rows per unit of it to keep, each the mean of the samples around it; all
            rows of the others.
        advance: called with the bytes read.

    Raises:
        LogReadError: the file is damaged.
        TooLargeError: it has more numbers than are kept in memory.
    """
    bins = {clock: _Bins(rates.get(clock)) for clock in set(clocks.values())}
    held = 0
    for block in file.blocks(keys, advance):
        for clock, thinner in bins.items():
            own = {key: block[key] for key in keys if clocks[key] == clock and key in block}
            if own:
                held += thinner.add(own, clock)
        if held > LARGEST:
            raise TooLargeError(
                f"{file.path.name} holds more than {LARGEST // 1_000_000} million numbers of "
                "these signals. Give a lower rate (rate=, --rate), or cut the log: samples are "
                "averaged while they are read."
            )
    found: dict[str, Float[np.ndarray, "N k"]] = {}
    for thinner in bins.values():
        found |= thinner.arrays()
    empty = [key for key in keys if key not in found or not len(found[key])]
    if empty:
        more = f" and {len(empty) - 5} more signals" if len(empty) > 5 else ""
        raise LogReadError(
            f"{file.path} has no row of {', '.join(empty[:5])}{more}. Map other signals."
        )
    return found


class TooLargeError(LogReadError):
    """A log holds more numbers than are kept in memory."""


class _Bins:
    """Rows of one clock, or their means over steps of equal length."""

    def __init__(self, rate: float | None) -> None:
        self.rate = rate
        self._parts: dict[str, list[np.ndarray]] = {}
        self._left: dict[str, np.ndarray] = {}
        self._start: float | None = None

    def add(self, block: Mapping[str, np.ndarray], clock: str) -> int:
        """Take rows in; returns how many numbers are kept of them."""
        if self.rate is None or clock not in block:
            return self._keep(block)
        joined = {
            key: np.concatenate([self._left[key], rows]) if self._left else np.asarray(rows)
            for key, rows in block.items()
        }
        times = joined[clock][:, 0]
        if self._start is None:
            known = times[np.isfinite(times)]
            self._start = float(known[0]) if known.size else None
        if self._start is None:
            return 0
        # Rounding must not put a sample that lies on an edge to either side.
        step = np.floor((times - self._start) * self.rate + 1e-6)
        edges = np.flatnonzero(np.diff(step) != 0) + 1
        last = int(edges[-1]) if edges.size else 0
        self._left = {key: rows[last:] for key, rows in joined.items()}
        if not last:
            return 0
        return self._keep(_means({k: r[:last] for k, r in joined.items()}, edges[:-1]))

    def arrays(self) -> dict[str, np.ndarray]:
        """All rows that were kept; a last step that was only begun is none, unless it is all."""
        if self._left and not self._parts:
            self._keep(_means(self._left, np.zeros(0, int)))
            self._left = {}
        # One after the other, so that parts and wholes are not both held.
        return {key: np.concatenate(self._parts.pop(key)) for key in list(self._parts)}

    def _keep(self, block: Mapping[str, np.ndarray]) -> int:
        for key, rows in block.items():
            self._parts.setdefault(key, []).append(np.array(rows))
        return sum(rows.size for rows in block.values())


def _means(block: Mapping[str, np.ndarray], edges: np.ndarray) -> dict[str, np.ndarray]:
    """Means between edges, of the numbers that are there."""
    starts = np.concatenate([[0], edges]).astype(int)
    found = {}
    for key, rows in block.items():
        known = np.isfinite(rows)
        total = np.add.reduceat(np.where(known, rows, 0.0), starts, axis=0)
        count = np.add.reduceat(known, starts, axis=0, dtype=int)
        found[key] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return found
