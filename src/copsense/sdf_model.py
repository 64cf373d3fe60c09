"""sdf_model: the ``pin.Model`` of an SDF, with a floating base, and the loops that it closes.

In the model's frame link i stands at L_i while every joint is at zero, and a joint at L_c P with P
its pose in its child c. Pinocchio's joint stands there too, its axes those of the joint's frame:

    child in parent = (L_p^-1 L_c P) J(q) P^-1

A link that has two parents hangs on the first joint of the file; the others close loops.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.drives import Drives, Loop, LoopKind, Spring
from copsense.joint_models import along
from copsense.sdf import (
    AXES,
    axes_in_model,
    end_of,
    roots_and_joints,
    says,
    sdf_model_element,
    sdf_numbers,
)

_KINDS: dict[str, LoopKind] = {
    "revolute": "pin",
    "continuous": "pin",
    "ball": "ball",
    "fixed": "weld",
}
_NONE = "0 0 0 0 0 0"
_UNBOUNDED = 1e15  # rad, m, Nm: the format writes 1e16 for no bound


@dataclass(frozen=True, eq=False)
class SdfReading:
    """What an SDF says about a robot.

    Attributes:
        model: the Pinocchio model, with a floating base and two frames for each pin or weld.
        drives: its springs and loops; of motors a file says nothing.
        notes: what was assumed, a sentence each.
    """

    model: pin.Model
    drives: Drives
    notes: tuple[str, ...]


def read_sdf(text: str) -> SdfReading:
    """Read the model of an SDF.

    Args:
        text: a file that `sdf_faults` finds no fault with.
    """
    root = ET.fromstring(text)
    reader = _Reader(sdf_model_element(root), axes_in_model(root))
    reader.build()
    notes: tuple[str, ...] = ()
    if reader.springs or reader.loops:
        notes = (
            "An SDF does not say which joints have motors: all are taken to have one. "
            "passive=[...] (--passive JOINT) takes them away.",
        )
    drives = Drives(springs=reader.springs, loops=tuple(reader.loops))
    return SdfReading(reader.model, drives, notes)


@dataclass(eq=False)
class _Reader:
    """Builds the model link by link, each limb to its tip."""

    element: ET.Element
    in_model: bool
    model: pin.Model = field(default_factory=pin.Model)
    springs: dict[str, Spring] = field(default_factory=dict)
    loops: list[Loop] = field(default_factory=list)
    at: dict[str, tuple[int, pin.SE3, int]] = field(default_factory=dict)
    bounds: dict[int, ET.Element] = field(default_factory=dict)

    def build(self) -> None:
        """The whole model, limb by limb; then its loops and the numbers of its joints."""
        self.model.name = self.element.get("name", "") or "robot"
        (root,), _, tree, loops = roots_and_joints(self.element)
        taken = {joint.get("name") for joint in self.element.findall("joint")}
        name = next(n for n in ("root_joint", "base_free", f"{root}_free") if n not in taken)
        base = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
        self._add_link(root, base, pin.SE3.Identity(), self.model.addJointFrame(base, 0))
        self._add_limbs(root, tree)
        for joint in loops:
            self._add_loop(joint)
        self._set_numbers()

    def _add_limbs(self, link: str, tree: list[ET.Element]) -> None:
        for joint in tree:
            if end_of(joint, "parent") == link:
                self._add_joint(joint)
                self._add_limbs(end_of(joint, "child"), tree)

    def _link(self, name: str) -> ET.Element:
        return next(e for e in self.element.findall("link") if e.get("name") == name)

    def _in_model(self, name: str) -> pin.SE3:
        """A link in the model's frame, every joint at zero."""
        return _pose(self._link(name))

    def _add_link(self, name: str, joint: int, place: pin.SE3, frame: int) -> None:
        """Hang a link's mass and frame on a joint, in which it stands at `place`."""
        inertial = self._link(name).find("inertial")
        (mass,) = sdf_numbers(inertial, "mass", "1")
        parts = None if inertial is None else inertial.find("inertia")
        xx, yy, zz = (sdf_numbers(parts, tag, "1")[0] for tag in ("ixx", "iyy", "izz"))
        xy, xz, yz = (sdf_numbers(parts, tag, "0")[0] for tag in ("ixy", "ixz", "iyz"))
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        centred = pin.Inertia(mass, np.zeros(3), about)
        self.model.appendBodyToJoint(joint, centred, place * _pose(inertial))
        body = self.model.addFrame(pin.Frame(name, joint, frame, place, pin.FrameType.BODY))
        self.at[name] = joint, place, int(body)

    def _add_joint(self, element: ET.Element) -> None:
        """Add a joint of the tree and the link that it carries."""
        name, kind = element.get("name", ""), element.get("type", "")
        child = end_of(element, "child")
        joint, outer, frame = self.at[end_of(element, "parent")]
        pose = _pose(element)
        here = self._in_model(end_of(element, "parent")).actInv(self._in_model(child) * pose)
        place = outer * here
        tags = ("axis", "axis2")[: AXES.get(kind, 0)]
        moved: list[tuple[str, Any, ET.Element]] = []
        for number, tag in enumerate(tags):
            axis = element.find(tag)
            assert axis is not None
            label = name if len(tags) == 1 else f"{name}[{number}]"
            slides = "P" if kind == "prismatic" else "R"
            moved.append((label, along(self._axis(axis, child, pose), slides), axis))  # type: ignore[arg-type]
        if kind == "ball":
            moved = [(name, pin.JointModelSpherical(), element)]
        for label, model_joint, axis in moved:
            joint = int(self.model.addJoint(joint, model_joint, place, label))
            frame = int(self.model.addJointFrame(joint, frame))
            place = pin.SE3.Identity()
            self.bounds[joint] = axis
            stiffness, rest = (
                sdf_numbers(axis.find("dynamics"), f"spring_{tag}", "0")[0]
                for tag in ("stiffness", "reference")
            )
            if stiffness:
                self.springs[label] = Spring(stiffness, rest)
        if not moved:
            fixed = pin.Frame(name, joint, frame, place, pin.FrameType.FIXED_JOINT)
            frame = int(self.model.addFrame(fixed))
        self._add_link(child, joint, place * pose.inverse(), frame)

    def _axis(self, axis: ET.Element, child: str, pose: pin.SE3) -> Float[np.ndarray, " 3"]:
        """Direction of an axis in the joint's frame."""
        given, direction = axis.find("xyz"), np.array(sdf_numbers(axis, "xyz", "0 0 1"))
        named = "" if given is None else given.get("expressed_in", "")
        if self.in_model or named == "__model__" or says(axis, "use_parent_model_frame"):
            return np.asarray((self._in_model(child) * pose).rotation.T @ direction)
        return direction

    def _add_loop(self, element: ET.Element) -> None:
        """Add a joint that closes a loop; where its axes count, with a frame at either end."""
        name, kind = element.get("name", ""), _KINDS[element.get("type", "")]
        child, pose = end_of(element, "child"), _pose(element)
        ends = end_of(element, "parent"), end_of(element, "child")
        there = [self._in_model(link).actInv(self._in_model(child) * pose) for link in ends]
        if kind == "ball":
            (xa, ya, za), (xb, yb, zb) = (place.translation for place in there)
            found = Loop(ends[0], ends[1], kind, (xa, ya, za), (xb, yb, zb), name=name)
            self.loops.append(found)
            return
        names = []
        for link, place in zip(ends, there, strict=True):
            joint, outer, frame = self.at[link]
            names.append(self._free_name(f"{name}_{link}"))
            kind_of_frame = pin.FrameType.OP_FRAME
            added = pin.Frame(names[-1], joint, frame, outer * place, kind_of_frame)
            self.model.addFrame(added)
        axis = element.find("axis")
        x, y, z = (0.0, 0.0, 1.0)
        if kind == "pin" and axis is not None:
            x, y, z = (float(c) for c in self._axis(axis, child, pose))
        self.loops.append(Loop(names[0], names[1], kind, axis=(x, y, z), name=name))

    def _free_name(self, name: str) -> str:
        while self.model.existFrame(name):
            name += "_end"
        return name

    def _set_numbers(self) -> None:
        """Limits of position and effort, damping and friction of every joint."""
        model = self.model
        lower, upper = np.full(model.nq, -np.inf), np.full(model.nq, np.inf)
        effort, speed = np.full(model.nv, np.inf), np.full(model.nv, np.inf)
        damping, friction = np.zeros(model.nv), np.zeros(model.nv)
        lower[3:7], upper[3:7] = -1.01, 1.01
        for joint, axis in self.bounds.items():
            moved = model.joints[joint]
            if moved.nq == 4:
                lower[moved.idx_q : moved.idx_q + 4] = -1.01
                upper[moved.idx_q : moved.idx_q + 4] = 1.01
                continue
            limit, v = axis.find("limit"), moved.idx_v
            lower[moved.idx_q] = _bound(limit, "lower", -np.inf)
            upper[moved.idx_q] = _bound(limit, "upper", np.inf)
            # A negative bound of effort or speed means none.
            for tag, bounds in (("effort", effort), ("velocity", speed)):
                most = _bound(limit, tag, np.inf)
                bounds[v] = most if most >= 0 else np.inf
            for tag, values in (("damping", damping), ("friction", friction)):
                values[v] = sdf_numbers(axis.find("dynamics"), tag, "0")[0]
        model.lowerPositionLimit, model.upperPositionLimit = lower, upper
        model.lowerEffortLimit, model.upperEffortLimit = -effort, effort
        model.upperVelocityLimit, model.lowerVelocityLimit = speed, -speed
        model.damping = damping
        model.upperDryFrictionLimit, model.lowerDryFrictionLimit = friction, -friction


def _bound(limit: ET.Element | None, tag: str, none: float) -> float:
    """A bound, or `none` where it is not given or the format's way to say so."""
    text = None if limit is None else limit.findtext(tag)
    value = float(text) if text and text.strip() else none
    return value if abs(value) < _UNBOUNDED else none


def _pose(parent: ET.Element | None) -> pin.SE3:
    """The <pose> of an element: x y z, then roll, pitch, yaw about the fixed axes."""
    x, y, z, roll, pitch, yaw = sdf_numbers(parent, "pose", _NONE)
    return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.array([x, y, z]))
