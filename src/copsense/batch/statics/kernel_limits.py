"""Kernel limits: the rows of limits as the flat arrays that the limited kernel reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from copsense.limits import LimitRows, Limits, limit_rows
from copsense.margins import MarginTable
from copsense.stance import Stance


class KernelLimits(NamedTuple):
    """Rows of limits: those of the contacts, c . w <= bound, and |tau_i| <= limit.

    A contact's rows stand together, in the order of `LimitRows`.

    Attributes:
        coefficient: c over the contact's wrench, by components (6, rc).
        bound: of each row (rc,).
        inverse: 1 / |c| (rc,); 1 for a row that is zero.
        short: the same, at most 1 (rc,).
        first: first row of each contact, and the end (nc + 1,).
        group_first: first group of margins of each contact, and the end (nc + 1,).
        group_rows: first row of each of these groups, and the end.
        cop: 1 for a group of a centre of pressure, whose margin is a length.
        torque: limit of each joint's torque; the first is the base's; infinite where there is none
            (n + 1,).
        row: the first of a joint's two rows in `LimitRows.all_names` (n + 1,); -1 without.
        torque_group: of margins that a joint's rows belong to (n + 1,); -1 without.
    """

    coefficient: np.ndarray
    bound: np.ndarray
    inverse: np.ndarray
    short: np.ndarray
    first: np.ndarray
    group_first: np.ndarray
    group_rows: np.ndarray
    cop: np.ndarray
    torque: np.ndarray
    row: np.ndarray
    torque_group: np.ndarray


def kernel_limits(stance: Stance, limits: Limits) -> KernelLimits:
    """The rows of limits of a robot on its contacts."""
    rows: LimitRows = limit_rows(stance, limits)
    table = MarginTable(stance.contacts, rows)
    rc, nc, n = len(rows.bound), len(stance.contacts), len(rows.torque)
    # Over all six components of each contact; a point's moments have no row.
    coefficient, start = np.zeros((6, rc)), 0
    contacts = np.array(rows.contacts, dtype=np.int64)
    for k, contact in enumerate(stance.contacts):
        own = contacts == k
        for component in contact.components:
            coefficient[component, own] = rows.matrix[own, start]
            start += 1
    length = np.linalg.norm(coefficient, axis=0)
    inverse = 1.0 / np.where(length > 0, length, 1.0)
    # Rows of one kind stand together, so that a group of them is a stretch.
    starts = [int(members[0]) for members in table.groups if members[0] < rc]
    owners = [contacts[i] for i in starts]
    row, torque_group = np.full(n + 1, -1, dtype=np.int64), np.full(n + 1, -1, dtype=np.int64)
    for pair, joint in enumerate(rows.joint[::2]):
        row[joint + 1] = rc + 2 * pair
        torque_group[joint + 1] = len(starts) + pair
    return KernelLimits(
        coefficient,
        np.array(rows.bound, dtype=float),
        inverse,
        np.minimum(inverse, 1.0),
        np.searchsorted(contacts, np.arange(nc + 1)).astype(np.int64),
        np.searchsorted(owners, np.arange(nc + 1)).astype(np.int64),
        np.array([*starts, rc], dtype=np.int64),
        np.array([rows.kinds[i] == "cop" for i in starts], dtype=np.uint8),
        np.append(np.inf, rows.torque),
        row,
        torque_group,
    )
