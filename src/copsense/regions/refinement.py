"""Refinement of a convex region of the plane, between an inner and an outer polygon."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from copsense.polygon import segment_distance

Point = Float[np.ndarray, " 2"]
Points = Float[np.ndarray, "k 2"]


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
    return segment_distance(outer, (px, py), (qx, qy)), np.array(outer)
