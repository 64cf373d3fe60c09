"""Results as they are drawn: mm and degrees, contact axes turned into the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.labelled import LabelledResult
from copsense.polygon import Polygon, unpadded
from copsense.statics import WrenchPolicy

MM, DEG = 1e3, 180.0 / np.pi
_AXES = {"x": 0, "y": 1}


@dataclass(frozen=True, eq=False)
class Abscissa:
    """What a figure has along its horizontal axis.

    Attributes:
        values: in the unit of the label.
        label: quantity and unit.
    """

    values: Float[np.ndarray, " N"]
    label: str


def abscissa(result: LabelledResult, name: str | None = None) -> Abscissa:
    """The path's coordinate, or another coordinate over postures, in mm or degrees."""
    name = name or str(result.attrs["coordinate"])
    variable = result[name]
    values = np.asarray(variable.values, dtype=float)
    titles = {"com_x": "CoM x", "com_y": "CoM y", "com_z": "CoM z", "index": "posture"}
    title = titles.get(name, name)
    unit = str(variable.attrs.get("units", "1"))
    if unit == "m":
        return Abscissa(values * MM, f"{title} [mm]")
    if unit == "rad":
        return Abscissa(values * DEG, f"{title} [deg]")
    return Abscissa(values, title if unit == "1" else f"{title} [{unit}]")


def labels(result: LabelledResult, dimension: str) -> list[str]:
    """The names along a dimension."""
    return [str(name) for name in np.atleast_1d(result[dimension].values)]


def criterion_name(policy: Criterion | WrenchPolicy) -> str:
    """What a figure calls a criterion or a policy."""
    return policy.name if isinstance(policy, Criterion) else policy.__name__


def world_cops(result: LabelledResult) -> Float[np.ndarray, "N criterion contact 2"]:
    """Horizontal position of each CoP in the world [mm]."""
    axes = result["contact_rotation"].values[:, :2, :2]
    cops = np.einsum("kab,ijkb->ijka", axes, result["cop"].values)
    return np.asarray((contact_origins(result) / MM + cops) * MM)


def contact_origins(result: LabelledResult) -> Float[np.ndarray, "contact 2"]:
    """Horizontal position of each contact frame in the world [mm]."""
    return np.asarray(result["contact_position"].values[:, :2] * MM)


def world_soles(result: LabelledResult) -> list[Float[np.ndarray, "k 2"] | None]:
    """Outline of each sole in the world, seen from above [mm]; None for a contact without one."""
    if "sole_polygon" not in result:
        return [None] * result.sizes["contact"]
    axes = result["contact_rotation"].values[:, :2, :2]
    soles: list[np.ndarray | None] = []
    for k, sole in enumerate(map(unpadded, result["sole_polygon"].values)):
        outline = contact_origins(result)[k] + sole.vertices @ axes[k].T * MM if sole else None
        soles.append(outline)
    return soles


def edges(result: LabelledResult, axis: str) -> list[tuple[float, float] | None]:
    """The two edges of each sole along an axis [mm], level with the middle of its CoPs."""
    cops = world_cops(result)[..., 1 - _AXES[axis]]
    found = []
    for k, sole in enumerate(world_soles(result)):
        here = cops[:, :, k]
        known = here[np.isfinite(here)]
        at = float(np.median(known)) if known.size else float(contact_origins(result)[k, 0])
        found.append(None if sole is None else Polygon.hull(sole).section(axis, at))
    return found


def first_to_go(result: LabelledResult) -> Float[np.ndarray, "N criterion"]:
    """First-order CoM travel to the first contact that tips or unloads [mm]; NaN if none does."""
    both = np.minimum(result["com_travel"].values, result["unloading_travel"].values)
    least = both.min(axis=2) * MM  # a failed row is NaN on every contact
    return np.asarray(np.where(np.isfinite(least), least, np.nan))
