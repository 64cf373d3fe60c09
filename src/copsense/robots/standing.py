"""Standing: from a robot's name, file or model to a stance with its feet on the ground."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, finite_number
from copsense.contact import Contact, Plane
from copsense.description import is_file, load_description
from copsense.errors import CopsenseError, InvalidInputError, ModelLoadError, UnknownNameError
from copsense.posture import solve_posture
from copsense.robot import Robot
from copsense.robots.presets import PRESETS, Preset, preset_robot
from copsense.sole import read_sole, tilt_text
from copsense.stance import Stance

ContactAt = Literal["frame", "sole"]
_OFF_SOLE = 1e-3  # m: a contact frame farther from the sole's bottom is said to be off it


class ContactGeometryWarning(UserWarning):
    """A contact frame is not on the sole that the collision geometry shows."""


def load_robot(
    source: str | Path | Robot | pin.Model,
    *,
    package_dirs: Iterable[str | Path] = (),
    frames: Iterable[str] = (),
    root: str | None = None,
) -> Robot:
    """A robot from a preset's name, a URDF or MJCF (path or text), or a ``pin.Model``.

    Args:
        source: what to load; a `Robot` is returned as it is.
        package_dirs: folders that hold the packages of ``package://`` meshes.
        frames: frames of the robot, such as its contacts: where an MJCF holds several things, the
            tree that holds them is the robot.
        root: name of a body of the robot that is meant, where an MJCF holds several.

    Raises:
        UnknownNameError: neither a preset nor a file, or no body is named `root`.
        ModelLoadError: the file cannot be read.
        InvalidInputError: an MJCF holds several things that could be the robot.
        MissingExtraError: the preset's package is not installed.
    """
    if isinstance(source, Robot):
        return source
    if isinstance(source, pin.Model):
        return Robot.from_model(source)
    if str(source) in PRESETS:
        return preset_robot(PRESETS[str(source)])
    text = str(source)
    path = Path(text)
    if not (text.lstrip().startswith("<") or is_file(path) or path.suffix) and (
        path.parent == Path()
    ):
        raise UnknownNameError("robot", text, PRESETS, "Or give the path of a URDF or MJCF file.")
    return Robot.from_description(
        load_description(source, None, package_dirs, frames=frames, root=root)
    )


def load_stance(
    source: str | Path | Robot | pin.Model,
    *,
    contacts: Sequence[str | Contact] | None = None,
    posture: Mapping[str, float] | None = None,
    base_rpy: Sequence[float] | Float[np.ndarray, " 3"] | None = None,
    width: float | None = None,
    contact_at: ContactAt | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> Stance:
    """A robot standing on its contacts, its CoM over their middle, the middle at the origin.

    Args:
        source: preset's name, URDF or MJCF, `Robot` or ``pin.Model``.
        contacts: frames (taken as surface contacts) or `Contact` values; default the preset's.
        posture: joint name -> position [rad, or m] that the stance stays nearest to; it replaces
            the preset's joint by joint.
        base_rpy: roll, pitch, yaw of the base to start from [rad]; default the preset's.
        width: lateral distance between two feet [m].
        contact_at: ``"sole"`` puts each surface contact at the bottom of its collision geometry
            and reads its polygon; ``"frame"`` keeps it at the model's frame and reads the polygon
            if it can. Default: as the preset says; for another robot ``"frame"``, with a warning
            where that is not on the sole.
        package_dirs: folders that hold the packages of ``package://`` meshes.

    Raises:
        CopsenseError: anything wrong with the input, or no posture that stands.
    """
    if contact_at not in (None, *get_args(ContactAt)):
        raise UnknownNameError("place of a contact", contact_at, get_args(ContactAt))
    preset = PRESETS.get(str(source)) if isinstance(source, str | Path) else None
    robot = load_robot(source, package_dirs=package_dirs, frames=_frames(contacts))
    if contacts is None:
        if preset is None:
            likely = likely_feet(robot)
            raise InvalidInputError(
                f"robot {robot.name!r} is not a preset, so its contacts are not known. Name their "
                f"frames, contacts=[...] (--contact FRAME); {'likely ones' if likely else 'all'}: "
                f"{', '.join(likely or robot.frame_names)}."
            )
        chosen: tuple[Contact, ...] = preset.contacts
    elif isinstance(contacts, str):
        raise InvalidInputError(f"contacts is one name, {contacts!r}. Give a list, [{contacts!r}].")
    else:
        known = {c.frame: c for c in preset.contacts} if preset else {}
        chosen = tuple(_contact(c, known) for c in contacts)
    chosen = _complete(robot, chosen, preset, contact_at)
    own = preset.posture if preset else {}
    q = robot.configuration({**own, **(posture or {})})
    if base_rpy is not None and robot.base_nv != 6:
        raise InvalidInputError(
            f"robot {robot.name!r} lives in a plane: its base has no orientation to choose. Leave "
            "base_rpy (--base-yaw) out."
        )
    rpy = np.array(preset.base_rpy if preset else (0.0, 0.0, 0.0))
    if base_rpy is not None:
        rpy = finite_array(base_rpy, "base_rpy (--base-yaw)", (3,), "roll, pitch, yaw [rad]")
    q = _turn_base(robot, q, pin.rpy.rpyToMatrix(*[float(a) for a in rpy]))
    if width is None and preset and len(chosen) == len(preset.contacts):
        width = preset.width
    return stand(robot, chosen, q, width=width)


def stand(
    robot: Robot, contacts: Sequence[Contact], q: ArrayLike, *, width: float | None = None
) -> Stance:
    """Put a robot's contacts on their planes with its CoM over their middle.

    Each contact goes to the nearest place on its plane (the ground z = 0 where it has none) with
    the nearest orientation flat on it; the posture stays nearest to `q`, turned as a whole so that
    the first surface contact lies flat.

    Args:
        robot: the robot.
        contacts: its contacts.
        q: configuration (nq,) to start from; where the base stands does not matter.
        width: lateral distance between two contacts [m], or None to leave it.

    Raises:
        UnreachablePostureError: no such posture.
    """
    loose = Stance(robot, np.asarray(q, dtype=float), tuple(contacts), check=False)
    planar = robot.base_nv != 6
    first = next((k for k, c in enumerate(contacts) if c.kind == "surface"), None)
    if first is not None:
        # Turn the whole robot about the horizontal, so that its first sole is flat.
        flat = _align(loose.placements[first].rotation[:, 2], _plane(contacts[first]))
        base = pin.Quaternion(loose.q[3:7]).matrix()
        loose = loose.at(_turn_base(robot, loose.q, flat @ base), check=False)
    middle = np.mean([place.translation for place in loose.placements], axis=0)
    heights = [
        _height(c, p.translation - middle) for c, p in zip(contacts, loose.placements, strict=True)
    ]
    loose = loose.at(_shift_base(robot, loose.q, -middle - [0, 0, np.mean(heights)]), check=False)
    targets = []
    for k, (contact, place) in enumerate(zip(contacts, loose.placements, strict=True)):
        flat = np.eye(3) if planar else _align(place.rotation[:, 2], _plane(contact))
        origin = place.translation.copy()
        if width is not None:
            if len(contacts) != 2:
                raise InvalidInputError(
                    f"a stance width is a distance between two contacts, but there are "
                    f"{len(contacts)}. Leave width out."
                )
            finite_number(width, "the stance width [m]", positive=True)
            left = place.translation[1] >= loose.placements[1 - k].translation[1]
            origin[:2] = 0.0, width / 2 if left else -width / 2
        origin[2] -= _height(contact, origin)
        targets.append(pin.SE3(flat @ place.rotation, origin))
    centre = np.mean([target.translation for target in targets], axis=0)
    com = (None if planar else float(centre[0]), float(centre[1]), None)
    return solve_posture(loose, targets=targets, com=com).stance


def sole_notes(stance: Stance) -> tuple[str, ...]:
    """What is off between the contact frames and the soles, in words; empty where all is well.

    Contacts whose geometry cannot be read are passed over.
    """
    notes = []
    for contact in stance.contacts:
        if contact.kind != "surface":
            continue
        try:
            sole = read_sole(stance.robot, contact)
        except CopsenseError:
            continue
        over = float(contact.rotation[:, 2] @ np.array(contact.offset)) - sole.height
        if abs(over) > _OFF_SOLE:
            notes.append(
                f"contact {contact.name!r} lies {abs(over) * 1e3:.1f} mm "
                f"{'over' if over > 0 else 'under'} the bottom of its collision geometry; "
                "contact_at='sole' (--contact-at sole) puts it there."
            )
    return tuple(notes)


def likely_feet(robot: Robot) -> tuple[str, ...]:
    """Frames of a model whose names look like feet."""
    words = ("sole", "foot", "toe", "ankle_roll")
    return tuple(n for n in dict.fromkeys(robot.frame_names) if any(w in n.lower() for w in words))


def _frames(contacts: object) -> tuple[str, ...]:
    """Frames named by contacts of any kind; what is none is rejected elsewhere."""
    given = contacts if isinstance(contacts, Sequence) and not isinstance(contacts, str) else ()
    frames = [c.frame if isinstance(c, Contact) else c for c in given]
    return tuple(frame for frame in frames if isinstance(frame, str))


def _contact(given: object, known: Mapping[str, Contact]) -> Contact:
    """A contact, or a frame's name as what the preset knows of it, else a surface contact."""
    if isinstance(given, str):
        return known.get(given) or Contact(given)
    if not isinstance(given, Contact):
        raise InvalidInputError(
            f"{given!r} is not a contact. Give a frame's name, or Contact(frame=...)."
        )
    return given


def _complete(
    robot: Robot, contacts: tuple[Contact, ...], preset: Preset | None, at: ContactAt | None
) -> tuple[Contact, ...]:
    """Fill in offsets and polygons from the collision geometry.

    A contact that the caller placed stays there, unless the sole is asked for.
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
        if contact.kind != "surface" or not (lower or outline):
            completed.append(contact)
            continue
        robot.frame(contact.frame)
        try:
            sole = read_sole(robot, contact)
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
                f"{tilt_text(contact, sole.tilt)}. Turn the contact by its rotation so that the "
                "underside lies flat, or give the polygon.",
                ContactGeometryWarning,
                stacklevel=3,
            )
        offset, up = np.array(contact.offset), contact.rotation[:, 2]
        if lower:
            offset = offset + up * (sole.height - up @ offset)
        elif not preset and at is None and abs(sole.height - up @ offset) > _OFF_SOLE:
            away = abs(sole.height - up @ offset) * 1e3
            warnings.warn(
                f"contact {contact.name!r} is {away:.1f} mm from the bottom of its collision "
                "geometry. Give contact_at='sole' to put it there, or contact_at='frame' to keep "
                "it.",
                ContactGeometryWarning,
                stacklevel=3,
            )
        x, y, z = (float(c) for c in offset)
        polygon = sole.polygon if contact.polygon is None else contact.polygon
        completed.append(replace(contact, offset=(x, y, z), polygon=polygon))
    return tuple(completed)


def _plane(contact: Contact) -> Plane:
    return contact.plane or Plane()


def _height(contact: Contact, point: np.ndarray) -> float:
    """How far above a contact's plane a point is, along the vertical (the normal for a wall)."""
    plane = _plane(contact)
    n = np.array(plane.normal)
    return float(n @ (point - np.array(plane.point)) / (n[2] if abs(n[2]) > 0.1 else 1.0))


def _align(axis: np.ndarray, plane: Plane) -> np.ndarray:
    """The smallest rotation (3 x 3) that takes an axis to a plane's normal."""
    turn = pin.Quaternion.FromTwoVectors(np.array(axis), np.array(plane.normal))
    return np.asarray(turn.matrix())


def _turn_base(robot: Robot, q: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    turned = np.array(q)
    if robot.base_nv == 6:
        turned[3:7] = pin.Quaternion(rotation).coeffs()
    return turned


def _shift_base(robot: Robot, q: np.ndarray, shift: np.ndarray) -> np.ndarray:
    moved = np.array(q)
    if robot.base_nv == 6:
        moved[:3] += shift
    else:
        # A planar base moves in the axes of its own plane.
        moved[:2] += (robot.model.jointPlacements[1].rotation.T @ shift)[:2]
    return moved
