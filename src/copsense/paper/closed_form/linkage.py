"""The four-bar as a floating linkage: kinematics, Jacobians and statics from scratch, numerically.

What the printed formulas and the closed forms are judged against. The coordinates are the paper's,
q = (p_x, p_y, theta, q1, q2, q3, q4) [Romano2016, Section IV-A]: the rod's middle and angle, then
hip and ankle of the left leg and of the right leg. Derivatives are complex-step, so exact.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Inexact

from copsense.paper.closed_form.dimensions import FourBar

# Any step below the square root of the smallest double works: no difference is taken.
_STEP = 1e-30


class Hand(enum.Enum):
    """On which side of the linkage "left" is: the paper's equations do not agree.

    The value is the sign of the left foot's x, the rod's middle being 0.
    """

    LEFT_AT_MINUS_X = -1
    LEFT_AT_PLUS_X = +1


@dataclass(frozen=True)
class Linkage:
    """A four-bar with its feet free, and a choice of where "left" is.

    Attributes:
        four_bar: lengths and masses.
        hand: where the left leg is; copsense's own choice is LEFT_AT_MINUS_X.
    """

    four_bar: FourBar
    hand: Hand = Hand.LEFT_AT_MINUS_X

    def standing(self, xi: float) -> Float[np.ndarray, "7"]:
        """Posture q = chi(xi), [Romano2016] Eq. (14), the foot at -x at the origin [m, rad]."""
        l, d = self.four_bar.leg_length, self.four_bar.rod_length
        return np.array(
            [d / 2 + l * np.cos(xi), l * np.sin(xi), 0.0, xi, np.pi - xi, xi, np.pi - xi]
        )

    def feet(self, q: Inexact[np.ndarray, "7"]) -> Inexact[np.ndarray, "6"]:
        """Poses (x, y, angle) of the left and of the right foot [m, rad]."""
        points = self._points(q)
        angles = q[2] + np.array([q[3] + q[4], q[5] + q[6]])
        return np.concatenate([points[0], angles[:1], points[1], angles[1:]])

    def masses(self, q: Inexact[np.ndarray, "7"]) -> Inexact[np.ndarray, "6"]:
        """Positions (x, y) of the point masses: left leg, right leg, rod [m] (Hypothesis 1-i)."""
        hips, feet = self._hips(q), self._points(q)
        return np.concatenate([(hips[0] + feet[0]) / 2, (hips[1] + feet[1]) / 2, q[:2]])

    def jacobian(self, xi: float) -> Float[np.ndarray, "6 7"]:
        """J of both feet, left first, at the standing posture: the paper's J_CL over J_CR."""
        return _derivative(self.feet, self.standing(xi))

    def mass_matrix(self, xi: float) -> Float[np.ndarray, "7 7"]:
        """M for massless feet and point masses, at the standing posture [kg, kg m, kg m²]."""
        D = _derivative(self.masses, self.standing(xi))
        m = np.array([self.four_bar.leg_mass, self.four_bar.leg_mass, self.four_bar.body_mass])
        return D.T @ (np.repeat(m, 2)[:, None] * D)

    def gravity(self, xi: float) -> Float[np.ndarray, "7"]:
        """G = dV/dq, V the potential energy, at the standing posture [N, N m]."""
        m = np.array([self.four_bar.leg_mass, self.four_bar.leg_mass, self.four_bar.body_mass])
        D = _derivative(self.masses, self.standing(xi))
        return np.asarray(self.four_bar.gravity * m @ D[1::2])

    def com_to_feet(self, xi: float) -> Float[np.ndarray, "2 2"]:
        """Rows lambda and rho: from the CoM to the left and to the right foot [m]."""
        feet = self.feet(self.standing(xi)).real
        return np.array([feet[0:2], feet[3:5]]) - self.four_bar.com(xi)

    def _hips(self, q: Inexact[np.ndarray, "7"]) -> Inexact[np.ndarray, "2 2"]:
        side = self.hand.value * self.four_bar.rod_length / 2
        along = np.array([np.cos(q[2]), np.sin(q[2])])
        return np.array([q[:2] + side * along, q[:2] - side * along])

    def _points(self, q: Inexact[np.ndarray, "7"]) -> Inexact[np.ndarray, "2 2"]:
        angles = q[2] + q[[3, 5]]
        legs = self.four_bar.leg_length * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.asarray(self._hips(q) - legs)


def _derivative(
    function: Callable[[Inexact[np.ndarray, "n"]], Inexact[np.ndarray, "m"]],
    q: Float[np.ndarray, "n"],
) -> Float[np.ndarray, "m n"]:
    """Derivative d function / dq by the complex step, exact to rounding."""
    steps = q + 1j * _STEP * np.eye(q.size)
    return np.column_stack([function(row).imag / _STEP for row in steps])


def wrench_balance(arms: Float[np.ndarray, "2 2"]) -> Float[np.ndarray, "3 6"]:
    """X = [X_L X_R]: foot wrenches to their resultant about the CoM, [Romano2016] Eq. (21).

    Args:
        arms: rows lambda and rho, from the CoM to the left and to the right foot [m].

    Returns:
        Rows f_x, f_y, m_z; columns the left foot's, then the right foot's wrench.
    """
    blocks = []
    for x, y in arms:
        blocks.append(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-y, x, 1.0]]))
    return np.hstack(blocks)
