"""Heading: which way a robot faces at rest, and which way up its base is."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.robot import Robot
from copsense.robots.feet import Foot

_PLAIN = 1.5  # an axis says what is up when it is so much longer than the base's z
_CLEAR = 0.4  # of the limbs' reach: how far off their ends' middle has to be to say what is up
_PARALLEL = 0.9  # cosine from which axes count as parallel
_PLAINLY = 0.5  # joints more about one horizontal axis than about the other
_AHEAD = 0.05  # of its length: a sole set off less from its ankle does not say where ahead is
_STRAIGHT = np.radians(15.0)  # knees bent less are straight
_SPANNED = 0.3  # of axes that turn a thigh any way: the least singular value
_NEWTON = 8  # steps
_ALIKE = 0.5  # cosine to a line up to which names do not tell its ends apart
_TIE = "nothing distinguishes ahead from behind"
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")  # of names such as toeFL, LF_FOOT, shank_hl
_FRONT = frozenset({"front", "fore", "f", "fl", "fr", "lf", "rf"})
_HIND = frozenset({"hind", "rear", "back", "h", "hl", "hr", "lh", "rh", "rl", "rr", "bl", "br"})
_LEFT = frozenset({"left", "l", "fl", "lf", "hl", "lh", "rl", "bl"})
_RIGHT = frozenset({"right", "r", "fr", "rf", "hr", "rh", "rr", "br"})
_TURNS = {  # axis of the base that is up -> roll, pitch, yaw [deg] that turn it there
    (0, 1): (0.0, -90.0, 0.0),
    (0, -1): (0.0, 90.0, 0.0),
    (1, 1): (90.0, 0.0, 0.0),
    (1, -1): (-90.0, 0.0, 0.0),
    (2, -1): (180.0, 0.0, 0.0),
}


def upright_base(robot: Robot, q: Float[np.ndarray, " nq"]) -> tuple[float, float, float]:
    """Roll, pitch, yaw [deg] that put the limbs' ends under the centre of mass; zeros if they are.

    Args:
        robot: the robot, with a free base.
        q: a configuration, the base not turned.
    """
    model, data = robot.model, robot.model.createData()
    com = np.array(pin.centerOfMass(model, data, q))
    ends = [i for i in range(2, model.njoints) if len(model.subtrees[i]) == 1]
    if not ends:
        return (0.0, 0.0, 0.0)
    # The last link reaches farther than its joint does: a shin hangs under its knee.
    tips = {i: data.oMi[i].act(model.inertias[i].lever) for i in ends}
    # A limb counts once, however many fingers it has.
    limbs: dict[int, list[Float[np.ndarray, " 3"]]] = {}
    for i in ends:
        limbs.setdefault(int(model.supports[i][2]), []).append(tips[i])
    up = com - np.mean([np.mean(places, axis=0) for places in limbs.values()], axis=0)
    axis = int(np.argmax(np.abs(up)))
    sign = 1 if up[axis] > 0 else -1
    if (axis, sign) == (2, 1) or (axis != 2 and abs(up[axis]) < _PLAIN * abs(up[2])):
        return (0.0, 0.0, 0.0)
    reach = max(float(np.linalg.norm(tips[i] - com)) for i in ends)
    if abs(up[axis]) < _CLEAR * reach:
        return (0.0, 0.0, 0.0)  # limbs to all sides
    return _TURNS[axis, sign]


def facing(
    robot: Robot, q: Float[np.ndarray, " nq"], feet: tuple[Foot, ...]
) -> tuple[float | None, str]:
    """Heading [deg, counter-clockwise from the world's x] at a configuration, and how it is known.

    None where nothing says it. Feet stand beside each other, soles reach ahead of the ankles, and
    knees turn about the axis from side to side. Where that leaves ahead and behind alike, the names
    of the feet decide: front, hind, left, right, or letters such as ``FL``, ``RH``.
    """
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    named = _named_ahead(feet)
    soles = [foot for foot in feet if foot.sole is not None]
    if not soles:
        left = _knees_axis(robot, q, feet)
        if left is None:
            if np.any(named):
                return _quarter(named), "its feet are named by where they are"
            return None, "its feet have no soles to show it, and its knees no axis in common"
        ahead, how = _sided(np.array([left[1], -left[0]]), named)
        return _quarter(ahead), f"its knees turn across; {how or _TIE}"
    ahead = np.mean([(f.middle - data.oMi[f.joint].translation)[:2] for f in soles], axis=0)
    plain = _AHEAD * max(max(foot.sole.size) for foot in soles if foot.sole is not None)
    why = "its soles reach ahead of the ankles"
    aside = (soles[-1].middle - soles[0].middle)[:2]
    if len(soles) == 2 and np.linalg.norm(aside) > plain:
        across = np.array([-aside[1], aside[0]]) / np.linalg.norm(aside)
        along = float(across @ ahead)
        ahead = across * along
        if abs(along) < plain:
            ahead, how = _sided(across, named)
            how = how or "its soles do not distinguish ahead from behind"
            why = f"its feet stand beside each other; {how}"
    elif np.linalg.norm(ahead) < plain:
        return None, "its soles reach as far behind the ankles as ahead of them"
    return _quarter(ahead), why


def _sided(
    line: Float[np.ndarray, " 2"], named: Float[np.ndarray, " 2"]
) -> tuple[Float[np.ndarray, " 2"], str]:
    """The way along a line by names, and that it is by names; else forward, left before right."""
    along = float(line @ named)
    if abs(along) > _ALIKE * float(np.linalg.norm(named)):
        return line * np.sign(along), "its feet's names tell ahead from behind"
    return line if line @ (1.0, 0.1) > 0 else -line, ""


def _named_ahead(feet: tuple[Foot, ...]) -> Float[np.ndarray, " 2"]:
    """Ahead by the names of the feet: from hind to front, or across from right to left.

    Zero where they say nothing, or contradict each other.
    """
    ends = _named_side(feet, _FRONT, _HIND)
    left = _named_side(feet, _LEFT, _RIGHT)
    across = np.array([left[1], -left[0]])
    return np.zeros(2) if ends @ across < 0 else ends + across


def _named_side(
    feet: tuple[Foot, ...], one: frozenset[str], other: frozenset[str]
) -> Float[np.ndarray, " 2"]:
    """Unit vector from the feet whose names have one of some words to those of others, or zero."""
    groups: list[list[np.ndarray]] = [[], []]
    for foot in feet:
        words = {word.lower() for word in _WORD.findall(foot.frame)}
        for group, which in zip(groups, (other, one), strict=True):
            if words & which:
                group.append(foot.middle[:2])
    if not all(groups):
        return np.zeros(2)
    way = np.mean(groups[1], axis=0) - np.mean(groups[0], axis=0)
    return np.asarray(way / max(float(np.linalg.norm(way)), 1e-9))


def _quarter(ahead: Float[np.ndarray, " 2"]) -> float:
    """A horizontal direction's heading [deg], to the nearest quarter turn."""
    angle = np.degrees(np.arctan2(ahead[1], ahead[0]))
    return float(np.round(angle / 90.0) * 90.0) % 360.0


def _knees_axis(
    robot: Robot, q: Float[np.ndarray, " nq"], feet: tuple[Foot, ...]
) -> Float[np.ndarray, " 2"] | None:
    """The horizontal axis about which most joints of every leg turn, or None."""
    axes = []
    for foot in feet:
        turning = np.array([_turning_axis(robot, q, i)[:2] for i in robot.limb(foot.joint)])
        counts, directions = np.linalg.eigh(turning.reshape(-1, 2).T @ turning.reshape(-1, 2))
        if counts[1] - counts[0] < _PLAINLY:
            return None
        axes.append(directions[:, 1])
    if not axes or min(abs(float(axes[0] @ axis)) for axis in axes) < _PARALLEL:
        return None
    return np.asarray(axes[0])


@dataclass(frozen=True)
class StraightLeg:
    """The joints of a leg whose knee is straight.

    Attributes:
        hips: that pitch the thigh: one, or several that do so together.
        knee: its knee.
        ankle: its ankle; None over a point.
    """

    hips: tuple[str, ...]
    knee: str
    ankle: str | None


def straight_legs(
    robot: Robot, q: Float[np.ndarray, " nq"], feet: tuple[Foot, ...], heading: float
) -> tuple[StraightLeg, ...]:
    """The legs whose knee is straight at a configuration, for a heading [deg]."""
    legs = []
    for foot in feet:
        leg = _leg(robot, q, foot, heading)
        if leg is not None and _knee_angle(robot, q, leg, foot, heading) < _STRAIGHT:
            legs.append(leg)
    return tuple(legs)


def bent_knees(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    legs: tuple[StraightLeg, ...],
    heading: float,
    bend: float,
) -> dict[str, float]:
    """Joint -> position [rad] that bends straight knees, ahead where their ranges allow it."""
    lower, upper = robot.position_limits
    posture: dict[str, float] = {}
    for leg in legs:
        for way in (1.0, -1.0):
            found = _pitched(robot, q, leg.hips, heading, -way * bend / 2)
            shares = ((leg.knee, bend), (leg.ankle, -bend / 2))
            found |= {
                joint: robot.joint_position(q, joint)
                + way * _sign(robot, q, joint, heading) * share
                for joint, share in shares
                if joint is not None
            }
            index = [robot.velocity_index(joint) - robot.base_nv for joint in found]
            if all(lower[i] <= at <= upper[i] for i, at in zip(index, found.values(), strict=True)):
                posture |= found
                break
    return posture


def _leg(
    robot: Robot, q: Float[np.ndarray, " nq"], foot: Foot, heading: float
) -> StraightLeg | None:
    """The last joints of a leg that turn about the lateral axis: hip, knee (and ankle).

    Where a hip has no such joint of its own, all that turn above the knee pitch the thigh together,
    if they can.
    """
    names = [robot.model.names[i] for i in robot.limb(foot.joint)]
    pitch = [name for name in names if abs(_axis(robot, q, name, heading)) > 0.8]
    below = 2 if foot.kind == "surface" else 1
    if len(pitch) < below:
        return None
    knee, ankle = pitch[-below], pitch[-1] if below == 2 else None
    if len(pitch) > below:
        return StraightLeg((pitch[-below - 1],), knee, ankle)
    hips = tuple(names[: names.index(knee)])
    axes = np.array([_turning_axis(robot, q, robot.model.getJointId(name)) for name in hips])
    if not hips or np.linalg.matrix_rank(axes, tol=_SPANNED) < 3:
        return None
    return StraightLeg(hips, knee, ankle)


def _pitched(
    robot: Robot, q: Float[np.ndarray, " nq"], hips: tuple[str, ...], heading: float, angle: float
) -> dict[str, float]:
    """Positions [rad] of hip joints that turn the thigh about the robot's left by an angle."""
    here = {joint: robot.joint_position(q, joint) for joint in hips}
    if len(hips) == 1:
        return {joint: at + _sign(robot, q, joint, heading) * angle for joint, at in here.items()}
    model, data, moved = robot.model, robot.model.createData(), np.array(q)
    last = model.getJointId(hips[-1])
    columns = [robot.velocity_index(joint) for joint in hips]
    pin.forwardKinematics(model, data, moved)
    wanted = pin.exp3(_left(heading) * angle) @ data.oMi[last].rotation
    for _ in range(_NEWTON):
        axes = np.array([_turning_axis(robot, moved, model.getJointId(joint)) for joint in hips]).T
        pin.forwardKinematics(model, data, moved)
        step = np.zeros(model.nv)
        step[columns] = np.linalg.lstsq(axes, pin.log3(wanted @ data.oMi[last].rotation.T))[0]
        moved = pin.integrate(model, moved, step)
    # To a tenth of a degree: where the posture goes is decided by the ground.
    return {j: float(np.radians(np.degrees(robot.joint_position(moved, j)).round(1))) for j in hips}


def _axis(robot: Robot, q: Float[np.ndarray, " nq"], joint: str, heading: float) -> float:
    """Part of a joint's axis along the robot's left; zero for a joint of another kind."""
    return float(_turning_axis(robot, q, robot.model.getJointId(joint)) @ _left(heading))


def _left(heading: float) -> Float[np.ndarray, " 3"]:
    """The robot's left in the world."""
    return np.array([-np.sin(np.radians(heading)), np.cos(np.radians(heading)), 0.0])


def _turning_axis(robot: Robot, q: Float[np.ndarray, " nq"], joint: int) -> Float[np.ndarray, " 3"]:
    """World axis about which a joint turns; zero for a joint of another kind."""
    if robot.model.joints[joint].nv != 1 or robot.joint_unit(robot.model.names[joint]) != "rad":
        return np.zeros(3)
    data = robot.model.createData()
    jacobian = pin.computeJointJacobian(robot.model, data, q, joint)
    pin.forwardKinematics(robot.model, data, q)
    return np.asarray(data.oMi[joint].rotation @ jacobian[3:, robot.model.joints[joint].idx_v])


def _sign(robot: Robot, q: Float[np.ndarray, " nq"], joint: str, heading: float) -> float:
    return 1.0 if _axis(robot, q, joint, heading) > 0 else -1.0


def _knee_angle(
    robot: Robot, q: Float[np.ndarray, " nq"], leg: StraightLeg, foot: Foot, heading: float
) -> float:
    """Angle [rad] between thigh and shin as seen from the robot's side.

    Joints stand anywhere along their axes: a thigh beside its hip does not bend the knee.
    """
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    hip, knee = (data.oMi[robot.model.getJointId(j)].translation for j in (leg.hips[-1], leg.knee))
    end = foot.middle
    if leg.ankle is not None:
        end = data.oMi[robot.model.getJointId(leg.ankle)].translation
    left = _left(heading)
    thigh, shin = (line - (line @ left) * left for line in (knee - hip, end - knee))
    cosine = thigh @ shin / max(float(np.linalg.norm(thigh) * np.linalg.norm(shin)), 1e-12)
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
