"""Pulling: gradients over velocities become gradients over a chart's coordinates.

A chart solves h(x, u) = 0 for u, the joints of the limbs (and base coordinates), where x is named.
A gradient g over all of them is, along the postures of the chart,

    df/dx = g_x - h_x' l,    h_u' l = g_u

with h_u = Q R: l = Q R^-T g_u. Where x is a whole posture, moved to the nearest one with the
contacts in place, df/dx = g - Q Q' g with h_x' = Q R: the projection itself.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import compiled, entry
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import get, load, root, splat, store
from copsense.batch.layout import Feet, Tree
from copsense.batch.postures.constraints import jacobian
from copsense.batch.postures.search_plan import SearchOffsets, SearchPlan
from copsense.batch.statics.loops import factorise, invert_upper, times_lower
from copsense.batch.transfer import read_postures, write_postures
from copsense.batch.vectors import across, dot3, load3, store3
from copsense.batch.workspace import WIDTH, Offsets


class PullPlan(NamedTuple):
    """What is solved for, and what each coordinate is.

    Attributes:
        rows: of h.
        solved: how many columns of h's derivative are solved for, the first; 0 where the nearest
            posture is.
        column: of each coordinate in h's derivative (k,); -1 of the CoM's.
        row: of h that sets the CoM's coordinate (k,); -1 of the others.
        given: which of the given numbers each coordinate is (k,).
    """

    rows: int
    solved: int
    column: np.ndarray
    row: np.ndarray
    given: np.ndarray


class PullOffsets(NamedTuple):
    """First row of each block that pulling adds to a workspace; the rest is the search's.

    Attributes:
        A: columns of h's derivative that are solved for, or all its rows, then Q.
        R: its triangular factor, by rows.
        T: R^-1, by rows.
        felt: g_u.
        multiplier: l of each row.
        gradient: of one output (nv,).
        size: rows in all.
    """

    A: int
    R: int
    T: int
    felt: int
    multiplier: int
    gradient: int
    pulled: int
    size: int


@entry
def pull_gradients(
    tree: Tree,
    feet: Feet,
    plan: SearchPlan,
    pull: PullPlan,
    offset: Offsets,
    search: SearchOffsets,
    more: PullOffsets,
    q: Any,
    gradient: Any,
    pulled: Any,
    doubtful: Any,
    W: Any,
    start: int,
    stop: int,
) -> None:
    """Pull the gradients of postures start to stop, `WIDTH` abreast.

    Args:
        tree: the robot.
        feet: its contacts.
        plan: of one limb with all contacts, what is solved for first, then the coordinates.
        pull: what the coordinates are.
        offset: of the workspace.
        search: likewise.
        more: likewise.
        q: configurations (N, nq).
        gradient: over velocities (N, outputs * nv).
        pulled: to be filled (N, 1, outputs * k).
        doubtful: set to 1 where the coordinates decide no posture (N,).
        W: the workspace.
        start: first posture.
        stop: end of the postures.
    """
    nv, n, k = len(tree.parent) + 5, plan.unknown_first[1], len(pull.given)
    nearest = pull.solved == 0
    outputs = gradient.shape[1] // nv
    for first in range(start, stop, WIDTH):
        count = min(WIDTH, stop - first)
        read_postures(W, offset.q, q, first, count)
        read_postures(W, more.gradient, gradient, first, count)
        move(tree, offset, W)
        place_feet(feet, offset, W)
        _turning_axes(offset, search, W)
        jacobian(tree, feet, plan, offset, search, W, 0)
        for i in range(pull.rows):
            for c in range(n if nearest else pull.solved):
                at = n * i + c if nearest else pull.rows * c + i
                store(W, more.A + at, load(W, search.J + n * i + c))
        if nearest:
            lost = factorise(W, more.A, more.R, n, pull.rows)
        else:
            lost = factorise(W, more.A, more.R, pull.rows, pull.solved)
            invert_upper(W, more.R, more.T, pull.solved)
        store(W, offset.flag, lost)
        for output in range(outputs):
            g, out = more.gradient + nv * output, more.pulled + k * output
            _given_gradient(offset, search, W, g)
            if nearest:
                _remove(pull, more, W, g, n)
            else:
                _multipliers(plan, pull, more, W, g)
            for j in range(k):
                if pull.row[j] >= 0:
                    store(W, out + j, load(W, more.multiplier + pull.row[j]))
                    continue
                s = load(W, g + pull.given[j])
                if not nearest:
                    for i in range(pull.rows):
                        along = load(W, search.J + n * i + pull.column[j])
                        s = s - load(W, more.multiplier + i) * along
                store(W, out + j, s)
        write_postures(W, more.pulled, pulled, first, count, 0)
        for lane in range(count):
            doubtful[first + lane] = get(W, offset.flag, lane) != 0.0


@compiled
def _turning_axes(offset: Offsets, search: SearchOffsets, W: Any) -> None:
    """World axes about which roll, pitch and yaw turn the base, from its orientation."""
    x = load3(W, offset.rotation)
    level = root(x[0] * x[0] + x[1] * x[1])  # zero where roll and yaw turn about one axis
    zero = splat(0.0)
    store3(W, search.turn, x)
    store3(W, search.turn + 3, (zero - x[1] / level, x[0] / level, zero))
    store3(W, search.turn + 6, (zero, zero, splat(1.0)))


@compiled
def _given_gradient(offset: Offsets, search: SearchOffsets, W: Any, g: int) -> None:
    """A gradient over velocities, base axes, as one over the base's coordinates and joints."""
    store3(W, g, across(W, offset.rotation, load3(W, g)))
    w = across(W, offset.rotation, load3(W, g + 3))
    for i in range(3):
        store(W, g + 3 + i, dot3(load3(W, search.turn + 3 * i), w))


@compiled
def _remove(pull: PullPlan, more: PullOffsets, W: Any, g: int, n: int) -> None:
    """g -= Q Q' g."""
    for i in range(pull.rows):
        column = more.A + n * i
        s = load(W, column) * load(W, g)
        for c in range(1, n):
            s = s + load(W, column + c) * load(W, g + c)
        for c in range(n):
            store(W, g + c, load(W, g + c) - s * load(W, column + c))


@compiled
def _multipliers(plan: SearchPlan, pull: PullPlan, more: PullOffsets, W: Any, g: int) -> None:
    """l = Q R^-T g_u."""
    for c in range(pull.solved):
        store(W, more.felt + c, load(W, g + plan.unknown[c]))
    times_lower(W, more.T, more.felt, pull.solved)
    for i in range(pull.rows):
        s = load(W, more.A + i) * load(W, more.felt)
        for c in range(1, pull.solved):
            s = s + load(W, more.A + pull.rows * c + i) * load(W, more.felt + c)
        store(W, more.multiplier + i, s)
