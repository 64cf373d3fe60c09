"""Feet, found by geometry: what a robot reaches lowest with at rest, whatever it is called."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.contact import Contact
from copsense.content import freeze
from copsense.errors import CopsenseError, ModelLoadError
from copsense.polygon import Polygon
from copsense.robot import Robot
from copsense.robots.contact_soles import sole_text
from copsense.robots.uprighting import upright_contacts
from copsense.shapes import Geometry, link_shapes, shape_points, whole_robot
from copsense.sole import THICKNESS, Sole, levelled, read_sole

_LOW = 0.4  # share of the height under which a link's frames must reach to be looked at
_NEAR = 0.05  # share of the height within which lowest points are on one ground
_LEVEL = 0.01  # share of the height within which a foot and its toes are
_BALL = 0.04  # m: among three feet and more, a narrower sole is a point
_HIGH = 0.03  # m: a point's frame this high over the ground is not on it
_UPRIGHT = np.cos(np.radians(0.1))


@dataclass(frozen=True, eq=False)
class Foot:
    """A link that the robot reaches lowest with.

    Attributes:
        frame: the frame to name as contact, of those fixed to the link.
        joint: index of the joint that carries it, in the robot's model.
        kind: ``"surface"``, or ``"point"`` where there is no sole.
        sole: as read there; None where none can be.
        contact: the contact, turned where the frame's z is not up.
        middle: middle of the sole at rest, in the world [m]; the lowest point where there is none.
        reason: why no sole could be read, or "".
    """

    frame: str
    joint: int
    kind: str
    sole: Sole | None
    contact: Contact
    middle: Float[np.ndarray, " 3"]
    reason: str = ""

    def __post_init__(self) -> None:
        """Own the middle."""
        freeze(self, "middle")

    def __str__(self) -> str:
        """The frame and the sole under it."""
        if self.sole is None:
            why = "it ends in a point" if not self.reason else self.reason
            return f"{self.frame}: no sole: {why}"
        return f"{self.frame}: sole {sole_text(self.contact, self.sole)}"


def find_feet(
    robot: Robot, q: Float[np.ndarray, " nq"], geometry: Geometry
) -> tuple[tuple[Foot, ...], tuple[str, ...]]:
    """The feet of a robot at rest, and what could not be read on the way, a sentence each.

    Args:
        robot: the robot.
        q: its configuration at rest, the base upright.
        geometry: whose lowest points count; frames count where there is none.
    """
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    depths = _depths(robot, data)
    lowest, highest = min(depths.values()), max(depths.values())
    joints = [j for j, z in depths.items() if z <= lowest + _LOW * (highest - lowest)]
    clouds, notes = _clouds(robot, data, joints, geometry)
    if clouds:
        bottoms = {j: float(points[:, 2].min()) for j, points in clouds.items()}
    else:
        bottoms = {j: depths[j] for j in joints}
    ground = min(bottoms.values())
    near = max(0.01, _NEAR * (highest - ground))
    low = [j for j, z in bottoms.items() if z <= ground + near]
    # Of a foot and its toes, on the same ground, the one that stands on more.
    level = max(0.005, _LEVEL * (highest - ground))
    feet = []
    for limb in _limbs(robot, low):
        bottom = min(bottoms[j] for j in limb)
        foot_and_toes = [
            _foot(robot, q, data, j, clouds.get(j), geometry)
            for j in limb
            if bottoms[j] <= bottom + level
        ]
        feet.append(
            max(
                foot_and_toes,
                key=lambda f: (_area(robot, f, geometry), -bottoms[f.joint], f.joint),
            )
        )
    if len(feet) > 2:
        feet = [f if f.sole is None or _width(f.sole) > _BALL else _as_point(f) for f in feet]
    placed = []
    for foot in feet:
        place = data.oMf[robot.frame_id(foot.frame)]
        over = float(place.translation[2] - foot.middle[2])
        if foot.kind == "point" and over > _HIGH:
            x, y, z = (float(c) for c in place.actInv(foot.middle).round(4) + 0.0)
            tip = replace(foot.contact, kind="point", offset=(x, y, z), rotation=np.eye(3))
            foot = replace(foot, contact=tip)
            notes += (
                f"contact {foot.frame!r}: its frame is {over * 1e3:.0f} mm over the lowest point "
                "of its link at rest; the contact is put there (--contact-offset).",
            )
        placed.append(foot)
    feet = placed
    return tuple(feet), notes


def faced_feet(
    robot: Robot, feet: tuple[Foot, ...], q: Float[np.ndarray, " nq"], geometry: Geometry
) -> tuple[Foot, ...]:
    """The feet with their contacts as they are turned where the robot faces along the world's x.

    Args:
        robot: the robot.
        feet: as `find_feet` found them.
        q: its configuration at rest, the base upright and facing along x.
        geometry: whose soles are read.
    """
    found = []
    for foot in feet:
        if foot.sole is not None and not np.array_equal(foot.contact.rotation, np.eye(3)):
            contact = _upright(robot, foot.frame, q)
            sole = read_sole(robot, contact, geometry=geometry)
            foot = replace(foot, contact=contact, sole=sole)
        found.append(foot)
    return tuple(found)


def _depths(robot: Robot, data: pin.Data) -> dict[int, float]:
    """Joint -> height of the lowest frame that it carries [m]."""
    depths: dict[int, float] = {}
    for frame, place in zip(robot.model.frames, data.oMf, strict=True):
        if frame.parentJoint > 0:
            z = float(place.translation[2])
            depths[frame.parentJoint] = min(z, depths.get(frame.parentJoint, np.inf))
    return depths


def _clouds(
    robot: Robot, data: pin.Data, joints: list[int], geometry: Geometry
) -> tuple[dict[int, Float[np.ndarray, "k 3"]], tuple[str, ...]]:
    """Joint -> points of its shapes in the world, and what could not be read."""
    if robot.description is None:
        return {}, ()
    try:
        whole = whole_robot(robot).model
    except ModelLoadError as error:
        return {}, (str(error),)
    owners = _owners(robot, whole)
    wanted = [own for own, (joint, _) in owners.items() if joint in joints]
    notes: list[str] = []
    try:
        shapes = link_shapes(robot, wanted, geometry)
    except ModelLoadError:  # one by one, for what can be read
        shapes = []
        for own in wanted:
            try:
                shapes += link_shapes(robot, [own], geometry)
            except ModelLoadError as error:
                notes.append(str(error))
    found: dict[int, list[Float[np.ndarray, "k 3"]]] = {}
    for shape in shapes:
        joint, frame = owners[shape.parentJoint]
        moved = data.oMi[joint] if frame is None else data.oMf[frame]
        place = moved * shape.placement
        points = shape_points(shape, -moved.rotation[2]) @ place.rotation.T + place.translation
        found.setdefault(joint, []).append(points)
    return {joint: np.vstack(points) for joint, points in found.items()}, tuple(notes)


def _owners(robot: Robot, whole: pin.Model) -> dict[int, tuple[int, int | None]]:
    """Joint of the file -> the robot's joint that moves it, and its frame where it is locked."""
    owners: dict[int, tuple[int, int | None]] = {}
    for own, name in enumerate(whole.names):
        if own == 1:
            owners[own] = 1, None
        elif name in robot.joint_names:
            owners[own] = robot.joint_id(name), None
        elif robot.model.existFrame(name, pin.FrameType.FIXED_JOINT):
            frame = robot.model.getFrameId(name, pin.FrameType.FIXED_JOINT)
            owners[own] = int(robot.model.frames[frame].parentJoint), int(frame)
    return owners


def _limbs(robot: Robot, joints: list[int]) -> list[list[int]]:
    """Joints, those of one limb together: one carries the other."""
    limbs: list[list[int]] = []
    for joint in sorted(joints):
        above = set(robot.model.supports[joint])
        for limb in limbs:
            if joint > 1 and any(other in above and other > 1 for other in limb):
                limb.append(joint)
                break
        else:
            limbs.append([joint])
    return limbs


def _area(robot: Robot, foot: Foot, geometry: Geometry) -> float:
    """Area [m^2] that a foot stands on where its sole lies flat."""
    if foot.sole is None:
        return 0.0
    flat = foot.sole
    if flat.tilt:
        flat = read_sole(robot, levelled(robot, foot.contact, geometry=geometry), geometry=geometry)
    return float(Polygon(flat.polygon).area)


def _foot(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    data: pin.Data,
    joint: int,
    points: Float[np.ndarray, "k 3"] | None,
    geometry: Geometry,
) -> Foot:
    """The foot that a joint carries, by the frame that describes it best."""
    frame = _best_frame(robot, data, joint, points)
    place = data.oMf[robot.frame_id(frame)]
    contact = _upright(robot, frame, q)
    try:
        sole = read_sole(robot, contact, geometry=geometry)
    except CopsenseError as error:
        reason = "" if "single point" in str(error) else str(error)
        middle = place.translation if points is None else points[np.argmin(points[:, 2])]
        kind = "point" if not reason else "surface"
        return Foot(frame, joint, kind, None, contact, np.array(middle), reason)
    x, y = (sole.polygon.min(axis=0) + sole.polygon.max(axis=0)) / 2
    middle = place.act(contact.rotation @ np.array([x, y, sole.height]))
    return Foot(frame, joint, "surface", sole, contact, middle)


def _upright(robot: Robot, frame: str, q: Float[np.ndarray, " nq"]) -> Contact:
    """The contact at a frame, turned where its z axis is not up."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # said again when the robot stands
        return upright_contacts(robot, (Contact(frame),), q)[0]


def _best_frame(
    robot: Robot, data: pin.Data, joint: int, points: Float[np.ndarray, "k 3"] | None
) -> str:
    """Of the frames fixed to a joint: upright, over the sole, at its bottom, first in the file."""
    best: tuple[tuple[float, ...], str] | None = None
    bottom = None if points is None else points[points[:, 2] <= points[:, 2].min() + THICKNESS]
    for i, frame in enumerate(robot.model.frames):
        bodies = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
        if frame.parentJoint != joint or frame.type not in bodies:
            continue
        if robot.frame_id(frame.name) != i:
            continue
        place = data.oMf[i]
        upright = np.abs(place.rotation[:, 2]).max() >= _UPRIGHT and place.rotation[2, 2] > 0.5
        over, deep = 0.0, float(place.translation[2])
        if bottom is not None:
            inside = (place.translation >= bottom.min(axis=0)) & (
                place.translation <= bottom.max(axis=0)
            )
            over = 0.0 if inside[:2].all() else 1.0
            deep = abs(deep - float(bottom[:, 2].min()))
        rank = (not upright, over, round(deep, 3), frame.type != pin.FrameType.BODY)
        if best is None or rank < best[0]:
            best = rank, frame.name
    if best is None:  # a joint without a body of its own
        return str(robot.model.names[joint])
    return best[1]


def _width(sole: Sole) -> float:
    """Width [m] of the rectangle of a sole's length and area."""
    length = max(sole.size)
    return Polygon(sole.polygon).area / length if length else 0.0


def _as_point(foot: Foot) -> Foot:
    return replace(foot, kind="point", sole=None)
