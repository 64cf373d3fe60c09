"""analyse_line: the ``copsense analyse`` line for a robot, tried before it is given."""

from __future__ import annotations

import math
import shlex
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from copsense.contact import Contact, rectangle
from copsense.content import freeze
from copsense.drives import Drives
from copsense.errors import CopsenseError
from copsense.freedom import com_held, missing_joints
from copsense.robot import Robot
from copsense.robots.contact_soles import ContactAt
from copsense.robots.feet import Foot
from copsense.robots.plausibility import ImplausibleStanceWarning
from copsense.robots.standing import load_stance
from copsense.shapes import Geometry
from copsense.stance import Stance

_GUESSED = ((-0.08, 0.12), (-0.04, 0.04))  # m: a sole where none can be read
_WIDER = 1.2  # times as far apart, two feet under parallel legs


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
        given: options that the caller gave, word by word: of motors, springs and the like, and of
            `own`.
        own: the contacts that the caller gave, instead of `contacts`.
        level_soles: ``--level-soles``; of `own`, among the words given.
        width: ``--width`` [m], or None.
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
    given: tuple[str, ...] = ()
    own: tuple[Contact, ...] = ()
    level_soles: bool = False
    width: float | None = None

    def __post_init__(self) -> None:
        """Own the posture and the offsets."""
        freeze(self, "posture", "offsets")

    def __str__(self) -> str:
        """The line, quoted for a shell."""
        words = ["copsense", "analyse", self.source]
        if not self.own:  # else they are among the words that were given
            words += self._contact_words()
        roll, pitch, yaw = self.base_rpy
        if roll or pitch:
            words.append(f"--base-rpy={roll:g}:{pitch:g}:{yaw:g}")
        elif yaw:
            words.append(f"--base-yaw={yaw:g}")
        for joint, position in self.posture.items():
            words += ["--posture", f"{joint}={math.degrees(position):g}"]
        if self.width is not None:
            words += ["--width", f"{self.width:g}"]
        for folder in self.package_dirs:
            words += ["--package-dir", folder]
        return shlex.join([*words, *self.given])

    def _contact_words(self) -> list[str]:
        words: list[str] = []
        for contact in self.contacts:
            words += ["--contact", contact]
        for frame, place in self.offsets.items():
            words += ["--contact-offset", f"{frame}=" + ":".join(f"{c:g}" for c in place)]
        if self.contact_at is not None:
            words += ["--contact-at", self.contact_at]
        if self.level_soles:
            words.append("--level-soles")
        if self.soles != "collision":
            words += ["--soles", self.soles]
        if self.sole is not None:
            words.append("--sole=" + ":".join(f"{edge:g}" for pair in self.sole for edge in pair))
        return words

    def stand(self, robot: Robot | str, drives: Drives | None, locked: Sequence[str]) -> Stance:
        """Stand as the command does for this line.

        Args:
            robot: the robot, or the name of a preset, whose feet and posture come along.
            drives: what holds the joints, of a preset.
            locked: its joints that are rigid.
        """
        return load_stance(
            robot,
            contacts=list(self.own) or self._contacts() or None,
            contact_at=self.contact_at,
            soles=self.soles,
            level_soles=self.level_soles,
            posture=self.posture,
            base_rpy=np.radians(self.base_rpy) if any(self.base_rpy) else None,
            width=self.width,
            drives=drives,
            locked=locked,
        )

    def _contacts(self) -> list[Contact]:
        found = []
        for text in self.contacts:
            frame, colon, _ = text.rpartition(":")
            point = text.endswith(":point") and bool(colon)
            contact = Contact(text)
            if point:
                offset = self.offsets.get(frame, (0.0, 0.0, 0.0))
                contact = Contact(frame, kind="point", offset=offset)
            if self.sole is not None and not point:
                contact = Contact(text, polygon=rectangle(*self.sole))
            found.append(contact)
        return found


def lines_to_try(
    start: AnalyseLine, feet: Sequence[Foot], postures: Iterable[Mapping[str, float]]
) -> Iterator[AnalyseLine]:
    """Lines for these feet, or for the contacts that the caller gave, the likeliest first.

    Args:
        start: what all of them say.
        feet: the feet that were found.
        postures: joint -> position [rad].
    """
    surfaces = [foot for foot in feet if foot.kind == "surface"]
    unread = any(foot.sole is None for foot in surfaces)
    offsets = {f.frame: f.contact.offset for f in feet if f.kind == "point"}
    if not start.own:
        start = replace(
            start,
            contacts=tuple(f.frame if f.kind == "surface" else f"{f.frame}:point" for f in feet),
            contact_at="sole" if surfaces and not unread else None,
            sole=_GUESSED if unread else None,
            offsets={frame: offset for frame, offset in offsets.items() if any(offset)},
        )
    tilted = not start.own and any(f.sole is not None and f.sole.tilt for f in surfaces)
    postures = list(postures)
    distinct = [p for i, p in enumerate(postures) if p not in postures[:i]]
    for level, posture in product((True, False) if tilted else (start.level_soles,), distinct):
        yield replace(start, posture=posture, level_soles=level)


def first_that_stands(
    lines: Iterable[AnalyseLine], stand: Callable[[AnalyseLine], Stance]
) -> tuple[AnalyseLine | None, str, tuple[str, ...]]:
    """The first line by which the robot stands plausibly, else the first by which it stands.

    Args:
        lines: to be tried, in turn.
        stand: lets the robot stand by a line, or raises a `CopsenseError`.

    Returns:
        The line or None, why there is none or "", and what was said when it stood.
    """
    reason, doubtful = "no foot was found", None
    for line in lines:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("always")
                stance = stand(line)
        except CopsenseError as error:
            reason = str(error)
            continue
        if stance.branching and len(stance.contacts) == 2 and line.width is None:
            line, stance, apart = _apart(line, stance, stand)
        else:
            apart = ""
        # What most commands move is the CoM's y.
        held = com_held(stance, 1) if stance.robot.base_nv == 6 else ""
        told = [*(str(each.message) for each in said), held, apart]
        notes = tuple(filter(None, dict.fromkeys(told)))
        if not any(issubclass(each.category, ImplausibleStanceWarning) for each in said):
            return line, "", notes
        doubtful = doubtful or (line, "", notes)
    return doubtful or (None, reason, ())


def _apart(
    line: AnalyseLine, stance: Stance, stand: Callable[[AnalyseLine], Stance]
) -> tuple[AnalyseLine, Stance, str]:
    """The line with its feet wider apart where its legs stand exactly parallel, if that helps."""
    first, second = (place.translation for place in stance.placements)
    wider = replace(line, width=round(_WIDER * float(np.linalg.norm(second - first)), 3))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = stand(wider)
    except CopsenseError:
        return line, stance, ""
    if found.branching:
        return line, stance, ""
    lacking = "; ".join(missing_joints(stance))
    return (
        wider,
        found,
        "Legs that stand exactly parallel let the contacts lose rank, and wrenches have no "
        f"derivative there: the line puts the feet wider apart (--width). {lacking[:1].upper()}"
        f"{lacking[1:]}{'.' if lacking else ''}".rstrip(),
    )
