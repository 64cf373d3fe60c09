"""Sole: the part of a foot's geometry that meets the ground."""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.contact import SOLE_DETAIL, Contact
from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.magnitudes import in_metres
from copsense.polygon import Polygon
from copsense.robot import Robot
from copsense.shapes import Geometry, link_shapes, shape_points, whole_robot

THICKNESS = 1e-3  # m: what lies within this of the lowest point belongs to the sole
LEVEL = "turn the contact by its rotation, or level it (level_soles=True, --level-soles)"
_STEEPEST = np.radians(45.0)  # a face that faces down within this may be a tilted underside
_UP = (0.0, 0.0, 1.0)
_TIP = 1 / 6  # share of its foot's outline under which a sole is hardly all of it


@dataclass(frozen=True, eq=False, repr=False)
class Sole(ShortRepr):
    """The sole under a frame of the robot's model.

    Attributes:
        height: height of the lowest point over the frame, along the contact's z [m]; negative
            when the sole lies under the frame.
        polygon: convex hull (k, 2) of the lowest millimetre, counter-clockwise, contact axes [m];
            without vertices that stand out of it by less than a micrometre.
        upright: unit vector normal to the underside, away from the ground, contact axes, where the
            lowest millimetre is a mere edge of it; the contact's z where the sole lies flat.
        footprint: length and width of all that is fixed to the frame, seen from above [m].
    """

    height: float
    polygon: Float[np.ndarray, "k 2"]
    upright: tuple[float, float, float] = _UP
    footprint: tuple[float, float] = (0.0, 0.0)

    @property
    def tilt(self) -> float:
        """Angle between the contact's z and the underside [rad]; zero where the sole lies flat."""
        return float(np.arctan2(np.hypot(self.upright[0], self.upright[1]), self.upright[2]))

    @property
    def size(self) -> tuple[float, float]:
        """Length and width of the polygon along the contact's x and y [m]."""
        length, width = np.ptp(self.polygon, axis=0)
        return float(length), float(width)

    @property
    def is_tip(self) -> bool:
        """Whether it is so small beside its foot that it may be a tip or an edge of it alone."""
        outline = Polygon(self.polygon)
        return len(outline) > 2 and outline.area < _TIP * self.footprint[0] * self.footprint[1]

    def __post_init__(self) -> None:
        """Own the polygon."""
        freeze(self, "polygon")


def read_sole(
    robot: Robot,
    contact: Contact,
    *,
    thickness: float = THICKNESS,
    geometry: Geometry = "collision",
) -> Sole:
    """Read a foot's sole from the geometry of its link.

    Args:
        robot: a robot read from URDF or MJCF; its meshes are opened for this link alone.
        contact: names the frame and, by its rotation, which way is down (-z). Its offset is not
            applied: the height is over the model's frame.
        thickness: how near to the lowest point a vertex must be to count as sole [m].
        geometry: ``"collision"``, or ``"visual"`` where a URDF has no other.

    Raises:
        ModelLoadError: a mesh is missing, or the link has no such geometry.
        InvalidInputError: the robot has no description to read geometry from.
        UnknownNameError: the contact's frame is not in the model.
    """
    finite_number(thickness, "the thickness of a sole [m]", positive=True)
    robot.frame(contact.frame)
    vertices = _foot_vertices(robot, contact, geometry)
    if thickness > max(THICKNESS, float(np.ptp(vertices, axis=0).max())):
        raise InvalidInputError(
            f"the thickness of a sole is {thickness:g} m, more than all that is fixed to frame "
            f"{contact.frame!r}. {in_metres(thickness)}"
        )
    lowest = float(vertices[:, 2].min())
    sole = vertices[vertices[:, 2] <= lowest + thickness]
    outline = Polygon.hull(sole[:, :2], f"the sole of contact {contact.name!r}", SOLE_DETAIL)
    upright = _upright(vertices, outline)
    if len(outline) < 2:
        tilt = Sole(lowest, outline.vertices, upright).tilt
        why = f", because {tilt_text(contact, tilt)}" if tilt else ""
        remedy = f"{LEVEL}, use" if tilt else "Use"
        raise ModelLoadError(
            f"the {geometry} geometry under frame {contact.frame!r} touches the ground in a single "
            f"point: it has no sole{why}. {remedy[0].upper()}{remedy[1:]} a point contact, or give "
            "the polygon (--sole X0:X1:Y0:Y1)."
        )
    width, depth = np.ptp(vertices[:, :2], axis=0)
    return Sole(lowest, outline.vertices, upright, (float(width), float(depth)))


def levelled(robot: Robot, contact: Contact, *, geometry: Geometry = "collision") -> Contact:
    """The contact with its frame turned, by the smallest rotation, until its sole lies flat.

    A contact whose sole lies flat is returned as it is, as is one that is a point or whose
    underside is more than 45 degrees off.

    Args:
        robot: a robot read from URDF or MJCF.
        contact: its offset stays, its polygon must not be given.
        geometry: ``"collision"``, or ``"visual"`` where a URDF has no other.

    Raises:
        ModelLoadError: a mesh is missing, or the link has no such geometry.
        InvalidInputError: the contact has a polygon, which is in the axes that would turn.
    """
    if contact.kind == "point":
        return contact
    if contact.polygon is not None:
        raise InvalidInputError(
            f"contact {contact.name!r} has a polygon in its own axes, so they cannot be turned "
            "until the sole lies flat. Leave the polygon out to have it read, or do not level."
        )
    robot.frame(contact.frame)
    vertices = _foot_vertices(robot, contact, geometry)
    bottom = vertices[vertices[:, 2] <= vertices[:, 2].min() + THICKNESS]
    upright = _upright(vertices, Polygon.hull(bottom[:, :2], f"the sole of {contact.name!r}"))
    if upright == _UP:
        return contact
    turn = np.asarray(pin.Quaternion.FromTwoVectors(np.array(_UP), np.array(upright)).matrix())
    return replace(contact, rotation=contact.rotation @ turn)


def tilt_text(contact: Contact, tilt: float) -> str:
    """A sole's tilt [rad] in words."""
    return (
        f"the sole's underside is tilted by {np.degrees(tilt):.1f} deg against frame "
        f"{contact.frame!r}"
    )


def _upright(vertices: Float[np.ndarray, "k 3"], outline: Polygon) -> tuple[float, float, float]:
    """Unit normal of a foot's underside, away from the ground, contact axes.

    The underside is the largest face of the convex hull that faces down within `_STEEPEST`. The
    contact's z where the lowest millimetre holds about half of it: then it is the sole.
    """
    width, depth = np.ptp(vertices[:, :2], axis=0)
    if outline.area > width * depth / 2:
        return _UP
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    points = np.unique(np.round(vertices, 9), axis=0)
    if len(points) == 2:  # the two ends of a capsule
        run = points[1] - points[0]
        level = float(np.hypot(run[0], run[1]))
        if len(outline) < 2 and np.arctan2(abs(run[2]), level) <= _STEEPEST:
            return _unit(np.array([-run[0] * run[2], -run[1] * run[2], level**2]))
        return _UP
    try:
        hull = ConvexHull(points)
    except QhullError:
        return _UP  # flat: it has no underside of its own
    faces: dict[tuple[float, ...], Float[np.ndarray, " 3"]] = {}
    for corners, equation in zip(hull.simplices, hull.equations, strict=True):
        alike = tuple(np.round(equation[:3], 4).tolist())
        if -alike[2] >= np.cos(_STEEPEST):
            a, b, c = points[corners]
            twice = float(np.linalg.norm(np.cross(b - a, c - a)))
            faces[alike] = faces.get(alike, np.zeros(3)) - twice * equation[:3]
    if not faces:
        return _UP
    largest = max(faces.values(), key=lambda face: float(face @ face))
    if outline.area >= float(np.linalg.norm(largest)) / 4:  # twice the area stands there
        return _UP
    return _unit(largest)


def _unit(vector: Float[np.ndarray, " 3"]) -> tuple[float, float, float]:
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return x, y, z


# Meshes are slow to read, and asked for again by notes and warnings. Held as long as the robot, so
# that a robot loaded after its files have changed is read again.
_VERTICES: WeakKeyDictionary[Robot, dict[tuple[str, bytes, str], Float[np.ndarray, "k 3"]]] = (
    WeakKeyDictionary()
)


def _foot_vertices(robot: Robot, contact: Contact, geometry: Geometry) -> Float[np.ndarray, "k 3"]:
    """Vertices of the shapes rigidly attached to the contact's frame, contact axes."""
    known = _VERTICES.setdefault(robot, {})
    key = contact.frame, contact.rotation.tobytes(), geometry
    if key not in known:
        known[key] = _read_vertices(robot, contact, geometry)
    return known[key]


def _read_vertices(robot: Robot, contact: Contact, geometry: Geometry) -> Float[np.ndarray, "k 3"]:
    """The same, read from the files."""
    at_frame = replace(contact, offset=(0.0, 0.0, 0.0)).on(whole_robot(robot))
    axes = at_frame.placement
    where = f"under frame {contact.frame!r}"
    shapes = link_shapes(robot, {at_frame.joint}, geometry, where)
    if not shapes:
        raise ModelLoadError(
            f"no {geometry} geometry is attached to frame {contact.frame!r}. Give the contact its "
            "polygon (--sole X0:X1:Y0:Y1)"
            + (", or read what is drawn (--soles visual)." if geometry == "collision" else ".")
        )
    found = []
    for shape in shapes:
        place = axes.actInv(shape.placement)
        points = shape_points(shape, -axes.rotation[:, 2])
        found.append(points @ place.rotation.T + place.translation)
    return np.vstack(found)
