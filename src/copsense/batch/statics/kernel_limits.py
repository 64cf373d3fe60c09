"""Kernel limits: the rows of limits as the flat arrays that the limited kernel reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from copsense.batch.workspace import WIDTH
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.margins import MarginTable
from copsense.stance import Stance


class KernelLimits(NamedTuple):
    """Rows of limits: those of the contacts, c . w <= bound, and |tau_i| <= limit.

    A contact's rows stand together, in the order of `LimitRows`, and so do those of a group of
    margins. A group begins at a multiple of `WIDTH`, and its last row is repeated up to the next.

    Attributes:
        coefficient: c over the contact's wrench, by components (6, rc).
        bound: of each row (rc,).
        inverse: 1 / |c| (rc,); 1 for a row that is zero.
        short: the same, at most 1 (rc,).
        first: first row of each contact, and the end (nc + 1,).
        group_first: first group of margins of each contact, and the end (nc + 1,).
        group_rows: first row of each of these groups, and the end.
        cop: 1 for a group of a centre of pressure, whose margin is a length.
        public: a row's place in `LimitRows.all_names` (rc,); -1 where it is repeated.
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
    public: np.ndarray
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
    groups = [members for members in table.groups if members[0] < rc]
    filled = [np.pad(g, (0, -len(g) % WIDTH), mode="edge") for g in groups]
    public = np.concatenate([np.zeros(0, dtype=np.int64), *filled])
    once = np.append(-1, public[:-1]) != public
    ends = np.cumsum([0] + [len(g) for g in filled])
    owners = [contacts[g[0]] for g in groups]
    coefficient, bound = coefficient[:, public].copy(), np.array(rows.bound, dtype=float)[public]
    length = np.linalg.norm(coefficient, axis=0)
    inverse = 1.0 / np.where(length > 0, length, 1.0)
    row, torque_group = np.full(n + 1, -1, dtype=np.int64), np.full(n + 1, -1, dtype=np.int64)
    for pair, joint in enumerate(rows.joint[::2]):
        row[joint + 1] = rc + 2 * pair
        torque_group[joint + 1] = len(groups) + pair
    group_first = np.searchsorted(owners, np.arange(nc + 1)).astype(np.int64)
    return KernelLimits(
        coefficient,
        bound,
        inverse,
        np.minimum(inverse, 1.0),
        ends[group_first].astype(np.int64),
        group_first,
        ends.astype(np.int64),
        np.array([rows.kinds[g[0]] == "cop" for g in groups], dtype=np.uint8),
        np.where(once, public, -1),
        np.append(np.inf, rows.torque),
        row,
        torque_group,
    )
