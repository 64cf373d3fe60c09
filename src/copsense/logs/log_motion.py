"""LogMotion: the configurations of a log, smoothed, with the base that its feet or the log give.

Joints are smoothed by a Savitzky-Golay filter (cubic), as long as a tenth of the sway's period and
half a second at most: it leaves a sinusoid of that period within 1e-4 of its size. Velocities are
central differences of the smoothed configurations, accelerations the filter's derivative of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from copsense.contact import Contact
from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError
from copsense.logs.finding import stretches
from copsense.logs.log import Log
from copsense.robot import Robot

SHARE = 0.1  # of the sway's period that the filter is long
LONGEST = 0.5  # s, and never longer
# Joint rows (N, nq), samples to smooth over, and which of the log's rows they are (every first,
# second ...) -> the same array with the base in place.
Stand = Callable[[np.ndarray, int, int], np.ndarray]
_LEAST = 5  # samples: a cubic through fewer smooths nothing


@dataclass(frozen=True, eq=False, repr=False)
class LogMotion(ShortRepr):
    """How a robot moved in a log.

    Attributes:
        configurations: q (N, nq), the base standing on the first contact's plane z = 0.
        velocities: v (N, nv).
        accelerations: dv/dt (N, nv).
        known: (N,) rows whose joints were measured; the others bridge gaps.
        window: length of the smoothing filter [s].
    """

    configurations: Float[np.ndarray, "N nq"]
    velocities: Float[np.ndarray, "N nv"]
    accelerations: Float[np.ndarray, "N nv"]
    known: Bool[np.ndarray, " N"]
    window: float

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "configurations", "velocities", "accelerations", "known")


def bridged(values: Float[np.ndarray, "N k"]) -> Float[np.ndarray, "N k"]:
    """The same with what is missing filled in linearly, so that filters can pass over it.

    Raises:
        InvalidInputError: a column is missing altogether.
    """
    found, rows = np.array(values), np.arange(len(values))
    for column in found.T:
        known = np.isfinite(column)
        if not known.any():
            raise InvalidInputError(
                "a joint of the log has no finite position at all. Map another signal, or ignore "
                "this joint."
            )
        if not known.all():
            column[~known] = np.interp(rows[~known], rows[known], column[known])
    return found


def smoothing_window(frequency: float, step: float) -> int:
    """Samples, an odd number, that the filter takes for a sway of a frequency [Hz]."""
    length = LONGEST if not np.isfinite(frequency) else min(LONGEST, SHARE / frequency)
    return max(_LEAST, 2 * round(length / step / 2) + 1)


def joint_rows(log: Log, robot: Robot) -> Float[np.ndarray, "N nq"]:
    """Configurations with the log's joints, gaps bridged, and the base at the origin.

    Args:
        log: all of its joints are the robot's.
        robot: with no other joints than the log's.
    """
    positions = bridged(log.positions)
    q = np.tile(pin.neutral(robot.model), (len(log.times), 1))
    for name, column in zip(log.joint_names, positions.T, strict=True):
        joint = robot.model.joints[robot.joint_id(name)]
        if joint.nq == 2:  # turns without end: cosine and sine
            q[:, joint.idx_q], q[:, joint.idx_q + 1] = np.cos(column), np.sin(column)
        else:
            q[:, joint.idx_q] = column
    return q


def stand_on_feet(
    robot: Robot, contacts: Sequence[Contact], q: Float[np.ndarray, "N nq"]
) -> Float[np.ndarray, "N nq"]:
    """The configurations with the base where the contacts put it, in the array given.

    The first contact with a surface stands level at the origin. On points alone the base is where
    all of them fit best to where they are on average, their common plane level.

    Raises:
        InvalidInputError: fewer than three points and no surface.
    """
    model, data = robot.model, robot.model.createData()
    places = [contact.on(robot) for contact in contacts]
    surface = next((k for k, c in enumerate(contacts) if c.kind != "point"), None)
    if robot.base_nv != 6:
        raise InvalidInputError(
            f"{robot.name!r} lives in a plane; a log's base is a pose in space. Use a robot with a "
            "free base."
        )
    if surface is None and len(contacts) < 3:
        raise InvalidInputError(
            f"{len(contacts)} point contact(s) do not say where the base is. Give three or more, "
            "or base='recorded' (--base recorded) with a log that has it."
        )
    points = np.empty((len(q), len(contacts), 3))
    for i, row in enumerate(q):
        pin.forwardKinematics(model, data, row)
        poses = [data.oMi[joint] * place for joint, place in places]
        points[i] = [pose.translation for pose in poses]
        if surface is not None:
            _move(q[i], poses[surface].inverse())
    if surface is None:
        target = _levelled(_average(points), np.array(pin.centerOfMass(model, data, q[0])))
        for i in range(len(q)):
            _move(q[i], _fit(points[i], target))
    return q


def put_on_base(
    robot: Robot,
    q: Float[np.ndarray, "N nq"],
    base: Float[np.ndarray, "N 7"],
    frame: str,
    window: int,
) -> Float[np.ndarray, "N nq"]:
    """The configurations with the base as recorded, in the array given.

    Args:
        robot: the robot.
        q: joint rows.
        base: position and quaternion.
        frame: of the robot, which `base` places; empty for the root link.
        window: samples over which the base is smoothed, 1 for none.

    Raises:
        UnknownNameError: no such frame.
        InvalidInputError: the frame is not fixed to the base.
    """
    at = pin.SE3.Identity()
    if frame:
        own = robot.frame(frame)
        if own.parentJoint != 1:
            raise InvalidInputError(
                f"the recorded base places {frame!r}, which is not fixed to the robot's base. "
                "Record the root link, or leave the base to the feet."
            )
        at = own.placement.inverse()
    from scipy.signal import savgol_filter

    poses = bridged(base)
    if window > 3:
        poses = savgol_filter(poses, window, 3, axis=0)
    for row, pose in zip(q, poses, strict=True):
        turn = pin.Quaternion(np.array(pose[3:])).normalized()
        _put(row, pin.SE3(turn.matrix(), np.array(pose[:3])) * at)
    return q


def smooth_motion(
    robot: Robot,
    q: Float[np.ndarray, "N nq"],
    window: int,
    step: float,
    stand: Stand,
    known: Bool[np.ndarray, " N"],
) -> LogMotion:
    """Smoothed configurations and their derivatives.

    Args:
        robot: the robot.
        q: joint rows as recorded, gaps bridged (N, nq); overwritten.
        window: of the filter, samples.
        step: from row to row [s].
        stand: puts the base in place, after the joints were smoothed.
        known: rows that were measured.

    Raises:
        InvalidInputError: the log is shorter than the filter.
    """
    from scipy.signal import savgol_filter

    if len(q) < window + 2:
        raise InvalidInputError(
            f"the log has {len(q)} rows, fewer than the {window + 2} that smoothing takes. Give a "
            "longer log."
        )
    model = robot.model
    q[:, 7:] = savgol_filter(q[:, 7:], window, 3, axis=0)
    for joint in list(model.joints)[2:]:
        if joint.nq == 2:
            pair = q[:, joint.idx_q : joint.idx_q + 2]
            pair /= np.linalg.norm(pair, axis=1, keepdims=True)
    configurations = stand(q, window, 1)
    last = len(q) - 1
    v = np.empty((len(q), model.nv))
    for i in range(len(q)):
        a, b = max(0, i - 1), min(last, i + 1)
        v[i] = pin.difference(model, configurations[a], configurations[b]) / ((b - a) * step)
    acceleration = savgol_filter(v, window, 3, deriv=1, delta=step, axis=0)
    # In a gap, and near one, the bridge's corners are not accelerations.
    wide = np.array(known)
    for first, end in stretches(~known):
        wide[max(0, first - window // 2) : end + window // 2 + 1] = False
    return LogMotion(configurations, v, acceleration, wide & known, window * step)


def com_rows(robot: Robot, q: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N 3"]:
    """The centre of mass of every row."""
    data = robot.model.createData()
    return np.array([pin.centerOfMass(robot.model, data, row) for row in q])


def _put(q: np.ndarray, pose: pin.SE3) -> None:
    q[:3] = pose.translation
    q[3:7] = pin.Quaternion(pose.rotation).normalized().coeffs()


def _move(q: np.ndarray, move: pin.SE3) -> None:
    """Move the whole robot."""
    turn = pin.Quaternion(np.array(q[3:7])).normalized()
    _put(q, move * pin.SE3(turn.matrix(), np.array(q[:3])))


def _average(points: np.ndarray) -> np.ndarray:
    """Where the points are on average, each row fitted onto the first."""
    first = points[0]
    moved = [_fit(row, first) for row in points]
    fitted = [row @ m.rotation.T + m.translation for m, row in zip(moved, points, strict=True)]
    return np.asarray(np.mean(fitted, axis=0))


def _levelled(points: np.ndarray, com: np.ndarray) -> np.ndarray:
    """The points with their best plane at z = 0, the CoM above it, their middle at the origin."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred)[2][2]
    if normal @ (com - points.mean(axis=0)) < 0:
        normal = -normal
    turn = pin.Quaternion.FromTwoVectors(normal, np.array([0.0, 0.0, 1.0])).matrix()
    return np.asarray(centred @ turn.T)


def _fit(points: np.ndarray, target: np.ndarray) -> pin.SE3:
    """The rigid motion that brings points nearest to a target (Kabsch 1976)."""
    a, b = points.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((points - a).T @ (target - b))
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(vt.T @ u.T)))])
    R = vt.T @ flip @ u.T
    return pin.SE3(R, b - R @ a)
