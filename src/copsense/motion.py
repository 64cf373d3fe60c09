"""Motion: a velocity and an acceleration at one configuration, whose inertia is to be carried."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.content import ShortRepr, freeze
from copsense.robot import Robot


@dataclass(frozen=True, eq=False, repr=False)
class Motion(ShortRepr):
    """How a robot moves at one instant.

    Attributes:
        velocity: v (nv,), base in its own frame, then joints [m/s, rad/s].
        acceleration: dv/dt (nv,), componentwise as Pinocchio's: the base's linear part is the
            derivative of the velocity's numbers in the turning base frame [m/s^2, rad/s^2].
    """

    velocity: Float[np.ndarray, " nv"]
    acceleration: Float[np.ndarray, " nv"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "velocity", "acceleration")

    @classmethod
    def of(cls, robot: Robot, velocity: ArrayLike, acceleration: ArrayLike) -> Motion:
        """A motion of a robot, its numbers checked.

        Raises:
            InvalidInputError: not finite numbers (nv,).
        """
        shape, meaning = (robot.model.nv,), "the base in its own frame, then the joints"
        return cls(
            finite_array(velocity, "the velocity", shape, meaning),
            finite_array(acceleration, "the acceleration", shape, meaning),
        )
