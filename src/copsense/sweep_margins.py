"""Margins of a sweep: how far its wrenches and torques are from limits, without its robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact, Kind
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import Limits, check_limits, rows_of
from copsense.margins import UNITS, MarginTable
from copsense.polygon import unpadded

if TYPE_CHECKING:
    import xarray as xr


def with_limit_margins(dataset: xr.Dataset, limits: Limits) -> xr.Dataset:
    """A sweep with the margin of every contact and joint to every kind of limit.

    Args:
        dataset: a sweep, as evaluated or as read back from netCDF.
        limits: what to measure to; the sweep need not have been evaluated within them.

    Returns:
        The dataset with ``limit_margin`` (posture, criterion, limit), negative beyond the limit,
        and ``limit_kind`` and ``limit_unit`` of each. NaN where a row failed, and to the sole's
        edge where a contact pulls and has no centre of pressure.

    Raises:
        InvalidInputError: a limit needs what the contacts do not have, or the sweep did not record.
        UnknownNameError: a torque limit names no joint.
    """
    check_limits(limits)
    contacts = _contacts(dataset)
    rows = rows_of(contacts, limits, *_torque_limits(dataset, limits))
    table = MarginTable(contacts, rows)
    # Wrenches (.., nc, 6) to stacked forces (.., m).
    wrench = dataset["wrench"].values
    forces = np.concatenate(
        [wrench[..., k, list(c.components)] for k, c in enumerate(contacts)], axis=-1
    )
    margins = table.group_margins(forces, dataset["torque"].values)
    margins[dataset["reason"].values != ""] = np.nan
    kinds = [table.kinds[group[0]] for group in table.groups]
    names = [f"{table.where[g[0]]}: {k}" for g, k in zip(table.groups, kinds, strict=True)]
    meaning = "signed distance to the limit, negative beyond; unit: limit_unit"
    return dataset.drop_vars(
        ["limit", "limit_margin", "limit_kind", "limit_unit"], errors="ignore"
    ).assign(
        limit_margin=(("posture", "criterion", "limit"), margins, {"long_name": meaning}),
        limit_kind=("limit", np.array(kinds, dtype=str), {"long_name": "what is limited"}),
        limit_unit=("limit", [UNITS.get(kind, "N") for kind in kinds], {"long_name": "unit"}),
        limit=("limit", np.array(names, dtype=str), {"long_name": "contact or joint, and kind"}),
    )


def _contacts(dataset: xr.Dataset) -> tuple[Contact, ...]:
    """The contacts that a sweep recorded."""
    names = [str(name) for name in dataset["contact"].values]
    kinds = str(dataset.attrs["contact_kinds"]).split(", ")
    found = []
    for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
        sole = unpadded(dataset["sole_polygon"].values[k]) if "sole_polygon" in dataset else None
        found.append(
            Contact(
                name,
                cast(Kind, kind),
                polygon=sole.vertices if sole else None,
                friction=_given(dataset, "friction", k),
                torsional_friction=_given(dataset, "torsional_friction", k),
            )
        )
    return tuple(found)


def _given(dataset: xr.Dataset, name: str, contact: int) -> float | None:
    value = float(dataset[name].values[contact]) if name in dataset else np.nan
    return None if np.isnan(value) else value


def _torque_limits(
    dataset: xr.Dataset, limits: Limits
) -> tuple[Float[np.ndarray, " n"], tuple[str, ...]]:
    """The limit of each joint's torque [Nm], infinite where there is none; and the joints."""
    joints = tuple(str(name) for name in dataset["joint"].values)
    given: Any = limits.torque
    if given is None:
        return np.full(len(joints), np.inf), joints
    if isinstance(given, str):
        if "torque_limit" not in dataset:
            raise InvalidInputError(
                "the sweep has no record of the model's torque limits: an earlier version wrote "
                "it. Sweep again, or give a number [Nm]."
            )
        model = dataset["torque_limit"].values
        return np.where(np.isnan(model), np.inf, model), joints
    if isinstance(given, Mapping):
        for joint in given:
            if joint not in joints:
                raise UnknownNameError("joint in the torque limits", joint, joints)
        return np.array([float(given.get(joint, np.inf)) for joint in joints]), joints
    return np.full(len(joints), float(given)), joints
