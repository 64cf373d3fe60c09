"""perturbed: the stance and the limits of a model with given errors, whole and not linearised.

It is what the derivatives of `source_changes` are held against, and what samples are drawn of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact, Plane
from copsense.limits import Limits, friction_of
from copsense.posture import retract, solve_posture
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.uncertainty.source import AXES, PLACES, SLOPES, Source
from copsense.uncertainty.source_changes import (
    inertial_joint,
    joint_displacement,
    sole_displacement,
    with_friction,
)

_POSTURE = ("offset", "place", "height")
_ROBOT = ("mass", "com", "payload", "slope", "torque")


def perturbed(stance: Stance, sources: Sequence[Source], errors: Float[np.ndarray, " p"]) -> Stance:
    """The stance as it truly is where a model has these errors.

    Joints stand elsewhere than their encoders say, as far as the contacts let them; contacts stand
    elsewhere, and the posture follows with its centre of mass over the same point (by the model);
    then links, soles and the ground's slope are others. Everything is given in the ground's axes,
    loads included.

    Args:
        stance: by the model.
        sources: what is wrong.
        errors: by how much (p,), each in its source's unit.

    Raises:
        UnreachablePostureError: the joints cannot follow the contacts.
        InvalidInputError: a link's mass would not be positive.
    """
    given = [(s, e) for s, e in zip(sources, errors.tolist(), strict=True) if e]
    moved = _moved(stance, [(s, e) for s, e in given if s.kind in _POSTURE])
    of_robot = [(s, e) for s, e in given if s.kind in _ROBOT]
    of_soles = [(s, e) for s, e in given if s.kind == "sole"]
    if not of_robot and not of_soles:
        return moved
    robot = _other(stance.robot, of_robot) if of_robot else stance.robot
    contacts = [
        _shifted(contact, [(s, e) for s, e in of_soles if s.where == contact.name])
        for contact in moved.contacts
    ]
    return Stance(robot, moved.q, contacts, False, moved.loads)


def perturbed_limits(
    stance: Stance, limits: Limits, sources: Sequence[Source], errors: Float[np.ndarray, " p"]
) -> Limits:
    """The limits with the errors of friction; a coefficient below zero is zero."""
    friction: dict[str, float] = {}
    for source, error in zip(sources, errors, strict=True):
        if source.kind == "friction":
            contact = stance.contacts[stance.contact_names.index(source.where)]
            own = friction_of(contact, limits)
            assert own is not None  # `sources_of` rejects it
            friction[source.where] = max(own + float(error), 0.0)
    return with_friction(stance, limits, friction) if friction else limits


def _moved(stance: Stance, given: Sequence[tuple[Source, float]]) -> Stance:
    """The stance where joints and contacts truly stand, by the model's own masses."""
    robot, here = stance.robot, stance
    offsets = np.zeros(robot.model.nv - robot.base_nv)
    places = np.zeros((len(stance.contacts), 6))
    for source, error in given:
        if source.kind == "offset":
            offsets[robot.velocity_index(source.where) - robot.base_nv] = error
        else:
            places[stance.contact_names.index(source.where), PLACES[source.part]] = error
    if offsets.any():
        here = retract(here, joint_displacement(here, offsets))
    if not places.any():
        return here
    targets = [
        place * pin.exp6(pin.Motion(d)) for place, d in zip(here.placements, places, strict=True)
    ]
    contacts = [
        replace(contact, plane=_through(place)) if contact.kind == "point" else _freed(contact)
        for contact, place in zip(here.contacts, targets, strict=True)
    ]
    free = Stance(robot, here.q, contacts, False, here.loads)
    x, y, _ = here.com.tolist()
    com = (x if robot.base_nv == 6 else None, y, None)
    return solve_posture(free, com=com, targets=targets).stance


@lru_cache(maxsize=64)  # samples of one stance share theirs, with all that follows from them
def _freed(contact: Contact) -> Contact:
    """The contact without the plane that it leaves."""
    return replace(contact, plane=None)


def _through(place: pin.SE3) -> Plane:
    """The plane that a point moves to; its axes stay."""
    return Plane(tuple(place.translation.tolist()), tuple(place.rotation[:, 2].tolist()))


def _other(robot: Robot, given: Sequence[tuple[Source, float]]) -> Robot:
    """The robot with other links, held torques, and gravity as the sloping ground sees it."""
    model, held, slope = robot.model.copy(), dict(robot.drives.held), np.zeros(3)
    for source, error in given:
        if source.kind == "torque":
            held[source.where] = held.get(source.where, 0.0) + error
        elif source.kind == "slope":
            slope[SLOPES[source.part]] = error
        else:
            joint = inertial_joint(robot, source)
            model.inertias[joint] = _body(model.inertias[joint], robot, source, error)
    if slope.any():
        turn = pin.rpy.rpyToMatrix(slope)
        model.gravity.linear = turn.T @ robot.model.gravity.linear
    drives = robot.drives
    if held != dict(drives.held):
        drives = replace(drives, held=held)
    return robot.with_dynamics(model, drives)


def _body(body: pin.Inertia, robot: Robot, source: Source, error: float) -> pin.Inertia:
    """A link's inertia with one error; it may be one that no body has, as statics do not mind."""
    found = body.copy()
    mass, lever = float(body.mass), np.array(body.lever)
    if source.kind == "mass":
        found.mass = mass + error
    elif source.kind == "com":
        lever[AXES[source.part]] += error
        found.lever = lever
    else:
        point = robot.frame(source.where).placement.act(np.array(source.point))
        arm = point - lever
        found.mass = mass + error
        if found.mass > 0:  # the robot rejects another
            found.lever = lever + error / found.mass * arm
            about = mass * error / found.mass * ((arm @ arm) * np.eye(3) - np.outer(arm, arm))
            found.inertia = np.array(body.inertia) + about
    return found


def _shifted(contact: Contact, given: Sequence[tuple[Source, float]]) -> Contact:
    """The contact with its frame and sole elsewhere on the link."""
    if not given:
        return contact
    d = sum(error * sole_displacement(source.part) for source, error in given)
    place = pin.SE3(np.array(contact.rotation), np.array(contact.offset)) * pin.exp6(pin.Motion(d))
    x, y, z = place.translation.tolist()
    return replace(contact, offset=(x, y, z), rotation=np.array(place.rotation), plane=None)
