"""Contact soles: offsets and polygons of contacts, completed from the collision geometry."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from copsense.contact import Contact
from copsense.errors import CopsenseError, ModelLoadError
from copsense.listing import listed
from copsense.robot import Robot
from copsense.robots.presets import Preset
from copsense.shapes import Geometry
from copsense.sole import LEVEL, Sole, levelled, read_sole, tilt_text
from copsense.stance import Stance

ContactAt = Literal["frame", "sole"]
_AT_FRAME = 0.05  # mm: a sole nearer to its frame is at it
_LEANING = 45.0  # deg: a frame turned by less was levelled, by more has another axis up
_OFF_SOLE = 1e-3  # m: a contact frame farther from the sole's bottom is said to be off it


class ContactGeometryWarning(UserWarning):
    """A contact frame is not on the sole that the collision geometry shows."""


def complete_contacts(
    robot: Robot,
    contacts: tuple[Contact, ...],
    preset: Preset | None,
    at: ContactAt | None,
    geometry: Geometry = "collision",
    *,
    level: bool = False,
) -> tuple[Contact, ...]:
    """Fill in offsets and polygons from the geometry.

    A contact that the caller placed stays there, unless the sole is asked for. With `level` every
    surface contact is first turned until its sole lies flat.
    """
    mode = preset.sole_from_geometry if preset else None
    known = {c.frame: c for c in preset.contacts} if preset else {}
    completed = []
    for contact in contacts:
        own = known.get(contact.frame)
        untouched = own is not None and (
            contact.offset == own.offset and np.array_equal(contact.rotation, own.rotation)
        )
        lower = at == "sole" or (at is None and mode == "sole" and untouched)
        outline = contact.polygon is None and (
            at is not None or mode is not None or (not preset and robot.description is not None)
        )
        if level and contact.kind == "surface":
            contact = levelled(robot, contact, geometry=geometry)
        if contact.kind != "surface" or not (lower or outline):
            completed.append(contact)
            continue
        robot.frame(contact.frame)
        try:
            sole = read_sole(robot, contact, geometry=geometry)
        except ModelLoadError as error:
            if lower:
                raise
            warnings.warn(
                f"contact {contact.name!r} has no sole polygon, so no margin to its edge is known: "
                f"{error}",
                ContactGeometryWarning,
                stacklevel=3,
            )
            completed.append(contact)
            continue
        if sole.tilt and contact.polygon is None:
            warnings.warn(
                f"contact {contact.name!r} was given the lowest edge alone as its sole, because "
                f"{tilt_text(contact, sole.tilt)}. {LEVEL[0].upper()}{LEVEL[1:]}, or give the "
                "polygon.",
                ContactGeometryWarning,
                stacklevel=3,
            )
        if sole.is_tip and contact.polygon is None:
            warnings.warn(tip_text(contact, sole), ContactGeometryWarning, stacklevel=3)
        offset, up = np.array(contact.offset), contact.rotation[:, 2]
        if lower:
            offset = offset + up * (sole.height - up @ offset)
        elif not preset and at is None and abs(sole.height - up @ offset) > _OFF_SOLE:
            away = abs(sole.height - up @ offset) * 1e3
            warnings.warn(
                f"contact {contact.name!r} is {away:.1f} mm from the bottom of its collision "
                "geometry. Give contact_at='sole' (--contact-at sole) to put it there, or "
                "contact_at='frame' (--contact-at frame) to keep it.",
                ContactGeometryWarning,
                stacklevel=3,
            )
        x, y, z = (float(c) for c in offset)
        polygon = sole.polygon if contact.polygon is None else contact.polygon
        completed.append(replace(contact, offset=(x, y, z), polygon=polygon))
    return tuple(completed)


def sole_text(contact: Contact, sole: Sole) -> str:
    """Size and height of a sole, as "200 x 80 mm, 35 mm under the frame"."""
    length, width = (edge * 1e3 for edge in sole.size)
    high = sole.height * 1e3
    where = (
        "at the frame"
        if abs(high) < _AT_FRAME
        else f"{abs(high):.3g} mm " + ("under the frame" if high < 0 else "over the frame")
    )
    tilt = f"; {tilt_text(contact, sole.tilt)}" if sole.tilt else ""
    return f"{length:.0f} x {width:.0f} mm, {where}{tilt}"


def tip_text(contact: Contact, sole: Sole) -> str:
    """The doubt about a sole that is a small part of its foot."""
    length, width = (edge * 1e3 for edge in sole.size)
    foot_length, foot_width = (edge * 1e3 for edge in sole.footprint)
    return (
        f"contact {contact.name!r}: a sole of {length:.0f} x {width:.0f} mm was read under a foot "
        f"of {foot_length:.0f} x {foot_width:.0f} mm. Is that the whole sole, or a tip or an edge "
        "that reaches lowest? Give the polygon (--sole X0:X1:Y0:Y1), or a point contact."
    )


def soles_read(stance: Stance) -> tuple[str, ...]:
    """The soles that a stance has from its robot's geometry, a sentence for those alike."""
    found: dict[tuple[str, Geometry], list[str]] = {}
    for contact in stance.contacts:
        for geometry in get_args(Geometry):
            if contact.kind != "surface" or contact.polygon is None:
                continue
            try:
                sole = read_sole(stance.robot, contact, geometry=geometry)
            except CopsenseError:
                continue
            if np.array_equal(contact.polygon, sole.polygon):
                turn = float(np.degrees(np.arccos(min(1.0, contact.normal[2]))))
                turned = f"; turned by {turn:.1f} deg to lie flat" if 0 < turn < _LEANING else ""
                alike = f"sole {sole_text(contact, sole)}{turned}", geometry
                found.setdefault(alike, []).append(contact.name)
                break
    return tuple(
        f"{listed(names)}: {sole}; read from {'their' if len(names) > 1 else 'its'} {geometry} "
        "geometry."
        for (sole, geometry), names in found.items()
    )


def sole_notes(stance: Stance) -> tuple[str, ...]:
    """What is off between the contact frames and the soles, in words; empty where all is well.

    Contacts whose geometry cannot be read are passed over.
    """
    off: dict[str, list[str]] = {}
    for contact in stance.contacts:
        if contact.kind != "surface":
            continue
        try:
            sole = read_sole(stance.robot, contact)
        except CopsenseError:
            continue
        over = float(contact.rotation[:, 2] @ np.array(contact.offset)) - sole.height
        if abs(over) > _OFF_SOLE:
            how = f"{abs(over) * 1e3:.1f} mm {'over' if over > 0 else 'under'} the bottom of"
            off.setdefault(how, []).append(repr(contact.name))
    return tuple(
        f"contact{'s' * (len(names) > 1)} {listed(names)} lie{'s' * (len(names) == 1)} {how} "
        f"{'their' if len(names) > 1 else 'its'} collision geometry; contact_at='sole' "
        f"(--contact-at sole) puts {'them' if len(names) > 1 else 'it'} there."
        for how, names in off.items()
    )
