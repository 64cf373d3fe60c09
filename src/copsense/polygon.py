"""Polygon: a convex figure of the plane, such as a sole, its edges, and distances to them.

A small exact class of the package's own: Qhull rejects flat input, and neither it nor GEOS numbers
the edges and names the way they face, which is what margins and limits are about.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError
from copsense.qp import linear_minimum

_ROUNDING = 1e-12  # m: how far beyond a line a vertex may be and still be on it
# m: a centre of pressure this near to its sole's edge is on it, and on the sole: a limit may hold
# it there.
ON_EDGE = 1e-9
_ON_LINE = 1e-9  # m: a point nearer to a segment is on it
_FLAT = 1e-6  # m: how far a vertex may lie inside the line of its neighbours by rounding
_AXES = {"x": 0, "y": 1}

Pair = Sequence[float]


@dataclass(frozen=True, eq=False, repr=False)
class EdgeMargin(ShortRepr):
    """Distance of a point to the nearest edge of a polygon.

    Attributes:
        distance: signed distance to that edge's line [m]; negative outside.
        edge: index of the edge, from vertex `edge` to the next; of a segment 0 and 1 are its ends,
            2 and 3 its sides.
        side: which side of the polygon's axes that edge faces, such as ``"+y (left)"``.
        normal: the edge's outward unit normal (2,).
    """

    distance: float
    edge: int
    side: str
    normal: Float[np.ndarray, " 2"]

    def __post_init__(self) -> None:
        """Own the normal."""
        freeze(self, "normal")


@dataclass(frozen=True, eq=False)
class Polygon:
    """A convex polygon; two vertices make a segment, one a point, none an empty set.

    Edge i goes from vertex i to the next. A segment's edges are its two ends: it is looked at along
    its own line, and has no inside across it. Polygons compare and hash by their vertices.

    Attributes:
        vertices: (k, 2), counter-clockwise, each once [m].
    """

    vertices: Float[np.ndarray, "k 2"]

    def __post_init__(self) -> None:
        """Own the vertices.

        Raises:
            InvalidInputError: not a finite (k, 2) array that goes round counter-clockwise.
        """
        v = finite_array(self.vertices, "the polygon", (None, 2), "x, y [m]")
        object.__setattr__(self, "vertices", v)
        before, after = v - np.roll(v, 1, axis=0), np.roll(v, -1, axis=0) - v
        repeated = len(v) > 1 and not np.all(np.any(after != 0, axis=1))
        inwards = 0.0
        if len(v) > 2 and not repeated:
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            along = np.einsum("ij,ij->i", before, after)
            inwards = float((turn / np.linalg.norm(before + after, axis=1).clip(1e-300)).min())
            # A star turns left at every vertex too, but goes round more than once.
            repeated = float(np.arctan2(turn, along).sum()) > 3 * np.pi
        if repeated or inwards < -_FLAT:
            raise InvalidInputError(
                "the polygon does not go round a convex figure counter-clockwise, each vertex "
                "once. Use Polygon.hull(points), which puts any points in order."
            )

    @classmethod
    def hull(cls, points: ArrayLike, what: str = "the polygon", detail: float = 0.0) -> Polygon:
        """The convex hull of points (k, 2) in any order.

        Args:
            points: x, y of each point [m].
            what: how an error calls them.
            detail: what stands out by no more is left out, as in `merged` [m].

        Raises:
            InvalidInputError: not a finite (k, 2) array.
        """
        array = finite_array(points, what, (None, 2), "x, y [m]")
        # Andrew's monotone chain. Rounded to the picometre: noise in x would put the points of an
        # upright edge out of order.
        ordered = [tuple(p) for p in np.unique(np.round(array, 12) + 0.0, axis=0)]
        round_it = ordered if len(ordered) < 3 else _half(ordered) + _half(ordered[::-1])
        hull = cls(np.array(round_it).reshape(-1, 2))
        fewer = cls.merged(hull.vertices, detail) if detail else hull
        return hull if len(fewer) == len(hull) else cls.hull(fewer.vertices, what)

    @classmethod
    def merged(cls, vertices: Float[np.ndarray, "k 2"], tolerance: float) -> Polygon:
        """A polygon of vertices in order, without those on the line of their neighbours.

        The nearest to it is left out first, until each vertex stands out by more: merged again, the
        polygon is the same. Of a segment the end of the lesser x + y comes first.

        Args:
            vertices: (k, 2), counter-clockwise, convex but for rounding; some may be equal [m].
            tolerance: how near to the segment of its neighbours a vertex is left out [m].
        """
        corners: list[list[float]] = vertices.tolist()

        def standing_out(i: int) -> float:
            # Of two points each is the other's only neighbour.
            here, before, after = (corners[j % len(corners)] for j in (i, i - 1, i + 1))
            return segment_distance(here, before, after)

        out = [standing_out(i) for i in range(len(corners))]
        while len(corners) > 1 and (least := min(out)) <= tolerance:
            i = out.index(least)
            del corners[i], out[i]
            for j in (i - 1, i):
                out[j % len(out)] = standing_out(j)
        if len(corners) == 2:
            corners.sort(key=sum)
        return cls(np.array(corners).reshape(-1, 2))

    def __eq__(self, other: object) -> bool:
        """Whether the other is a polygon of the same vertices in the same order."""
        return isinstance(other, Polygon) and np.array_equal(self.vertices, other.vertices)

    def __hash__(self) -> int:
        """By the vertices; -0 and 0 are the same."""
        return hash((len(self.vertices), (self.vertices + 0.0).tobytes()))

    def __len__(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    def __repr__(self) -> str:
        """What it is, its extent and area."""
        if len(self) < 2:
            return f"Polygon({self.vertices.tolist()})"
        (x0, y0), (x1, y1) = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return (
            f"Polygon({len(self)} vertices, x {x0:.4g} to {x1:.4g} m, y {y0:.4g} to {y1:.4g} m, "
            f"{self.area:.4g} m2)"
        )

    @cached_property
    def normals(self) -> Float[np.ndarray, "e 2"]:
        """Outward unit normal a of each edge: inside where a p <= b, b the `offsets`."""
        v = self.vertices
        if len(v) < 2:
            return _owned(np.zeros((0, 2)))
        edges = np.roll(v, -1, axis=0) - v
        if len(v) == 2:
            return _owned(-edges / np.linalg.norm(edges, axis=1, keepdims=True))
        normals = np.column_stack([edges[:, 1], -edges[:, 0]])
        return _owned(normals / np.linalg.norm(normals, axis=1, keepdims=True))

    @cached_property
    def offsets(self) -> Float[np.ndarray, " e"]:
        """Distance b of each edge's line from the origin along its normal [m]."""
        return _owned(np.sum(self.normals * self.vertices[: len(self.normals)], axis=1))

    @cached_property
    def area(self) -> float:
        """Area [m^2]; zero for a segment, a point or nothing."""
        x, y = (self.vertices - self.vertices[:1]).T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

    @cached_property
    def sides(self) -> tuple[Float[np.ndarray, "s 2"], Float[np.ndarray, " s"]]:
        """Normals and offsets of a segment's two sides, which leave no room across it; else none.

        They are not edges: a point on the segment is as far from the nearest edge as from its ends.
        """
        if len(self) != 2:
            return _owned(np.zeros((0, 2))), _owned(np.zeros(0))
        normals = self.normals @ np.array([[0.0, -1.0], [1.0, 0.0]])
        return _owned(normals), _owned(normals @ self.vertices[0])

    def distances(self, points: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n e"]:
        """Signed distance of points to the line of each edge [m], positive on the inner side."""
        return np.asarray(self.offsets - points @ self.normals.T)

    def margins(self, points: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n"]:
        """Signed distance of points to the line of the nearest edge [m]; NaN where a point is.

        Of a segment: of points on it to the nearer end, of others from its line, if that is more.
        """
        nearest = self.distances(points).min(axis=-1)
        if len(self) != 2:
            return np.asarray(nearest)
        off = -self._beside(points).min(axis=-1)
        return np.asarray(np.where(off > _ON_LINE, np.minimum(nearest, -off), nearest))

    def _beside(self, points: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Signed distance of points to each side of a segment's line [m], positive inside."""
        normals, offsets = self.sides
        return np.asarray(offsets - points @ normals.T)

    def margin(self, point: ArrayLike) -> EdgeMargin:
        """The margin of one point (2,) [m] to the nearest edge.

        Raises:
            InvalidInputError: the point is not finite, or the polygon has no edge.
        """
        if len(self) < 2:
            raise InvalidInputError(
                f"a polygon of {len(self)} vertices has no edge to be near to. Give two or more."
            )
        p = finite_array(point, "the point", (2,), "x, y [m]")
        distances = self.distances(p)
        edge = int(np.argmin(distances))
        if len(self) == 2 and (beside := self._beside(p)).min() < min(-_ON_LINE, distances[edge]):
            side = int(np.argmin(beside))
            return EdgeMargin(
                float(beside[side]),
                2 + side,
                f"{self.side(2 + side)} of its line",
                self.sides[0][side],
            )
        return EdgeMargin(float(distances[edge]), edge, self.side(edge), self.normals[edge])

    def boundary_distance(self, point: Float[np.ndarray, " 2"]) -> float:
        """Distance of a point to the boundary itself [m], infinite where there is none."""
        ends = np.roll(self.vertices, -1, axis=0)
        edges = ends - self.vertices
        lengths = np.maximum(np.sum(edges**2, axis=1), 1e-300)
        shares = np.clip(np.sum((point - self.vertices) * edges, axis=1) / lengths, 0.0, 1.0)
        nearest = self.vertices + shares[:, None] * edges
        return float(np.min(np.linalg.norm(nearest - point, axis=1), initial=np.inf))

    def side(self, edge: int) -> str:
        """The side of the polygon's axes that an edge faces, such as ``"+y (left)"``."""
        normal = np.vstack([self.normals, self.sides[0]])[edge]
        quarter = int(np.round(np.arctan2(normal[1], normal[0]) / (np.pi / 2))) % 4
        return ("+x (front)", "+y (left)", "-x (back)", "-y (right)")[quarter]

    @cached_property
    def edge_names(self) -> tuple[str, ...]:
        """A name of each edge: its side, with its index where several edges face that side."""
        sides = [self.side(i) for i in range(len(self.normals))]
        alike = Counter(sides)
        return tuple(
            f"the {side} edge" if alike[side] == 1 else f"edge {i}, {side}"
            for i, side in enumerate(sides)
        )

    def clip(self, normal: Float[np.ndarray, " 2"], offset: float) -> Polygon:
        """The part where normal p <= offset."""
        beyond = (self.vertices @ normal - offset).tolist()
        if max(beyond, default=0.0) <= _ROUNDING:
            return self
        corners, kept = self.vertices.tolist(), []
        for j, (x, y) in enumerate(corners):
            i = j - 1
            # A segment is crossed once, not there and back.
            if (i >= 0 or len(corners) > 2) and (beyond[i] > _ROUNDING) != (beyond[j] > _ROUNDING):
                share = min(max(beyond[i] / (beyond[i] - beyond[j]), 0.0), 1.0)
                u, v = corners[i]
                kept.append([u + share * (x - u), v + share * (y - v)])
            if beyond[j] <= _ROUNDING:
                kept.append([x, y])
        # A vertex on the line may be met twice, the second time within rounding.
        once = [
            [x, y]
            for i, (x, y) in enumerate(kept)
            if max(abs(x - kept[i - 1][0]), abs(y - kept[i - 1][1])) > _ROUNDING or len(kept) == 1
        ]
        return Polygon(np.array(once or kept[:1]).reshape(-1, 2))

    def within(
        self, normals: Float[np.ndarray, "r 2"], offsets: Float[np.ndarray, " r"]
    ) -> Polygon:
        """The part where normals p <= offsets, the normals of any length but zero."""
        left = self
        for n, offset in zip(normals, offsets, strict=True):
            length = np.linalg.norm(n)
            left = left.clip(n / length, offset / length)
        return left

    def section(self, axis: str, at: float) -> tuple[float, float] | None:
        """Where the line along an axis, the other coordinate being `at` [m], enters and leaves.

        These two are the edges that a point on that line can reach. None where the line misses the
        polygon. A segment is looked at along its own line.

        Args:
            axis: ``"x"`` or ``"y"``.
            at: the other coordinate [m].
        """
        along = _AXES[axis]
        across = 1 - along
        v = self.vertices
        low, high = v[:, across].min(initial=np.inf), v[:, across].max(initial=-np.inf)
        if 0 <= high - low < 1e-9:  # a segment along the axis
            return float(v[:, along].min()), float(v[:, along].max())
        if not low <= at <= high:
            return None
        crossings = []
        for a, b in zip(v, np.roll(v, -1, axis=0), strict=True):
            least, most = sorted((a[across], b[across]))
            if least <= at <= most and most > least:
                part = (at - a[across]) / (b[across] - a[across])
                crossings.append(a[along] + part * (b[along] - a[along]))
        return float(min(crossings)), float(max(crossings))

    def room(self, x: float | None = None) -> float:
        """The largest distance to the nearest edge that a point can have [m].

        Args:
            x: only points of this x [m]; negative room where the polygon has none.
        """
        normals, offsets = self.normals, self.offsets
        if x is not None:
            normals, offsets = normals[:, 1:], offsets - normals[:, 0] * x
        cost = -np.eye(normals.shape[1] + 1)[-1]
        found = linear_minimum(cost, np.column_stack([normals, np.ones(len(normals))]), offsets)
        assert found is not None  # far enough outside there always is a point
        return float(found[-1])


def padded(polygons: Sequence[Polygon | None]) -> Float[np.ndarray, "n k 2"]:
    """Vertices of several polygons as one array for a table.

    A polygon's last vertex is repeated to the length of the longest; NaN where there is none.
    """
    known = [np.full((1, 2), np.nan) if p is None else p.vertices for p in polygons]
    longest = max(map(len, known))
    return np.array([np.vstack([p, np.repeat(p[-1:], longest - len(p), axis=0)]) for p in known])


def unpadded(vertices: Float[np.ndarray, "k 2"]) -> Polygon | None:
    """One polygon of what `padded` made, or None where it is NaN."""
    if np.any(np.isnan(vertices)):
        return None
    return Polygon(vertices[np.r_[True, np.any(np.diff(vertices, axis=0) != 0, axis=1)]])


def segment_distance(point: Pair, start: Pair, end: Pair) -> float:
    """Distance of a point to a segment [m], in plain numbers."""
    (x, y), (ax, ay), (bx, by) = point, start, end
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    share = ((x - ax) * dx + (y - ay) * dy) / square if square > 0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.hypot(ax + share * dx - x, ay + share * dy - y)


def _half(sequence: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """One side of a hull, without its last point."""
    chain: list[tuple[float, ...]] = []
    for p in sequence:
        while len(chain) >= 2 and _turn(chain[-2], chain[-1], p) <= 1e-15:
            chain.pop()
        chain.append(p)
    return chain[:-1]


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _owned(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
