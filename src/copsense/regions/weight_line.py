"""The base's balance by the position of the centre of mass, posture held."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.rigid_body import base_axes
from copsense.stance import Stance, check_at_rest, check_stance

_NOTHING = 1e-9  # of the weight: what rounding leaves of a slope that is zero


def balance_at(stance: Stance, com: ArrayLike) -> Float[np.ndarray, " nv"]:
    """The balance with the weight's line of action through another point, posture and loads held.

    Args:
        stance: robot, posture and contacts.
        com: (2,) world x, y [m] of the centre of mass.

    Returns:
        The vector N (nv,) in N and Nm. The base's rows, in the base's frame, are those of the
        weight at `com`; the joints' rows are the stance's. It equals ``stance.balance`` at
        ``stance.com[:2]``.
    """
    point = finite_array(com, "the centre of mass", (2,), "world x, y [m]")
    balance = np.array(stance.balance)
    balance[: stance.robot.base_nv] += gravity_slope(stance) @ (point - stance.com[:2])
    return balance


def gravity_slope(stance: Stance) -> Float[np.ndarray, "nb 2"]:
    """S = dG_b/dc, the base's rows by world x, y of the centre of mass [N]."""
    robot = stance.robot
    turning = base_axes(robot, stance.q)
    # By virtual work the base carries the weight's moment, c x (-m g), along what it can turn.
    lift = -robot.mass * np.asarray(robot.model.gravity.linear)
    return np.asarray(turning.T @ np.cross(np.eye(3)[:2], lift).T)


def com_axes(stance: Stance) -> Float[np.ndarray, "2 r"]:
    """Orthonormal horizontal directions in which the CoM may move: x and y, or a plane's own."""
    check_stance(stance)
    check_at_rest(stance, "a region of the CoM")
    if stance.robot.base_nv == 6:
        return np.eye(2)
    u, size, _ = np.linalg.svd(gravity_slope(stance).T)
    axes = u[:, size > _NOTHING * stance.robot.weight]
    return np.asarray(axes * np.sign(axes.sum(axis=0)))
