"""geometry: the collision shapes of an MJCF as Pinocchio's geometry objects."""

from __future__ import annotations

from typing import Any

import pinocchio as pin

from copsense.description import Description
from copsense.mjcf.mjcf_reading import MjcfReading, MjcfShape


def geometry_objects(reading: MjcfReading, description: Description) -> list[pin.GeometryObject]:
    """The collision shapes, on the joints of the reading's model.

    Raises:
        ValueError, RuntimeError: Pinocchio cannot read a mesh (without MuJoCo).
    """
    if reading.shapes is None:
        from copsense.mjcf.plain import read_shapes

        return read_shapes(description, reading.model)
    return [
        pin.GeometryObject(shape.name, shape.joint, 0, shape.placement, _geometry(shape))
        for shape in reading.shapes
    ]


def _geometry(shape: MjcfShape) -> Any:
    import coal  # slow to load, and seldom needed

    x, y, z = (float(s) for s in shape.size)
    if shape.kind == "mesh":
        mesh = coal.BVHModelOBBRSS()
        mesh.beginModel(0, len(shape.vertices))
        mesh.addVertices(shape.vertices)
        return mesh
    if shape.kind == "sphere":
        return coal.Sphere(x)
    if shape.kind == "ellipsoid":
        return coal.Ellipsoid(x, y, z)
    if shape.kind == "box":
        return coal.Box(2 * x, 2 * y, 2 * z)
    return (coal.Capsule if shape.kind == "capsule" else coal.Cylinder)(x, 2 * y)
