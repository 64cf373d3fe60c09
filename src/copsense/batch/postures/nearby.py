"""Nearby: known postures at the points of a lattice, between which a search starts.

A search from the stance takes five or six steps; one that starts between postures which are known
takes two. The lattice lies over the ends of the coordinates and is solved from the stance, so a row
depends on its values and on those ends alone, and on no other row. In a cell of the lattice the
start is linear in each coordinate:

    x(v) = sum over corners b of x_b prod_i (f_i if b_i else 1 - f_i)

with f the place of v in its cell. A cell serves where all its corners have a posture, and where
what is found from them at its centre is what is found from the stance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from copsense.batch.postures.coordinates import Coordinates
from copsense.batch.postures.posture_batch import PostureBatch
from copsense.stance import Stance

CELLS = (32, 16, 8, 4, 3, 2)  # along each coordinate, by how many there are; none for more
SAME = 1e-9  # m, rad: two searches found the same posture


class Nearby(NamedTuple):
    """Known postures at the points of a lattice, its last coordinate fastest.

    Attributes:
        column: the coordinates whose ends differ (w,).
        low: first end of each (w,).
        scale: cells per unit (w,).
        cells: along each (w,).
        unknowns: of each point, in the order of the plan's (points, u).
        serves: 1 for each cell that does (cells in all,); of no length where nothing is known.
    """

    column: np.ndarray
    low: np.ndarray
    scale: np.ndarray
    cells: np.ndarray
    unknowns: np.ndarray
    serves: np.ndarray


def nothing_nearby(plan: Coordinates) -> Nearby:
    """Where no posture is known: every search starts from the stance."""
    unknowns = sum(len(limb.unknowns) for limb in plan.limbs)
    whole, real = np.zeros(0, dtype=np.int64), np.zeros(0)
    none = np.zeros((0, unknowns))
    return Nearby(whole, real, real.copy(), whole.copy(), none, whole.copy())


def can_start_nearby(stance: Stance, plan: Coordinates) -> bool:
    """Whether postures over a plan's coordinates are isolated, and blend along straight lines.

    Where joints or base leave a choice, what is found depends on where the search starts: there it
    always is the stance.
    """
    rows = [sum(len(stance.contacts[k].components) for k in limb.contacts) for limb in plan.limbs]
    rows[-1] += len(plan.com_axes)
    if any(len(limb.unknowns) != m for limb, m in zip(plan.limbs, rows, strict=True)):
        return False
    return all(entry >= 0 for limb in plan.limbs for entry in _entries(stance, limb.unknowns))


def postures_nearby(
    stance: Stance,
    plan: Coordinates,
    ends: tuple[np.ndarray, np.ndarray],
    solve: Callable[[np.ndarray, Nearby], PostureBatch],
) -> Nearby:
    """Solve for the postures of a lattice over the coordinates.

    Args:
        stance: that of the plan.
        plan: what the coordinates mean.
        ends: first and last of each coordinate (k,).
        solve: finds the postures of rows of values (N, k), given what is nearby.
    """
    low, high = ends
    nothing, column = nothing_nearby(plan), np.flatnonzero(high > low)
    if not 1 <= len(column) <= len(CELLS) or not can_start_nearby(stance, plan):
        return nothing
    cells, w = CELLS[len(column) - 1], len(column)
    steps = np.arange(cells + 1) / cells
    at = [
        low[i : i + 1] + (high[i] - low[i]) * (steps if i in column else 0.0)
        for i in range(len(low))
    ]
    known = solve(_rows(at), nothing)
    there = known.converged.reshape((cells + 1,) * w)
    corners = [
        there[tuple(slice(b, b + cells) for b in corner)] for corner in product((0, 1), repeat=w)
    ]
    serves = np.logical_and.reduce(corners).astype(np.int64).ravel()
    unknowns = [u for limb in plan.limbs for u in limb.unknowns]
    nearby = Nearby(
        column,
        low[column],
        cells / (high - low)[column],
        np.full(w, cells),
        np.ascontiguousarray(known.configurations[:, _entries(stance, unknowns)]),
        serves,
    )
    centres = _rows([(x[:-1] + x[1:]) / 2 if i in column else x for i, x in enumerate(at)])
    found, expected = solve(centres, nearby), solve(centres, nothing)
    off = np.abs(found.configurations - expected.configurations).max(axis=1)
    return nearby._replace(serves=serves * (off < SAME))  # not where one of them is none


def _rows(at: Sequence[np.ndarray]) -> np.ndarray:
    """Every combination of the coordinates' values, the last coordinate fastest (N, k)."""
    rows = np.stack([x.ravel() for x in np.meshgrid(*at, indexing="ij")], axis=1)
    rows.flags.writeable = False  # as checked values are: else the kernel is compiled once more
    return rows


def _entries(stance: Stance, unknowns: Sequence[int]) -> list[int]:
    """Entry of the configuration that each unknown is; -1 for one that is more than one entry."""
    model = stance.robot.model
    entry = {0: 0, 1: 1, 2: 2}
    entry |= {j.idx_v: j.idx_q for j in list(model.joints)[2:] if j.nq == j.nv == 1}
    return [entry.get(int(u), -1) for u in unknowns]
