"""Contact: where a robot touches its environment, and which wrench it can receive there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.errors import InvalidInputError

Kind = Literal["surface", "point", "planar"]

# Components of (fx, fy, fz, mx, my, mz) that each kind of contact carries. "planar" is the foot
# of a mechanism that lives in its contact frame's y-z plane, such as the four-bar linkage.
COMPONENTS: dict[str, tuple[int, ...]] = {
    "surface": (0, 1, 2, 3, 4, 5),
    "point": (0, 1, 2),
    "planar": (1, 2, 3),
}
COMPONENT_NAMES = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class Plane:
    """A plane of the environment, in world axes.

    Attributes:
        point: any point of it [m].
        normal: its outward normal; scaled to unit length.
    """

    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Refuse a plane without direction; store the unit normal."""
        point = finite_array(self.point, "the plane's point", (3,), "x, y, z in the world [m]")
        normal = finite_array(self.normal, "the plane's normal", (3,), "x, y, z in the world")
        length = float(np.linalg.norm(normal))
        _require(
            0 < length < np.inf,
            f"the plane's normal {self.normal} is no direction. Give one, such as (0, 0, 1)",
        )
        object.__setattr__(self, "point", tuple(float(c) for c in point))
        object.__setattr__(self, "normal", tuple(float(c) / length for c in normal))


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact between a link of the robot and a plane of the environment.

    The **contact frame** is the model's frame moved by `placement`: origin on the contact plane,
    z along the plane's outward normal. A point contact has no orientation of its own: its axes are
    those of its plane (z the normal, x as near to the world's x as can be).

    Attributes:
        frame: name of the frame in the robot's model.
        kind: ``"surface"`` (force and moment), ``"point"`` (force) or ``"planar"`` (fy, fz, mx).
        name: how the contact is called in results; default the frame's name.
        offset: translation from the model's frame to the contact frame, in the model's frame [m].
        rotation: orientation of the contact frame in the model's frame (3 x 3).
        polygon: vertices (k x 2) of the sole in the contact frame, counter-clockwise [m], or None.
        plane: where the contact should lie, checked by the stance; None to take it as it is.
        friction: Coulomb coefficient, or None.
        torsional_friction: torsional coefficient [m], or None.
    """

    frame: str
    kind: Kind = "surface"
    name: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    polygon: Float[np.ndarray, "k 2"] | None = None
    plane: Plane | None = None
    friction: float | None = None
    torsional_friction: float | None = None

    def __post_init__(self) -> None:
        """Check every field and own the arrays."""
        label = self.name or self.frame
        _require(label, "a contact needs its frame. Give the name of a frame in the robot's model")
        object.__setattr__(self, "name", label)
        _require(
            self.kind in COMPONENTS,
            f"contact {label!r} is of kind {self.kind!r}. Valid kinds: {', '.join(COMPONENTS)}",
        )
        offset = finite_array(self.offset, f"the offset of contact {label!r}", (3,), "x, y, z [m]")
        object.__setattr__(self, "offset", tuple(float(c) for c in offset))
        rotation = finite_array(self.rotation, f"the rotation of contact {label!r}", (3, 3))
        _require(
            np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
            and np.linalg.det(rotation) > 0,
            f"contact {label!r}: the rotation is no rotation matrix. Give orthonormal, right-"
            "handed columns",
        )
        object.__setattr__(self, "rotation", rotation)
        if self.polygon is not None:
            object.__setattr__(self, "polygon", convex_polygon(self.polygon, label))
        for what in ("friction", "torsional_friction"):
            value = getattr(self, what)
            _require(
                value is None or (np.isfinite(value) and value >= 0),
                f"contact {label!r}: {what} is {value}. Give a non-negative number, or None",
            )

    @property
    def components(self) -> tuple[int, ...]:
        """Which of (fx, fy, fz, mx, my, mz) this contact carries."""
        return COMPONENTS[self.kind]


def rectangle(
    x: tuple[float, float], y: tuple[float, float] = (0.0, 0.0)
) -> Float[np.ndarray, "4 2"]:
    """Vertices of a rectangular sole, counter-clockwise, in the contact frame [m]."""
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def convex_polygon(points: ArrayLike, label: str = "sole") -> Float[np.ndarray, "k 2"]:
    """The convex hull of points of a sole, counter-clockwise (two points make a segment).

    Raises:
        InvalidInputError: not a finite (k, 2) array of at least two distinct points.
    """
    array = finite_array(points, f"the polygon of contact {label!r}", (None, 2), "x, y [m]")
    # Andrew's monotone chain: no dependency on a hull that refuses flat input.
    # Rounded to the picometre: noise in x would put the points of an upright edge out of order.
    ordered = [tuple(p) for p in np.unique(np.round(array, 12) + 0.0, axis=0)]
    _require(
        len(ordered) >= 2,
        f"the polygon of contact {label!r} is a single point. Give two or more, or make the "
        "contact a point contact",
    )

    def half(sequence: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
        chain: list[tuple[float, ...]] = []
        for p in sequence:
            while len(chain) >= 2 and _turn(chain[-2], chain[-1], p) <= 1e-15:
                chain.pop()
            chain.append(p)
        return chain[:-1]

    hull = np.array(half(ordered) + half(ordered[::-1]))
    hull.flags.writeable = False
    return hull


def half_planes(
    polygon: Float[np.ndarray, "k 2"],
) -> tuple[Float[np.ndarray, "e 2"], Float[np.ndarray, " e"]]:
    """Outward unit normals a and offsets b of a sole's edges: inside where a p <= b.

    A sole of two points (a line) has its two ends as edges.
    """
    if len(polygon) == 2:
        along = (polygon[1] - polygon[0]) / np.linalg.norm(polygon[1] - polygon[0])
        normals = np.array([-along, along])
        return normals, np.array([normals[0] @ polygon[0], normals[1] @ polygon[1]])
    edges = np.roll(polygon, -1, axis=0) - polygon
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.sum(normals * polygon, axis=1)


def edge_side(normal: Float[np.ndarray, " 2"]) -> str:
    """The side of the contact frame that an edge faces, by its outward normal."""
    quarter = int(np.round(np.arctan2(normal[1], normal[0]) / (np.pi / 2))) % 4
    return ("+x (front)", "+y (left)", "-x (back)", "-y (right)")[quarter]


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _require(condition: object, message: str) -> None:
    if not condition:
        raise InvalidInputError(message + ".")
