"""URDF drives: couplings, loops and joints without motors, as a URDF describes them.

<mimic>          the joint follows another
<loop_joint>     two links are joined (Drake's, and Isaac's, element)
<transmission>   the joints of a limb that has some, and are in none, have no motor
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from copsense.drives import Coupling, Drives, Loop, LoopKind
from copsense.listing import first_few
from copsense.urdf import loop_ends
from copsense.xml_numbers import read_numbers

_KINDS: dict[str, LoopKind] = {
    "": "pin",
    "continuous": "pin",
    "revolute": "pin",
    "spherical": "ball",
    "ball": "ball",
    "fixed": "weld",
}


@dataclass(eq=False)
class UrdfDrives:
    """What a URDF says about a robot's drives.

    Attributes:
        model: the Pinocchio model, with the frames of loops, without joints that cannot move.
        drives: the robot's drives.
        notes: what was assumed or is not used, a sentence each.
    """

    model: pin.Model
    drives: Drives
    notes: tuple[str, ...]


def read_urdf_drives(text: str, model: pin.Model) -> UrdfDrives:
    """The drives of a robot read from a URDF.

    Args:
        text: a URDF without faults.
        model: read from it, with a base.
    """
    reader = _Reader(ET.fromstring(text), model)
    couplings, loops = reader.couplings(), reader.loops()
    motors = reader.motors(couplings)
    reader.note_efforts(couplings, motors)
    drives = Drives(motors=motors, couplings=couplings, loops=loops)
    return UrdfDrives(reader.model, drives, tuple(reader.notes))


@dataclass(eq=False)
class _Reader:
    """Reads a URDF beside the model that was built from it, and notes what it assumes."""

    root: ET.Element
    model: pin.Model
    notes: list[str] = field(default_factory=list)

    @property
    def moving(self) -> tuple[str, ...]:
        """The joints of the model behind its base."""
        return tuple(self.model.names)[2:]

    def _single(self, joint: str) -> bool:
        return joint in self.moving and self.model.joints[self.model.getJointId(joint)].nv == 1

    def couplings(self) -> tuple[Coupling, ...]:
        """Joints that mimic others; those that mimic what cannot move are locked."""
        mimics: list[Coupling] = []
        several = []
        for joint in self.root.findall("joint"):
            mimic, name = joint.find("mimic"), joint.get("name", "")
            if mimic is None:
                continue
            found = Coupling(
                name,
                mimic.get("joint", ""),
                _numbers(mimic, "multiplier", "1")[0],
                _numbers(mimic, "offset", "0")[0],
            )
            if name not in self.moving:
                continue  # a fixed joint, which stays where it is whatever it mimics
            if not self._single(name):
                several.append(name)
            else:
                mimics.append(found)
        fixed = {j.get("name", "") for j in self.root.findall("joint") if j.get("type") == "fixed"}
        held = dict.fromkeys(fixed, 0.0)
        waiting, before = mimics, -1
        while len(waiting) != before:  # what mimics a locked joint is locked too
            before = len(waiting)
            held |= {c.joint: c.ratio * held[c.of] + c.offset for c in waiting if c.of in held}
            waiting = [c for c in waiting if c.joint not in held]
        kept = [c for c in waiting if self._single(c.of)]
        lost = [c for c in waiting if c not in kept]
        locked = {c.joint: held[c.joint] for c in mimics if c.joint in held}
        self._lock(locked)
        if locked:
            at = first_few(f"{joint} at {value:g}" for joint, value in locked.items())
            self.notes.append(f"Joints that mimic a fixed joint do not move: {at} (rad or m).")
        for c in lost:
            self.notes.append(
                f"Joint {c.joint!r} mimics {c.of!r}, which is not a joint with one position: the "
                "<mimic> is not used."
            )
        if several:
            self.notes.append(
                f"The <mimic> of joints with several positions ({first_few(several)}) is not used."
            )
        return tuple(kept)

    def _lock(self, positions: dict[str, float]) -> None:
        """Take joints out of the model, each where it stays [rad, or m]."""
        if not positions:
            return
        displacement, ids = np.zeros(self.model.nv), []
        for joint, position in positions.items():
            ids.append(int(self.model.getJointId(joint)))
            displacement[self.model.joints[ids[-1]].idx_v] = position
        at = pin.integrate(self.model, pin.neutral(self.model), displacement)
        self.model = pin.buildReducedModel(self.model, ids, at)

    def loops(self) -> tuple[Loop, ...]:
        """Loop joints; other elements that join links are noted."""
        found, unused = [], []
        for element in self.root:
            kind = _local(element)
            if kind.endswith("_constraint") or "bushing" in kind:
                unused.append(f"<{kind}>")
            if kind != "loop_joint":
                continue
            name, given = element.get("name", "loop_joint"), element.get("type", "")
            ends = loop_ends(element)
            gone = [end.get("link", "") for end in ends if self._link(end) is None]
            if given not in _KINDS:
                self.notes.append(
                    f"Loop joint {name!r} is not used: it is of type {given!r}, not "
                    f"{', '.join(filter(None, _KINDS))}."
                )
            elif gone:
                self.notes.append(
                    f"Loop joint {name!r} is not used: link {gone[0]!r} was taken out with the "
                    "base that is written into the file."
                )
            else:
                found.append(self._loop(element, name, _KINDS[given], ends))
        if unused:
            self.notes.append(f"{first_few(dict.fromkeys(unused))} in the file is not used.")
        return tuple(found)

    def _loop(self, element: ET.Element, name: str, kind: LoopKind, ends: list[ET.Element]) -> Loop:
        (frame_a, offset_a), (frame_b, offset_b) = (
            self._end(end, f"{name}_{k}") for k, end in enumerate(ends, 1)
        )
        axis = element.find("axis")
        x, y, z = (1.0, 0.0, 0.0) if axis is None else _numbers(axis, "xyz", "1 0 0")
        return Loop(frame_a, frame_b, kind, offset_a, offset_b, (x, y, z), name)

    def _link(self, end: ET.Element) -> int | None:
        """Index of a link's frame, or None where it was taken out with the base."""
        name = end.get("link", "")
        if not self.model.existFrame(name, pin.FrameType.BODY):
            return None
        return int(self.model.getFrameId(name, pin.FrameType.BODY))

    def _end(self, end: ET.Element, name: str) -> tuple[str, tuple[float, float, float]]:
        """Frame and point of a loop's end; where it is turned, a frame of its own."""
        link = self._link(end)
        assert link is not None
        (x, y, z), rpy = _numbers(end, "xyz", "0 0 0"), _numbers(end, "rpy", "0 0 0")
        frame = self.model.frames[link]
        if not any(rpy):
            return str(frame.name), (x, y, z)
        while self.model.existFrame(name):
            name += "_end"
        place = frame.placement * pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array([x, y, z]))
        added = pin.Frame(name, frame.parentJoint, link, place, pin.FrameType.OP_FRAME)
        self.model.addFrame(added)
        return name, (0.0, 0.0, 0.0)

    def motors(self, couplings: tuple[Coupling, ...]) -> tuple[str, ...] | None:
        """Names of the motors, or None where every joint that leads has one.

        A <transmission> says which joints a controller drives. Vendors of arms and of grippers put
        theirs into files of robots whose other joints have none: limbs whose first joint is in no
        transmission are not described by them, and keep their motors.
        """
        driven: set[str] = set()
        for transmission in self.root.findall("transmission"):
            named = [e.get("name", "") for e in transmission.iter() if _is_joint(e)]
            joints = [joint for joint in dict.fromkeys(named) if joint in self.moving]
            actuators = sum("actuator" in _local(e).lower() for e in transmission)
            if 0 < actuators < len(joints):
                self.notes.append(
                    f"Transmission {transmission.get('name', '')!r} drives {', '.join(joints)} by "
                    "fewer actuators than joints; each is taken to have a motor of its own."
                )
            driven.update(joints)
        if not driven:
            return None
        followers = {c.joint: c.of for c in couplings}
        for joint in tuple(driven):
            while joint in followers:  # who drives a follower drives whom it follows
                joint = followers[joint]
            driven.add(joint)
        idle: list[str] = []
        untold: list[str] = []
        for limb in self._limbs():
            left = [j for j in limb if j not in driven and j not in followers]
            (idle if limb[0] in driven else untold).extend(left)
        if untold:
            self.notes.append(
                f"Joints {first_few(untold)} have no <transmission>, nor has the first of their "
                "limb, while others have; they are taken to have motors. passive=[...] (--passive "
                "JOINT) takes them away."
            )
        if not idle:
            return None
        self.notes.append(
            f"Joints {first_few(idle)} have no <transmission>, while others of their limbs do: "
            "they are taken to have no motor. drives=Drives(...) (--motor JOINT) gives them one."
        )
        motors = [j for j in self.moving if j not in idle and j not in followers]
        return tuple(label for joint in motors for label in self._labels(joint))

    def _limbs(self) -> Iterator[list[str]]:
        """The joints of each limb that hangs on the base."""
        for i, parent in enumerate(self.model.parents):
            if i > 1 and parent == 1:
                yield [str(self.model.names[k]) for k in self.model.subtrees[i]]

    def _labels(self, joint: str) -> list[str]:
        count = self.model.joints[self.model.getJointId(joint)].nv
        return [joint] if count == 1 else [f"{joint}[{i}]" for i in range(count)]

    def note_efforts(self, couplings: tuple[Coupling, ...], motors: tuple[str, ...] | None) -> None:
        """Name the joints whose motor may exert nothing, according to the file."""
        followers = {c.joint for c in couplings}
        zero = []
        for joint in self.root.findall("joint"):
            name, limit = joint.get("name", ""), joint.find("limit")
            if limit is None or name not in self.moving or name in followers:
                continue
            driven = motors is None or name in motors
            if driven and _numbers(limit, "effort", "1")[0] == 0.0:
                zero.append(name)
        if zero:
            self.notes.append(
                f'Joints {first_few(zero)} have effort="0", which is taken as no limit known. If '
                "they have no motor, say so with passive=[...] (--passive JOINT)."
            )


def _local(element: ET.Element) -> str:
    """The element's name without its namespace; empty for a comment."""
    return str(element.tag).rpartition("}")[2] if isinstance(element.tag, str) else ""


def _is_joint(element: ET.Element) -> bool:
    """Whether an element inside a transmission names a joint, however it is called."""
    return _local(element).lower().endswith("joint")


def _numbers(element: ET.Element, attribute: str, default: str) -> tuple[float, ...]:
    return tuple(read_numbers(element.get(attribute, default)) or read_numbers(default) or ())
