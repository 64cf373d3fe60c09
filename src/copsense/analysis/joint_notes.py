"""Joints beyond their limits, in words."""

from __future__ import annotations

import math

from copsense.stance import Stance

ROUNDING = 1e-6  # rad or m: a joint this far beyond its limit is at it


def joint_limit_notes(stance: Stance) -> tuple[str, ...]:
    """Which joints of a posture are beyond their limits, each in its own unit."""
    robot = stance.robot
    return tuple(
        f"{joint} is {distance_text(excess, unit)} beyond its limit."
        for joint, unit, excess in zip(
            robot.dof_names, robot.dof_units, stance.joint_limit_excess.tolist(), strict=True
        )
        if excess > ROUNDING
    )


def distance_text(value: float, unit: str) -> str:
    """A distance of a joint, ``"rad"`` or ``"m"``, as people read it: degrees or millimetres."""
    if unit == "rad":
        return f"{math.degrees(value):.1f} deg"
    return f"{value * 1e3:.1f} mm"
