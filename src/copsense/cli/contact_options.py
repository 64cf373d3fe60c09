"""The options that say where a robot touches its environment, and with which soles."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from copsense.cli.option_lists import CONTACTS, F, with_options
from copsense.cli.units import LENGTH, Unit, read_numbers, read_quantity, split_assignment
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    import numpy as np

    from copsense.contact import Contact

_OFFSET = "FRAME=X:Y:Z in metres, in the frame's axes, such as l_foot=0:0:-0.05"
_RPY = "FRAME=ROLL:PITCH:YAW in degrees, such as l_hand=0:90:0"
_GROUND = (
    "FRAME=ROLL:PITCH[:HEIGHT], degrees and metres, such as l_foot=0:10 (a slope) or "
    "l_foot=0:0:0.15 (a step)"
)
_FRICTION = "FRAME=MU[:TORSION], such as l_foot=0.6 or l_foot=0.6:0.02 (metres)"
_CORNERS = "its corners X:Y,X:Y,X:Y [m], such as 0.1:0,-0.05:0.04,-0.05:-0.04"
_PLANE = (
    "FRAME=NX:NY:NZ[:X:Y:Z], an outward normal and a point in metres, such as "
    "l_hand=-1:0:0:0.4:0:0 (a wall 0.4 m ahead)"
)


def contact_options(command: F) -> F:
    """Contacts: frames, soles, and the planes they touch."""
    options = [
        click.option(
            "--contact",
            "contacts",
            multiple=True,
            metavar="FRAME[:KIND]",
            help="Contact frame; KIND is surface (default), point or planar. Repeatable; a "
            "preset has its own.",
        ),
        click.option(
            "--contact-at",
            type=click.Choice(["frame", "sole"]),
            help="Put surface contacts at the model's frame, or at the sole's bottom as the "
            "collision geometry shows it.",
        ),
        click.option(
            "--soles",
            type=click.Choice(["collision", "visual"]),
            default="collision",
            help="Geometry that soles are read from: what collides (default), or what is drawn, "
            "for a URDF without collision geometry.",
        ),
        click.option(
            "--level-soles",
            is_flag=True,
            help="Turn contacts whose sole is tilted against their frame until it lies flat.",
        ),
        click.option(
            "--sole",
            multiple=True,
            metavar="[FRAME=]X0:X1:Y0:Y1",
            help="Rectangle of the sole in its contact frame [m], instead of the collision "
            "geometry's: of every surface contact, or of one. Another outline by its corners, "
            "X:Y,X:Y,X:Y. Repeatable.",
        ),
        click.option(
            "--sole-height",
            type=LENGTH,
            metavar="LENGTH",
            help="Height of the contact plane over the model's frames, along its normal [m]; "
            "negative where the sole lies below the frame, such as -0.1077.",
        ),
        click.option(
            "--contact-offset",
            "offsets",
            multiple=True,
            metavar="FRAME=X:Y:Z",
            help="Place of a contact in its frame [m], where the model has no frame at the very "
            "point, as at the tip of a leg. Repeatable.",
        ),
        click.option(
            "--contact-rpy",
            "turns",
            multiple=True,
            metavar="FRAME=ROLL:PITCH:YAW",
            help="Turn of a contact's axes from its frame's (degrees), for a frame whose z is not "
            "the outward normal of what it touches. Repeatable.",
        ),
        click.option(
            "--ground",
            "grounds",
            multiple=True,
            metavar="FRAME=ROLL:PITCH[:HEIGHT]",
            help="The ground under a contact: a slope (degrees; a positive pitch falls away ahead, "
            "a positive roll to the right), and its height over the world's origin [m]: a step. "
            "Repeatable.",
        ),
        click.option(
            "--contact-friction",
            "frictions",
            multiple=True,
            metavar="FRAME=MU[:TORSION]",
            help="Coulomb coefficient of a contact, and its torsional coefficient [m], which "
            "limits take unless they have their own. Repeatable.",
        ),
        click.option(
            "--plane",
            "planes",
            multiple=True,
            metavar="FRAME=NX:NY:NZ[:X:Y:Z]",
            help="The plane that a contact touches, by its outward normal and a point of it [m], "
            "world axes, such as a wall: l_hand=-1:0:0:0.4:0:0. Repeatable.",
        ),
    ]
    return with_options(options, command, CONTACTS)


def read_contacts(
    robot: str,
    texts: Sequence[str],
    frames: Collection[str],
    *,
    sole: Sequence[str],
    sole_height: float | None,
    offsets: Sequence[str],
    turns: Sequence[str],
    grounds: Sequence[str],
    planes: Sequence[str],
    frictions: Sequence[str] = (),
) -> list[Contact] | None:
    """The contacts that the options of `contact_options` say; None where they say nothing.

    Args:
        robot: the robot's name or file; a preset's contacts come along.
        texts: ``FRAME[:KIND]``; a frame alone takes what its preset knows of it.
        frames: the robot's frames.
        sole: ``[FRAME=]X0:X1:Y0:Y1``, or corners ``X:Y,X:Y,X:Y``.
        sole_height: of the contact plane over the frames [m].
        offsets: ``FRAME=X:Y:Z``.
        turns: ``FRAME=ROLL:PITCH:YAW``.
        grounds: ``FRAME=ROLL:PITCH[:HEIGHT]``.
        planes: ``FRAME=NX:NY:NZ[:X:Y:Z]``.
        frictions: ``FRAME=MU[:TORSION]``.

    Raises:
        InvalidInputError: an option that is not understood, or two that contradict each other.
        UnknownNameError: a kind, or a frame that is none of the contacts'.
    """
    from copsense.contact import Contact
    from copsense.robots import PRESETS

    known = PRESETS[robot].contacts if robot in PRESETS else ()
    contacts: list[Contact] = [] if texts else list(known)
    for text in texts:
        frame, kind = _frame_and_kind(text, frames)
        own = next((c for c in known if c.frame == frame), Contact(frame))
        contacts.append(own if kind is None else replace(own, kind=kind))  # type: ignore[arg-type]
    contacts = _placed(contacts, offsets, turns, grounds, planes)
    if (sole or sole_height is not None) and contacts and all(c.kind == "point" for c in contacts):
        raise InvalidInputError(
            "--sole and --sole-height describe a sole, and every contact is a point. Leave them "
            "out, or give a surface contact: --contact FRAME:surface."
        )
    contacts = _rubbing(_soled(contacts, sole), frictions)
    if sole_height is not None:
        if not math.isfinite(sole_height):
            raise InvalidInputError(f"--sole-height is {sole_height}. Give a finite height [m].")
        contacts = [c.at_height(sole_height) if c.kind != "point" else c for c in contacts]
    return list(contacts) or None


def possible_frames(texts: Iterable[str]) -> list[str]:
    """Frames that ``FRAME[:KIND]`` options may mean, before it is known which there are."""
    return [frame for text in texts for frame in (text, text.rpartition(":")[0]) if frame]


def _placed(
    contacts: Sequence[Contact],
    offsets: Sequence[str],
    turns: Sequence[str],
    grounds: Sequence[str],
    planes: Sequence[str],
) -> list[Contact]:
    """The contacts with what the options say of each."""
    from copsense.contact import Plane

    found = {contact.frame: contact for contact in contacts}
    for frame, values in _numbers("--contact-offset", offsets, _OFFSET, found, ("m",) * 3):
        found[frame] = replace(found[frame], offset=_three(values))
    for frame, values in _numbers("--contact-rpy", turns, _RPY, found, ("rad",) * 3):
        found[frame] = found[frame].turned(*values)
    units: tuple[Unit, ...] = ("rad", "rad", "m")
    sloping = _numbers("--ground", grounds, _GROUND, found, units, least=2)
    standing = _numbers("--plane", planes, _PLANE, found, (None,) * 3 + ("m",) * 3, least=3)
    both = {frame for frame, _ in sloping} & {frame for frame, _ in standing}
    if both:
        raise InvalidInputError(
            f"--ground and --plane both say what {sorted(both)[0]} touches. Give one of them."
        )
    for frame, values in sloping:
        found[frame] = replace(found[frame], plane=Plane.sloping(*values))
    for frame, values in standing:
        plane = Plane(_three(values[3:]), _three(values[:3]))
        found[frame] = replace(found[frame], plane=plane)
    return [found[contact.frame] for contact in contacts]


def _numbers(
    option: str,
    texts: Sequence[str],
    form: str,
    contacts: Collection[str],
    units: Sequence[Unit | None],
    *,
    least: int | None = None,
) -> list[tuple[str, list[float]]]:
    """``FRAME=A:B:C`` options of contacts: frame and numbers in SI; None is the unit of a number.

    What is left out from the `least` number on is zero; by default nothing may be.
    """
    found: dict[str, list[float]] = {}
    for text in texts:
        frame, value = split_assignment(text, form)
        if frame not in contacts:
            raise UnknownNameError("contact", frame, contacts, "Name it by --contact as well.")
        if frame in found:
            raise InvalidInputError(f"{option} is given twice for {frame}. Give it once.")
        found[frame] = read_numbers(value, f"{option} {text!r}", form, units, least=least)
    return list(found.items())


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _frame_and_kind(text: str, frames: Collection[str]) -> tuple[str, str | None]:
    """``FRAME[:KIND]`` taken apart: names may hold colons themselves, as in ``robot::l_foot``.

    Args:
        text: the option.
        frames: the robot's frames, of which the longest that fits is meant.
    """
    from copsense.contact import COMPONENTS

    frame, colon, kind = text.rpartition(":")
    if not colon or text in frames:
        return text, None
    if kind in COMPONENTS:
        return frame, kind
    if frame in frames:
        raise UnknownNameError("kind of contact", kind, COMPONENTS)
    return text, None  # the look-up of the frame reports what there is


def _soled(contacts: Sequence[Contact], texts: Sequence[str]) -> list[Contact]:
    """The contacts with the soles that ``--sole`` says."""
    found: dict[str, np.ndarray] = {}
    names = [contact.frame for contact in contacts if contact.kind != "point"]
    for text in texts:
        frame, equals, outline = text.rpartition("=")
        if equals and frame not in names:
            raise UnknownNameError(
                "contact with a sole", frame, names, "Name it by --contact as well."
            )
        if frame in found:
            raise InvalidInputError(
                f"--sole is given twice for {frame or 'every contact'}. Give it once."
            )
        found[frame] = _read_outline(outline)
    soled = []
    for contact in contacts:
        own = found.get(contact.frame, found.get(""))
        bare = contact.kind == "point" or own is None
        soled.append(contact if bare else replace(contact, polygon=own))
    return soled


def _rubbing(contacts: Sequence[Contact], texts: Sequence[str]) -> list[Contact]:
    """The contacts with the friction that ``--contact-friction`` says."""
    found = {contact.frame: contact for contact in contacts}
    seen: set[str] = set()
    for text in texts:
        frame, value = split_assignment(text, f"--contact-friction {_FRICTION}")
        if frame not in found:
            raise UnknownNameError("contact", frame, found, "Name it by --contact as well.")
        if frame in seen:
            raise InvalidInputError(f"--contact-friction is given twice for {frame}. Give it once.")
        seen.add(frame)
        said = f"--contact-friction {text!r}"
        friction, torsion = read_numbers(value, said, _FRICTION, (None, "m"), least=1)
        found[frame] = replace(found[frame], friction=friction)
        if ":" in value:
            found[frame] = replace(found[frame], torsional_friction=torsion)
    return [found[contact.frame] for contact in contacts]


def _read_outline(text: str) -> np.ndarray:
    """``X0:X1:Y0:Y1``, or corners ``X:Y,X:Y,X:Y``, as a polygon (k, 2) [m]."""
    import numpy as np

    from copsense.contact import rectangle

    if "," not in text:
        return rectangle(*_read_rectangle(text))
    said = f"the sole {text!r}"
    corners = text.split(",")
    return np.array([read_numbers(corner, said, _CORNERS, ("m", "m")) for corner in corners])


def _read_rectangle(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    try:
        x0, x1, y0, y1 = (read_quantity(number, "m") for number in text.split(":"))
    except ValueError:
        raise InvalidInputError(
            f"the sole {text!r} is not understood. Give X0:X1:Y0:Y1 [m], such as "
            "-0.07:0.12:-0.045:0.05."
        ) from None
    finite = all(map(math.isfinite, (x0, x1, y0, y1)))
    if not (finite and x0 <= x1 and y0 <= y1 and (x0 < x1 or y0 < y1)):
        raise InvalidInputError(
            f"the sole {text!r} is empty or not finite. Give X0 < X1 and Y0 < Y1 [m]; one pair may "
            "be equal, for a sole that is a line."
        )
    return (x0, x1), (y0, y1)
