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
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.mjcf.geometry import geometry_objects
from copsense.polygon import Polygon
from copsense.robot import Robot

THICKNESS = 1e-3  # m: what lies within this of the lowest point belongs to the sole
_RIM = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)  # samples of a round rim


@dataclass(frozen=True, eq=False)
class Sole:
    """The sole under a frame of the robot's model.

    Attributes:
        height: height of the lowest point over the frame, along the contact's z [m]; negative
            when the sole lies under the frame.
        polygon: convex hull (k, 2) of the lowest millimetre, counter-clockwise, contact axes [m].
    """

    height: float
    polygon: Float[np.ndarray, "k 2"]


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
    if len(outline) < 2:
        raise ModelLoadError(
            f"the collision geometry under frame {contact.frame!r} touches the ground in a single "
            "point: it has no sole. Use a point contact, or give the polygon."
        )
    return Sole(lowest, outline.vertices)


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
    try:
        if robot.mjcf is None:
            links = {f.name for f in model.frames if f.parentJoint == joint}
            text = _only_collisions_of(description.text, links)
            shapes = pin.buildGeomFromUrdfString(
                model, text, pin.GeometryType.COLLISION, None, list(description.package_dirs)
            ).geometryObjects
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


def _only_collisions_of(text: str, links: set[str]) -> str:
    """The URDF without the collision geometry of other links, so that no other mesh is opened."""
    root = ET.fromstring(text.encode())
    for link in root.iter("link"):
        if link.get("name") not in links:
            for collision in link.findall("collision"):
                link.remove(collision)
    return ET.tostring(root, encoding="unicode")
