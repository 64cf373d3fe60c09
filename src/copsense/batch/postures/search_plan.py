"""Search plan: a chart's coordinates as the flat arrays that its kernel reads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from copsense.batch.layout import RobotLayout
from copsense.batch.machine_code import writeable
from copsense.batch.postures.coordinates import Coordinates
from copsense.batch.workspace import Offsets
from copsense.stance import Stance


class SearchPlan(NamedTuple):
    """A chart's coordinates as flat arrays; see `Coordinates`.

    Attributes:
        given: the stance's numbers.
        place: which of them each coordinate sets (k,).
        com_axis: axes of the CoM that are named.
        turned: 1 where the base's orientation may differ from the stance's.
        quaternion: the stance's (4,).
        position: origin of each contact (nc, 3).
        axes: its axes, three columns (nc, 9).
        slope: of its plane (nc, 2).
        contact: the contacts, limb by limb (nc,).
        contact_first: first of each limb's, and the end.
        unknown: the unknowns, limb by limb.
        unknown_first: first of each limb's, and the end.
        carries: whether a joint (1 ... n) moves a contact (n + 1, nc).
        low: lower limit of each joint (n,).
        high: upper limit (n,).
    """

    given: np.ndarray
    place: np.ndarray
    com_axis: np.ndarray
    turned: int
    quaternion: np.ndarray
    position: np.ndarray
    axes: np.ndarray
    slope: np.ndarray
    contact: np.ndarray
    contact_first: np.ndarray
    unknown: np.ndarray
    unknown_first: np.ndarray
    carries: np.ndarray
    low: np.ndarray
    high: np.ndarray


class SearchOffsets(NamedTuple):
    """First row of each block that the search adds to a workspace.

    Attributes:
        given: the given numbers.
        turn: axes about which roll, pitch and yaw turn the base (3, 3).
        error: h of every contact, limb by limb, then of the CoM.
        worst: the largest of them.
        going: above zero where the lane is not done.
        posture: number of the posture in the lane; -1 where there is none.
        steps: taken for it, from where it was begun last.
        spent: taken before that, in vain.
        nearby: above zero where it was begun between known postures.
        before: the largest error some steps ago.
        J: by rows.
        M: J J' + mu 1, then its Cholesky factor, by rows.
        multiplier: of each row.
        step: of each unknown.
        size: rows in all.
    """

    given: int
    turn: int
    error: int
    worst: int
    going: int
    posture: int
    steps: int
    spent: int
    nearby: int
    before: int
    J: int
    M: int
    multiplier: int
    step: int
    size: int


def plan_search(
    stance: Stance, layout: RobotLayout, offset: Offsets, coordinates: Coordinates
) -> tuple[SearchPlan, SearchOffsets]:
    """The arrays, and where the search's numbers stand in a workspace."""
    limbs, feet = coordinates.limbs, layout.feet
    n, nc = len(layout.tree.parent) - 1, len(stance.contacts)
    carries = np.zeros((n + 1, nc), dtype=np.int64)
    carries[feet.support] = feet.member[feet.group]
    plan = SearchPlan(
        coordinates.given,
        coordinates.place,
        np.array(coordinates.com_axes, dtype=np.int64),
        int(coordinates.turned),
        stance.q[3:7],
        coordinates.positions,
        coordinates.rotations.transpose(0, 2, 1).reshape(nc, 9),
        coordinates.slopes,
        np.array([k for limb in limbs for k in limb.contacts], dtype=np.int64),
        np.cumsum([0] + [len(limb.contacts) for limb in limbs]).astype(np.int64),
        np.array([u for limb in limbs for u in limb.unknowns], dtype=np.int64),
        np.cumsum([0] + [len(limb.unknowns) for limb in limbs]).astype(np.int64),
        carries,
        coordinates.low,
        coordinates.high,
    )
    m, most = (
        len(stance.component_index) + len(coordinates.com_axes),
        max(len(limb.unknowns) for limb in limbs),
    )
    sizes = {
        "given": len(coordinates.given),
        "turn": 9,
        "error": m,
        "worst": 1,
        "going": 1,
        "posture": 1,
        "steps": 1,
        "spent": 1,
        "nearby": 1,
        "before": 1,
        "J": m * most,
        "M": m * m,
        "multiplier": m,
        "step": most,
    }
    starts, end = {}, offset.size
    for name, size in sizes.items():
        starts[name], end = end, end + size
    return writeable(plan), SearchOffsets(**starts, size=end)
