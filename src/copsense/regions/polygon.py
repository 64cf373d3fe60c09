"""Convex polygons of the plane: refined from support points, clipped, and made minimal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

MERGE = 1e-8  # m: vertices nearer than this to the line of their neighbours are no corners
_ROUNDING = 1e-12  # m: how far beyond a line a corner may be and still be on it

Point = Float[np.ndarray, " 2"]
Points = Float[np.ndarray, "k 2"]
Pair = Sequence[float]


def refine(farthest: Callable[[Point], Point], tolerance: float) -> tuple[Points, Points]:
    """An inner and an outer polygon of a convex region, from its support points ([Bretl2008]).

    Each support point p of a direction n gives a vertex of the inner polygon and the half-plane
    n c <= n p of the outer one. Between two neighbours the region lies in the triangle of the edge
    and the two support lines; the tallest triangle is cut, by the support line parallel to its
    edge, until none is taller than the tolerance.

    Returns:
        Vertices of the inner polygon and of the outer one, counter-clockwise.
    """
    # Directions that no sole is likely to be aligned with: the support points are corners.
    angles = 0.3 + 2 * np.pi / 3 * np.arange(3)
    normals = list(np.column_stack([np.cos(angles), np.sin(angles)]))
    points = [farthest(n) for n in normals]

    def corner(i: int) -> tuple[float, Point]:
        j = (i + 1) % len(points)
        return _triangle(points[i], normals[i], points[j], normals[j])

    corners = [corner(i) for i in range(3)]
    while True:
        i = int(np.argmax([height for height, _ in corners]))
        if corners[i][0] <= tolerance:
            return np.array(points), np.array([outer for _, outer in corners])
        edge = points[(i + 1) % len(points)] - points[i]
        n = np.array([edge[1], -edge[0]]) / np.hypot(*edge)
        normals.insert(i + 1, n)
        points.insert(i + 1, farthest(n))
        corners[i : i + 1] = [corner(i), corner(i + 1)]


def _triangle(p: Point, n: Point, q: Point, m: Point) -> tuple[float, Point]:
    """Where the line through p normal to n meets that through q normal to m, n turned left to m.

    Returns:
        Its distance from the segment p q, and the point.
    """
    (px, py), (qx, qy), (nx, ny), (mx, my) = (v.tolist() for v in (p, q, n, m))
    length = math.hypot(qx - px, qy - py)
    # Sine of the third angle, at the lines' meeting: of the whole turn from n to m.
    apex = nx * my - ny * mx
    if length == 0.0 or apex <= 0.0:
        return 0.0, p
    ex, ey = (qx - px) / length, (qy - py) / length
    # Sines of the triangle's angles at p and q: of the turns from n to the edge's normal, to m.
    a, b = max(-nx * ex - ny * ey, 0.0), max(mx * ex + my * ey, 0.0)
    cosine = nx * ey - ny * ex  # of the angle at p; (ey, -ex) is the edge's outward normal
    from_p = length * b / apex
    outer = (px + from_p * (cosine * ex + a * ey), py + from_p * (cosine * ey - a * ex))
    return _segment_distance(outer, (px, py), (qx, qy)), np.array(outer)


def clip(
    corners: Float[np.ndarray, "k r"], normal: Float[np.ndarray, " r"], offset: float
) -> Float[np.ndarray, "l r"]:
    """The part of a convex polygon or interval where normal x <= offset."""
    beyond = corners @ normal - offset
    kept: list[np.ndarray] = []
    for i, j in zip(range(-1, len(corners) - 1), range(len(corners)), strict=True):
        if (beyond[i] > _ROUNDING) != (beyond[j] > _ROUNDING):
            share = np.clip(beyond[i] / (beyond[i] - beyond[j]), 0.0, 1.0)
            kept.append(corners[i] + share * (corners[j] - corners[i]))
        if beyond[j] <= _ROUNDING:
            kept.append(corners[j])
    return np.array(kept).reshape(-1, corners.shape[1])


def tidy(polygon: Points) -> Float[np.ndarray, "l 2"]:
    """The convex polygon without vertices that lie between their neighbours."""
    corners, i, kept = polygon.tolist(), 0, 0
    while kept < len(corners) and len(corners) > 1:
        i %= len(corners)
        # Its neighbours; of two points each is the other's only one.
        if _segment_distance(corners[i], corners[i - 1], corners[(i + 1) % len(corners)]) <= MERGE:
            del corners[i]
            i, kept = max(i - 1, 0), 0
        else:
            i, kept = i + 1, kept + 1
    if len(corners) == 2:
        corners.sort(key=sum)
    return np.array(corners).reshape(-1, 2)


def distance(point: Point, polygon: Points) -> float:
    """Distance from a point to the boundary of a polygon, segment or point [m]."""
    ends = np.roll(polygon, -1, axis=0)
    edges = ends - polygon
    lengths = np.maximum(np.sum(edges**2, axis=1), 1e-300)
    shares = np.clip(np.sum((point - polygon) * edges, axis=1) / lengths, 0.0, 1.0)
    return float(np.min(np.linalg.norm(polygon + shares[:, None] * edges - point, axis=1)))


def _segment_distance(point: Pair, start: Pair, end: Pair) -> float:
    """The same for one segment, in plain numbers."""
    (x, y), (ax, ay), (bx, by) = point, start, end
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    share = ((x - ax) * dx + (y - ay) * dy) / square if square > 0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.hypot(ax + share * dx - x, ay + share * dy - y)
