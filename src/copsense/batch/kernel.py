"""Kernel: from rows of configurations to rows of results, a few postures abreast."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.choice import LEAST_WRENCH, Choices
from copsense.batch.gains import com_gains, com_motions, margins
from copsense.batch.gradients import torque_gradients, wrench_gradients
from copsense.batch.inertia import factorise_inertia
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import WIDTH, compiled, get, load, put, read_lanes, store, write_lanes
from copsense.batch.layout import Feet, Tree
from copsense.batch.loops import build
from copsense.batch.rows import Rows
from copsense.batch.sharing import (
    finish,
    least_squares,
    least_wrench,
    set_load,
)
from copsense.batch.tangents import level_gradients, span
from copsense.batch.vectors import along, load3, store3


class Out(NamedTuple):
    """Arrays that a kernel fills, the posture first; named as in `BatchResult`."""

    wrenches: np.ndarray
    torques: np.ndarray
    cops: np.ndarray
    gradient: np.ndarray
    com_gain: np.ndarray
    com_travel: np.ndarray
    tipping_edge: np.ndarray
    margin: np.ndarray
    load_share: np.ndarray
    com: np.ndarray
    doubtful: np.ndarray


@compiled
def run(
    tree: Tree,
    feet: Feet,
    choices: Choices,
    rows: Rows,
    q: Any,
    out: Out,
    W: Any,
    start: int,
    stop: int,
    width: int,
) -> None:
    """Fill the results of postures start to stop, `width` abreast."""
    nc, nv = len(feet.body), len(tree.parent) + 5
    moving = feet.held == 1
    gains = len(out.com_gain) > 0
    for first in range(start, stop, width):
        count = min(width, stop - first)
        _read(W, rows.q, q, first, count, width)
        move(tree, rows, W)
        place_feet(feet, rows, W)
        build(feet, rows, W)
        set_load(tree, rows, W)
        if moving:
            span(feet, rows, W)
            level_gradients(tree, feet, rows, W)
        if gains and moving:
            factorise_inertia(tree, rows, W)
            com_motions(tree, feet, rows, W)
        for index in range(len(choices.kind)):
            store(W, rows.doubt, load(W, rows.flag))
            if choices.kind[index] == LEAST_WRENCH:
                arm = choices.force[index] / choices.moment[index]
                least_wrench(feet, rows, W, arm)
                finish(tree, feet, rows, W)
                wrench_gradients(tree, feet, rows, W, arm, gains)
            else:
                least_squares(feet, rows, W, choices, index)
                finish(tree, feet, rows, W)
                torque_gradients(tree, feet, rows, W, choices, index, gains)
            if gains:
                com_gains(feet, rows, W, nv)
            margins(feet, rows, W, gains)
            for output in range(2 * nc):
                at = rows.gradient + nv * output
                store3(W, at, along(W, rows.rotation, load3(W, at)))
                store3(W, at + 3, along(W, rows.rotation, load3(W, at + 3)))
            column = choices.column[index]
            _write(W, rows.contact_wrench, out.wrenches, first, count, column)
            _write(W, rows.torque + 1, out.torques, first, count, column)
            _write(W, rows.cop, out.cops, first, count, column)
            _write(W, rows.gradient, out.gradient, first, count, column)
            _write(W, rows.margin, out.margin, first, count, column)
            if gains:
                _write(W, rows.gain, out.com_gain, first, count, column)
                _write(W, rows.travel, out.com_travel, first, count, column)
            for lane in range(count):
                row = first + lane
                for k in range(nc):
                    share = get(W, rows.contact_wrench + 6 * k + 2, lane) / feet.weight
                    out.load_share[row, column, k] = share
                    if gains:
                        edge = int(get(W, rows.edge + k, lane))
                        out.tipping_edge[row, column, k] = edge
                out.doubtful[row, column] = get(W, rows.doubt, lane) != 0.0
        mass = tree.carried[0]
        for lane in range(count):
            for j in range(3):
                h = get(W, rows.first_moment + j, lane)
                out.com[first + lane, j] = get(W, rows.base + j, lane) + h / mass


@compiled
def _read(W: Any, row: int, q: Any, first: int, count: int, width: int) -> None:
    """Configurations first to first + count; the last is repeated where they do not fill `width`.

    Lanes are read in squares, the last of which overlaps the one before.
    """
    n = q.shape[1]
    if W.ndim == 2 and n >= WIDTH:
        last = first + count - 1
        for block in range(0, n, WIDTH):
            i = min(block, n - WIDTH)
            read_lanes(
                W,
                row + i,
                q,
                (
                    n * first + i,
                    n * min(first + 1, last) + i,
                    n * min(first + 2, last) + i,
                    n * min(first + 3, last) + i,
                    n * min(first + 4, last) + i,
                    n * min(first + 5, last) + i,
                    n * min(first + 6, last) + i,
                    n * min(first + 7, last) + i,
                ),
            )
        return
    for lane in range(width):
        at = first + min(lane, count - 1)
        for i in range(n):
            put(W, row + i, lane, q[at, i])


@compiled
def _write(W: Any, row: int, values: Any, first: int, count: int, column: int) -> None:
    """Rows of a workspace as values[first : first + count, column], in squares where they fit."""
    n, stride = values.shape[2], values.shape[1] * values.shape[2]
    if W.ndim == 2 and n >= WIDTH and count == WIDTH:
        start = stride * first + n * column
        for block in range(0, n, WIDTH):
            i = min(block, n - WIDTH)
            write_lanes(W, row + i, values, start + i, stride)
        return
    for lane in range(count):
        for i in range(n):
            values[first + lane, column, i] = get(W, row + i, lane)
