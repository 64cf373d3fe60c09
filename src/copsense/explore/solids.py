"""Solids: boxes, cylinders, capsules and balls as the hulls of points."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from copsense.errors import ModelLoadError

_ROUND = 24  # corners of a round outline


def solid(kind: str, x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a solid about its middle; round ones have the z axis.

    Args:
        kind: ``"box"`` of half sides x, y, z; ``"sphere"`` of radius x; ``"ellipsoid"`` of radii
            x, y, z; ``"cylinder"`` or ``"capsule"`` of radius x and half length y.
        x: as the kind has it [m].
        y: likewise.
        z: likewise.

    Raises:
        ModelLoadError: no such kind, or it has no volume.
    """
    if kind == "box":
        points = np.array(np.meshgrid([-x, x], [-y, y], [-z, z])).reshape(3, -1).T
    elif kind == "cylinder":
        angle = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
        rim = np.column_stack([x * np.cos(angle), x * np.sin(angle)])
        points = np.vstack([np.column_stack([rim, np.full(_ROUND, end)]) for end in (-y, y)])
    elif kind == "sphere":
        points = _round(x, x, x)
    elif kind == "ellipsoid":
        points = _round(x, y, z)
    elif kind == "capsule":
        points = _round(x, x, x)
        points = points + np.where(points[:, 2:] >= 0, y, -y) * [0, 0, 1]
    else:
        raise ModelLoadError(
            f"a {kind!r} is not a shape that is drawn. Leave meshes out with --no-meshes."
        )
    return hull_of(points)


def _round(x: float, y: float, z: float) -> np.ndarray:
    turn = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
    rise = np.linspace(-np.pi / 2, np.pi / 2, _ROUND // 2 + 1)[1:-1]
    u, v = (a.ravel() for a in np.meshgrid(turn, rise))
    around = np.column_stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)])
    return np.vstack([around, [[0, 0, 1], [0, 0, -1]]]) * [x, y, z]


def hull_of(points: Float[np.ndarray, "k 3"]) -> tuple[np.ndarray, Int[np.ndarray, "f 3"]]:
    """The convex hull of points, its triangles seen from outside.

    Raises:
        ModelLoadError: they have no volume.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        raise ModelLoadError("a shape without volume. Leave meshes out with --no-meshes.") from None
    faces = hull.simplices.astype(np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces
