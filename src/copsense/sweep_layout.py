"""The dataset of a sweep: its variables, their dimensions and units, and what they are."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float

from copsense._version import __version__
from copsense.contact import COMPONENT_NAMES
from copsense.ground import CONVENTIONS, ground_variables
from copsense.limits import torque_limits
from copsense.path import PosturePath
from copsense.stance import Stance

if TYPE_CHECKING:
    import xarray as xr

# name -> (dimensions after posture and criterion, unit, what it is)
PER_CRITERION: dict[str, tuple[tuple[str, ...], str, str]] = {
    "cop": (("contact", "axis"), "m", "centre of pressure, contact axes"),
    "wrench": (
        ("contact", "component"),
        "N, N m",
        "wrench of the environment on the robot about the contact frame's origin, contact axes",
    ),
    "torque": (("joint",), "N m", "joint torque (force for a prismatic joint)"),
    "cop_sensitivity": (
        ("contact", "axis", "velocity"),
        "m/rad, m/m",
        "gradient of the centre of pressure over velocities, projected on the admissible motions",
    ),
    "cop_slope": (
        ("contact", "axis"),
        "m per unit of the path's coordinate",
        "derivative of the centre of pressure along the path",
    ),
    "cop_gain": (
        ("contact", "axis", "com_direction"),
        "1",
        "centre of pressure (contact axes) per centre of mass (world x, y)",
    ),
    "worst_case_gain": (("contact",), "1", "largest gain over motions of equal kinetic energy"),
    "com_travel": (
        ("contact",),
        "m",
        "first-order distance the centre of mass may move before the contact tips",
    ),
    "unloading_travel": (
        ("contact",),
        "m",
        "first-order distance the centre of mass may move before the contact carries no load",
    ),
    "margin": (
        ("contact",),
        "m",
        "signed distance of the centre of pressure to the sole's nearest edge, positive inside",
    ),
    "residual": ((), "N, N m", "largest imbalance, recomputed by inverse dynamics"),
}


class SweepRows:
    """The rows of a sweep while it is computed: NaN and no reason until they are set.

    Args:
        stance: robot and contacts.
        postures: how many.
        criteria: their names.
    """

    def __init__(self, stance: Stance, postures: int, criteria: Sequence[str]) -> None:
        """Make every row empty."""
        shape, sizes = (postures, len(criteria)), _sizes(stance)
        self.criteria: list[str] = list(criteria)
        self.values: dict[str, Float[np.ndarray, "p c ..."]] = {
            name: np.full(shape + tuple(sizes[d] for d in dims), np.nan)
            for name, (dims, _, _) in PER_CRITERION.items()
        }
        self.side: np.ndarray = np.full((*shape, sizes["contact"]), "", dtype=object)
        self.pulling: Bool[np.ndarray, "p c nc"] = np.zeros((*shape, sizes["contact"]), dtype=bool)
        self.reason: np.ndarray = np.full(shape, "", dtype=object)
        self.active: np.ndarray = np.full(shape, "", dtype=object)
        self.change_travel: Float[np.ndarray, "p c"] = np.full(shape, np.nan)
        self.change_limit: np.ndarray = np.full(shape, "", dtype=object)


def with_changes(dataset: xr.Dataset, rows: SweepRows) -> xr.Dataset:
    """A sweep's dataset within limits with those that are active, and their nearest change."""
    first = ("posture", "criterion")
    found: dict[str, Any] = {
        "active_limits": (
            first,
            rows.active.astype(str),
            {"long_name": "limits that hold with equality, the hardest pressed first"},
        ),
        "change_travel": (
            first,
            rows.change_travel,
            {
                "units": "m",
                "long_name": "first-order distance the centre of mass may move, whichever way, "
                "before a limit begins or ceases to press; infinite where none will, NaN where a "
                "tie-break alone presses",
            },
        ),
        "change_limit": (
            first,
            rows.change_limit.astype(str),
            {"long_name": "the limit that does; empty for none"},
        ),
    }
    return dataset.assign(found)


def sweep_dataset(path: PosturePath, rows: SweepRows, attributes: Mapping[str, str]) -> xr.Dataset:
    """Lay a sweep out.

    Args:
        path: the postures.
        rows: what was computed at them.
        attributes: what made the numbers.
    """
    import xarray as xr

    stance = path.stances[0]
    first = ("posture", "criterion")
    data: dict[str, Any] = {
        name: ((*first, *dims), rows.values[name], {"units": unit, "long_name": meaning})
        for name, (dims, unit, meaning) in PER_CRITERION.items()
    }
    data["margin_side"] = (
        (*first, "contact"),
        rows.side.astype(str),
        {"long_name": "side of the edge"},
    )
    data["pulling"] = (
        (*first, "contact"),
        rows.pulling,
        {"long_name": "the contact would have to pull"},
    )
    data["reason"] = (
        first,
        rows.reason.astype(str),
        {"long_name": "why the row failed; empty if not"},
    )
    data |= _of_postures(path)
    data |= ground_variables(stance)
    data |= _of_the_robot(stance)
    coordinates: dict[str, Any] = {
        "posture": np.arange(len(path)),
        "criterion": rows.criteria,
        "contact": list(stance.contact_names),
        "axis": ["x", "y"],
        "com_axis": ["x", "y", "z"],
        "contact_axis": ["x", "y", "z"],
        "com_direction": ["x", "y"],
        "component": list(COMPONENT_NAMES),
        "joint": list(stance.robot.torque_names),
        "velocity": list(stance.robot.velocity_names),
    }
    taken = {*data, *coordinates, *(d for dims, *_ in data.values() for d in dims)}
    coordinate = variable_name(path.coordinate, taken)
    if _dof_dimension(stance) == "dof":
        coordinates["dof"] = list(stance.robot.dof_names)
    coordinates[coordinate] = (
        "posture",
        path.values,
        {"units": path.unit, "long_name": f"{path.coordinate}, the coordinate of the path"},
    )
    return xr.Dataset(
        data,
        coordinates,
        {
            "title": f"Static centre-of-pressure sensitivity of {stance.robot.name}",
            "source": f"copsense {__version__}",
            "robot": stance.robot.name,
            "mass": stance.robot.mass,
            "weight": stance.robot.weight,
            "coordinate": coordinate,
            "contact_frames": ", ".join(c.frame for c in stance.contacts),
            "contact_kinds": ", ".join(c.kind for c in stance.contacts),
            "without_sole": ", ".join(
                c.name for c in stance.contacts if c.kind != "point" and c.sole is None
            ),
            **attributes,
            "conventions": CONVENTIONS,
        },
    )


def variable_name(name: str, taken: set[str]) -> str:
    """A name that netCDF allows and no other variable has: a joint may be called anything."""
    plain = re.sub(r"[^\w.-]", "_", name)
    if not (plain[0].isalnum() or plain[0] == "_"):
        plain = f"_{plain}"
    while plain in taken:
        plain += "_"
    return plain


def _dof_dimension(stance: Stance) -> str:
    """The dimension of the joints' degrees of freedom: that of the torques, if all have motors."""
    return "joint" if stance.robot.dof_names == stance.robot.torque_names else "dof"


def _sizes(stance: Stance) -> dict[str, int]:
    return {
        "contact": len(stance.contacts),
        "axis": 2,
        "component": 6,
        "joint": len(stance.robot.torque_names),
        "velocity": stance.robot.model.nv,
        "com_direction": 2,
    }


def _of_postures(path: PosturePath) -> dict[str, Any]:
    """What does not depend on the criterion; NaN at a posture that was not reached."""
    found = {
        "com": (
            "com_axis",
            np.array([s.com for s in path.stances]),
            {"units": "m", "long_name": "centre of mass, world axes"},
        ),
        "configuration": (
            "configuration_index",
            np.array([s.q for s in path.stances]),
            {"long_name": "base position, quaternion (x, y, z, w), joints", "units": "m, 1, rad"},
        ),
        "tangent": (
            "velocity",
            np.array(path.tangents),
            {"long_name": f"d configuration / d {path.coordinate}, base in its own frame"},
        ),
        "joint_limit_excess": (
            _dof_dimension(path.stances[0]),
            np.array([s.joint_limit_excess for s in path.stances]),
            {"units": "rad, m", "long_name": "how far the joint is beyond the model's limits"},
        ),
    }
    for _, values, _ in found.values():
        values[list(path.failures)] = np.nan
    return {
        name: (("posture", dim), values, attributes)
        for name, (dim, values, attributes) in found.items()
    }


def _of_the_robot(stance: Stance) -> dict[str, Any]:
    """Friction of the contacts and effort limits of the joints."""
    found: dict[str, Any] = {}
    for name, of_contacts, unit, meaning in (
        ("friction", [c.friction for c in stance.contacts], "1", "Coulomb coefficient"),
        ("torsional_friction", [c.torsional_friction for c in stance.contacts], "m", "torsional"),
    ):
        found[name] = (
            "contact",
            np.array(of_contacts, dtype=float),
            {"units": unit, "long_name": f"{meaning} of the contact; NaN where it gives none"},
        )
    torque = torque_limits(stance, "model")
    found["torque_limit"] = (
        "joint",
        np.where(np.isfinite(torque), torque, np.nan),
        {"units": "N m", "long_name": "effort limit of the model; NaN where it has none"},
    )
    return found
