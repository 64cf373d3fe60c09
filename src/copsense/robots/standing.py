"""Standing: from a robot's name, file or model to a stance with its feet on the ground."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import get_args

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import (
    check_type,
    checked_positions,
    checked_tuple,
    finite_array,
    finite_number,
)
from copsense.closing import check_closable, close
from copsense.contact import Contact, Plane
from copsense.description import is_file, load_description
from copsense.drives import Drives
from copsense.errors import InvalidInputError, UnknownNameError, UnreachablePostureError
from copsense.freedom import held_com_axes, missing_joints
from copsense.magnitudes import check_angle
from copsense.posture import pull_back, solve_posture
from copsense.reach import check_within_reach
from copsense.robot import Robot
from copsense.robots.contact_soles import ContactAt, complete_contacts
from copsense.robots.plausibility import (
    ImplausibleStanceWarning,
    ceiling_notes,
    check_plausible,
    check_size,
    warn_of_turn,
)
from copsense.robots.presets import PRESETS, preset_robot
from copsense.robots.rigid_points import keep_distances
from copsense.robots.stance_tables import is_stance_file
from copsense.robots.uprighting import base_turn, upright_contacts
from copsense.shapes import Geometry
from copsense.stance import Stance, check_support

_UP = 0.1  # z of a plane's normal up to which it is a wall
_OFF_MIDDLE = 1e-6  # m
_AT_ZERO = 0.02  # rad or m: a range that begins so near to zero begins there


class StandingWarning(UserWarning):
    """A stance is not quite what was asked for."""


def load_robot(
    source: str | Path | Robot | pin.Model,
    *,
    package_dirs: Iterable[str | Path] = (),
    frames: Iterable[str] = (),
    root: str | None = None,
    drives: Drives | None = None,
    passive: Iterable[str] = (),
    locked: Iterable[str] = (),
) -> Robot:
    """A robot from a preset's name, a URDF, MJCF or SDF (path or text), or a ``pin.Model``.

    Args:
        source: what to load, or a stance file (.toml), whose robot it is, with its drives and
            payloads; a `Robot` is returned as it is.
        package_dirs: folders that hold the packages of ``package://`` meshes.
        frames: frames of the robot, such as its contacts: where an MJCF holds several things, the
            tree that holds them is the robot.
        root: name of a body of the robot that is meant, where an MJCF holds several.
        drives: what holds its joints, instead of what its file says.
        passive: joints without a motor, beside those that have none already.
        locked: joints that are rigid, at zero.

    Raises:
        UnknownNameError: neither a preset nor a file, or no body is named `root`, or drives are
            of a joint or frame that the robot has not.
        ModelLoadError: the file cannot be read.
        InvalidInputError: an MJCF holds several things that could be the robot.
        MissingExtraError: the preset's package is not installed.
    """
    robot = _read(source, package_dirs, frames, root)
    if drives is not None:
        robot = robot.with_drives(drives)
    robot = robot.without_motors(passive) if passive else robot
    rigid = set(checked_tuple(locked, str, "name", 'Give joints, such as ["l_elbow"].'))
    for joint in rigid:
        robot.joint_id(joint)  # that it exists
    return robot.keeping(j for j in robot.joint_names if j not in rigid) if rigid else robot


def _read(
    source: str | Path | Robot | pin.Model,
    package_dirs: Iterable[str | Path],
    frames: Iterable[str],
    root: str | None,
) -> Robot:
    if isinstance(source, Robot):
        return source
    if isinstance(source, pin.Model):
        return Robot.from_model(source)
    if is_stance_file(source):
        return _read_stance(source).robot
    if str(source) in PRESETS:
        return preset_robot(PRESETS[str(source)])
    text = str(source)
    path = Path(text)
    if not (text.lstrip().startswith("<") or is_file(path) or path.suffix) and (
        path.parent == Path()
    ):
        raise UnknownNameError(
            "robot", text, PRESETS, "Or give the path of a URDF, MJCF or SDF file."
        )
    return Robot.from_description(
        load_description(source, None, package_dirs, frames=frames, root=root)
    )


def _read_stance(path: str | Path) -> Stance:
    """What a stance file says, whose module stands on this one."""
    from copsense.robots.stance_file import StanceFile

    return StanceFile.read(path).stance()


def load_stance(
    source: str | Path | Robot | pin.Model,
    *,
    contacts: Sequence[str | Contact] | None = None,
    posture: Mapping[str, float] | None = None,
    base_rpy: Sequence[float] | Float[np.ndarray, " 3"] | None = None,
    width: float | None = None,
    contact_at: ContactAt | None = None,
    soles: Geometry = "collision",
    level_soles: bool = False,
    package_dirs: Iterable[str | Path] = (),
    drives: Drives | None = None,
    passive: Iterable[str] = (),
    locked: Iterable[str] = (),
) -> Stance:
    """A robot standing on its contacts, its CoM over their middle, the middle at the origin.

    Where the contacts do not let the CoM go there, as legs that only pitch, it stays where it is,
    with a warning. A contact whose frame has another axis up than z is turned, with a warning.
    Joints not named start at zero, or inside their range where that leaves zero out.

    Args:
        source: preset's name, URDF, MJCF or SDF, `Robot` or ``pin.Model``; or a stance file
            (.toml), which says all the rest itself.
        contacts: frames (taken as surface contacts) or `Contact` values; default the preset's.
        posture: joint name -> position [rad, or m] that the stance stays nearest to; it replaces
            the preset's joint by joint.
        base_rpy: roll, pitch, yaw of the base to start from [rad]; default the preset's, or the
            quarter turn that puts a robot above its point contacts, with a warning.
        width: lateral distance between two feet [m].
        contact_at: ``"sole"`` puts each surface contact at the bottom of its collision geometry
            and reads its polygon; ``"frame"`` keeps it at the model's frame and reads the polygon
            if it can. Default: as the preset says; for another robot ``"frame"``, with a warning
            where that is not on the sole.
        soles: which geometry soles are read from: what collides, or what is drawn, for a URDF
            without collision geometry.
        level_soles: turn surface contacts whose sole is tilted against their frame, until it lies
            flat.
        package_dirs: folders that hold the packages of ``package://`` meshes.
        drives: what holds the robot's joints, instead of what its file says.
        passive: joints without a motor, beside those that have none already.
        locked: joints that are rigid, at zero.

    Raises:
        CopsenseError: anything wrong with the input, or no posture that stands.
    """
    if contact_at not in (None, *get_args(ContactAt)):
        raise UnknownNameError("place of a contact", contact_at, get_args(ContactAt))
    if soles not in get_args(Geometry):
        raise UnknownNameError("geometry of soles", soles, get_args(Geometry))
    if is_stance_file(source):
        given = (contacts, posture, base_rpy, width, contact_at, drives)
        if level_soles or passive or locked or any(value is not None for value in given):
            raise InvalidInputError(
                f"the stance file {source} says how the robot stands, and so does another "
                "argument. Change the file, or leave the argument out."
            )
        return _read_stance(source)
    preset = PRESETS.get(str(source)) if isinstance(source, str | Path) else None
    robot = load_robot(
        source,
        package_dirs=package_dirs,
        frames=_frames(contacts),
        drives=drives,
        passive=passive,
        locked=locked,
    )
    if contacts is None:
        if preset is None:
            likely = likely_feet(robot)
            raise InvalidInputError(
                f"robot {robot.name!r} is not a preset, so its contacts are not known. Name their "
                f"frames, contacts=[...] (--contact FRAME); {'likely ones' if likely else 'all'}: "
                f"{', '.join(likely or robot.frame_names)}. `copsense inspect FILE` finds its "
                "soles, and prints the line that stands it on them."
            )
        chosen: tuple[Contact, ...] = preset.contacts
    elif isinstance(contacts, str):
        raise InvalidInputError(f"contacts is one name, {contacts!r}. Give a list, [{contacts!r}].")
    else:
        remedy = 'Give frames or contacts, such as ["l_sole", Contact("r_sole")].'
        check_type(contacts, Iterable, "a list of contacts", remedy)
        known = {c.frame: c for c in preset.contacts} if preset else {}
        chosen = tuple(_contact(c, known) for c in contacts)
    moving = set(robot.joint_names)  # a preset's joint may be locked
    own = {j: at for j, at in (preset.posture if preset else {}).items() if j in moving}
    wanted = checked_positions(posture, "the posture's joints")
    q = robot.configuration({**rest_positions(robot), **own, **wanted})
    q = close(robot, q, held=wanted or own)
    check_closable(robot, q)
    if base_rpy is not None and robot.base_nv != 6:
        raise InvalidInputError(
            f"robot {robot.name!r} lives in a plane: its base has no orientation to choose. Leave "
            "base_rpy (--base-yaw, --base-rpy) out."
        )
    if base_rpy is not None:
        what = "base_rpy (--base-yaw, --base-rpy)"
        rpy = finite_array(base_rpy, what, (3,), "roll, pitch, yaw [rad]")
        for angle in rpy.tolist():
            check_angle(angle, what)
    else:
        rpy = np.array(preset.base_rpy if preset else base_turn(robot, chosen, q))
    q = _turn_base(robot, q, pin.rpy.rpyToMatrix(*[float(a) for a in rpy]))
    check_size(Stance(robot, q, chosen, check=False))
    upright = upright_contacts(robot, chosen, q)
    chosen = complete_contacts(robot, upright, preset, contact_at, soles, level=level_soles)
    if width is None and preset and len(chosen) == len(preset.contacts):
        width = preset.width
    if base_rpy is not None and np.any(rpy[:2]):
        warn_of_turn(Stance(robot, q, chosen, check=False), rpy)
    return stand(robot, chosen, q, width=width)


def stand(
    robot: Robot, contacts: Sequence[Contact], q: ArrayLike, *, width: float | None = None
) -> Stance:
    """Put a robot's contacts on their planes with its CoM over the middle of those on the ground.

    Each contact goes straight up or down to its plane (the ground z = 0 where it has none), or
    straight onto its wall, with the nearest orientation flat on it; the posture stays nearest to
    `q`, turned as a whole so that the first surface contact lies flat. Where the contacts hold the
    CoM, it stays where it is, with a warning.

    Args:
        robot: the robot.
        contacts: its contacts.
        q: configuration (nq,) to start from; where the base stands does not matter.
        width: lateral distance between two contacts [m], or None to leave it.

    Raises:
        UnreachablePostureError: no such posture.
        InsufficientContactsError: no posture on such contacts can be balanced.
        InvalidInputError: lengths that are not metres, or a robot that hangs under its contacts.
    """
    loose = Stance(robot, np.asarray(q, dtype=float), tuple(contacts), check=False)
    check_size(loose)
    planar = robot.base_nv != 6
    # Hands on a wall are put there by those who stand on the ground.
    ground = [k for k, c in enumerate(contacts) if _plane(c).normal[2] > _UP]
    ground = ground or list(range(len(contacts)))
    first = next((k for k in ground if contacts[k].kind == "surface"), None)
    if first is not None:
        # Turn the whole robot about the horizontal, so that its first sole is flat.
        flat = _align(loose.placements[first].rotation[:, 2], _plane(contacts[first]))
        base = pin.Quaternion(loose.q[3:7]).matrix()
        loose = loose.at(_turn_base(robot, loose.q, flat @ base), check=False)
    middle = np.mean([loose.placements[k].translation for k in ground], axis=0)
    heights = [_height(contacts[k], loose.placements[k].translation - middle) for k in ground]
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
            check_within_reach(robot, width, "the stance width (width, --width)")
            left = place.translation[1] >= loose.placements[1 - k].translation[1]
            origin[:2] = 0.0, width / 2 if left else -width / 2
        normal = np.array(_plane(contact).normal)
        along = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) > _UP else normal
        targets.append(pin.SE3(flat @ place.rotation, origin - _height(contact, origin) * along))
    targets = keep_distances(robot, contacts, loose.placements, targets)
    centre = np.mean([targets[k].translation for k in ground], axis=0)
    # Of two that are too far apart, the one whose plane was given is named.
    for contact, target in sorted(
        zip(contacts, targets, strict=True), key=lambda p: not p[0].plane
    ):
        away = float(np.linalg.norm(target.translation - centre))
        check_within_reach(robot, away, f"contact {contact.name!r}, from the middle of the ground,")
    com = (None if planar else float(centre[0]), float(centre[1]), None)
    doubts = ceiling_notes(contacts, targets, loose.com)
    try:
        found = _settled(loose, targets, com)
    except UnreachablePostureError as error:
        raise UnreachablePostureError(" ".join([str(error), *doubts])) from None
    for doubt in doubts:
        warnings.warn(doubt, ImplausibleStanceWarning, stacklevel=3)
    return check_plausible(found)


def _settled(
    loose: Stance, targets: list[pin.SE3], com: tuple[float | None, float | None, float | None]
) -> Stance:
    """The posture with the contacts at their targets, and the CoM there as far as they let it."""
    try:
        return solve_posture(loose, targets=targets, com=com).stance
    except UnreachablePostureError as error:
        failure = error
    check_support(loose)  # the true reason where points cannot carry a robot
    try:
        placed = pull_back(loose, targets)
    except UnreachablePostureError:
        raise failure from None
    held = held_com_axes(placed)
    free = tuple(None if axis in held else value for axis, value in enumerate(com))
    for asked in dict.fromkeys([free, (com[0], None, None), (None, com[1], None), (None,) * 3]):
        try:
            found = solve_posture(placed, targets=targets, com=asked, reference=loose.q).stance
        except UnreachablePostureError:
            continue
        break
    else:
        found = placed
    off = [
        f"{'xy'[axis]} by {(found.com[axis] - value) * 1e3:+.3g} mm"
        for axis, value in enumerate(com)
        if value is not None and abs(found.com[axis] - value) > _OFF_MIDDLE
    ]
    if off:
        why = "; ".join(missing_joints(found))
        warnings.warn(
            f"the CoM of {loose.robot.name!r} is not over the middle of its contacts, in "
            f"{' and '.join(off)}: they cannot be moved under it from this posture"
            + (f", for {why}" if why else "")
            + ".",
            StandingWarning,
            stacklevel=4,
        )
    return found


def rest_positions(robot: Robot) -> dict[str, float]:
    """Joint -> a position inside its range, for joints whose range leaves zero out [rad, m]."""
    lower, upper = robot.position_limits
    inside = {}
    for name, low, high in zip(robot.dof_names, lower.tolist(), upper.tolist(), strict=True):
        if low > 0.0 or high < 0.0:
            near, far = (low, high) if low > 0.0 else (high, low)
            # A quarter of the range in; where it has no other end, or begins at once, its end.
            deep = abs(near) > _AT_ZERO and np.isfinite(far)
            inside[name] = near + (far - near) / 4 if deep else near
    return inside


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
