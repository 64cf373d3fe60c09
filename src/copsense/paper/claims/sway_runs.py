"""Sway: recordings of Section V's motion in closed loop, as its claims read them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from copsense.limits import Limits
from copsense.simulation import Recording


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
    left: Recording
    right: Recording
    torque: Recording
    limited: Mapping[str, Recording]
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
    def runs(self) -> dict[str, Recording]:
        """Every recording by what it is called."""
        found = {
            "minimum wrench, to the left": self.left,
            "minimum wrench, to the right": self.right,
            "minimum torque": self.torque,
        }
        return found | {f"{name} within limits": run for name, run in self.limited.items()}


def stretch(recording: Recording) -> Stretch:
    """What a recording shows while every contact stood."""
    standing = recording.before_first_tip.settled
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
