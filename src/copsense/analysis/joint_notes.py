"""Joints beyond their limits, in words."""

from __future__ import annotations

import math

from copsense.stance import AT_LIMIT, Stance


def joint_limit_notes(stance: Stance) -> tuple[str, ...]:
    """Which joints of a posture are beyond their limits, each in its own unit."""
    robot = stance.robot
    return tuple(
        f"{joint} is {distance_text(excess, unit)} beyond its limit."
        for joint, unit, excess in zip(
            robot.dof_names, robot.dof_units, stance.joint_limit_excess.tolist(), strict=True
        )
        if excess > AT_LIMIT
    )


def distance_text(value: float, unit: str) -> str:
    """A distance of a joint, ``"rad"`` or ``"m"``, as people read it: degrees or millimetres."""
    shown, name = (math.degrees(value), "deg") if unit == "rad" else (value * 1e3, "mm")
    # What rounds to nothing is not nothing.
    return f"{shown:.1f} {name}" if abs(shown) >= 0.05 or not shown else f"{shown:.1g} {name}"
