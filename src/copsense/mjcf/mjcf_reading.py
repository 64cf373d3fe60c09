"""MjcfReading: what is read from an MJCF, by MuJoCo or without it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.drives import Drives


@dataclass(frozen=True, eq=False)
class MjcfShape:
    """A shape of a robot's link.

    Attributes:
        name: its own, or made of its body's.
        kind: ``"sphere"``, ``"capsule"``, ``"ellipsoid"``, ``"cylinder"``, ``"box"`` or ``"mesh"``.
        joint: index of the joint that moves it, in the model read with it.
        placement: its axes in that joint's.
        size: half sizes as MJCF has them, three numbers [m]; unused by meshes.
        vertices: of a mesh (k, 3), in the shape's axes [m]; empty otherwise.
        faces: corners of a mesh's triangles (f, 3), where it is to be drawn; empty otherwise.
    """

    name: str
    kind: str
    joint: int
    placement: pin.SE3
    size: Float[np.ndarray, " 3"]
    vertices: Float[np.ndarray, "k 3"] = field(repr=False)
    faces: Int[np.ndarray, "f 3"] = field(
        repr=False, default_factory=lambda: np.zeros((0, 3), dtype=np.int64)
    )


@dataclass(frozen=True, eq=False)
class MjcfReading:
    """A robot read from an MJCF.

    Attributes:
        model: the Pinocchio model, with a floating (or planar) base as its first joint.
        shapes: its collision shapes; None where Pinocchio reads them from the file, if asked.
        notes: what the file says and is not used, a sentence each.
        drives: its motors, springs, couplings and loops.
        base: orientation (3, 3) of the root body in the file's world; None where it is not known.
    """

    model: pin.Model
    shapes: tuple[MjcfShape, ...] | None
    notes: tuple[str, ...] = ()
    drives: Drives = field(default_factory=Drives)
    base: Float[np.ndarray, "3 3"] | None = None
