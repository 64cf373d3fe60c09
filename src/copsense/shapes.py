"""Shapes: the geometry of a robot's links, as its description gives it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.description import Description
from copsense.errors import InvalidInputError, ModelLoadError
from copsense.meshes import find_mesh
from copsense.mjcf.geometry import geometry_objects
from copsense.parser_output import caught_parser_output
from copsense.robot import Robot

Geometry = Literal["collision", "visual"]

_RIM = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)  # samples of a round rim

# Asked for by every foot, and slow to build. It holds no description, which could not go then.
_WHOLE: WeakKeyDictionary[Description, pin.Model] = WeakKeyDictionary()


def whole_robot(robot: Robot) -> Robot:
    """The robot with every joint of its file: geometry hangs on those.

    Raises:
        ModelLoadError: it was read from an SDF, whose shapes are not read.
        InvalidInputError: the robot has no description to read geometry from.
    """
    description = robot.description
    if description is None:
        raise InvalidInputError(
            f"robot {robot.name!r} was given as a model, without geometry. Give each contact its "
            "polygon, or load the robot from its URDF or MJCF."
        )
    if description.language == "sdf":
        raise ModelLoadError(
            "the shapes of an SDF are not read. Give the contacts their polygons "
            "(--sole X0:X1:Y0:Y1)."
        )
    if robot.mjcf is not None:
        return Robot(robot.name, robot.mjcf.model, description)
    if description not in _WHOLE:
        _WHOLE[description] = Robot.from_description(description).model
    return Robot(robot.name, _WHOLE[description], description)


def link_shapes(
    robot: Robot,
    joints: Collection[int],
    geometry: Geometry = "collision",
    where: str = "of the links asked for",
) -> list[pin.GeometryObject]:
    """The shapes that some joints carry; no other mesh is opened.

    Args:
        robot: a robot read from URDF or MJCF.
        joints: indices of the joints in the model of `whole_robot`.
        geometry: what collides, or what is drawn (URDF alone).
        where: which geometry that is, for an error.

    Raises:
        ModelLoadError: a mesh is missing or unreadable, or geometry was asked for that is not
            read: an MJCF's drawn one, an SDF's.
        InvalidInputError: the robot has no description to read geometry from.
    """
    model = whole_robot(robot).model
    description = robot.description
    assert description is not None
    if robot.mjcf is not None and geometry == "visual":
        raise ModelLoadError(
            "what an MJCF draws is not read, only what collides. Give contype or conaffinity to "
            "the geoms of the feet, or the contacts their polygons (--sole X0:X1:Y0:Y1)."
        )
    text = ""
    if robot.mjcf is None:
        links = {f.name for f in model.frames if f.parentJoint in joints}
        text = _only_shapes_of(description, links, geometry)
    kind = pin.GeometryType.COLLISION if geometry == "collision" else pin.GeometryType.VISUAL
    try:
        if robot.mjcf is None:
            with caught_parser_output():  # the reason is in the exception
                read = pin.buildGeomFromUrdfString(model, text, kind)
            shapes = list(read.geometryObjects)
        else:
            shapes = geometry_objects(robot.mjcf, description)
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0].rstrip(".")
        raise ModelLoadError(
            f"the {geometry} geometry {where} could not be read: {reason}. "
            "Give package_dirs= (--package-dir) for its meshes, or the contact's polygon."
        ) from None
    return [shape for shape in shapes if shape.parentJoint in joints]


def shape_points(
    shape: pin.GeometryObject, down: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "k 3"]:
    """Points of a shape, in its own frame, among which its lowest ones are.

    Args:
        shape: the shape.
        down: which way is down, in the axes of the joint that carries it.
    """
    import coal  # slow to load, and seldom needed

    geometry, down = shape.geometry, shape.placement.rotation.T @ down
    if isinstance(geometry, coal.Box):
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        return signs * geometry.halfSide
    if isinstance(geometry, coal.Cylinder):
        rim = np.column_stack([np.cos(_RIM), np.sin(_RIM)]) * geometry.radius
        half = np.full((len(rim), 1), geometry.halfLength)
        return np.vstack([np.hstack([rim, half]), np.hstack([rim, -half])])
    if isinstance(geometry, coal.Sphere | coal.Capsule):
        # The lowest point of a ball lies straight under its centre.
        end = geometry.halfLength if isinstance(geometry, coal.Capsule) else 0.0
        return np.array([[0.0, 0.0, end], [0.0, 0.0, -end]]) + down * geometry.radius
    if isinstance(geometry, coal.Ellipsoid):
        # Its lowest point, where the outward normal is straight down.
        radii = np.array(geometry.radii)
        return (radii**2 * down / np.linalg.norm(radii * down))[None]
    if isinstance(geometry, coal.BVHModelBase):
        return np.array(geometry.vertices())
    if isinstance(geometry, coal.ConvexBase):
        return np.array(geometry.points())
    raise ModelLoadError(
        f"shape {shape.name!r} is a {type(geometry).__name__}, of which no sole can be "
        "read. Give the contact its polygon."
    )


def _only_shapes_of(description: Description, links: set[str], geometry: Geometry) -> str:
    """The URDF with the geometry of these links and no more than it takes, its meshes found."""
    root = ET.fromstring(description.text)
    for part in list(root):
        if part.tag not in ("link", "joint", "material"):
            root.remove(part)
    for link in root.iter("link"):
        for part in list(link):
            if part.tag != geometry or link.get("name") not in links:
                link.remove(part)
        for mesh in link.iterfind(f"{geometry}/geometry/mesh"):
            filename = mesh.get("filename", "")
            found = find_mesh(filename, description.package_dirs, description.path)
            mesh.set("filename", str(found))
    return ET.tostring(root, encoding="unicode")
