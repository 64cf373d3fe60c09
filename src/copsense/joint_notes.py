"""Joints beyond their limits, in words."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from copsense.robot import Robot
from copsense.stance import Stance

# How far beyond a limit is said: what a printed position is rounded by is not.
_NOTED = {"rad": math.radians(0.01), "m": 1e-5}


def joint_limit_notes(stance: Stance) -> tuple[str, ...]:
    """Which joints of a posture are beyond their limits, each in its own unit."""
    robot = stance.robot
    return tuple(
        f"{joint} is {distance_text(excess, unit)} beyond its limit."
        for joint, unit, excess in zip(
            robot.dof_names, robot.dof_units, stance.joint_limit_excess.tolist(), strict=True
        )
        if excess > _NOTED[unit]
    )


def swept_joint_notes(robot: Robot, excess: Float[np.ndarray, "N n"]) -> tuple[str, ...]:
    """The same of several postures: at how many of them, and by how much at most.

    Args:
        robot: whose joints they are.
        excess: how far each is beyond its limit [rad, m]; NaN where there is no posture.
    """
    found = []
    for name, unit, column in zip(robot.dof_names, robot.dof_units, excess.T, strict=True):
        count, most = int((column > _NOTED[unit]).sum()), float(np.nanmax(column, initial=0.0))
        if count:
            found.append(
                f"{name} is beyond its limit at {count} posture{'s' * (count != 1)}, by up to "
                f"{distance_text(most, unit)}"
            )
    return tuple(found)


def distance_text(value: float, unit: str) -> str:
    """A distance of a joint, ``"rad"`` or ``"m"``, as people read it: degrees or millimetres."""
    shown, name = (math.degrees(value), "deg") if unit == "rad" else (value * 1e3, "mm")
    # What rounds to nothing is not nothing.
    return f"{shown:.1f} {name}" if abs(shown) >= 0.05 or not shown else f"{shown:.1g} {name}"
