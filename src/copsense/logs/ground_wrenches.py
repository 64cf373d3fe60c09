"""Ground wrenches: what the ground did to each foot, from sensors in soles, legs or the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs.log import WORLD, Log, WrenchSeries
from copsense.logs.log_motion import LogMotion
from copsense.robot import Robot


def ground_wrenches(
    log: Log, robot: Robot, contacts: Sequence[Contact], motion: LogMotion, world: bool
) -> Float[np.ndarray, "N nc 6"]:
    """Wrench of the ground on each contact, in contact axes [N, Nm]; NaN where not measured.

    Args:
        log: the log.
        robot: the robot.
        contacts: the contacts; several sensors of one contact are added up.
        motion: of the log.
        world: whether the motion's world is the log's own, so that plates can be placed in it.

    Raises:
        UnknownNameError: a sensor's contact or frame is not the robot's.
        InvalidInputError: a sensor that cannot serve its contact.
    """
    names = [c.name for c in contacts]
    found = np.full((len(log.times), len(contacts), 6), np.nan)
    for series in log.wrenches:
        at = _contact_of(series, contacts)
        if at is None:
            raise UnknownNameError(f"contact for the sensor {series.name!r}", series.contact, names)
        one = _at_contact(series, robot, contacts[at], motion, world)
        added = found[:, at]
        found[:, at] = np.where(np.isnan(added), one, added + np.where(np.isnan(one), 0.0, one))
    return found


def _contact_of(series: WrenchSeries, contacts: Sequence[Contact]) -> int | None:
    for k, contact in enumerate(contacts):
        if series.contact in (contact.name, contact.frame):
            return k
    return None


def _at_contact(
    series: WrenchSeries, robot: Robot, contact: Contact, motion: LogMotion, world: bool
) -> Float[np.ndarray, "N 6"]:
    """One sensor's rows as wrenches on the contact, in its axes about its origin."""
    values = series.values
    joint, place = contact.on(robot)
    if series.kind == "plate":
        if not world and not series.normal_only:
            values = _normal_part(values)
        elif world:
            return _turned(values, robot, joint, place, motion, about_origin=False)
        return values
    if not series.frame:
        return values
    if series.frame == WORLD:
        return _turned(values, robot, joint, place, motion, about_origin=True)
    own = robot.frame(series.frame)
    if series.normal_only and series.frame != contact.frame:
        raise InvalidInputError(
            f"the sensor {series.name!r} gives one number in {series.frame!r}: it is not the "
            f"normal force of {contact.name!r}. Map its six numbers, or its frame as the contact's."
        )
    if series.kind == "sole":
        if own.parentJoint != joint:
            raise InvalidInputError(
                f"the sensor {series.name!r} is in {series.frame!r}, on another link than the "
                f'contact {contact.name!r}. Map it with kind = "leg", so that the weight below '
                "it is taken off."
            )
        if series.normal_only:
            return values
        return _rows(place.actInv(own.placement), values)
    if joint not in robot.model.subtrees[own.parentJoint]:
        raise InvalidInputError(
            f"the sensor {series.name!r} in {series.frame!r} is not between the base and the "
            f"contact {contact.name!r}. Map it to the contact that its limb ends in."
        )
    return _below_taken_off(values, robot, series.frame, joint, place, motion)


def _below_taken_off(
    values: np.ndarray, robot: Robot, frame: str, joint: int, place: pin.SE3, motion: LogMotion
) -> Float[np.ndarray, "N 6"]:
    """The ground's wrench from one in the leg: weight and inertia below the sensor taken off.

    ground = sensor + sum over what hangs below of (I a + v x* I v), with a of the links less
    gravity.
    """
    model, data = robot.model, robot.model.createData()
    own = robot.frame(frame)
    inertias = _below(robot, frame)
    found = np.full((len(values), 6), np.nan)
    for i in np.flatnonzero(np.isfinite(values).all(axis=1)):
        q, v, a = motion.configurations[i], motion.velocities[i], motion.accelerations[i]
        pin.forwardKinematics(model, data, q)  # where the links are
        pin.rnea(model, data, q, v, a)  # leaves in a_gf their accelerations less gravity
        sensor = data.oMi[own.parentJoint] * own.placement
        total = sensor.act(pin.Force(values[i]))
        for body, inertia in inertias:
            moved = inertia * data.a_gf[body] + inertia.vxiv(data.v[body])
            total += data.oMi[body].act(moved)
        found[i] = (data.oMi[joint] * place).actInv(total).vector
    return found


def _below(robot: Robot, frame: str) -> list[tuple[int, pin.Inertia]]:
    """Joint -> inertia, in its axes, of what a frame's link and all that hangs from it weigh."""
    model, root = robot.model, robot.frame_id(frame)
    # A link's own frame hangs from that of the joint which fixes it, and that one has its inertia.
    if model.frames[root].type == pin.FrameType.BODY:
        root = int(model.frames[root].parentFrame)
    joint = int(model.frames[root].parentJoint)
    if model.frames[root].type == pin.FrameType.JOINT:
        return [(int(j), model.inertias[j]) for j in model.subtrees[joint]]
    below, size = {root}, 0
    while len(below) > size:
        size = len(below)
        below |= {i for i, f in enumerate(model.frames) if f.parentFrame in below}
    found: list[tuple[int, pin.Inertia]] = []
    for own in (model.frames[i] for i in below):
        if own.parentJoint == joint:
            if own.inertia.mass > 0:
                found.append((joint, own.placement.act(own.inertia)))
        elif own.type == pin.FrameType.JOINT:
            found.append((int(own.parentJoint), model.inertias[own.parentJoint]))
    return found


def _turned(
    values: np.ndarray,
    robot: Robot,
    joint: int,
    place: pin.SE3,
    motion: LogMotion,
    about_origin: bool,
) -> np.ndarray:
    """Wrenches in world axes, about the contact's origin or the world's, in contact axes."""
    model, data = robot.model, robot.model.createData()
    found = np.full(values.shape, np.nan)
    for i, row in enumerate(values):
        pin.forwardKinematics(model, data, motion.configurations[i])
        pose = data.oMi[joint] * place
        f, m = row[:3], row[3:]
        if not about_origin:
            m = m - np.cross(pose.translation, f)
        found[i] = np.concatenate([pose.rotation.T @ f, pose.rotation.T @ m])
    return found


def _rows(move: pin.SE3, values: np.ndarray) -> np.ndarray:
    """Wrenches in another frame of the same link."""
    R, p = move.rotation, move.translation
    force = values[:, :3] @ R.T
    return np.hstack([force, values[:, 3:] @ R.T + np.cross(p, force)])


def _normal_part(values: np.ndarray) -> np.ndarray:
    found = np.full(values.shape, np.nan)
    found[:, 2] = values[:, 2]
    return found
