"""Plausibility: a stance that cannot be meant is rejected, or doubted aloud."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.listing import first_few, listed
from copsense.magnitudes import in_metres, in_radians
from copsense.polygon import Polygon
from copsense.reach import robot_reach
from copsense.stance import Stance

_TALL = 20.0  # m between contacts and CoM: no robot of metres is so tall
_SMALL = 5e-3  # m
_LIGHT, _HEAVY = 0.1, 1e4  # kg
_FAR_BEYOND = np.radians(10.0)  # rad beyond a joint's limit
_FAR_SLID = 0.05  # m
_THIN = 1 / 200  # of the robot's reach: a narrower sole is hardly all of it
_FLIPPED = 0.5  # cosine under which a contact was not where its base was turned to: 60 degrees
_AHEAD = 45.0 + 1e-6  # deg between a contact's x axis and world x, beyond which names mislead
_UP = 0.1  # z of a contact's normal from which it stands on something
_LEVEL = 5e-3  # m, and 1 - cosine: soles within it are on one plane
_OVERLAP = 0.1  # of the smaller sole, from which two lie in each other
_STRONG = 3.0  # times weight and reach, from which a held torque is doubted
_WOUND = 4 * np.pi  # rad, from which a spring's rest is hardly in radians
_NAMED = 3  # joints that a doubt names


class ImplausibleStanceWarning(UserWarning):
    """A stance that holds together, and that is hardly meant."""


def check_size(loose: Stance) -> None:
    """Reject a robot whose lengths are not metres, before it is made to stand.

    Raises:
        InvalidInputError: the CoM is tens of metres from the contacts.
    """
    middle = np.mean([place.translation for place in loose.placements], axis=0)
    away = float(np.linalg.norm(loose.com - middle))
    if away > _TALL:
        unit = "millimetres" if away > 100.0 else "centimetres"
        scale = "0.001" if away > 100.0 else "0.01"
        raise InvalidInputError(
            f"the CoM of {loose.robot.name!r} is {away:.3g} m from its contacts: are its lengths "
            f"{unit}? Descriptions are in metres: scale them by {scale}."
        )


def check_plausible(stance: Stance) -> Stance:
    """Reject a stance with its CoM under all of its ground, and warn of what is hardly meant.

    Raises:
        InvalidInputError: the robot hangs under its contacts.
    """
    ground = [p for p in stance.placements if p.rotation[2, 2] > _UP]
    height = float(stance.com[2])
    if ground and stance.robot.base_nv == 6:
        lowest = min(float(place.translation[2]) for place in ground)
        if height < lowest:
            raise InvalidInputError(
                f"the CoM of {stance.robot.name!r} comes to lie {(lowest - height) * 1e3:.0f} mm "
                "under all of its contacts: it hangs upside down under the ground. The contact "
                "frames' z axes have to point up, out of the ground: give contacts a rotation, "
                "the base its orientation (base_rpy, --base-rpy), or other frames. A robot that "
                "does hang is a copsense.Stance(robot, q, contacts)."
            )
    for note in plausibility_notes(stance):
        warnings.warn(note, ImplausibleStanceWarning, stacklevel=4)
    return stance


def plausibility_notes(stance: Stance) -> tuple[str, ...]:
    """What of a stance is hardly meant, in words; empty where all is plausible."""
    return (
        *_size_notes(stance),
        *_sole_notes(stance),
        *_overlap_notes(stance),
        *_drive_notes(stance),
        *_joint_notes(stance),
        *_hanging_notes(stance),
    )


def heading_notes(stance: Stance) -> tuple[str, ...]:
    """Which feet face elsewhere than ahead (world x), so that their own front and left are others.

    Results name the sides of a sole by the contact's axes: x the front, y the left.
    """
    turned: dict[int, list[str]] = {}
    for contact, place in zip(stance.contacts, stance.placements, strict=True):
        x, _, z = place.rotation.T
        if contact.kind == "point" or z[2] <= _UP:
            continue  # its axes are its plane's, or it does not stand on it
        angle = float(np.degrees(np.arctan2(x[1], x[0])))
        if abs(angle) > _AHEAD:
            turned.setdefault(round(angle), []).append(contact.name)
    return tuple(
        f"the x axis of {listed(names)} points {abs(angle)} deg to the "
        f"{'left' if angle > 0 else 'right'} of world x: front, back, left and right of a sole are "
        "by its own axes. Turn the contact's axes (--contact-rpy, Contact(rotation=)), or the "
        "robot (--base-yaw, base_rpy), for x to point ahead."
        for angle, names in turned.items()
    )


def ceiling_notes(
    contacts: Sequence[Contact], targets: Sequence[pin.SE3], com: Float[np.ndarray, " 3"]
) -> list[str]:
    """Doubts about planes that face down and lie under the robot, in words.

    Args:
        contacts: the contacts.
        targets: where they will be, in the world.
        com: the robot's centre of mass as it starts [m].
    """
    floor = min(float(target.translation[2]) for target in targets)
    notes = []
    for contact, target in zip(contacts, targets, strict=True):
        facing = 1.0 if contact.plane is None else contact.plane.normal[2]
        under = float(target.translation[2]) - floor <= abs(float(com[2]) - floor) / 2
        if facing < -_UP and under:
            notes.append(
                f"The plane of contact {contact.name!r} faces down, as a ceiling does, and lies "
                "at the height of the feet. A plane's normal points out of it, towards the robot: "
                "a floor's is (0, 0, 1) (--plane FRAME=0:0:1)."
            )
    return notes


def warn_of_turn(start: Stance, rpy: Float[np.ndarray, " 3"]) -> None:
    """Warn where a base orientation turns the first sole away from its plane.

    The robot is then turned back until that lies flat, and its heading is whatever comes of it.

    Args:
        start: the stance as the base was turned, before it is made to stand.
        rpy: roll, pitch, yaw of the base as given [rad].
    """
    for contact, place in zip(start.contacts, start.placements, strict=True):
        normal = np.array((0.0, 0.0, 1.0) if contact.plane is None else contact.plane.normal)
        if contact.kind != "surface" or normal[2] <= _UP:
            continue
        cosine = float(np.clip(place.rotation[:, 2] @ normal, -1.0, 1.0))
        if cosine < _FLIPPED:
            given = ":".join(f"{angle:.4g}" for angle in np.degrees(rpy))
            warnings.warn(
                f"A base turned by {given} degrees has contact {contact.name!r} "
                f"{np.degrees(np.arccos(cosine)):.0f} degrees off its plane; the robot was turned "
                "back until it lies flat. Leave base_rpy (--base-rpy) out, or give it the yaw "
                "alone (--base-yaw).",
                ImplausibleStanceWarning,
                stacklevel=3,
            )
        return


def _size_notes(stance: Stance) -> list[str]:
    robot, notes = stance.robot, []
    middle = np.mean([place.translation for place in stance.placements], axis=0)
    away = float(np.linalg.norm(stance.com - middle))
    if away > _TALL or away < _SMALL:
        notes.append(
            f"The CoM is {away:.3g} m from the contacts: are the lengths of {robot.name!r} metres?"
        )
    if robot.mass < _LIGHT or robot.mass > _HEAVY:
        grams = "missing, or in tonnes" if robot.mass < _LIGHT else "grams"
        notes.append(
            f"The whole of {robot.name!r} weighs {robot.mass:.3g} kg: are its masses {grams}?"
        )
    return notes


def _sole_notes(stance: Stance) -> list[str]:
    """Soles of another size than the robot."""
    robot, notes = stance.robot, []
    reach = robot_reach(robot)
    for contact in stance.contacts:
        away = float(np.linalg.norm(contact.offset))
        if away > 2 * reach:
            notes.append(
                f"Contact {contact.name!r} is {away:.3g} m from its frame, and {robot.name!r} "
                f"reaches {reach:.2g} m from its base. {in_metres(away)}"
            )
        if contact.sole is None or contact.kind != "surface":
            continue
        length, width = sorted(np.ptp(contact.sole.vertices, axis=0).tolist(), reverse=True)
        if length > 2 * reach:
            notes.append(
                f"The sole of {contact.name!r} is {length:.3g} m long, and {robot.name!r} reaches "
                f"{reach:.2g} m from its base. {in_metres(length)}"
            )
        if contact.sole.area and width < _THIN * reach:
            notes.append(
                f"The sole of {contact.name!r} is {length * 1e3:.3g} x {width * 1e3:.2g} mm, thin "
                f"under a robot of {reach:.2g} m: is that the whole sole? Give the polygon "
                "(--sole X0:X1:Y0:Y1), another frame, or a point contact."
            )
    return notes


def _overlap_notes(stance: Stance) -> list[str]:
    """Soles of two links on one plane that lie in each other."""
    soles = [
        (contact.name, contact.sole, place, contact.on(stance.robot).joint)
        for contact, place in zip(stance.contacts, stance.placements, strict=True)
        if contact.kind == "surface" and contact.sole is not None and contact.sole.area
    ]
    notes = []
    for (name, sole, here, link), (near, two, there, other) in combinations(soles, 2):
        relative = here.actInv(there)
        if link == other or relative.rotation[2, 2] < 1 - _LEVEL:
            continue
        corners = np.pad(two.vertices, ((0, 0), (0, 1)))
        x, y, z = (corners @ relative.rotation.T + relative.translation).T
        if np.abs(z).max() > _LEVEL:
            continue
        common = Polygon.merged(np.column_stack([x, y]), 0.0).within(sole.normals, sole.offsets)
        share = common.area / min(sole.area, two.area)
        if share > _OVERLAP:
            notes.append(
                f"The soles of {name!r} and {near!r} lie in each other by "
                f"{share * 100:.0f} % of the smaller one, which two feet cannot. Put them farther "
                "apart (width=, --width), or give each its own part (polygon=, --sole)."
            )
    return notes


def _drive_notes(stance: Stance) -> list[str]:
    """Torques of springs and of who holds a joint, far beyond what weight can do to it."""
    robot, notes = stance.robot, []
    most = _STRONG * robot.weight * robot_reach(robot)
    for joint, torque in robot.drives.held.items():
        if abs(torque) > most:
            notes.append(
                f"The torque held on joint {joint!r} is {torque:.4g} Nm, and all of the weight at "
                f"the end of {robot.name!r} is {most / _STRONG:.2g} Nm. Torques are in "
                f"newton-metres: {torque:.4g} Nmm are {torque / 1e3:.4g} Nm."
            )
    for joint, spring in robot.drives.springs.items():
        if robot.joint_unit(joint) == "rad" and abs(spring.rest) > _WOUND:
            notes.append(
                f"The spring of joint {joint!r} rests at {spring.rest:.4g} rad, "
                f"{abs(spring.rest) / (2 * np.pi):.2g} turns away. {in_radians(spring.rest)}"
            )
    return notes


def _joint_notes(stance: Stance) -> list[str]:
    robot, excess = stance.robot, stance.joint_limit_excess
    slides = np.array([unit == "m" for unit in robot.dof_units], dtype=bool)
    far = excess > np.where(slides, _FAR_SLID, _FAR_BEYOND)
    if not far.any():
        return []
    order = [i for i in np.argsort(-excess) if far[i]]
    named = [
        f"{robot.dof_names[i]} by "
        + (f"{excess[i] * 1e3:.0f} mm" if slides[i] else f"{np.degrees(excess[i]):.0f} deg")
        for i in order
    ]
    return [
        f"Joints stand far beyond their limits ({first_few(named, _NAMED)}): "
        f"{robot.name!r} cannot stand so. Give a posture nearer to how it stands (posture=, "
        "--posture JOINT=POSITION), or other contact frames."
    ]


def _hanging_notes(stance: Stance) -> list[str]:
    """A CoM under all contacts, of a stance that was built by hand."""
    ground = [p.translation[2] for p in stance.placements if p.rotation[2, 2] > _UP]
    if ground and stance.robot.base_nv == 6 and stance.com[2] < min(ground):
        return [
            f"The CoM is {(min(ground) - stance.com[2]) * 1e3:.0f} mm under all of the contacts, "
            "whose normals point up: is the robot upside down? Quaternions are x, y, z, w."
        ]
    return []
