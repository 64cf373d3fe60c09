"""Contact: where a robot touches its environment, and which wrench it can receive there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from types import NoneType
from typing import Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import check_type, finite_array, finite_number, read_only
from copsense.content import ShortRepr
from copsense.errors import InvalidInputError
from copsense.magnitudes import LONGEST_SOLE, check_angle, check_length, doubt_friction, in_radians
from copsense.polygon import Polygon
from copsense.rigid_body import Attachment
from copsense.robot import Robot

Kind = Literal["surface", "point", "planar"]

# Components of (fx, fy, fz, mx, my, mz) that each kind of contact carries. "planar" is the foot
# of a mechanism that lives in its contact frame's y-z plane, such as the four-bar linkage.
COMPONENTS: dict[str, tuple[int, ...]] = {
    "surface": (0, 1, 2, 3, 4, 5),
    "point": (0, 1, 2),
    "planar": (1, 2, 3),
}
# m: vertices of a sole that stand out by less are left out. Of two edges that are nearly one line,
# as the hull of a mesh has them, rounding would say which is met.
SOLE_DETAIL = 1e-6
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
        """Validate the plane; store the unit normal."""
        point = finite_array(self.point, "the plane's point", (3,), "x, y, z in the world [m]")
        normal = finite_array(self.normal, "the plane's normal", (3,), "x, y, z in the world")
        length = float(np.linalg.norm(normal))
        _require(
            0 < length < np.inf,
            f"the plane's normal {self.normal} is not a direction. Give one, such as (0, 0, 1)",
        )
        object.__setattr__(self, "point", tuple(float(c) for c in point))
        object.__setattr__(self, "normal", tuple(float(c) / length for c in normal))

    @classmethod
    def sloping(cls, roll: float = 0.0, pitch: float = 0.0, height: float = 0.0) -> Plane:
        """A floor that slopes: Ry(pitch) Rx(roll) of a level one, as roll and pitch of a base.

        Args:
            roll: about the world's x [rad]; a positive one falls away to the right (-y).
            pitch: about the world's y [rad]; a positive one falls away ahead (+x).
            height: over the world's origin [m].

        Raises:
            InvalidInputError: an angle of a right angle or more: a wall has a normal.
        """
        for what, angle in (("roll", roll), ("pitch", pitch)):
            steep = abs(finite_number(angle, f"the {what} of a slope [rad]")) >= np.pi / 2
            _require(
                not steep,
                f"the {what} of a slope is {np.degrees(angle):.4g} degrees. Give less than 90, or "
                "a wall by its normal, Plane(point, normal) (--plane). "
                f"{in_radians(angle).rstrip('.')}",
            )
        normal = pin.rpy.rpyToMatrix(float(roll), float(pitch), 0.0)[:, 2]
        x, y, z = (float(c) for c in normal)
        return cls((0.0, 0.0, finite_number(height, "the height of a floor [m]")), (x, y, z))

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """World axes of a point contact on it: z the normal, x as near to the world's x as can be.

        On a plane that faces along x, as near to the world's y.
        """
        z = np.array(self.normal)
        nearest = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        x = nearest - z * (z @ nearest)
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True, eq=False, repr=False)
class Contact(ShortRepr):
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
            Points in any order are taken; those inside their hull, or that stand out of it by less
            than a micrometre, are left out.
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
        check_type(label, str, "the name of a contact", "Give the name of its frame, a text.")
        check_type(self.frame, str, "the name of a frame", "Give one of the robot's model.")
        remedy = "Give Plane(point, normal), or None."
        check_type(self.plane, (Plane, NoneType), "the plane of a contact", remedy)
        _require(
            isinstance(self.kind, str) and self.kind in COMPONENTS,
            f"contact {label!r} is of kind {self.kind!r}. Valid kinds: {', '.join(COMPONENTS)}",
        )
        offset = finite_array(self.offset, f"the offset of contact {label!r}", (3,), "x, y, z [m]")
        for lever in offset.tolist():
            check_length(lever, f"the offset of contact {label!r}")
        object.__setattr__(self, "offset", tuple(float(c) for c in offset))
        rotation = finite_array(self.rotation, f"the rotation of contact {label!r}", (3, 3))
        _require(
            np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
            and np.linalg.det(rotation) > 0,
            f"contact {label!r}: the rotation is not a rotation matrix. Give orthonormal, right-"
            "handed columns",
        )
        object.__setattr__(self, "rotation", rotation)
        if self.polygon is not None:
            what = f"the polygon of contact {label!r}"
            outline = Polygon.hull(self.polygon, what, SOLE_DETAIL)
            _require(
                len(outline) >= 2,
                f"the polygon of contact {label!r} is a single point. Give two or more, or make "
                "the contact a point contact",
            )
            for size in np.ptp(outline.vertices, axis=0).tolist():
                check_length(size, f"the sole of contact {label!r}", LONGEST_SOLE)
            object.__setattr__(self, "polygon", outline.vertices)
        for what in ("friction", "torsional_friction"):
            value = getattr(self, what)
            if value is not None:
                told = f"contact {label!r}: {what}"
                number = finite_number(value, told)
                _require(number >= 0, f"{told} is {value}. Give a non-negative number, or None")
                object.__setattr__(self, what, number)
        if self.friction is not None:
            doubt_friction(self.friction, f"contact {label!r}: friction")
        if self.torsional_friction is not None:
            what = f"contact {label!r}: torsional_friction"
            check_length(self.torsional_friction, what, LONGEST_SOLE)

    @property
    def components(self) -> tuple[int, ...]:
        """Which of (fx, fy, fz, mx, my, mz) this contact carries."""
        return COMPONENTS[self.kind]

    @property
    def normal_row(self) -> int:
        """Which of its components is the normal force fz."""
        return self.components.index(2)

    @cached_property
    def sole(self) -> Polygon | None:
        """The polygon in which its centre of pressure must lie, in the contact frame.

        None where no polygon is known, and for a point contact, whose centre of pressure is its
        origin whatever polygon it was given.
        """
        if self.polygon is None or self.kind == "point":
            return None
        return Polygon(self.polygon)

    @cached_property
    def edge_rows(self) -> Float[np.ndarray, "e 6"]:
        """Row of each edge of the sole: times the contact's wrench, f_z (b - a . p) [N m].

        The sole of a surface contact that is a line has two rows more, for its sides.
        """
        if self.sole is None:
            return read_only(np.zeros((0, 6)))
        edges = [*zip(self.sole.normals, self.sole.offsets, strict=True)]
        if self.kind == "surface":
            edges += zip(*self.sole.sides, strict=True)
        return read_only(np.array([edge_row(a, b) for a, b in edges]))

    @property
    def normal(self) -> Float[np.ndarray, " 3"]:
        """The outward normal of its plane, the contact frame's z, in the model's frame (3,)."""
        return self.rotation[:, 2]

    def at_height(self, height: float) -> Contact:
        """The contact with its plane that high over the model's frame, along its normal [m].

        What the offset has along the plane stays.
        """
        offset, up = np.array(self.offset), self.normal
        x, y, z = (offset - (up @ offset) * up + height * up).tolist()
        return replace(self, offset=(x, y, z))

    def turned(self, roll: float, pitch: float, yaw: float) -> Contact:
        """The contact with its axes at Rz(yaw) Ry(pitch) Rx(roll) in the model's frame [rad].

        Its offset stays.
        """
        angles = [float(a) for a in finite_array((roll, pitch, yaw), "roll, pitch, yaw", (3,))]
        for what, angle in zip(("roll", "pitch", "yaw"), angles, strict=True):
            check_angle(angle, f"the {what} of contact {self.name!r}")
        return replace(self, rotation=pin.rpy.rpyToMatrix(*angles))

    def on(self, robot: Robot) -> Attachment:
        """Where on a robot the contact is.

        Raises:
            UnknownNameError: the contact's frame is not in the model.
        """
        frame = robot.frame(self.frame)
        offset = pin.SE3(self.rotation, np.array(self.offset))
        return Attachment(int(frame.parentJoint), frame.placement * offset)


def edge_row(normal: Float[np.ndarray, " 2"], offset: float) -> Float[np.ndarray, " 6"]:
    """The row that gives f_z (b - a . p) of a wrench, with f_z p = (-m_y, m_x).

    Args:
        normal: outward normal a of an edge of the sole.
        offset: distance b of its line from the contact frame's origin along the normal [m].
    """
    return np.array([0.0, 0.0, offset, -normal[1], normal[0], 0.0])


def rectangle(
    x: tuple[float, float], y: tuple[float, float] = (0.0, 0.0)
) -> Float[np.ndarray, "4 2"]:
    """Vertices of a rectangular sole, counter-clockwise, in the contact frame [m]."""
    what, need = "of the rectangle", "its two ends [m]"
    (x0, x1), (y0, y1) = (
        finite_array(x, f"x {what}", (2,), need),
        finite_array(y, f"y {what}", (2,), need),
    )
    check_length(float(x1 - x0), f"the length {what}", LONGEST_SOLE)
    check_length(float(y1 - y0), f"the width {what}", LONGEST_SOLE)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _require(condition: object, message: str) -> None:
    if not condition:
        raise InvalidInputError(message + ".")
