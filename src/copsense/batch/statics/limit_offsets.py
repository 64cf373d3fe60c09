"""Limit offsets: where the limited kernel keeps what it adds to a workspace."""

from __future__ import annotations

from typing import NamedTuple

from copsense.batch.layout import RobotLayout
from copsense.batch.workspace import Offsets


class LimitOffsets(NamedTuple):
    """First row of each block that follows those of `Offsets`.

    Attributes:
        lost: above zero where the criterion's matrix may have lost rank.
        N: contact wrenches per coordinate x of the active set, by columns (r, 6 nc).
        B: torque that x takes off each support joint, by columns (r, ns).
        P: onto what the pressing rows leave of x (r, r).
        torque_response: change of each support joint's multiplier per gradient in x (ns, r).
        twist_response: rotation that the held contact's multipliers add to xi, by columns (r, 3).
        pressing: multiplier of each support joint's torque, signed as the torque (ns,).
        shift: x, or a gradient along it (r,).
        scale: norm of each support joint's torque over the contacts' wrenches (ns,).
        twist: of each body along a motion (n + 1, 6).
        moved: what a motion adds to dh of each body by the joints it carries (n + 1, 3).
        gravity_rate: change of G along both motions (2, n + 1).
        screw_rate: change of the support joints' screws (2, ns, 6).
        load_rate: change of b (2, 6).
        wrench_rate: change of the contact wrenches if no row were held (2, 6 nc).
        torque_rate: change of the torques, likewise (2, n + 1).
        size: rows in all.
    """

    lost: int
    N: int
    B: int
    P: int
    torque_response: int
    twist_response: int
    pressing: int
    shift: int
    scale: int
    twist: int
    moved: int
    gravity_rate: int
    screw_rate: int
    load_rate: int
    wrench_rate: int
    torque_rate: int
    size: int


def limit_offsets(layout: RobotLayout, offset: Offsets) -> LimitOffsets:
    """Lay the blocks out behind the others."""
    nc, ns, r = len(layout.feet.body), len(layout.feet.support), layout.feet.unknowns
    bodies = len(layout.tree.parent)
    sizes = {
        "lost": 1,
        "N": 6 * nc * r,
        "B": ns * r,
        "P": r * r,
        "torque_response": ns * r,
        "twist_response": 3 * r,
        "pressing": ns,
        "shift": r,
        "scale": ns,
        "twist": 6 * bodies,
        "moved": 3 * bodies,
        "gravity_rate": 2 * bodies,
        "screw_rate": 12 * ns,
        "load_rate": 12,
        "wrench_rate": 12 * nc,
        "torque_rate": 2 * bodies,
    }
    starts, end = {}, offset.size
    for name, size in sizes.items():
        starts[name], end = end, end + size
    return LimitOffsets(**starts, size=end)
