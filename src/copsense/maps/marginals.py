"""Marginals: a map over two of its coordinates, the rest at their worst or at the median."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Float

from copsense.content import freeze
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.maps.columns import EVALUATED, ROBUST
from copsense.maps.reduction import QUANTITIES
from copsense.maps.store import map_parameters

if TYPE_CHECKING:
    import xarray as xr

_BINS = 48  # at most, along each coordinate of a sample, or of a grid of many values
_IN_CELL = 4  # postures of a sample, on average
_WIDTH = 1e-3  # m or rad of a cell that stands alone
_HOW = ("worst", "median")


@dataclass(frozen=True, eq=False)
class Marginal:
    """A quantity over two coordinates.

    Attributes:
        names: of the two coordinates.
        units: of the two.
        quantity: ``"least_com_travel"`` or ``"largest_com_gain"``; of a map with an uncertainty
            ``"likely_com_travel"`` or ``"robust_com_travel"`` too.
        how: how the rest was reduced.
        edges: of the cells along each coordinate.
        criteria: names of the criteria.
        values: for each criterion and cell, first coordinate first; NaN where no posture was
            evaluated.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    quantity: str
    how: str
    edges: tuple[np.ndarray, np.ndarray]
    criteria: tuple[str, ...]
    values: Float[np.ndarray, "nk a b"]

    def __post_init__(self) -> None:
        """Own the numbers."""
        freeze(self, "edges", "values")

    def __repr__(self) -> str:
        """Its quantity, coordinates and size."""
        shape = " x ".join(str(n) for n in self.values.shape[1:])
        return (
            f"Marginal({self.how} {self.quantity} over {' and '.join(self.names)}, {shape} cells; "
            f"criteria {', '.join(self.criteria)})"
        )


def marginal(
    dataset: xr.Dataset,
    over: tuple[str, str] | None = None,
    quantity: str = "least_com_travel",
    how: Literal["worst", "median"] = "worst",
) -> Marginal:
    """Reduce a map, or what is done of it, to two of its coordinates.

    A grid keeps its values, unless they are very many; a sample is put into bins, the fewer the
    fewer its postures. The quantity is read for one criterion at a time: a few bytes a posture.

    Args:
        dataset: what `load_map` gives.
        over: the two coordinates; default the first two.
        quantity: ``"least_com_travel"`` or ``"largest_com_gain"``; of a map with an uncertainty
            ``"likely_com_travel"`` or ``"robust_com_travel"`` too.
        how: ``"worst"`` (least travel, largest gain) or ``"median"`` (the lower one).

    Raises:
        InvalidInputError: the map has a single coordinate, one is named twice, or no chunk is done.
        UnknownNameError: a coordinate, quantity or reduction that does not exist.
    """
    known = tuple(dataset.attrs["over"])
    drawn = QUANTITIES | {name: 1.0 for name in ROBUST if name in dataset}
    if quantity not in drawn:
        raise UnknownNameError("quantity of a map", quantity, drawn)
    if how not in _HOW:
        raise UnknownNameError("way to marginalise", how, _HOW)
    names = known[:2] if over is None else tuple(over)
    for name in names:
        if name not in known:
            raise UnknownNameError("coordinate of the map", name, known)
    if len(set(names)) != 2:
        raise InvalidInputError(
            f"a picture is drawn over two coordinates, got {', '.join(names)}. The map has "
            f"{', '.join(known)}."
        )
    sampled = map_parameters(dataset.attrs)["sampling"]["is"] == "Sample"
    dataset = dataset.isel(posture=_visited(dataset))
    cells = [_cells(np.asarray(dataset[name].values), sampled) for name in names]
    shape = tuple(len(edges) - 1 for edges, _ in cells)
    cell = np.ravel_multi_index((cells[0][1], cells[1][1]), shape)
    criteria = tuple(str(c) for c in dataset["criterion"].values)
    values = np.full((len(criteria), *shape), np.nan)
    for j in range(len(criteria)):
        here = dataset.isel(criterion=j)
        found = np.asarray(here[quantity].values, dtype=float)
        kept = (here["status"].values == EVALUATED) & ~np.isnan(found)
        values[j].ravel()[:] = _reduced(drawn[quantity] * found[kept], cell[kept], shape, how)
    values *= drawn[quantity]
    units = tuple(str(dataset[name].attrs.get("units", "")) for name in names)
    return Marginal(
        (names[0], names[1]),
        (units[0], units[1]),
        quantity,
        how,
        (cells[0][0], cells[1][0]),
        criteria,
        values,
    )


def _visited(dataset: xr.Dataset) -> slice | np.ndarray:
    """The rows of the chunks that are done: all of a complete map."""
    done = np.asarray(dataset["done"].values) > 0
    if done.all():
        return slice(None)
    if not done.any():
        raise InvalidInputError("no posture of the map is evaluated yet. Resume the map first.")
    size = int(map_parameters(dataset.attrs)["chunk"])
    return np.flatnonzero(np.repeat(done, size)[: dataset.sizes["posture"]])


def _cells(values: np.ndarray, sampled: bool) -> tuple[np.ndarray, np.ndarray]:
    """Edges of cells, and the cell of each value."""
    known = np.unique(values)
    if len(known) == 1:
        return known[0] + np.array([-0.5, 0.5]) * _WIDTH, np.zeros(len(values), dtype=np.int64)
    if not sampled and len(known) <= 4 * _BINS:
        middles = (known[1:] + known[:-1]) / 2
        first, last = known[0] - (middles[0] - known[0]), known[-1] + (known[-1] - middles[-1])
        return np.concatenate([[first], middles, [last]]), np.searchsorted(known, values)
    bins = min(_BINS, math.isqrt(len(values) // _IN_CELL) or 1)
    edges = np.linspace(known[0], known[-1], bins + 1)
    return edges, np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)


def _reduced(signed: np.ndarray, cell: np.ndarray, shape: tuple[int, ...], how: str) -> np.ndarray:
    """The least of each cell, or its lower median."""
    found = np.full(int(np.prod(shape)), np.nan)
    order = np.lexsort((signed, cell))
    where, first, count = np.unique(cell[order], return_index=True, return_counts=True)
    rank = np.zeros_like(count) if how == "worst" else (count - 1) // 2
    found[where] = signed[order][first + rank]
    return found
