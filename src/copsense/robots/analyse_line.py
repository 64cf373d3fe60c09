"""analyse_line: the ``copsense analyse`` line for a robot, tried before it is given."""

from __future__ import annotations

import math
import shlex
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from copsense.contact import Contact, rectangle
from copsense.content import freeze
from copsense.errors import CopsenseError
from copsense.robot import Robot
from copsense.robots.contact_soles import ContactAt
from copsense.robots.feet import Foot
from copsense.robots.plausibility import ImplausibleStanceWarning
from copsense.robots.standing import load_stance
from copsense.shapes import Geometry

_GUESSED = ((-0.08, 0.12), (-0.04, 0.04))  # m: a sole where none can be read


@dataclass(frozen=True)
class AnalyseLine:
    """How a robot is made to stand, as options of every command.

    Attributes:
        source: path or name of the robot.
        contacts: ``FRAME`` or ``FRAME:point``.
        contact_at: ``--contact-at``, or None.
        soles: ``--soles``.
        sole: a rectangle for ``--sole`` where none can be read, or None.
        base_rpy: orientation of the base [deg].
        posture: joint -> position [rad].
        package_dirs: as given.
        offsets: frame -> place of its contact in it [m], of points beside their frames.
    """

    source: str
    contacts: tuple[str, ...] = ()
    contact_at: ContactAt | None = None
    soles: Geometry = "collision"
    sole: tuple[tuple[float, float], tuple[float, float]] | None = None
    base_rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    posture: Mapping[str, float] = field(default_factory=dict)
    package_dirs: tuple[str, ...] = ()
    offsets: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Own the posture and the offsets."""
        freeze(self, "posture", "offsets")

    def __str__(self) -> str:
        """The line, quoted for a shell."""
        words = ["copsense", "analyse", self.source]
        for contact in self.contacts:
            words += ["--contact", contact]
        for frame, place in self.offsets.items():
            words += ["--contact-offset", f"{frame}=" + ":".join(f"{c:g}" for c in place)]
        if self.contact_at is not None:
            words += ["--contact-at", self.contact_at]
        if self.soles != "collision":
            words += ["--soles", self.soles]
        if self.sole is not None:
            words.append("--sole=" + ":".join(f"{edge:g}" for pair in self.sole for edge in pair))
        roll, pitch, yaw = self.base_rpy
        if roll or pitch:
            words.append(f"--base-rpy={roll:g}:{pitch:g}:{yaw:g}")
        elif yaw:
            words.append(f"--base-yaw={yaw:g}")
        for joint, position in self.posture.items():
            words += ["--posture", f"{joint}={math.degrees(position):g}"]
        for folder in self.package_dirs:
            words += ["--package-dir", folder]
        return shlex.join(words)


def lines_to_try(
    source: str,
    feet: Sequence[Foot],
    soles: Geometry,
    base_rpy: tuple[float, float, float],
    postures: Iterable[Mapping[str, float]],
    package_dirs: tuple[str, ...],
) -> Iterator[AnalyseLine]:
    """Lines for these feet, the likeliest first."""
    surfaces = [foot for foot in feet if foot.kind == "surface"]
    unread = any(foot.sole is None for foot in surfaces)
    contacts = tuple(f.frame if f.kind == "surface" else f"{f.frame}:point" for f in feet)
    at: ContactAt | None = "sole" if surfaces and not unread else None
    sole = _GUESSED if unread else None
    offsets = {f.frame: f.contact.offset for f in feet if f.kind == "point"}
    beside = {frame: offset for frame, offset in offsets.items() if any(offset)}
    for posture in postures:
        yield AnalyseLine(
            source, contacts, at, soles, sole, base_rpy, posture, package_dirs, beside
        )


def first_that_stands(
    robot: Robot, lines: Iterable[AnalyseLine]
) -> tuple[AnalyseLine | None, str, tuple[str, ...]]:
    """The first line by which the robot stands plausibly, else the first by which it stands.

    Returns:
        The line or None, why there is none or "", and what was said when it stood.
    """
    reason, doubtful = "no foot was found", None
    for line in lines:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                _stand(robot, line)
        except CopsenseError as error:
            reason = str(error)
            continue
        notes = tuple(dict.fromkeys(str(each.message) for each in said))
        if not any(issubclass(each.category, ImplausibleStanceWarning) for each in said):
            return line, "", notes
        doubtful = doubtful or (line, "", notes)
    return doubtful or (None, reason, ())


def _stand(robot: Robot, line: AnalyseLine) -> None:
    """Stand as the command does for this line."""
    contacts = []
    for text in line.contacts:
        frame, colon, _ = text.rpartition(":")
        point = text.endswith(":point") and bool(colon)
        contact = Contact(text)
        if point:
            contact = Contact(frame, kind="point", offset=line.offsets.get(frame, (0.0, 0.0, 0.0)))
        if line.sole is not None and not point:
            contact = Contact(text, polygon=rectangle(*line.sole))
        contacts.append(contact)
    load_stance(
        robot,
        contacts=contacts,
        contact_at=line.contact_at,
        soles=line.soles,
        posture=line.posture,
        base_rpy=np.radians(line.base_rpy) if any(line.base_rpy) else None,
    )
