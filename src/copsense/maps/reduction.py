"""Reduction: counts and worst postures of a map, folded from the parts of its chunks.

A chunk's part depends on that chunk alone, and parts are folded in the order of the chunks. So a
map that was stopped, resumed, or shared among machines reduces to the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from copsense.content import ShortRepr
from copsense.maps.columns import EVALUATED, STATUS, Chunk

WORST = 10  # postures of each chunk, and of the map, that are kept by name
_HALF = 1 << 16  # values of half a key
# column -> sign that puts the worst first in ascending order
QUANTITIES = {"least_com_travel": 1.0, "largest_com_gain": -1.0}


@dataclass(frozen=True, eq=False, repr=False)
class Part(ShortRepr):
    """What one chunk contributes; folding two gives another.

    Attributes:
        counts: rows of each status (nk, ns).
        worst: postures with the worst of each quantity, the worst first (nq, nk, w); -1 where
            there are fewer.
        values: the quantity there (nq, nk, w); NaN where there are fewer.
    """

    counts: Int[np.ndarray, "nk ns"]
    worst: Int[np.ndarray, "nq nk w"]
    values: Float[np.ndarray, "nq nk w"]


def reduce_chunk(chunk: Chunk, start: int) -> Part:
    """The part of a chunk whose first posture is `start`; rows not evaluated are only counted."""
    status = chunk["status"]
    counts = (status[..., None] == np.arange(len(STATUS))).sum(axis=0, dtype=np.int64)
    rows = np.arange(start, start + len(status))
    posture = np.where(status == EVALUATED, rows[:, None], -1)
    worst, values = [], []
    for name in QUANTITIES:
        found = [_first(name, posture[:, j], chunk[name][:, j]) for j in range(status.shape[1])]
        worst.append([p for p, _ in found])
        values.append([v for _, v in found])
    return Part(counts, np.array(worst, dtype=np.int64), np.array(values, dtype=np.float32))


def fold(parts: Sequence[Part]) -> Part:
    """Parts together."""
    postures = np.concatenate([part.worst for part in parts], axis=-1)
    values = np.concatenate([part.values for part in parts], axis=-1)
    worst, kept = np.empty_like(parts[0].worst), np.empty_like(parts[0].values)
    for i, name in enumerate(QUANTITIES):
        for j in range(worst.shape[1]):
            worst[i, j], kept[i, j] = _first(name, postures[i, j], values[i, j])
    return Part(np.sum([part.counts for part in parts], axis=0), worst, kept)


def _first(name: str, postures: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The WORST first postures by value, then by number."""
    known = np.flatnonzero((postures >= 0) & ~np.isnan(values))
    signed = QUANTITIES[name] * values[known]
    if len(known) > 4 * WORST:  # a whole chunk is not sorted for ten of it
        near = signed <= np.partition(signed, WORST - 1)[WORST - 1]
        known, signed = known[near], signed[near]
    order = known[np.lexsort((postures[known], signed))][:WORST]
    best, kept = np.full(WORST, -1, dtype=np.int64), np.full(WORST, np.nan, dtype=np.float32)
    best[: len(order)], kept[: len(order)] = postures[order], values[order]
    return best, kept


class Percentiles:
    """Exact percentiles of float32 columns that are read block by block, twice.

    The first reading counts by the upper 16 bits of an order-preserving key, the second by the
    lower 16 bits where a percentile falls: half a megabyte a percentile, however many the numbers.

    Args:
        columns: how many.
        levels: in percent.
    """

    def __init__(self, columns: int, levels: Sequence[float]) -> None:
        """Nothing is read."""
        self._levels = levels
        self._upper = np.zeros((columns, _HALF), dtype=np.int64)
        self._lower: list[dict[int, np.ndarray]] | None = None

    def count(self, block: Float[np.ndarray, "n m"]) -> None:
        """Take a block of the first reading; NaN is passed over."""
        for upper, values in zip(self._upper, block.T, strict=True):
            upper += np.bincount(_keys(values) >> 16, minlength=_HALF)

    def refine(self, block: Float[np.ndarray, "n m"]) -> None:
        """Take a block of the second reading."""
        if self._lower is None:
            self._lower = [
                {int(h): np.zeros(_HALF, dtype=np.int64) for h in self._high(upper)[0]}
                for upper in self._upper
            ]
        for lower, values in zip(self._lower, block.T, strict=True):
            keys = _keys(values)
            for high, counts in lower.items():
                counts += np.bincount(keys[keys >> 16 == high] & 0xFFFF, minlength=_HALF)

    def found(self) -> Float[np.ndarray, "m p"]:
        """The smallest numbers that at least these shares do not exceed (no interpolation).

        NaN where a column has no number.
        """
        found = np.full((len(self._upper), len(self._levels)), np.nan)
        if self._lower is None:  # no block at all
            return found
        for row, upper, lower in zip(found, self._upper, self._lower, strict=True):
            keys = [
                (int(h) << 16) + int(np.searchsorted(np.cumsum(lower[int(h)]), rank))
                for h, rank in zip(*self._high(upper), strict=True)
            ]
            if keys:
                row[:] = _values(np.array(keys, dtype=np.uint32))
        return found

    def _high(self, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Upper half of the key of each percentile, and its rank among those that share it."""
        total = int(upper.sum())
        if not total:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        ranks = np.array([max(int(np.ceil(level / 100 * total)), 1) for level in self._levels])
        cumulative = np.cumsum(upper)
        high = np.searchsorted(cumulative, ranks)
        return high, ranks - cumulative[high] + upper[high]


def _keys(values: np.ndarray) -> np.ndarray:
    """Unsigned integers in the order of float32 numbers; NaN left out."""
    bits = np.asarray(values, dtype=np.float32)[~np.isnan(values)].view(np.uint32)
    return np.where(bits >> 31, ~bits, bits | np.uint32(1 << 31)).astype(np.int64)


def _values(keys: np.ndarray) -> np.ndarray:
    bits = np.where(keys >> 31, keys & np.uint32(0x7FFFFFFF), ~keys)
    return np.asarray(bits.astype(np.uint32).view(np.float32), dtype=float)
