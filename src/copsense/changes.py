"""StanceChange: how a stance changes, to first order: posture, load, contact frames and masses.

What solves the statics has one right-hand side for each way of changing: with N - J' f = B tau and
stationarity J nu = W_f (f - f_ref), they are

    d(N - J' f) = A V + dN + Y dpi - dJ' f        at fixed f
    d(J nu)     = D V + dJ nu                      at fixed nu

where A = d(N - J' f)/dq and D = d(J nu)/dq; Y is the regressor of gravity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense import rigid_body
from copsense.content import ShortRepr, freeze
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class StanceChange(ShortRepr):
    """Ways in which a stance changes, one per column.

    Attributes:
        directions: V (nv, p), the posture's; they may move contacts, as far as the ground does.
        load: how N (`Stance.balance`) changes besides (nv, p) [N, Nm]; None for not at all.
        frames: how the constraints' Jacobian J changes besides (p, c, nv), as by contact frames
            that lie elsewhere on their links; None for not at all.
        inertias: how the links' inertial parameters change (10 (njoints - 1), p), in the order of
            Pinocchio's regressors; None for not at all. What they change in N is not in `load`.
    """

    directions: Float[np.ndarray, "nv p"]
    load: Float[np.ndarray, "nv p"] | None = None
    frames: Float[np.ndarray, "p c nv"] | None = None
    inertias: Float[np.ndarray, "k p"] | None = None

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "directions", "load", "frames", "inertias")

    def balance(self, stance: Stance, forces: Float[np.ndarray, " c"]) -> Float[np.ndarray, "nv p"]:
        """d(N - J' f) at fixed forces f (c,), rows in the order of `Robot.by_drive`."""
        found = stance.balance_derivative(forces).dot(self.directions)
        if self.load is not None:
            found = found + self.load
        if self.inertias is not None:
            found += rigid_body.inertial_regressor(stance.robot, stance.q).dot(self.inertias)
        if self.frames is not None:
            found -= np.einsum("pcv,c->vp", self.frames, forces)
        return stance.robot.by_drive(found)

    def constraint(
        self, stance: Stance, velocity: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "c p"]:
        """d(J v) at a fixed velocity v (nv,)."""
        found = stance.motion_derivative(velocity).dot(self.directions)
        if self.frames is not None:
            found += np.einsum("pcv,v->cp", self.frames, velocity)
        return found

    def inertia(
        self, stance: Stance, acceleration: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "nv p"]:
        """d(M a) at a fixed acceleration a (nv,), both in the order of `Robot.by_drive`."""
        robot = stance.robot
        a = robot.from_drives(acceleration)
        found = stance.inertia_derivative(a).dot(self.directions)
        if self.inertias is not None:
            moving = rigid_body.inertial_regressor(robot, stance.q, a)
            at_rest = rigid_body.inertial_regressor(robot, stance.q)
            found = found + (moving - at_rest).dot(self.inertias)
        return robot.by_drive(found)
