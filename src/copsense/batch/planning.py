"""Planning: a chart's coordinates as the flat arrays that its kernel reads."""

from __future__ import annotations

import numpy as np

from copsense.batch.coordinates import Coordinates
from copsense.batch.layout import Layout
from copsense.batch.newton import Plan, Search
from copsense.batch.rows import Rows
from copsense.stance import Stance


def plan_search(
    stance: Stance, layout: Layout, rows: Rows, coordinates: Coordinates
) -> tuple[Plan, Search]:
    """The arrays, and where the search's numbers stand in a workspace."""
    limbs, feet = coordinates.limbs, layout.feet
    n, nc = len(layout.tree.parent) - 1, len(stance.contacts)
    carries = np.zeros((n + 1, nc), dtype=np.int64)
    carries[feet.support] = feet.member[feet.group]
    plan = Plan(
        coordinates.given,
        coordinates.place,
        np.array(coordinates.com_axes, dtype=np.int64),
        int(coordinates.turned),
        np.array(stance.q[3:7]),
        coordinates.positions,
        np.ascontiguousarray(coordinates.rotations.transpose(0, 2, 1).reshape(nc, 9)),
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
        "J": m * most,
        "M": m * m,
        "multiplier": m,
        "step": most,
    }
    starts, end = {}, rows.size
    for name, size in sizes.items():
        starts[name], end = end, end + size
    return plan, Search(**starts, size=end)
