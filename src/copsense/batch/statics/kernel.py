"""Kernel: from configurations to results, a few postures abreast."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from copsense.batch.compiler import entry, from_array
from copsense.batch.kinematics import move, place_feet
from copsense.batch.lanes import get, load, store
from copsense.batch.layout import Feet, Tree
from copsense.batch.statics.com_gains import com_gains, com_motions, margins
from copsense.batch.statics.criteria import LEAST_WRENCH, KernelCriteria
from copsense.batch.statics.gradients import torque_gradients, wrench_gradients
from copsense.batch.statics.inertia import factorise_inertia
from copsense.batch.statics.load_sharing import (
    finish,
    least_squares,
    least_wrench,
    set_load,
)
from copsense.batch.statics.loops import build
from copsense.batch.statics.tangents import level_gradients, span
from copsense.batch.transfer import read_postures, write_postures, write_rows
from copsense.batch.vectors import along, load3, store3
from copsense.batch.workspace import WIDTH, Offsets

_offsets = from_array(Offsets)


class Out(NamedTuple):
    """Arrays that a kernel fills, the posture first; named as in `BatchResult`.

    But `motions` are of a block of postures alone, the CoM motions that the limits need as well
    (block, 2 nv); empty without limits.
    """

    wrenches: np.ndarray
    torques: np.ndarray
    cops: np.ndarray
    gradient: np.ndarray
    com_gain: np.ndarray
    com_travel: np.ndarray
    tipping_edge: np.ndarray
    unloading_travel: np.ndarray
    margin: np.ndarray
    load_share: np.ndarray
    com: np.ndarray
    doubtful: np.ndarray
    motions: np.ndarray


@entry
def evaluate_postures(
    tree: Tree,
    feet: Feet,
    criteria: KernelCriteria,
    offsets: Any,
    q: Any,
    out: Out,
    W: Any,
    start: int,
    stop: int,
) -> bool:
    """Fill the results of postures start to stop, `WIDTH` abreast; whether any is in doubt.

    `offsets` are `Offsets` as an array.
    """
    offset = _offsets(offsets)
    doubt = False
    nc, nv = len(feet.body), len(tree.parent) + 5
    moving = feet.held == 1
    gains = len(out.com_gain) > 0
    for first in range(start, stop, WIDTH):
        count = min(WIDTH, stop - first)
        read_postures(W, offset.q, q, first, count)
        move(tree, offset, W)
        place_feet(feet, offset, W)
        build(feet, offset, W)
        set_load(tree, offset, W)
        if moving or gains:
            span(feet, offset, W)
            level_gradients(tree, feet, offset, W)
        if gains:
            factorise_inertia(tree, offset, W)
            com_motions(tree, feet, offset, W)
            if len(out.motions) > 0:
                write_rows(W, offset.motion, out.motions, first - start, count)
        for index in range(len(criteria.kind)):
            store(W, offset.doubt, load(W, offset.flag))
            if criteria.kind[index] == LEAST_WRENCH:
                arm = criteria.arm[index]
                least_wrench(feet, offset, W, arm)
                finish(tree, feet, offset, W)
                wrench_gradients(tree, feet, offset, W, arm, gains)
            else:
                least_squares(feet, offset, W, criteria, index)
                finish(tree, feet, offset, W)
                torque_gradients(tree, feet, offset, W, criteria, index, gains, None)
            if gains:
                com_gains(feet, offset, W, nv)
            margins(feet, offset, W, gains)
            for output in range(2 * nc):
                at = offset.gradient + nv * output
                store3(W, at, along(W, offset.rotation, load3(W, at)))
                store3(W, at + 3, along(W, offset.rotation, load3(W, at + 3)))
            column = criteria.column[index]
            write_postures(W, offset.contact_wrench, out.wrenches, first, count, column)
            write_postures(W, offset.torque + 1, out.torques, first, count, column)
            write_postures(W, offset.cop, out.cops, first, count, column)
            write_postures(W, offset.gradient, out.gradient, first, count, column)
            write_postures(W, offset.margin, out.margin, first, count, column)
            if gains:
                write_postures(W, offset.gain, out.com_gain, first, count, column)
                write_postures(W, offset.travel, out.com_travel, first, count, column)
            # One more `write_postures` and LLVM inlines none of them: a tenth slower.
            for lane in range(count):
                row = first + lane
                for k in range(nc):
                    share = get(W, offset.contact_wrench + 6 * k + 2, lane) / feet.weight
                    out.load_share[row, column, k] = share
                    if gains:
                        edge = int(get(W, offset.edge + k, lane))
                        out.tipping_edge[row, column, k] = edge
                        out.unloading_travel[row, column, k] = get(W, offset.unloading + k, lane)
                doubtful = get(W, offset.doubt, lane) != 0.0
                out.doubtful[row, column] = doubtful
                doubt = doubt or doubtful
        mass = tree.carried[0]
        for lane in range(count):
            for j in range(3):
                h = get(W, offset.first_moment + j, lane)
                out.com[first + lane, j] = get(W, offset.base + j, lane) + h / mass
    return doubt
