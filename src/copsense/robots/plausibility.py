"""Plausibility: a stance that cannot be meant is rejected, or doubted aloud."""

from __future__ import annotations

import warnings

import numpy as np

from copsense.errors import InvalidInputError
from copsense.stance import Stance

_TALL = 20.0  # m between contacts and CoM: no robot of metres is so tall
_SMALL = 5e-3  # m
_LIGHT, _HEAVY = 0.1, 1e4  # kg
_FAR_BEYOND = np.radians(10.0)  # rad beyond a joint's limit
_FAR_SLID = 0.05  # m
_UP = 0.1  # z of a contact's normal from which it stands on something
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
    return (*_size_notes(stance), *_joint_notes(stance), *_hanging_notes(stance))


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


def _joint_notes(stance: Stance) -> list[str]:
    robot, excess = stance.robot, stance.joint_limit_excess
    slides = np.array([unit == "m" for unit in robot.dof_units], dtype=bool)
    far = excess > np.where(slides, _FAR_SLID, _FAR_BEYOND)
    if not far.any():
        return []
    order = [i for i in np.argsort(-excess) if far[i]]
    named = ", ".join(
        f"{robot.dof_names[i]} by "
        + (f"{excess[i] * 1e3:.0f} mm" if slides[i] else f"{np.degrees(excess[i]):.0f} deg")
        for i in order[:_NAMED]
    )
    more = f" and {len(order) - _NAMED} more" if len(order) > _NAMED else ""
    return [
        f"Joints stand far beyond their limits ({named}{more}): {robot.name!r} cannot stand so. "
        "Give a posture nearer to how it stands (posture=, --posture JOINT=POSITION), or other "
        "contact frames."
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
