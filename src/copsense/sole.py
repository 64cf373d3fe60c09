"""Sole: the part of a foot's collision geometry that meets the ground."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.contact import Contact
from copsense.description import Description
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.meshes import find_mesh
from copsense.mjcf.geometry import geometry_objects
from copsense.parser_output import caught_parser_output
from copsense.polygon import Polygon
from copsense.robot import Robot

THICKNESS = 1e-3  # m: what lies within this of the lowest point belongs to the sole
_STEEPEST = np.radians(30.0)  # a face that faces down within this may be a tilted underside
_RIM = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)  # samples of a round rim


@dataclass(frozen=True, eq=False)
class Sole:
    """The sole under a frame of the robot's model.

    Attributes:
        height: height of the lowest point over the frame, along the contact's z [m]; negative
            when the sole lies under the frame.
        polygon: convex hull (k, 2) of the lowest millimetre, counter-clockwise, contact axes [m].
        tilt: angle [rad] between the contact's z and the underside, where the lowest millimetre is
            a mere edge of it; zero where the sole lies flat.
    """

    height: float
    polygon: Float[np.ndarray, "k 2"]
    tilt: float = 0.0


def read_sole(robot: Robot, contact: Contact, *, thickness: float = THICKNESS) -> Sole:
    """Read a foot's sole from the collision geometry of its link.

    Args:
        robot: a robot read from URDF or MJCF; its meshes are opened for this link alone.
        contact: names the frame and, by its rotation, which way is down (-z). Its offset is not
            applied: the height is over the model's frame.
        thickness: how near to the lowest point a vertex must be to count as sole [m].

    Raises:
        ModelLoadError: a mesh is missing, or the link has no collision geometry.
        InvalidInputError: the robot has no description to read geometry from.
        UnknownNameError: the contact's frame is not in the model.
    """
    finite_number(thickness, "the thickness of a sole [m]", positive=True)
    robot.frame(contact.frame)
    vertices = _foot_vertices(robot, contact)
    lowest = float(vertices[:, 2].min())
    sole = vertices[vertices[:, 2] <= lowest + thickness]
    outline = Polygon.hull(sole[:, :2], f"the sole of contact {contact.name!r}")
    tilt = _tilt(vertices, outline)
    if len(outline) < 2:
        why = f", because {tilt_text(contact, tilt)}" if tilt else ""
        remedy = "turn the contact by its rotation, use" if tilt else "Use"
        raise ModelLoadError(
            f"the collision geometry under frame {contact.frame!r} touches the ground in a single "
            f"point: it has no sole{why}. {remedy[0].upper()}{remedy[1:]} a point contact, or give "
            "the polygon."
        )
    return Sole(lowest, outline.vertices, tilt)


def tilt_text(contact: Contact, tilt: float) -> str:
    """A sole's tilt [rad] in words."""
    return (
        f"the sole's underside is tilted by {np.degrees(tilt):.1f} deg against frame "
        f"{contact.frame!r}"
    )


def _tilt(vertices: Float[np.ndarray, "k 3"], outline: Polygon) -> float:
    """Angle [rad] by which the underside of a foot is turned from the contact's x, y plane.

    The underside is the largest face of the convex hull that faces down within `_STEEPEST`. Zero
    where the lowest millimetre holds about half of it: then it is the sole.
    """
    width, depth = np.ptp(vertices[:, :2], axis=0)
    if outline.area > width * depth / 2:
        return 0.0
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    points = np.unique(np.round(vertices, 9), axis=0)
    if len(points) == 2:  # the two ends of a capsule
        run = points[1] - points[0]
        slope = float(np.arctan2(abs(run[2]), np.hypot(run[0], run[1])))
        return slope if len(outline) < 2 and slope <= _STEEPEST else 0.0
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 0.0  # flat: it has no underside of its own
    areas: dict[tuple[float, ...], float] = {}
    for corners, equation in zip(hull.simplices, hull.equations, strict=True):
        normal = tuple(np.round(equation[:3], 4).tolist())
        if -normal[2] >= np.cos(_STEEPEST):
            a, b, c = points[corners]
            areas[normal] = areas.get(normal, 0.0) + float(np.linalg.norm(np.cross(b - a, c - a)))
    if not areas:
        return 0.0
    face = max(areas, key=lambda normal: areas[normal])
    if outline.area >= areas[face] / 4:  # twice the area stands there
        return 0.0
    return float(np.arccos(min(1.0, -face[2] / float(np.linalg.norm(face)))))


# Meshes are slow to read, and asked for again by notes and warnings. Held as long as the robot, so
# that a robot loaded after its files have changed is read again.
_VERTICES: WeakKeyDictionary[Robot, dict[tuple[str, bytes], Float[np.ndarray, "k 3"]]] = (
    WeakKeyDictionary()
)


def _foot_vertices(robot: Robot, contact: Contact) -> Float[np.ndarray, "k 3"]:
    """Vertices of the collision shapes rigidly attached to the contact's frame, contact axes."""
    known = _VERTICES.setdefault(robot, {})
    key = contact.frame, contact.rotation.tobytes()
    if key not in known:
        known[key] = _read_vertices(robot, contact)
    return known[key]


def _read_vertices(robot: Robot, contact: Contact) -> Float[np.ndarray, "k 3"]:
    """The same, read from the files."""
    description = robot.description
    if description is None:
        raise InvalidInputError(
            f"robot {robot.name!r} was given as a model, without geometry. Give each contact its "
            "polygon, or load the robot from its URDF or MJCF."
        )
    # Unreduced: geometry hangs on the joints of the file.
    whole = (
        Robot.from_description(description, name=robot.name)
        if robot.mjcf is None
        else Robot(robot.name, robot.mjcf.model, description)
    )
    model, at_frame = whole.model, replace(contact, offset=(0.0, 0.0, 0.0)).on(whole)
    joint, axes = at_frame.joint, at_frame.placement
    text = ""
    if robot.mjcf is None:
        links = {f.name for f in model.frames if f.parentJoint == joint}
        text = _only_collisions_of(description, links)
    try:
        if robot.mjcf is None:
            with caught_parser_output():  # the reason is in the exception
                read = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
            shapes = list(read.geometryObjects)
        else:
            shapes = geometry_objects(robot.mjcf, description)
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0].rstrip(".")
        raise ModelLoadError(
            f"the collision geometry under frame {contact.frame!r} could not be read: {reason}. "
            "Give package_dirs= (--package-dir) for its meshes, or the contact's polygon."
        ) from None
    found = []
    for shape in shapes:
        if shape.parentJoint == joint:
            place = axes.actInv(shape.placement)
            found.append(_shape_vertices(shape, axes) @ place.rotation.T + place.translation)
    if not found:
        raise ModelLoadError(
            f"no collision geometry is attached to frame {contact.frame!r}. Give the contact its "
            "polygon (--sole X0:X1:Y0:Y1)."
        )
    return np.vstack(found)


def _shape_vertices(shape: pin.GeometryObject, axes: pin.SE3) -> Float[np.ndarray, "k 3"]:
    """Points of a shape, in its own frame, among which its lowest ones are."""
    import coal  # slow to load, and seldom needed

    geometry = shape.geometry
    if isinstance(geometry, coal.Box):
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        return signs * geometry.halfSide
    if isinstance(geometry, coal.Cylinder):
        rim = np.column_stack([np.cos(_RIM), np.sin(_RIM)]) * geometry.radius
        half = np.full((len(rim), 1), geometry.halfLength)
        return np.vstack([np.hstack([rim, half]), np.hstack([rim, -half])])
    if isinstance(geometry, coal.Sphere | coal.Capsule):
        # The lowest point of a ball lies straight under its centre.
        down = -(shape.placement.rotation.T @ axes.rotation[:, 2]) * geometry.radius
        end = geometry.halfLength if isinstance(geometry, coal.Capsule) else 0.0
        return np.array([[0.0, 0.0, end], [0.0, 0.0, -end]]) + down
    if isinstance(geometry, coal.Ellipsoid):
        # Its lowest point, where the outward normal is straight down.
        down = shape.placement.rotation.T @ -axes.rotation[:, 2]
        radii = np.array(geometry.radii)
        return (radii**2 * down / np.linalg.norm(radii * down))[None]
    if isinstance(geometry, coal.BVHModelBase):
        return np.array(geometry.vertices())
    if isinstance(geometry, coal.ConvexBase):
        return np.array(geometry.points())
    raise ModelLoadError(
        f"collision shape {shape.name!r} is a {type(geometry).__name__}, of which no sole can be "
        "read. Give the contact its polygon."
    )


def _only_collisions_of(description: Description, links: set[str]) -> str:
    """The URDF with the collision geometry of these links alone, its meshes found.

    No other mesh is opened.
    """
    root = ET.fromstring(description.text)
    for link in root.iter("link"):
        for collision in link.findall("collision"):
            if link.get("name") not in links:
                link.remove(collision)
        for mesh in link.iterfind("collision/geometry/mesh"):
            filename = mesh.get("filename", "")
            found = find_mesh(filename, description.package_dirs, description.path)
            mesh.set("filename", str(found))
    return ET.tostring(root, encoding="unicode")
