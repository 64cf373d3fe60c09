"""Effects and sweeps of hardware as labelled datasets, tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from copsense.extras import require
from copsense.files import check_output, write_beside
from copsense.hardware.altered_travel import ChangedTravel
from copsense.hardware.travel_end import SIDES
from copsense.labelled import write_netcdf
from copsense.provenance import made_by

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from copsense.hardware.effects import HardwareEffects
    from copsense.hardware.value_sweep import HardwareSweep

_SIDES = (*SIDES, "smallest")


def effect_dataset(effects: HardwareEffects) -> xr.Dataset:
    """What each parameter makes of the travel, over parameter and side.

    Travels of checks are not there (NaN) where none was made, or where the robot cannot stand;
    `check_reason` says why.
    """
    require("xarray", "a dataset")
    import xarray as xr

    parameters, order = effects.parameters, [i for o in effects.ranking.values() for i in o]
    names = [parameters[i].name for i in order]
    units, slopes = effects.units, effects.slopes
    checks = [effects.checks.get(name, ()) for name in names]
    over, both = ("parameter", "side"), ("parameter", "change", "side")
    m, per = {"units": "m"}, {"units": "m per unit of the parameter"}
    travels = [*(end.travel for end in effects.ends), effects.smallest]
    data = {
        "travel": ("side", travels, m),
        "limit": ("side", [*(end.limit or "" for end in effects.ends), ""]),
        "nominal": ("parameter", [parameters[i].nominal for i in order]),
        "size": ("parameter", [parameters[i].size for i in order]),
        "better": ("parameter", [effects.better[i] for i in order]),
        "per_unit_more": (over, slopes[order, :, 0], per),
        "per_unit_less": (over, slopes[order, :, 1], per),
        "compared_by": ("parameter", units[order]),
        "gain_more": (over, effects.gains(units)[order], m),
        "gain_less": (over, effects.gains(-units)[order], m),
        "check_value": (("parameter", "change"), _pairs(checks, lambda each: each.value)),
        "check_travel": (both, _pairs(checks, _three, 3), m),
        "check_reason": (
            ("parameter", "change"),
            np.array([[each.reason for each in pair] or ["", ""] for pair in checks], dtype=object),
        ),
    }
    labels = {
        "parameter": names,
        "side": list(_SIDES),
        "change": ["less", "more"],
        "group": ("parameter", [parameters[i].group for i in order]),
        "unit": ("parameter", [parameters[i].unit for i in order]),
        "changes": ("parameter", [", ".join(parameters[i].where) for i in order]),
    }
    return xr.Dataset(data, labels, _attributes(effects) | {"step": effects.step})


def sweep_dataset(sweep: HardwareSweep) -> xr.Dataset:
    """The travels of a sweep over value and side, NaN with a `reason` where it cannot stand."""
    require("xarray", "a dataset")
    import xarray as xr

    p = sweep.parameter
    travel = np.array([_three(point) for point in sweep.points])
    limits = [[end.limit or "" for end in point.ends] or ["", ""] for point in sweep.points]
    data = {
        "travel": (("value", "side"), travel, {"units": "m"}),
        "limit": (("value", "way"), np.array(limits, dtype=object)),
        "reason": ("value", np.array([point.reason for point in sweep.points], dtype=object)),
    }
    labels = {
        "value": ("value", sweep.values, {"units": p.unit, "long_name": p.name}),
        "side": list(_SIDES),
        "way": list(SIDES),
    }
    more = {"parameter": p.name, "nominal": p.nominal, "changes": ", ".join(p.where)}
    return xr.Dataset(data, labels, _attributes(sweep.nominal) | more)


def effect_frame(effects: HardwareEffects) -> pd.DataFrame:
    """A row for each parameter, the best of each group first, with its units in the headings."""
    require("pandas", "a table")
    import pandas as pd

    more, less = effects.gains(effects.units), effects.gains(-effects.units)
    rows = []
    for group, order in effects.ranking.items():
        for rank, i in enumerate(order, start=1):
            p = effects.parameters[i]
            row: dict[str, Any] = {
                "parameter": p.name,
                "group": group,
                "rank": rank,
                "changes": ", ".join(p.where),
                "nominal": p.nominal,
                "unit": p.unit,
                "compared_by": float(effects.units[i]),
                "better": effects.better[i],
            }
            for k, side in enumerate(_SIDES):
                row[f"slope_more_{side}"] = float(effects.slopes[i, k, 0])
                row[f"slope_less_{side}"] = float(effects.slopes[i, k, 1])
                row[f"gain_more_{side}_m"] = float(more[i, k])
                row[f"gain_less_{side}_m"] = float(less[i, k])
            for way, each in zip(("less", "more"), effects.checks.get(p.name, ()), strict=False):
                row[f"check_{way}_value"] = each.value
                row[f"check_{way}_travel_m"] = each.smallest
                row[f"check_{way}_reason"] = each.reason
            rows.append(row)
    return pd.DataFrame(rows)


def sweep_frame(sweep: HardwareSweep) -> pd.DataFrame:
    """A row for each value."""
    require("pandas", "a table")
    import pandas as pd

    rows = []
    for point in sweep.points:
        row: dict[str, Any] = {
            "parameter": sweep.parameter.name,
            "value": point.value,
            "unit": sweep.parameter.unit,
        }
        limits = {end.side: end.limit or "" for end in point.ends}
        for side, travel in point.travels.items():
            row[f"travel_{side}_m"] = travel
            row[f"limit_{side}"] = limits.get(side, "")
        row["smallest_m"] = point.smallest
        row["reason"] = point.reason
        rows.append(row)
    return pd.DataFrame(rows)


def save_data(
    found: HardwareEffects | HardwareSweep, path: str | Path, *, overwrite: bool = False
) -> Path:
    """Write netCDF (``.nc``) or the table (``.csv``), whole or not at all."""
    where = check_output(path, suffixes=(".nc", ".csv"), overwrite=overwrite)
    if where.suffix == ".nc":
        dataset = found.to_xarray()
        write_beside(where, lambda temporary: write_netcdf(dataset, temporary))
    else:
        table = found.to_pandas()
        write_beside(where, lambda temporary: table.to_csv(temporary, index=False))
    return where


def _attributes(effects: HardwareEffects) -> dict[str, Any]:
    return made_by(effects.stance, [effects.criterion], effects.limits)


def _three(point: ChangedTravel) -> list[float]:
    """Travels to both sides and the smallest, NaN where there is none."""
    values = [*point.travels.values(), point.smallest]
    return [np.nan if value is None else float(value) for value in values]


def _pairs(checks: Any, value: Any, width: int = 0) -> np.ndarray:
    """A number or several of each check, NaN where none was made."""
    none = np.full(width, np.nan).tolist() if width else np.nan
    return np.array([[value(each) for each in pair] or [none, none] for pair in checks])
