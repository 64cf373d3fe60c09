"""Sweep: many postures and criteria into one labelled dataset; a failure is a row."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from copsense._version import __version__
from copsense.contact import COMPONENT_NAMES
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits, torque_limits
from copsense.path import PosturePath
from copsense.polygon import padded
from copsense.sensitivity import CopSensitivity, cop_sensitivity
from copsense.stance import Stance
from copsense.statics import ConstrainedEquilibrium, WrenchPolicy, policy_name

# name -> (dimensions after posture and criterion, unit, what it is)
_PER_CRITERION: dict[str, tuple[tuple[str, ...], str, str]] = {
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


def sweep(
    path: PosturePath,
    criteria: Sequence[Criterion | WrenchPolicy],
    limits: Limits | None = None,
    *,
    progress: Callable[[int], object] | None = None,
) -> xr.Dataset:
    """Evaluate every criterion at every posture of a path.

    Args:
        path: the postures and their tangents.
        criteria: criteria with distinct names, or laws q -> wrenches (named by their function).
        limits: what the wrenches and torques must respect; None for nothing. The active ones of
            each row are then named in ``active_limits``, separated by semicolons.
        progress: called with 1 after each posture.

    Returns:
        A dataset with dimensions ``posture, criterion, contact, axis, component, joint, velocity,
        com_direction, com_axis, vertex``. Its variables carry unit and meaning in their
        attributes. A row that failed has NaN values and its reason in ``reason``; elsewhere
        ``reason`` is empty.

    Raises:
        InvalidInputError: no criterion, or two of one name.
    """
    if isinstance(criteria, Criterion):
        raise InvalidInputError("criteria is a single criterion. Give a list of them.")
    names = [str(c.name) if isinstance(c, Criterion) else policy_name(c) for c in criteria]
    if not names or len(set(names)) != len(names):
        raise InvalidInputError(
            f"a sweep needs criteria of distinct names, got {', '.join(names) or 'none'}. "
            "Give at least one; Criterion.named(...) renames one."
        )
    stance, shape = path.stances[0], (len(path), len(names))
    sizes = _sizes(stance)
    values = {
        name: np.full(shape + tuple(sizes[d] for d in dims), np.nan)
        for name, (dims, _, _) in _PER_CRITERION.items()
    }
    side = np.full((*shape, sizes["contact"]), "", dtype=object)
    pulling = np.zeros((*shape, sizes["contact"]), dtype=bool)
    reason = np.full(shape, "", dtype=object)
    active = np.full(shape, "", dtype=object)
    for i, here in enumerate(path.stances):
        for j, criterion in enumerate(criteria):
            if i in path.failures:
                reason[i, j] = path.failures[i]
                continue
            try:
                row = cop_sensitivity(here, criterion, limits)
                if isinstance(row.equilibrium, ConstrainedEquilibrium):
                    active[i, j] = "; ".join(limit.name for limit in row.equilibrium.active)
                for name, value in _row(row, path.tangents[i]).items():
                    values[name][i, j] = value
                pulling[i, j] = [c in row.equilibrium.pulling for c in here.contact_names]
                margins = _margins(row)
                values["margin"][i, j] = [m[0] for m in margins]
                side[i, j] = [m[1] for m in margins]
            except CopsenseError as error:
                reason[i, j] = str(error)
        if progress:
            progress(1)
    dataset = _dataset(path, names, values, side, pulling, reason)
    if limits is not None:
        meaning = {"long_name": "limits that hold with equality, the hardest pressed first"}
        dataset["active_limits"] = (("posture", "criterion"), active.astype(str), meaning)
        dataset.attrs["limits"] = repr(limits)
    return dataset


def failed_rows(dataset: xr.Dataset) -> list[tuple[int, str, str]]:
    """Posture, criterion and reason of every failed row of a sweep."""
    reasons = dataset["reason"].values
    names = [str(n) for n in dataset["criterion"].values]
    return [(int(i), names[j], str(reasons[i, j])) for i, j in np.argwhere(reasons != "")]


def _row(row: CopSensitivity, tangent: np.ndarray) -> dict[str, Any]:
    return {
        "cop": row.cop,
        "wrench": row.equilibrium.wrenches,
        "torque": row.equilibrium.torques,
        "cop_sensitivity": row.gradient,
        "cop_slope": row.gradient @ tangent,
        "cop_gain": row.com_gain,
        "worst_case_gain": row.worst_case_gain,
        "com_travel": row.com_travel,
        "unloading_travel": row.unloading_travel,
        "residual": row.equilibrium.residual(),
    }


def _margins(row: CopSensitivity) -> list[tuple[float, str]]:
    """Margin and side of each contact; a contact without a sole has no edge to reach."""
    found = []
    for contact, cop in zip(row.equilibrium.stance.contacts, row.cop, strict=True):
        if contact.sole:
            margin = contact.sole.margin(cop)
            found.append((margin.distance, margin.side))
        else:
            found.append((np.inf, ""))
    return found


def _sizes(stance: Stance) -> dict[str, int]:
    return {
        "contact": len(stance.contacts),
        "axis": 2,
        "component": 6,
        "joint": len(stance.robot.torque_names),
        "velocity": stance.robot.model.nv,
        "com_direction": 2,
    }


def _dataset(
    path: PosturePath,
    names: list[str],
    values: dict[str, np.ndarray],
    side: np.ndarray,
    pulling: np.ndarray,
    reason: np.ndarray,
) -> xr.Dataset:
    stance = path.stances[0]
    first = ("posture", "criterion")
    data: dict[str, Any] = {
        name: ((*first, *dims), values[name], {"units": unit, "long_name": meaning})
        for name, (dims, unit, meaning) in _PER_CRITERION.items()
    }
    data["margin_side"] = ((*first, "contact"), side.astype(str), {"long_name": "side of the edge"})
    data["pulling"] = (
        (*first, "contact"),
        pulling,
        {"long_name": "the contact would have to pull"},
    )
    data["reason"] = (first, reason.astype(str), {"long_name": "why the row failed; empty if not"})
    # A posture that was not reached has no centre of mass, no configuration and no tangent.
    coms = np.array([s.com for s in path.stances])
    configurations = np.array([s.q for s in path.stances])
    tangents = np.array(path.tangents)
    excess = np.array([s.joint_limit_excess for s in path.stances])
    for values_of in (coms, configurations, tangents, excess):
        values_of[list(path.failures)] = np.nan
    data["com"] = (
        ("posture", "com_axis"),
        coms,
        {"units": "m", "long_name": "centre of mass, world axes"},
    )
    data["configuration"] = (
        ("posture", "configuration_index"),
        configurations,
        {"long_name": "base position, quaternion (x, y, z, w), joints", "units": "m, 1, rad"},
    )
    data["tangent"] = (
        ("posture", "velocity"),
        tangents,
        {"long_name": f"d configuration / d {path.coordinate}, base in its own frame"},
    )
    data["joint_limit_excess"] = (
        ("posture", "joint"),
        excess,
        {"units": "rad, m", "long_name": "how far the joint is beyond the model's limits"},
    )
    places = stance.placements
    data["contact_position"] = (
        ("contact", "com_axis"),
        np.array([p.translation for p in places]),
        {"units": "m", "long_name": "origin of the contact frame, world axes"},
    )
    data["contact_rotation"] = (
        ("contact", "com_axis", "contact_axis"),
        np.array([p.rotation for p in places]),
        {"units": "1", "long_name": "columns: contact axes in world axes"},
    )
    for name, values_of_contacts, unit, meaning in (
        ("friction", [c.friction for c in stance.contacts], "1", "Coulomb coefficient"),
        ("torsional_friction", [c.torsional_friction for c in stance.contacts], "m", "torsional"),
    ):
        data[name] = (
            "contact",
            np.array(values_of_contacts, dtype=float),
            {"units": unit, "long_name": f"{meaning} of the contact; NaN where it gives none"},
        )
    torque = torque_limits(stance, "model")
    data["torque_limit"] = (
        "joint",
        np.where(np.isfinite(torque), torque, np.nan),
        {"units": "N m", "long_name": "effort limit of the model; NaN where it has none"},
    )
    soles = [c.sole for c in stance.contacts]
    if any(soles):
        data["sole_polygon"] = (
            ("contact", "vertex", "axis"),
            padded(soles),
            {
                "units": "m",
                "long_name": "vertices of the sole, contact axes, last one repeated; NaN if none",
            },
        )
    coordinates: dict[str, Any] = {
        "posture": np.arange(len(path)),
        "criterion": names,
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
    coordinates[coordinate] = (
        "posture",
        path.values,
        {"units": path.unit, "long_name": f"{path.coordinate}, the coordinate of the path"},
    )
    attributes = {
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
        "conventions": "SI units, radians, world z up; wrenches are what the environment does to "
        "the robot, force first; base velocity in the base's frame",
    }
    return xr.Dataset(data, coordinates, attributes)


def variable_name(name: str, taken: set[str]) -> str:
    """A name that netCDF allows and no other variable has: a joint may be called anything."""
    plain = re.sub(r"[^\w.-]", "_", name)
    if not (plain[0].isalnum() or plain[0] == "_"):
        plain = f"_{plain}"
    while plain in taken:
        plain += "_"
    return plain
