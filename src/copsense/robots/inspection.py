"""Inspection: what a robot is, where its feet are, and how it is made to stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.content import ShortRepr
from copsense.drives import Drives
from copsense.errors import InvalidInputError
from copsense.json_data import json_data
from copsense.listing import counted, first_few, listed
from copsense.robot import PLACEHOLDER_EFFORT, Robot
from copsense.robots.analyse_line import AnalyseLine, first_that_stands, lines_to_try
from copsense.robots.contact_soles import ContactAt, tip_text
from copsense.robots.feet import Foot, faced_feet, find_feet
from copsense.robots.heading import bent_knees, facing, straight_legs, upright_base
from copsense.robots.presets import PRESETS
from copsense.robots.stance_tables import is_stance_file
from copsense.robots.standing import load_robot, rest_positions
from copsense.shapes import Geometry
from copsense.sole import tilt_text

_UPRIGHT = 0.9  # z of the base's z axis from which it is as good as up
_BENDS = (30.0, 15.0, 60.0)  # deg, of a straight knee
_SHORT = 3  # joints of legs that end in points rather than soles


@dataclass(frozen=True)
class InspectedJoint:
    """A degree of freedom behind the base.

    Attributes:
        name: of the joint.
        unit: of its position, ``"rad"`` or ``"m"``.
        lower: its lowest position; -inf where there is no limit.
        upper: its highest.
        motor: whether a motor of its own moves it.
        effort: the motor's largest torque [Nm, or N]; inf where the file has no number for it.
        placeholder: the number that stands in the file for no limit, or None.
        spring: stiffness of its spring [Nm/rad, or N/m], or None.
        follows: the joint that it follows, or None.
    """

    name: str
    unit: Literal["rad", "m"]
    lower: float
    upper: float
    motor: bool
    effort: float
    placeholder: float | None
    spring: float | None
    follows: str | None

    @property
    def has_range(self) -> bool:
        """Whether its position has a limit, to one side at least."""
        return bool(np.isfinite([self.lower, self.upper]).any())

    def __str__(self) -> str:
        """One line: range, motor, spring, what it follows."""
        scale, unit = (1e3, "mm") if self.unit == "m" else (180 / np.pi, "deg")
        low, high = self.lower * scale, self.upper * scale
        span = f"{low:8.1f} .. {high:6.1f} {unit}" if self.has_range else "without end"
        force = "N" if self.unit == "m" else "Nm"
        drive = f"{self.effort:g} {force}" if np.isfinite(self.effort) else "no effort limit"
        if self.placeholder is not None:
            drive += f" ({self.placeholder:g} in the file is a placeholder)"
        drive = drive if self.motor else "no motor"
        spring = "" if self.spring is None else f", spring {self.spring:g} {force}/{self.unit}"
        follows = "" if self.follows is None else f", follows {self.follows}"
        return f"{span:26}  {drive}{spring}{follows}"


@dataclass(frozen=True, eq=False, repr=False)
class Inspection(ShortRepr):
    """What `inspect_robot` found.

    Attributes:
        robot: the robot.
        joints: its degrees of freedom behind the base.
        feet: the links that it reaches lowest with.
        heading: which way it faces [deg, counter-clockwise from the world's x, the base as the
            line turns it up], or None where nothing says it.
        heading_reason: how that is known.
        line: how it stands, or None.
        reason: why it does not stand, or "".
        notes: what was dropped, repaired or doubted, a sentence each.
    """

    robot: Robot
    joints: tuple[InspectedJoint, ...]
    feet: tuple[Foot, ...]
    heading: float | None
    heading_reason: str
    line: AnalyseLine | None
    reason: str
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As plain data [kg, m, rad, Nm]; the heading in degrees."""
        robot = self.robot
        return json_data(
            {
                "name": robot.name,
                "mass": robot.mass,
                "base": robot.base_frame,
                "gravity": robot.model.gravity.linear.tolist(),
                "joints": [vars(joint) for joint in self.joints],
                "motors": list(robot.torque_names),
                "loops": [loop.name for loop in robot.drives.loops],
                "heading_deg": self.heading,
                "feet": [
                    {
                        "frame": foot.frame,
                        "kind": foot.kind,
                        "size": None if foot.sole is None else list(foot.sole.size),
                        "height": None if foot.sole is None else foot.sole.height,
                        "tilt": None if foot.sole is None else foot.sole.tilt,
                        "polygon": None if foot.sole is None else foot.sole.polygon.tolist(),
                        "x_axis": foot.contact.rotation[:, 0].tolist(),
                        "z_axis": foot.contact.normal.tolist(),
                        "offset": list(foot.contact.offset),
                    }
                    for foot in self.feet
                ],
                "notes": list(self.notes),
                "analyse": None if self.line is None else str(self.line),
                "reason": self.reason or None,
            }
        )

    def __str__(self) -> str:
        """Mass, what joints lack, heading, feet, notes, and the line to paste."""
        return self.text()

    def text(self, *, joints: bool = False) -> str:
        """What was found, the line to paste last.

        Args:
            joints: with a line for each joint and loop, instead of one that counts what they lack.
        """
        robot = self.robot
        gravity = ", ".join(f"{g:g}" for g in robot.model.gravity.linear)
        lines = [
            f"{robot.name}: {robot.mass:.4g} kg, gravity ({gravity}) m/s^2, "
            f"{counted(len(self.joints), 'joint')}, {counted(len(robot.torque_names), 'motor')}, "
            f"base {robot.base_frame}",
            *(self._joint_lines() if joints else self._joint_summary()),
            "faces: " + _facing(self.heading, self.heading_reason),
            "lowest at rest:" if self.feet else "lowest at rest: nothing was found",
            *_feet_lines(self.feet),
        ]
        lines += [f"note: {note}" for note in self.notes]
        if self.line is None:
            lines.append(f"no line by which it stands: {self.reason}")
        else:
            lines += ["to analyse it:", f"  {self.line}"]
        return "\n".join(lines)

    def _joint_lines(self) -> list[str]:
        width = max((len(joint.name) for joint in self.joints), default=0)
        return [
            *(f"  {joint.name:{width}}  {joint}" for joint in self.joints),
            *(f"  loop {loop.name} ({loop.kind})" for loop in self.robot.drives.loops),
        ]

    def _joint_summary(self) -> list[str]:
        """One line: what joints lack, how many are sprung, coupled or closed in loops."""
        if not self.joints:
            return []
        motors = [joint for joint in self.joints if joint.motor]
        said = [_lacking(self.joints, "joint", "a range", lambda joint: joint.has_range)]
        if motors:
            said.append(
                _lacking(motors, "motor", "an effort limit", lambda joint: joint.effort < np.inf)
            )
        others = {
            "spring": sum(joint.spring is not None for joint in self.joints),
            "coupling": sum(joint.follows is not None for joint in self.joints),
            "loop": len(self.robot.drives.loops),
        }
        said += [counted(number, noun) for noun, number in others.items() if number]
        return [f"{'; '.join(said)} (--joints lists them)"]


def inspect_robot(
    source: str | Path | Robot,
    *,
    package_dirs: Iterable[str | Path] = (),
    root: str | None = None,
    contacts: Sequence[Contact] | None = None,
    contact_at: ContactAt | None = None,
    soles: Geometry = "collision",
    level_soles: bool = False,
    drives: Drives | None = None,
    locked: Sequence[str] = (),
    given: Sequence[str] = (),
) -> Inspection:
    """Inspect a robot: its joints and motors, the feet found by geometry, and how it stands.

    Args:
        source: a preset's name, the path of a URDF, MJCF or SDF, a stance file (.toml), whose
            stance the line analyses, or a `Robot`.
        package_dirs: folders that hold the packages of ``package://`` meshes.
        root: body of the robot that is meant, where an MJCF holds several.
        contacts: what it is to stand on, instead of the feet found by geometry.
        contact_at: of these contacts, as `copsense.load_stance` takes it.
        soles: likewise.
        level_soles: likewise.
        drives: what holds its joints, instead of what its file says.
        locked: joints that are rigid, at zero.
        given: how contacts, drives and locked joints are written as options of the command, which
            the line repeats.

    Raises:
        CopsenseError: the robot cannot be loaded.
    """
    folders = tuple(map(str, package_dirs))
    own = tuple(contacts or ())
    if is_stance_file(source) and (folders or own or given or locked or drives or root):
        raise InvalidInputError(
            f"the stance file {source} says what its robot is and how it stands. Leave contacts, "
            "drives, locked joints, folders and root (and the options of these) out."
        )
    robot = load_robot(
        source,
        package_dirs=folders,
        root=root,
        frames=[contact.frame for contact in own],
        drives=drives,
        locked=locked,
    )
    named = str(source)
    if isinstance(source, Robot):
        path = None if source.description is None else source.description.path
        named = "ROBOT" if path is None else str(path)
    joints = _joints(robot)
    rest = robot.configuration(rest_positions(robot))
    turn = _base_turn(robot, rest)
    q = _turned(robot, rest, turn)
    feet, notes = find_feet(robot, q, "collision")
    geometry: Geometry = "collision"
    if not any(foot.sole is not None or foot.kind == "point" for foot in feet):
        drawn, said = find_feet(robot, q, "visual") if robot.mjcf is None else ((), ())
        if any(foot.sole is not None or foot.kind == "point" for foot in drawn):
            feet, geometry, notes = drawn, "visual", said
            notes += (
                "no collision geometry was found under its feet; what is drawn is read instead "
                "(--soles visual).",
            )
    heading, why = facing(robot, q, feet)
    rpy = (turn[0], turn[1], (360.0 - (heading or 0.0)) % 360.0)
    if heading:
        feet = faced_feet(robot, feet, _turned(robot, rest, rpy), geometry)
    start = AnalyseLine(
        named,
        contact_at=contact_at if own else None,
        soles=soles if own else geometry,
        package_dirs=folders,
        given=tuple(given),
        own=own,
        level_soles=level_soles,
    )
    if named in PRESETS or is_stance_file(source):
        start = replace(start, soles=soles)  # its contacts are known
        found: AnalyseLine | None = start
        reason = ""
        if own or drives is not None or locked:
            # A preset by name: its posture comes along.
            found, reason, told = first_that_stands(
                [start], lambda line: line.stand(named, drives, locked)
            )
            notes += tuple(note for note in told if note not in notes)
        return Inspection(robot, joints, feet, heading, why, found, reason, (*robot.notes, *notes))
    notes = tuple(n for n in dict.fromkeys(notes) if n not in {foot.reason for foot in feet})
    if not own and (blind := _blind_legs(robot, feet)):
        reason = (
            f"{listed(blind)} end in legs of few joints, of which nothing is known that could "
            "touch the ground. Give their meshes (--package-dir), or --contact FRAME:point with "
            "--contact-offset."
        )
        return Inspection(robot, joints, feet, heading, why, None, reason, (*robot.notes, *notes))
    if not own and any(foot.kind == "surface" and foot.sole is None for foot in feet):
        notes += (
            "no sole can be read under its feet: the rectangle of --sole is a guess. Measure it: "
            "X0:X1:Y0:Y1 in the frame's axes [m].",
        )
    legs = straight_legs(robot, q, feet, heading or 0.0)
    bent: list[dict[str, float]] = [
        bent_knees(robot, q, legs, heading or 0.0, np.radians(bend)) for bend in _BENDS if legs
    ]
    lines = lines_to_try(replace(start, base_rpy=rpy), feet, [*bent, {}])
    found, reason, said = first_that_stands(lines, lambda line: line.stand(robot, None, ()))
    levelled = not own and found is not None and found.level_soles
    if found is None or levelled:  # else it was said when the robot stood
        tips = (tip_text(f.contact, f.sole) for f in feet if f.sole and f.sole.is_tip)
        said = (*said, *tips)
    notes += tuple(note for note in said if note not in notes)
    if levelled:
        tilted = [tilt_text(f.contact, f.sole.tilt) for f in feet if f.sole and f.sole.tilt]
        notes += (f"{'; '.join(tilted)}: the line levels them (--level-soles).",)
    return Inspection(robot, joints, feet, heading, why, found, reason, (*robot.notes, *notes))


def _blind_legs(robot: Robot, feet: Sequence[Foot]) -> list[str]:
    """Frames of feet without a known shape that hardly have soles: more than two short legs."""
    if len(feet) <= 2:
        return []
    unknown = [foot for foot in feet if foot.kind == "surface" and foot.sole is None]
    return [foot.frame for foot in unknown if len(robot.limb(foot.joint)) <= _SHORT]


def _base_turn(robot: Robot, rest: Float[np.ndarray, " nq"]) -> tuple[float, float, float]:
    """Roll and pitch [deg] that put the base upright: as the file has it, or by its limbs."""
    if robot.base_nv != 6:
        return (0.0, 0.0, 0.0)
    written = None if robot.mjcf is None else robot.mjcf.base
    if written is not None and written[2, 2] < _UPRIGHT:
        roll, pitch, _ = np.degrees(pin.rpy.matrixToRpy(written)).round(2) + 0.0
        return (float(roll), float(pitch), 0.0)
    return upright_base(robot, rest)


def _joints(robot: Robot) -> tuple[InspectedJoint, ...]:
    lower, upper = robot.position_limits
    motors = dict(zip(robot.torque_names, robot.effort_limits.tolist(), strict=True))
    follows = {each.joint: each.of for each in robot.drives.couplings if each.ratio}
    raw = np.asarray(robot.model.upperEffortLimit)[robot.base_nv :]
    found = []
    for i, name in enumerate(robot.dof_names):
        spring = robot.drives.springs.get(name)
        placeholder = PLACEHOLDER_EFFORT <= raw[i] < np.inf
        found.append(
            InspectedJoint(
                name,
                "m" if robot.dof_units[i] == "m" else "rad",
                float(lower[i]),
                float(upper[i]),
                name in motors,
                motors.get(name, np.inf),
                float(raw[i]) if placeholder else None,
                None if spring is None else spring.stiffness,
                follows.get(name),
            )
        )
    return tuple(found)


def _turned(
    robot: Robot, q: Float[np.ndarray, " nq"], rpy: tuple[float, float, float]
) -> Float[np.ndarray, " nq"]:
    turned = np.array(q)
    if any(rpy):
        turned[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*np.radians(rpy))).coeffs()
    return turned


def _lacking(
    joints: Sequence[InspectedJoint], noun: str, what: str, has: Callable[[InspectedJoint], bool]
) -> str:
    """Whether every joint has something, or how many lack it, and the first of them."""
    without = [joint.name for joint in joints if not has(joint)]
    if not without:
        return f"every {noun} has {what}"
    if len(without) == len(joints):
        return f"no {noun} has {what}"
    lack = "lacks" if len(without) == 1 else "lack"
    return f"{len(without)} of {len(joints)} {noun}s {lack} {what}: {first_few(without, 3)}"


def _feet_lines(feet: Sequence[Foot]) -> list[str]:
    """A line for each foot; why no sole was read, once."""
    first: dict[str, str] = {}
    lines = []
    for foot in feet:
        like = first.setdefault(foot.reason, foot.frame) if foot.reason else foot.frame
        known = like == foot.frame
        lines.append(f"  {foot}{_axes(foot)}" if known else f"  {foot.frame}: no sole, as {like}")
    return lines


def _axes(foot: Foot) -> str:
    """Axes of a turned contact in words, or nothing."""
    if foot.sole is None or np.array_equal(foot.contact.rotation, np.eye(3)):
        return ""
    names = [
        "+-"[int(axis[np.argmax(np.abs(axis))] < 0)] + "xyz"[int(np.argmax(np.abs(axis)))]
        for axis in foot.contact.rotation.T
    ]
    return f"; its x, y, z are the frame's {', '.join(names)}"


def _facing(heading: float | None, reason: str) -> str:
    if heading is None:
        return f"taken as +x, for {reason}"
    known = {0.0: "+x", 90.0: "+y", 180.0: "-x", 270.0: "-y"}
    return f"{known[heading]} of the world at rest, for {reason}"
