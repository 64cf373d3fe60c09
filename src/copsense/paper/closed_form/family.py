"""FourBarSolution and solve_four_bar_member: the four-bar's statics in closed form.

World frame: x right, y up, origin at the left foot; the left foot is at (0, 0), the right foot at
(d, 0). A planar wrench is [f_x, f_y, m_z] in N, N, N m: what the ground does to the foot, the
moment about the foot's own point, counter-clockwise positive.

With c = cos(xi), s = sin(xi), u = kappa l c (the CoM's travel from the centre) and Q = m g u, every
equilibrium that puts the same moment on both feet and pulls them apart or together by h is

    f_x = +h, -h      f_y = m g (1/2 -/+ a u / d)      m_z = (1 - a) Q / 2    (upper sign: left)

where a, the share, is the part of the CoM's moment that load transfer carries; the feet's moments
carry 1 - a. h moves no CoP.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.errors import InvalidInputError, UnloadedContactError
from copsense.paper.closed_form.dimensions import FourBar

# Below this share of the weight a foot's vertical force is rounding, and so is its CoP.
_UNLOADED = 1e-12
# Below this |sin(xi)| the legs lie on the ground: the feet's constraints lose rank.
_COLLAPSED = 1e-12


@dataclass(frozen=True, eq=False)
class FourBarSolution:
    """One static equilibrium of a four-bar. Rows and entries go left foot, right foot.

    Attributes:
        four_bar: the linkage.
        xi: angle of the legs from the ground, pi/2 upright [rad].
        share: a, the part of the CoM's moment that load transfer carries [-].
        horizontal_force: h, what the ground pushes the left foot to the right with [N].
        wrenches: [f_x, f_y, m_z] per foot, ground on foot, about the foot's point [N, N, N m].
        torques: hip left, ankle left, hip right, ankle right [N m]; the hip's is rod on leg, the
            ankle's leg on foot, counter-clockwise positive. The rates of the leg angle they work on
            are +1, -1, +1, -1: a moving foot keeps its direction.
        cop: m_z / f_y, the CoP from the foot's point, right positive [m].
        sensitivity: d cop / d xi at constant share [m/rad] ([Romano2016] Eq. (11)).
        cop_per_com: d cop / d com_x, free of the choice of xi [-].
        com: centre of mass in the world, left foot at the origin [m].
    """

    four_bar: FourBar
    xi: float
    share: float
    horizontal_force: float
    wrenches: Float[np.ndarray, "2 3"]
    torques: Float[np.ndarray, "4"]
    cop: Float[np.ndarray, "2"]
    sensitivity: Float[np.ndarray, "2"]
    cop_per_com: Float[np.ndarray, "2"]
    com: Float[np.ndarray, "2"]

    def __post_init__(self) -> None:
        """Own read-only copies of the arrays, and reject one that overflowed."""
        for name in ("wrenches", "torques", "cop", "sensitivity", "cop_per_com", "com"):
            array = np.array(getattr(self, name), dtype=float)
            if not np.all(np.isfinite(array)):
                raise InvalidInputError(
                    f"the {name} overflow for xi={self.xi!r}, {self.four_bar!r}. Use magnitudes "
                    "that a linkage can have, in SI units."
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def to_dict(self) -> dict[str, Any]:
        """Plain data of it, as ``copsense four-bar --json`` prints it: by foot and joint."""
        sides = ("left", "right")
        by_foot = {
            name: dict(zip(sides, getattr(self, name).tolist(), strict=True))
            for name in ("wrenches", "cop", "sensitivity", "cop_per_com")
        }
        joints = ("hipL", "ankleL", "hipR", "ankleR")
        return {
            "wrenches": by_foot.pop("wrenches"),
            "torques": dict(zip(joints, self.torques.tolist(), strict=True)),
            **by_foot,
            "com": self.com.tolist(),
            "load_transfer_share": self.share,
        }

    def residual(self) -> float:
        """Largest imbalance of the linkage and its links, in parts of m g and m g (l + d).

        Newton and Euler on the whole, on each massless foot and on each leg about its hip, from the
        stored wrenches and torques and not from the formulas that made them.
        """
        l, d = self.four_bar.leg_length, self.four_bar.rod_length
        weight, leg = self.four_bar.weight, self.four_bar.leg_mass * self.four_bar.gravity
        c, s = math.cos(self.xi), math.sin(self.xi)
        (fxL, fyL, mzL), (fxR, fyR, mzR) = self.wrenches
        hipL, ankleL, hipR, ankleR = self.torques
        forces = [fxL + fxR, fyL + fyR - weight]
        moments = [
            d * fyR + mzL + mzR - weight * self.com[0],
            ankleL + mzL,
            ankleR + mzR,
            hipL + mzL - l * c * fyL + l * s * fxL + leg * l * c / 2,
            hipR + mzR - l * c * fyR + l * s * fxR + leg * l * c / 2,
        ]
        return float(max(np.abs(forces).max() / weight, np.abs(moments).max() / (weight * (l + d))))


def leg_angle(xi: object) -> float:
    """Return `xi` as a float, or raise if it is not an angle or the linkage is collapsed there."""
    angle = finite_number(xi, "xi [rad]")
    if abs(math.sin(angle)) < _COLLAPSED:
        raise InvalidInputError(
            f"the linkage is collapsed at xi={angle!r}: sin(xi) = 0, the legs lie on the "
            "ground and the internal force diverges. Keep xi between 0 and pi, pi/2 being upright."
        )
    return angle


@np.errstate(over="ignore", invalid="ignore")  # FourBarSolution rejects what overflows
def solve_four_bar_member(
    four_bar: FourBar, xi: float, share: float, horizontal_force: float = 0.0
) -> FourBarSolution:
    """Solve for one member (a, h) of the family, whatever criterion would pick it.

    Args:
        four_bar: the linkage.
        xi: angle of the legs from the ground [rad].
        share: a, any finite number.
        horizontal_force: h on the left foot, -h on the right foot [N].

    Returns:
        The equilibrium.

    Raises:
        InvalidInputError: a number is not finite, or sin(xi) = 0.
        UnloadedContactError: a foot carries no vertical force.
    """
    xi, a = leg_angle(xi), finite_number(share, "the share")
    h = finite_number(horizontal_force, "horizontal_force [N]")
    l, d, kappa, weight = four_bar.leg_length, four_bar.rod_length, four_bar.kappa, four_bar.weight
    c, s = math.cos(xi), math.sin(xi)
    u = kappa * l * c
    Q = weight * u
    side = np.array([-1.0, 1.0])  # left foot at -x, right foot at +x

    # f_y(±x) = m g (1/2 ± a u/d), mu = (1 - a) Q / 2
    loads = 0.5 + side * a * u / d
    unloaded = tuple(
        name
        for name, load in zip(("left foot", "right foot"), loads, strict=True)
        if abs(load) < _UNLOADED
    )
    if unloaded:
        raise UnloadedContactError(unloaded)
    mu = (1.0 - a) * Q / 2
    wrenches = np.column_stack([-side * h, weight * loads, np.full(2, mu)])

    # ankle: a massless foot, tau = -m_z. Hip: moments of leg and foot about it,
    # tau = -m_z + l c f_y - l s f_x - m_l g l c / 2 = a Q (1/2 ± l c/d) ± l s h
    hips = a * Q * (0.5 + side * l * c / d) + side * l * s * h
    torques = np.array([hips[0], -mu, hips[1], -mu])

    # SCoP = (1-a) d u / (d ± 2 a u); d SCoP / d u = (1-a) d² / (d ± 2 a u)²; du/dxi = -kappa l s
    span = 2.0 * loads  # (d ± 2 a u) / d
    cop = (1.0 - a) * u / span
    cop_per_com = (1.0 - a) / span**2
    return FourBarSolution(
        four_bar=four_bar,
        xi=xi,
        share=a,
        horizontal_force=h,
        wrenches=wrenches,
        torques=torques,
        cop=cop,
        sensitivity=-kappa * l * s * cop_per_com,
        cop_per_com=cop_per_com,
        com=four_bar.com(xi),
    )
