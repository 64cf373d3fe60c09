"""Uprighting: which way is up for a robot whose frames do not say so with their z axes.

Feet are down: from the contacts to the centre of mass is up, roughly. Descriptions drawn with y up,
or foot frames with z forward, differ from it by a quarter turn or two.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.robot import Robot
from copsense.stance import Stance

_ASKEW = 0.5  # cosine under which an axis does not point up: 60 degrees
_PLAIN = 0.7  # cosine from which another axis plainly does
_HIGH = 0.5  # height of the CoM over its contacts, per their spread, from which it says what is up
_AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
_SIGNED = np.vstack([s * np.eye(3)[i] for i in range(3) for s in (1.0, -1.0)])
# Roll, pitch, yaw [deg] that turn an axis of the base up.
_TURNS = {
    "+x": (0, -90, 0),
    "-x": (0, 90, 0),
    "+y": (90, 0, 0),
    "-y": (-90, 0, 0),
    "-z": (180, 0, 0),
}


class UprightWarning(UserWarning):
    """A frame's z axis is not up, and another axis was taken."""


def base_turn(
    robot: Robot, contacts: tuple[Contact, ...], q: Float[np.ndarray, " nq"]
) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a base whose z axis is not up, with a warning; else zeros.

    Args:
        robot: the robot.
        contacts: its contacts; where one is a surface, its sole decides and the base is left.
        q: the configuration to start from, the base not turned.
    """
    up = _upwards(Stance(robot, q, contacts, check=False))
    if up is None or any(c.kind != "point" for c in contacts) or up[2] >= _ASKEW:
        return (0.0, 0.0, 0.0)
    best = int(np.argmax(_SIGNED @ up))
    if _SIGNED[best] @ up < _PLAIN:
        return (0.0, 0.0, 0.0)
    turn = _TURNS[_AXES[best]]
    warnings.warn(
        f"the base's z axis of {robot.name!r} does not point up, away from its contacts: its "
        f"{_AXES[best]} axis does. The base is turned by base_rpy of {turn} degrees (--base-rpy "
        f"{':'.join(map(str, turn))}); give another where that is wrong.",
        UprightWarning,
        stacklevel=4,
    )
    roll, pitch, yaw = (math.radians(angle) for angle in turn)
    return roll, pitch, yaw


def upright_contacts(
    robot: Robot, contacts: tuple[Contact, ...], q: Float[np.ndarray, " nq"]
) -> tuple[Contact, ...]:
    """Contacts on the ground with their z axes up; a frame's other axis is taken with a warning.

    Args:
        robot: the robot.
        contacts: its contacts.
        q: the configuration to start from.

    Raises:
        InvalidInputError: the z axis of a contact that was placed by offset or rotation is not up.
    """
    loose = Stance(robot, q, contacts, check=False)
    up = _upwards(loose)
    if up is None:
        return contacts
    turned = []
    for contact, place in zip(contacts, loose.placements, strict=True):
        normal = (0.0, 0.0, 1.0) if contact.plane is None else contact.plane.normal
        leaning = contact.kind != "surface" or normal[2] < _ASKEW
        shares = _SIGNED @ place.rotation.T @ up  # of each axis of the contact in what is up
        best = int(np.argmax(shares))
        if leaning or shares[4] >= _ASKEW or shares[best] < _PLAIN:
            turned.append(contact)
            continue
        # Forward is the axis that faces along the world's x.
        z = _SIGNED[best]
        ahead = [a for a in _SIGNED if a @ z == 0]
        x = max(ahead, key=lambda a: float((place.rotation @ a)[0]))
        axes = np.column_stack([x, np.cross(z, x), z])
        said = (
            f"the z axis of contact {contact.name!r} does not point up, to the centre of mass: its "
            f"{_AXES[best]} axis does"
        )
        if any(contact.offset) or not np.array_equal(contact.rotation, np.eye(3)):
            rotation = (contact.rotation @ axes).round(6).tolist()
            raise InvalidInputError(
                f"{said}. Give Contact(rotation={rotation}), or leave its offset and rotation "
                "(--sole-height) out to have it turned."
            )
        names = [_AXES[int(np.argmax(_SIGNED @ axis))] for axis in axes.T]
        warnings.warn(
            f"{said}. It is turned: its x, y, z are the frame's {', '.join(names)}.",
            UprightWarning,
            stacklevel=4,
        )
        turned.append(replace(contact, rotation=axes))
    return tuple(turned)


def _upwards(loose: Stance) -> Float[np.ndarray, " 3"] | None:
    """The direction from the contacts to the CoM, or None where it does not say what is up."""
    if loose.robot.base_nv != 6:
        return None
    places = np.array([place.translation for place in loose.placements])
    middle = places.mean(axis=0)
    away = loose.com - middle
    length = float(np.linalg.norm(away))
    spread = float(np.linalg.norm(places - middle, axis=1).max())
    if length <= _HIGH * spread or length == 0.0:
        return None
    return np.asarray(away / length)
