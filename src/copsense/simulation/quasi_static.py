"""QuasiStatic: how far a motion is from one that is slow enough for statics.

On flat ground the net centre of pressure of a motion is not where it is at rest, but off by
m (h c'' - L' / m) / F_n: h the height of the CoM, L the angular momentum about it, and F_n the load
of the ground, m g without other loads. Along a path with tangent t both are rates of the path's
coordinate s, so that the CoP goes farther than at rest by ``lever s'' m / F_n`` with the lever
``h - L_x / m`` (L_x per unit of the CoM's velocity along y).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.controllers.target import Signal
from copsense.errors import InvalidInputError
from copsense.stance import Stance
from copsense.sway_levers import STATIC_SHARE, net_lever, static_frequency


@dataclass(frozen=True)
class QuasiStatic:
    """How much farther the net centre of pressure of a motion goes than its centre of mass.

    Attributes:
        lever: h - L_x / m where the path begins [m].
        excess: peak distance of the net centre of pressure from where it is at rest [m].
        share: that in shares of the CoM's largest excursion; of a sine w^2 lever / g.
        frequency: up to which a sine's share is at most 0.05 [Hz].
    """

    lever: float
    excess: float
    share: float
    frequency: float

    @property
    def holds(self) -> bool:
        """Whether the motion is slow enough for statics, within 5 %."""
        return self.share <= STATIC_SHARE


def quasi_static(stance: Stance, tangent: Float[np.ndarray, " nv"], signal: Signal) -> QuasiStatic:
    """How far a signal along a path is from being followed at rest.

    Args:
        stance: where the path begins.
        tangent: dq/dcoordinate there (nv,).
        signal: the coordinate, relative to the start, as a function of time.
    """
    g = stance.robot.weight / stance.robot.mass
    if stance.applied is not None:  # what of the weight the loads leave to the ground
        g -= float(stance.applied.wrenches[:, 2].sum()) / stance.robot.mass
    if g <= 0:
        raise InvalidInputError(
            f"the loads on {stance.robot.name!r} lift it by {-g * stance.robot.mass:.1f} N more "
            "than its weight: no contact that only pushes can hold it. Give smaller loads."
        )
    along, across, speed = net_lever(stance, tangent)
    lever = math.hypot(along, across)
    excess = lever * speed * peak_acceleration(signal) / g
    reach = speed * max(abs(end) for end in signal.extent)
    share = excess / reach if reach else 0.0 if excess == 0 else math.inf
    return QuasiStatic(lever, excess, share, static_frequency(lever, g))


def peak_acceleration(signal: Signal) -> float:
    """Largest second derivative of a signal; of one of the user's own over its first minute."""
    known = getattr(signal, "peak_acceleration", None)
    if known is not None:
        return float(known)
    return max(abs(signal.at(0.01 * i)[2]) for i in range(6000))
