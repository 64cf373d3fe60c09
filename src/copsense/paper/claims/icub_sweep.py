"""LateralSweep: what Section V's claims are judged on, read from a sweep of two criteria.

The sweep moves the CoM from above one foot to above the other, quasi-statically; the robot's left
is +y. Rows left, right. "Loaded" is the foot on whose side the CoM is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.paper.closed_form.dimensions import FourBar
from copsense.roots import first_zero
from copsense.sweeps import Sweep

WRENCH, TORQUE, SHORT = "minimum-wrench", "minimum-torque", "minimum-wrench, L = d/2"
HIP_ROLL = "l_hip_roll"
_SIDEWAYS = 1e-9  # m: how far short of a foot the sweep may stop and still be over it


@dataclass(frozen=True, eq=False)
class Series:
    """One criterion along the sweep.

    Attributes:
        load: f_z / (m g) of the left and right foot (N, 2).
        cop: CoP y in each foot's frame (N, 2) [m].
        slope: d CoP y / d CoM y along the sweep (N, 2).
        margin: CoP to the sole's nearest edge (N, 2) [m].
    """

    load: Float[np.ndarray, "N 2"]
    cop: Float[np.ndarray, "N 2"]
    slope: Float[np.ndarray, "N 2"]
    margin: Float[np.ndarray, "N 2"]


@dataclass(frozen=True, eq=False)
class LateralSweep:
    """A lateral sweep under the paper's two criteria, and criterion 1 with L = d/2.

    Attributes:
        com_y: world y of the CoM, rising (N,) [m].
        half: half the distance of the feet, where the CoM is over a foot [m].
        hip_roll: position of the left hip roll joint (N,) [rad].
        hip_rate: d hip roll / d CoM y along the sweep (N,) [rad/m].
        series: criterion's name -> what it gives.
        leg_masses: left and right leg [kg].
        body_mass: everything else [kg].
        hip_height: hip roll axes over the contact frames, at the centre [m].
        other_slope: d CoP y / d hip roll of the left foot at the centre along another path, one
            that sweeps the joint itself, criterion 1 [m/rad].
        four_bar: the linkage to compare with.
    """

    com_y: Float[np.ndarray, " N"]
    half: float
    hip_roll: Float[np.ndarray, " N"]
    hip_rate: Float[np.ndarray, " N"]
    series: dict[str, Series]
    leg_masses: tuple[float, float]
    body_mass: float
    hip_height: float
    other_slope: float
    four_bar: FourBar

    @classmethod
    def from_dataset(cls, lateral: Sweep, four_bar: FourBar) -> LateralSweep:
        """Read what the claims need.

        Args:
            lateral: as `copsense.paper.reproduce.everything` computes it: ``copsense.sweep`` along
                ``com_y`` under WRENCH, TORQUE and SHORT, with ``l_hip_roll`` and its rate.
            four_bar: the linkage to compare with.

        Raises:
            InvalidInputError: a criterion or a variable is missing, a row has failed, or the sweep
                does not reach from over one foot to over the other.
        """
        missing = {WRENCH, TORQUE, SHORT} - set(lateral.labels("criterion"))
        missing |= {"com_y", HIP_ROLL, f"{HIP_ROLL}_rate"} - set(lateral)
        if missing:
            raise InvalidInputError(
                f"the lateral sweep lacks {', '.join(sorted(missing))}. "
                "Take the one that copsense.paper.reproduce.everything returns."
            )
        if lateral.failed_rows:
            raise InvalidInputError(
                "the lateral sweep has failed rows, on which no claim can be judged: "
                f"{sorted({reason for _, _, reason in lateral.failed_rows})}."
            )
        dataset = lateral.to_xarray()
        place = dataset["contact_position"].sel(com_axis="y")
        both = dataset.isel(contact=np.argsort(-place.values))  # left first
        half, com_y = float(np.ptp(place.values)) / 2, both["com_y"].values
        if com_y[0] > -half + _SIDEWAYS or com_y[-1] < half - _SIDEWAYS:
            raise InvalidInputError(
                f"the sweep must reach over both feet, from {-half:g} m to {half:g} m; it goes "
                f"from {com_y[0]:g} m to {com_y[-1]:g} m."
            )
        attributes = both.attrs
        return cls(
            com_y=com_y,
            half=half,
            hip_roll=both[HIP_ROLL].values,
            hip_rate=both[f"{HIP_ROLL}_rate"].values,
            series={name: _series(both.sel(criterion=name)) for name in (WRENCH, TORQUE, SHORT)},
            leg_masses=(float(attributes["left_leg_mass"]), float(attributes["right_leg_mass"])),
            body_mass=float(attributes["body_mass"]),
            hip_height=float(attributes["hip_height"]),
            other_slope=float(attributes["joint_path_slope"]),
            four_bar=four_bar,
        )

    def at(self, values: Float[np.ndarray, " N"], y: float) -> float:
        """A value where the CoM is at y [m], between the postures linearly."""
        return float(np.interp(y, self.com_y, values))

    def over_foot(self, values: Float[np.ndarray, "N 2"]) -> tuple[float, float]:
        """A value of the loaded and of the unloaded foot with the CoM over the left foot."""
        return self.at(values[:, 0], self.half), self.at(values[:, 1], self.half)

    def reaches_foot(self, travel: float) -> bool:
        """Whether a travel of the CoM from the centre [m] brings it over a foot."""
        return travel >= self.half - _SIDEWAYS

    def planted(self, criterion: str) -> float:
        """How far the CoM may go to either side with both CoPs in their soles [m]."""
        margin = self.series[criterion].margin.min(axis=1)
        return min(
            first_zero(side * self.com_y[order], margin[order])
            for side, order in ((1, np.arange(len(margin))), (-1, np.arange(len(margin))[::-1]))
        )


def _series(here: xr.Dataset) -> Series:
    return Series(
        load=(here["wrench"].sel(component="fz") / here.attrs["weight"]).values,
        cop=here["cop"].sel(axis="y").values,
        slope=here["cop_slope"].sel(axis="y").values,
        margin=here["margin"].values,
    )
