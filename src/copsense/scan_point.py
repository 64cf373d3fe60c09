"""ScanPoint: the equilibrium at one posture of a path, and its exact derivatives along the path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from copsense.arrays import read_only
from copsense.content import freeze
from copsense.cop import contact_cops
from copsense.errors import CopsenseError
from copsense.sensitivity import CopSensitivity, cop_rates, sensitivity_of
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium


@dataclass(frozen=True, eq=False, repr=False)
class ScanPoint:
    """The equilibrium at one posture of a path, and its derivatives along the path.

    Attributes:
        value: the path's coordinate.
        tangent: dq/dcoordinate (nv,).
        equilibrium: the wrenches and torques there.
    """

    value: float
    tangent: Float[np.ndarray, " nv"]
    equilibrium: StaticEquilibrium

    def __post_init__(self) -> None:
        """Own the tangent."""
        freeze(self, "tangent")

    def __repr__(self) -> str:
        """The coordinate and the equilibrium there."""
        return f"ScanPoint(at {self.value:.6g}: {self.equilibrium!r})"

    @property
    def stance(self) -> Stance:
        """The posture."""
        return self.equilibrium.stance

    @property
    def forces(self) -> Float[np.ndarray, " m"]:
        """Stacked contact forces, contact axes [N, Nm]."""
        return self.equilibrium.contact_forces

    @property
    def torques(self) -> Float[np.ndarray, " n"]:
        """Joint torques [Nm]."""
        return self.equilibrium.torques

    @property
    def force_rates(self) -> Float[np.ndarray, " m"]:
        """d forces / d coordinate."""
        return self._derivatives[0][: len(self.forces), 0]

    @property
    def torque_rates(self) -> Float[np.ndarray, " n"]:
        """d torques / d coordinate."""
        return self._derivatives[1][:, 0]

    @property
    def com_gain(self) -> Float[np.ndarray, "nc 2 2"]:
        """d cop / d CoM, as `CopSensitivity.com_gain`."""
        change = self.stance.unstack(self._derivatives[0][:, 1:])
        return cop_rates(self.equilibrium, contact_cops(self.equilibrium), change)

    @cached_property
    def sensitivity(self) -> CopSensitivity:
        """The sensitivity of every contact's centre of pressure there, along every motion."""
        return sensitivity_of(self.equilibrium)

    @cached_property
    def _derivatives(self) -> tuple[np.ndarray, np.ndarray]:
        """Of forces and torques along the path, and along CoM x and y."""
        directions = np.column_stack([self.tangent, self.stance.com_motions])
        forces, torques = self.equilibrium.derivative(directions)
        return read_only(forces), read_only(torques)


def rates_or_nan(point: ScanPoint) -> tuple[np.ndarray, np.ndarray]:
    """Rates of forces and torques; NaN at a posture where they have no derivative."""
    try:
        return point.force_rates, point.torque_rates
    except CopsenseError:
        return np.full_like(point.forces, np.nan), np.full_like(point.torques, np.nan)
