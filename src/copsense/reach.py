"""Reach: how far a robot's links go from its base, and what lies beyond."""

from __future__ import annotations

import numpy as np

from copsense.errors import UnreachablePostureError
from copsense.magnitudes import check_angle, in_metres
from copsense.robot import Robot

_TWICE = 2.0  # from the base to the one point, and to the other
SWEPT = 10.0  # times the reach: a sweep may ask for what it cannot reach, and say so row by row
_LEAST = 1.0  # m: what is nearer is not said to be in another unit, however small the robot


def chain_lengths(robot: Robot) -> list[float]:
    """How far each joint of the model can be from the base [m], by its index.

    Its links end to end, with the slides drawn out; infinite behind one without limits.
    """
    model = robot.model
    lower, upper = robot.position_limits
    steps = [float(np.linalg.norm(place.translation)) for place in model.jointPlacements]
    steps[:2] = [0.0, 0.0]  # the universe, and where the file puts the base
    drawn = np.maximum(np.abs(lower), np.abs(upper))
    for k in range(2, model.njoints):
        first = model.joints[k].idx_v - robot.base_nv
        own = range(first, first + model.joints[k].nv)
        steps[k] += sum(float(drawn[i]) for i in own if robot.dof_units[i] == "m")
    return [sum(steps[j] for j in model.supports[k]) for k in range(model.njoints)]


def robot_reach(robot: Robot) -> float:
    """How far any frame or link's centre of mass can be from the base [m]."""
    model, far = robot.model, chain_lengths(robot)
    ends = [
        away + float(np.linalg.norm(link.lever))
        for away, link in zip(far, model.inertias, strict=True)
    ]
    ends += [
        far[frame.parentJoint] + float(np.linalg.norm(frame.placement.translation))
        for frame in model.frames
        if frame.parentJoint > 0
    ]
    return max(ends)


def beyond_reach(
    robot: Robot, metres: float, what: str, times: float = _TWICE, given: float | None = None
) -> str:
    """Why a distance is beyond a robot whatever its posture, a sentence or two; else "".

    Args:
        robot: the robot.
        metres: a distance between two of its points, or of one and its CoM; the sign does not
            count.
        what: how the sentence calls it.
        times: the reach from which it is beyond.
        given: the number that the caller gave for it [m]; default the distance.
    """
    reach = robot_reach(robot)
    if abs(metres) <= max(times * reach, _LEAST):
        return ""
    return (
        f"{what} is {metres:.4g} m, and {robot.name!r} reaches {reach:.2g} m from its base. "
        f"{in_metres(metres if given is None else given)}"
    )


def check_within_reach(
    robot: Robot, metres: float, what: str, times: float = _TWICE, given: float | None = None
) -> None:
    """Reject a distance that is beyond a robot whatever its posture.

    Args:
        robot: the robot.
        metres: the distance; the sign does not count.
        what: how the message calls it.
        times: the reach from which it is beyond.
        given: the number that the caller gave for it [m]; default the distance.

    Raises:
        UnreachablePostureError: it is; the message says what it would be in millimetres.
    """
    reason = beyond_reach(robot, metres, what, times, given)
    if reason:
        raise UnreachablePostureError(reason)


def check_coordinate(robot: Robot, name: str, unit: str, own: float, value: float) -> None:
    """Reject a value of a posture's coordinate that only another unit explains.

    Args:
        robot: the robot.
        name: of the coordinate: a joint, or as of `copsense.batch.PostureChart`.
        unit: its unit, ``"m"`` or ``"rad"``.
        own: the stance's value of it [m, rad].
        value: what is asked for [m, rad].

    Raises:
        InvalidInputError: no such position of the joint, or an angle of more than a turn.
        UnreachablePostureError: a place that is beyond the robot many times over.
    """
    if name in robot.joint_names:
        robot.checked_position(name, value)
    elif unit == "m":
        check_within_reach(robot, value - own, f"{name}, from the stance's own,", SWEPT, value)
    else:
        check_angle(value, name)
