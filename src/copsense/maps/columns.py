"""Columns: what a map stores for each posture, its dimensions, units and meaning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from copsense.batch import PostureChart
from copsense.batch.statics.limit_states import LIMIT_STATES
from copsense.limits import limit_rows
from copsense.maps.map_plan import MapPlan
from copsense.margins import MarginTable, margin_table
from copsense.sweep_layout import variable_name

EVALUATED, UNREACHABLE, REJECTED, INFEASIBLE, UNSOLVED = range(5)
# How a posture was evaluated under a criterion, by its code in the column `status`.
STATUS = ("evaluated", "unreachable", "rejected", "infeasible", "unsolved")
PENDING = 255  # not visited yet

Chunk = dict[str, np.ndarray]  # columns of a stretch of postures, by name

_EACH = ("posture", "criterion")


@dataclass(frozen=True)
class Column:
    """An array of the store.

    Attributes:
        dims: its dimensions.
        dtype: as NumPy names it, or ``"str"``.
        units: of its numbers; empty where it has none.
        meaning: in words.
    """

    dims: tuple[str, ...]
    dtype: str
    units: str
    meaning: str


_COLUMNS = {
    "status": Column(_EACH, "uint8", "", "how the posture was evaluated; see flag_meanings"),
    "reason": Column(_EACH, "str", "", "why it was not evaluated; empty if it was"),
    "least_com_travel": Column(
        _EACH,
        "float32",
        "m",
        "first-order distance the centre of mass may move before the first contact tips or "
        "unloads; negative where a centre of pressure is off its sole or a contact pulls",
    ),
    "largest_com_gain": Column(
        _EACH,
        "float32",
        "1",
        "largest singular value, over the contacts, of d CoP / d CoM",
    ),
    "com_travel": Column(
        (*_EACH, "contact"),
        "float32",
        "m",
        "first-order distance the centre of mass may move before the contact tips",
    ),
    "unloading_travel": Column(
        (*_EACH, "contact"),
        "float32",
        "m",
        "first-order distance the centre of mass may move before the contact carries no load",
    ),
    "tipping_edge": Column(
        (*_EACH, "contact"),
        "int16",
        "",
        "index of the sole's edge that com_travel goes to; -1 where it goes to none",
    ),
    "com_gain": Column(
        (*_EACH, "contact", "axis", "com_direction"),
        "float32",
        "1",
        "centre of pressure (contact axes) per centre of mass (world x, y)",
    ),
    "cop": Column((*_EACH, "contact", "axis"), "float32", "m", "centre of pressure, contact axes"),
    "margin": Column(
        (*_EACH, "contact"),
        "float32",
        "m",
        "signed distance of the centre of pressure to the sole's nearest edge, positive inside",
    ),
    "load_share": Column((*_EACH, "contact"), "float32", "1", "normal force over the weight"),
    "com": Column(("posture", "com_axis"), "float32", "m", "centre of mass, world axes"),
}
_LIMIT_MARGIN = Column(
    (*_EACH, "limit"),
    "float32",
    "m (cop), N m (torque, torsion), N (others)",
    "smallest distance of the criterion's own wrenches to the limits of each kind; negative where "
    "they break the limits",
)
STATE_WITHIN = "state_within"
CHANGE_TRAVEL, CHANGE_LIMIT = "change_travel", "change_limit"
_WITHIN = {
    "limit_margin": _LIMIT_MARGIN,
    STATE_WITHIN: Column(
        _EACH,
        "uint8",
        "",
        "how the posture stands to its limits; see flag_meanings. Unloaded: the wrenches within "
        "them leave a contact without load, which has no centre of pressure. Unanswered: see "
        "status and reason",
    ),
    "active_limits": Column(
        _EACH,
        "int16",
        "",
        "number of limits that press within the limits; -1 where no wrenches within them are known",
    ),
    CHANGE_TRAVEL: Column(
        _EACH,
        "float32",
        "m",
        "first-order distance the centre of mass may move within the limits, whichever way, before "
        "one begins or ceases to press; infinite where none will, NaN where it is not known",
    ),
    CHANGE_LIMIT: Column(
        _EACH,
        "int32",
        "",
        "index along limit_name of the limit that does; -1 for none",
    ),
    "cop_within": Column(
        (*_EACH, "contact", "axis"), "float32", "m", "centre of pressure within the limits"
    ),
    "com_gain_within": Column(
        (*_EACH, "contact", "axis", "com_direction"),
        "float32",
        "1",
        "d CoP / d CoM within the limits, those that press held",
    ),
}
ROBUST = {
    "likely_com_travel": Column(
        _EACH,
        "float32",
        "m",
        "what errors of the model leave of least_com_travel, all together",
    ),
    "robust_com_travel": Column(
        _EACH,
        "float32",
        "m",
        "what they leave of it where each is off its worst way",
    ),
}
_CONFIGURATION = Column(
    ("posture", "configuration_index"),
    "float64",
    "m, 1, rad",
    "base position, quaternion (x, y, z, w), joints",
)


def coordinate_columns(plan: MapPlan) -> dict[str, Column]:
    """A column for each of the map's coordinates, in their order."""
    chart = PostureChart(plan.stance, plan.sampling.names)
    own = {*_COLUMNS, *_WITHIN, *ROBUST}
    taken = {*own, "configuration", "done", "posture", "criterion", "contact"}
    found: dict[str, Column] = {}
    for name, unit in zip(chart.names, chart.units, strict=True):
        plain = variable_name(name, taken | set(found))
        found[plain] = Column(("posture",), "float64", unit, f"{name}, a coordinate of the map")
    return found


def columns(plan: MapPlan) -> dict[str, Column]:
    """Every column with a value for each posture, the coordinates first."""
    found = coordinate_columns(plan) | _COLUMNS
    if plan.limits is not None:
        found |= _WITHIN
    if plan.sources:
        found |= ROBUST
    if plan.configurations:
        found["configuration"] = _CONFIGURATION
    return found


def labels(plan: MapPlan) -> dict[str, tuple[str, ...]]:
    """Labels along each dimension but the postures'."""
    found = {
        "criterion": tuple(c.name for c in plan.criteria),
        "contact": plan.stance.contact_names,
        "axis": ("x", "y"),
        "com_direction": ("x", "y"),
        "com_axis": ("x", "y", "z"),
    }
    if plan.limits is not None:
        found["limit"] = limit_kinds(margin_table(plan.stance, plan.limits))
        found["limit_name"] = limit_rows(plan.stance, plan.limits).all_names
    if plan.configurations:
        found["configuration_index"] = tuple(map(str, range(plan.stance.robot.model.nq)))
    return found


def limit_kinds(table: MarginTable) -> tuple[str, ...]:
    """The kinds of limits that there are."""
    return tuple(dict.fromkeys(table.kinds))


FLAGS = {"status": STATUS, STATE_WITHIN: LIMIT_STATES}
"""Columns of codes, and what each code says; `PENDING` comes beside these."""


def fill_value(column: Column) -> Any:
    """What an array holds where it is not written."""
    if column.dtype.startswith("int"):
        return -1
    return {"str": "", "uint8": PENDING}.get(column.dtype, np.nan)
