"""Travel slope: how the travel to a sole's edge changes, from neighbours along one input."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int

OFFSETS = (-2, -1, 1, 2)
"""Neighbours of a posture, in steps."""
STEPS = (1e-4, 1e-6)
"""Steps [m, rad]: the error of fourth order is near its least with the first; the second serves
where a limit or the change of an edge is nearer than that."""


Travels = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Inputs (N, k) -> travel and edge (N, nc), and whether there is a posture (N,)."""


def travel_slopes(
    travels: Travels, x: Float[np.ndarray, "N k"], share: Float[np.ndarray, "N nc"]
) -> tuple[Float[np.ndarray, "N k"], list[int]]:
    """Slopes along every input of sums of share times travel.

    Args:
        travels: the function.
        x: the inputs.
        share: of each contact's travel.

    Returns:
        The slopes; zero where there is no posture. And the inputs along which a posture has no
        neighbours.
    """
    here, edge, valid = travels(x)
    slopes, stuck = np.zeros_like(x), []
    for j in range(x.shape[1]):
        left = valid.copy()
        for step in STEPS:
            rows = np.flatnonzero(left)
            near = np.repeat(x[rows, None], len(OFFSETS), axis=1)
            near[:, :, j] += step * np.array(OFFSETS)
            travel, edges, there = (
                a.reshape(len(rows), len(OFFSETS), *a.shape[1:])
                for a in travels(near.reshape(-1, x.shape[1]))
            )
            found = travel_slope(here[rows], edge[rows], travel, edges, there, step)
            found = np.where(share[rows] == 0.0, 0.0, found)
            known = np.isfinite(found).all(axis=1)
            slopes[rows[known], j] = (found * share[rows])[known].sum(axis=1)
            left[rows[known]] = False
            if not left.any():
                break
        if left.any():
            stuck.append(j)
    return slopes, stuck


def travel_slope(
    here: Float[np.ndarray, "N nc"],
    edge: Int[np.ndarray, "N nc"],
    travel: Float[np.ndarray, "N 4 nc"],
    edges: Int[np.ndarray, "N 4 nc"],
    there: Bool[np.ndarray, "N 4"],
    step: float,
) -> Float[np.ndarray, "N nc"]:
    """The slope, from neighbours on both sides where these go to the same edge, else from one.

    Args:
        here: travel of the postures [m].
        edge: the edge that it goes to.
        travel: of the neighbours, in the order of `OFFSETS`.
        edges: likewise.
        there: whether there is such a neighbour.
        step: between neighbours [m, rad].

    Returns:
        The slope; zero where the travel is infinite, NaN where neither side serves.
    """
    same = (edges == edge[:, None]) & there[:, :, None]
    before, after = same[:, :2].all(axis=1), same[:, 2:].all(axis=1)
    a, b, c, d = (np.where(np.isfinite(t), t, 0.0) for t in np.moveaxis(travel, 1, 0))
    middle = np.where(np.isfinite(here), here, 0.0)
    both = (a - 8.0 * b + 8.0 * c - d) / (12.0 * step)
    left = (3.0 * middle - 4.0 * b + a) / (2.0 * step)
    right = (4.0 * c - 3.0 * middle - d) / (2.0 * step)
    one = np.where(before, left, np.where(after, right, np.nan))
    return np.asarray(np.where(np.isfinite(here), np.where(before & after, both, one), 0.0))
