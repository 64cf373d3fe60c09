"""Kernel: from rows of configurations to rows of results, a few postures abreast."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.choice import LEAST_WRENCH, Choices
from copsense.batch.gains import com_gains, com_motions, margins
from copsense.batch.gradients import torque_gradients, wrench_gradients
from copsense.batch.inertia import factorise_inertia
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import along, compiled, get, load, load3, put, store, store3
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


class Out(NamedTuple):
    """Arrays that a kernel fills, the posture first; named as in `BatchResult`."""

    wrenches: np.ndarray
    torques: np.ndarray
    cops: np.ndarray
    gradient: np.ndarray
    com_gain: np.ndarray
    com_travel: np.ndarray
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
        for lane in range(width):
            # The last ones are repeated where too few are left to fill the lanes.
            at = first + min(lane, count - 1)
            for column in range(q.shape[1]):
                put(W, rows.q + column, lane, q[at, column])
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
                wrench_gradients(tree, feet, rows, W, arm)
            else:
                least_squares(feet, rows, W, choices, index)
                finish(tree, feet, rows, W)
                torque_gradients(tree, feet, rows, W, choices, index)
            if gains:
                com_gains(tree, feet, rows, W)
            margins(feet, rows, W, gains)
            for output in range(2 * nc):
                at = rows.gradient + nv * output
                store3(W, at, along(W, rows.rotation, load3(W, at)))
                store3(W, at + 3, along(W, rows.rotation, load3(W, at + 3)))
            column = choices.column[index]
            for lane in range(count):
                row = first + lane
                _copy(W, rows.contact_wrench, lane, out.wrenches[row, column])
                _copy(W, rows.torque + 1, lane, out.torques[row, column])
                _copy(W, rows.cop, lane, out.cops[row, column])
                _copy(W, rows.gradient, lane, out.gradient[row, column])
                _copy(W, rows.margin, lane, out.margin[row, column])
                if gains:
                    _copy(W, rows.gain, lane, out.com_gain[row, column])
                    _copy(W, rows.travel, lane, out.com_travel[row, column])
                for k in range(nc):
                    share = get(W, rows.contact_wrench + 6 * k + 2, lane) / feet.weight
                    out.load_share[row, column, k] = share
                out.doubtful[row, column] = get(W, rows.doubt, lane) != 0.0
        mass = tree.carried[0]
        for lane in range(count):
            for j in range(3):
                h = get(W, rows.first_moment + j, lane)
                out.com[first + lane, j] = get(W, rows.base + j, lane) + h / mass


@compiled
def _copy(W: Any, row: int, lane: int, values: Any) -> None:
    for i in range(len(values)):
        values[i] = get(W, row + i, lane)
