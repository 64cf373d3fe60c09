"""FourBar: the planar linkage of [Romano2016, Section IV-A], as numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError


@dataclass(frozen=True)
class FourBar:
    """A parallelogram linkage: two legs and an upper rod as long as the feet are apart.

    The defaults are the robot of [Romano2016, Section V]: hips 50 cm high, feet 14 cm apart, and
    the 33 kg of an iCub split so that the rod weighs two legs (Hypothesis 1-iii, which makes kappa
    3/4). The total mass scales the wrenches and the torques; it moves no CoP.

    Attributes:
        leg_length: l, foot to hip [m].
        rod_length: d, hip to hip and foot to foot [m].
        leg_mass: m_l of each leg, at its middle [kg].
        body_mass: m_b of the rod, at its middle [kg].
        gravity: g [m/s²].
    """

    leg_length: float = 0.5
    rod_length: float = 0.14
    leg_mass: float = 8.25
    body_mass: float = 16.5
    gravity: float = 9.81

    def __post_init__(self) -> None:
        """Reject lengths, masses or a gravity that are not finite and positive."""
        for name in ("leg_length", "rod_length", "leg_mass", "body_mass", "gravity"):
            number = finite_number(getattr(self, name), f"the four-bar's {name}", positive=True)
            object.__setattr__(self, name, number)

    @property
    def mass(self) -> float:
        """Total mass m = 2 m_l + m_b [kg]; the feet are massless."""
        return 2.0 * self.leg_mass + self.body_mass

    @property
    def weight(self) -> float:
        """Weight m g [N]."""
        return self.mass * self.gravity

    @property
    def kappa(self) -> float:
        """Kappa = (m_l + m_b) / m: the CoM's travel as a part of the hips' travel, in (1/2, 1)."""
        return (self.leg_mass + self.body_mass) / self.mass

    def angle_at(self, travel: float) -> float:
        """Angle xi [rad] at which the CoM is `travel` [m] right of the centre.

        Raises:
            InvalidInputError: the CoM cannot go that far with the feet in place.
        """
        reach = self.kappa * self.leg_length
        if not abs(travel) < reach:
            raise InvalidInputError(
                f"the CoM cannot travel {travel:g} m from the centre: kappa l is {reach:g} m. "
                "Give a FourBar with a shorter rod or longer legs."
            )
        # u = kappa l cos(xi)
        return math.acos(travel / reach)

    def with_kappa(self, kappa: float) -> FourBar:
        """The same linkage and total mass with another mass ratio kappa, between 1/2 and 1."""
        # kappa = (m_l + m_b)/m and m = 2 m_l + m_b
        m = self.mass
        return replace(self, leg_mass=(1 - kappa) * m, body_mass=(2 * kappa - 1) * m)

    def com(self, xi: float) -> Float[np.ndarray, "2"]:
        """Centre of mass [m] at the leg angle `xi` [rad], in the world with the left foot at 0."""
        # CoM = (d/2 + kappa l c, kappa l s)
        reach = self.kappa * self.leg_length
        return np.array([self.rod_length / 2 + reach * math.cos(xi), reach * math.sin(xi)])
