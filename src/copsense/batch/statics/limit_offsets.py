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
    size: int


def limit_offsets(layout: RobotLayout, offset: Offsets) -> LimitOffsets:
    """Lay the blocks out behind the others."""
    nc, ns, r = len(layout.feet.body), len(layout.feet.support), layout.feet.unknowns
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
    }
    starts, end = {}, offset.size
    for name, size in sizes.items():
        starts[name], end = end, end + size
    return LimitOffsets(**starts, size=end)
