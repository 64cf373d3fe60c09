"""Sway: recordings of Section V's motion in closed loop, as its claims read them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from jaxtyping import Float

from copsense.limits import Limits

_SETTLED = 0.1  # s until the ground carries the weight evenly


@dataclass(frozen=True, eq=False)
class Stretch:
    """A recording while every contact stood, the start left out.

    Attributes:
        time: [s].
        com_y: CoM y from where it began [m].
        load: normal force of each foot as a share of the weight (N, 2), left first.
        cop: CoP y of each foot in its own axes (N, 2) [m].
        static_cop: the same by the static analysis at this CoM [m].
        margin: of each CoP to its sole's edge (N, 2) [m].
    """

    time: Float[np.ndarray, " N"]
    com_y: Float[np.ndarray, " N"]
    load: Float[np.ndarray, "N 2"]
    cop: Float[np.ndarray, "N 2"]
    static_cop: Float[np.ndarray, "N 2"]
    margin: Float[np.ndarray, "N 2"]

    @property
    def slopes(self) -> Float[np.ndarray, "2"]:
        """dCoP/dCoM of each foot, the straight line through its points."""
        return np.asarray(np.polyfit(self.com_y, self.cop, 1)[0])


@dataclass(frozen=True, eq=False)
class Sway:
    """One robot swaying in simulation under criteria 1 and 2.

    Attributes:
        amplitude: of the CoM's sine where nothing limits the wrenches [m].
        limited_amplitude: of the one within limits [m].
        frequency: of both [Hz].
        left: criterion 1, the CoM going to the left first.
        right: criterion 1, to the right first.
        torque: criterion 2.
        limited: criterion's name -> the sway within limits.
    """

    amplitude: float
    limited_amplitude: float
    frequency: float
    left: xr.Dataset
    right: xr.Dataset
    torque: xr.Dataset
    limited: Mapping[str, xr.Dataset]
    limits: Limits

    @cached_property
    def wrench_stretches(self) -> tuple[Stretch, Stretch]:
        """Criterion 1 to the left and to the right, until a foot tips."""
        return stretch(self.left), stretch(self.right)

    @cached_property
    def torque_stretch(self) -> Stretch:
        """Criterion 2."""
        return stretch(self.torque)

    @property
    def runs(self) -> dict[str, xr.Dataset]:
        """Every recording by what it is called."""
        found = {
            "minimum wrench, to the left": self.left,
            "minimum wrench, to the right": self.right,
            "minimum torque": self.torque,
        }
        return found | {f"{name} within limits": run for name, run in self.limited.items()}


def stretch(recording: xr.Dataset) -> Stretch:
    """What a recording shows while every contact stood."""
    standing = _standing(recording)
    # A recording that ends sooner has no settled part: then all but its first instant counts.
    settled = standing.sel(time=slice(_SETTLED, None))
    standing = settled if settled.sizes["time"] > 1 else standing.isel(time=slice(1, None))
    order = np.argsort(-recording["contact_position"].sel(com_axis="y").values)  # left first
    y = recording["com"].sel(com_axis="y")
    start = float(y[0])
    com_y = standing["com"].sel(com_axis="y").values - start
    travel, static = recording["static_travel"].values, recording["static_cop"].values[:, order, 1]
    return Stretch(
        standing["time"].values,
        com_y,
        standing["wrench"].sel(component="fz").values[:, order] / recording.attrs["weight"],
        standing["cop"].values[:, order, 1],
        np.stack([np.interp(com_y, travel, foot) for foot in static.T], axis=1),
        standing["margin"].values[:, order],
    )


def _standing(recording: xr.Dataset) -> xr.Dataset:
    """The part until a foot tips."""
    tip = float(recording.attrs["tip_time"])
    return recording.sel(time=slice(None, tip if np.isfinite(tip) else None))


def tracking_error(recording: xr.Dataset) -> float:
    """Root mean square of CoM y minus its target until a foot tips, from the very start [m]."""
    stood = _standing(recording)
    error = (stood["com"] - stood["com_target"]).sel(com_axis="y")
    return float(np.sqrt((error**2).mean()))


def completed(recording: xr.Dataset) -> bool:
    """Whether every foot stood to the end."""
    return recording.attrs["end_kind"] == "completed" and not recording.attrs["tip_kind"]


def tip_travel(recording: xr.Dataset) -> float:
    """CoM y from the start when the first foot ceased to stand [m]; NaN where none did."""
    return float(recording["tip_com"].sel(com_axis="y") - recording["com"].sel(com_axis="y")[0])
