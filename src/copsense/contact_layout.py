"""ContactLayout: where the rows of a robot's contacts stand in forces, and on which joints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from scipy.linalg import block_diag

from copsense.arrays import read_only
from copsense.contact import COMPONENT_NAMES, Contact, Plane
from copsense.errors import ContactGeometryError, InvalidInputError
from copsense.rigid_body import Attachment
from copsense.robot import Robot

# How far a contact may lie from its stated plane.
POSITION_TOLERANCE = 1e-6  # m
ANGLE_TOLERANCE = 1e-6  # rad


@dataclass(frozen=True, eq=False)
class ContactLayout:
    """What a robot's contacts are at every configuration.

    Attributes:
        names: of the contacts.
        attachments: joint and placement on it of each contact frame.
        fixed_axes: world axes of a point contact; None for others, which turn with the foot.
        rows: of each contact in stacked forces.
        row_names: of stacked forces.
        component_index: component 0..5 of each row (m,).
        places: where each row stands among the contacts' wrenches, six numbers each (m,).
        edge_rows: rows of the soles' edges over the contacts' wrenches, in shares of the weight.
        edges: rows of each contact among them.
        line_edges: those of the contacts whose sole is a line.
    """

    names: tuple[str, ...]
    attachments: tuple[Attachment, ...]
    fixed_axes: tuple[Float[np.ndarray, "3 3"] | None, ...]
    rows: tuple[slice, ...]
    row_names: tuple[str, ...]
    component_index: Int[np.ndarray, " m"]
    places: Int[np.ndarray, " m"]
    edge_rows: Float[np.ndarray, "e k"]
    edges: tuple[slice, ...]
    line_edges: tuple[slice, ...]


@lru_cache(maxsize=32)  # a path's stances share theirs
def lay_out(robot: Robot, contacts: tuple[Contact, ...]) -> ContactLayout:
    """Validate contacts and look up where they are on the robot.

    Raises:
        InvalidInputError: there is none, two share a name, or one is fixed in the world.
        UnknownNameError: the robot lacks a contact's frame.
    """
    for contact in contacts:
        if not isinstance(contact, Contact):
            raise InvalidInputError(f"{contact!r} is not a contact. Give Contact(frame=...).")
    names = tuple(contact.name for contact in contacts)
    if not names:
        raise InvalidInputError(
            "a stance needs at least one contact. Give Contact(frame=...) for each foot; "
            f"frames of {robot.name!r}: {', '.join(robot.frame_names)}."
        )
    if len(set(names)) != len(names):
        raise InvalidInputError(
            f"two contacts share a name: {', '.join(names)}. Give each frame once, or name "
            "the contacts apart with Contact(name=...)."
        )
    for contact in contacts:
        if robot.frame(contact.frame).parentJoint == 0:
            raise InvalidInputError(
                f"frame {contact.frame!r} of contact {contact.name!r} is fixed in the world, not "
                "part of the robot. Name a frame of a foot."
            )
    ends = np.cumsum([0] + [len(contact.components) for contact in contacts])
    component = np.array([i for contact in contacts for i in contact.components])
    owner = np.repeat(np.arange(len(contacts)), np.diff(ends))
    edges = block_diag(*(contact.edge_rows for contact in contacts)) / robot.weight
    edge_ends = np.cumsum([0] + [len(contact.edge_rows) for contact in contacts])
    of_contacts = _slices(edge_ends)
    return ContactLayout(
        names,
        tuple(contact.on(robot) for contact in contacts),
        tuple((c.plane or Plane()).axes if c.kind == "point" else None for c in contacts),
        _slices(ends),
        tuple(f"{c.name} {COMPONENT_NAMES[i]}" for c in contacts for i in c.components),
        read_only(component),
        read_only(6 * owner + component),
        read_only(edges),
        of_contacts,
        tuple(r for c, r in zip(contacts, of_contacts, strict=True) if c.sole and len(c.sole) == 2),
    )


def _slices(ends: np.ndarray) -> tuple[slice, ...]:
    return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def check_plane(contact: Contact, foot: pin.SE3) -> None:
    """Reject a contact frame that is not on its plane.

    Args:
        contact: the contact; one without a plane lies where it will.
        foot: where its frame is in the world.

    Raises:
        ContactGeometryError: it is off the plane, or its z axis is not the plane's normal.
    """
    if contact.plane is None:
        return
    # Written out: these few numbers would take NumPy longer than all of the kinematics.
    (a, b, c), (px, py, pz) = contact.plane.normal, contact.plane.point
    x, y, z = foot.translation.tolist()
    u, v, w = foot.rotation[:, 2].tolist()
    height = a * (x - px) + b * (y - py) + c * (z - pz)
    along = a * u + b * v + c * w
    tilt = math.hypot(v * c - w * b, w * a - u * c, u * b - v * a)
    turned = contact.kind != "point" and (tilt > ANGLE_TOLERANCE or along < 0)
    if abs(height) > POSITION_TOLERANCE or turned:
        degrees = math.degrees(math.atan2(tilt, along))
        raise ContactGeometryError(
            f"contact {contact.name!r} is not on its plane: its origin is {height * 1e3:+.3f} "
            f"mm off along the normal"
            + ("" if contact.kind == "point" else f" and its z axis {degrees:.3f} deg away")
            + ". Move the base or the joints (copsense.solve_posture places the feet), "
            "correct the contact's offset or rotation, or drop its plane."
        )
