"""equalities: loops and couplings of a compiled MJCF.

connect, weld    a loop
joint            a coupling, q_1 - ref_1 = c_0 + c_1 (q_2 - ref_2); of one joint c_1 = 0, a pin
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from copsense.drives import Coupling, Loop
from copsense.mjcf.scene import body_label
from copsense.mjcf.tendons import tendon_bodies
from copsense.mjcf.tree_model import Tree, pose

_CONNECT, _WELD = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
_JOINT, _TENDON = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)
# What couplings are between, which MuJoCo does not repeat in `eq_objtype`.
_BETWEEN = {_JOINT: int(mujoco.mjtObj.mjOBJ_JOINT), _TENDON: int(mujoco.mjtObj.mjOBJ_TENDON)}
_ONE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
_SAME = 1e-12


@dataclass(eq=False)
class Equalities:
    """The equalities between links or joints of a robot.

    Attributes:
        mj: ``mujoco.MjModel``.
        tree: the robot in it; frames that loops need are added to its model.
        notes: those that are not used, and why.
    """

    mj: Any
    tree: Tree
    notes: list[str] = field(default_factory=list)

    def read(self) -> tuple[tuple[Loop, ...], tuple[Coupling, ...]]:
        """Active equalities between links or joints of the robot; others are noted."""
        mj, loops, couplings = self.mj, [], {}
        if mj.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_EQUALITY):
            return (), ()
        for e in range(mj.neq):
            kind = int(mj.eq_type[e])
            of = _BETWEEN.get(kind, int(mj.eq_objtype[e]))
            ends = [self._end(of, int(number)) for number in (mj.eq_obj1id[e], mj.eq_obj2id[e])]
            own = self.tree.bodies.keys()
            if not mj.eq_active0[e] or not any(bodies & own for _, bodies in ends):
                continue
            pins = kind == _JOINT and int(mj.eq_obj2id[e]) < 0
            inside = pins or all(bodies and bodies <= own for _, bodies in ends)
            why = "it joins the robot to what is not part of it" if kind != _JOINT else ""
            if inside and kind in (_CONNECT, _WELD):
                loops.append(self._loop(e, kind, of))
                continue
            if inside and kind == _JOINT:
                coupling, why = self._coupling(e)
                if coupling is not None and coupling.joint in couplings:
                    why = f"joint {coupling.joint!r} follows another already"
                elif coupling is not None:
                    couplings[coupling.joint] = coupling
                    continue
            elif kind not in (_CONNECT, _WELD):
                why = "copsense knows connect, weld and joint"
            name = f" {mj.eq(e).name!r}" if mj.eq(e).name else ""
            what = mujoco.mjtEq(kind).name.removeprefix("mjEQ_").lower()
            between = " and ".join(label for label, _ in ends if label)
            self.notes.append(f"equality{name} ({what}) of {between} is not used: {why}.")
        return tuple(loops), tuple(couplings.values())

    def _end(self, kind: int, number: int) -> tuple[str, set[int]]:
        """What an end of an equality is called, and the bodies it concerns."""
        mj = self.mj
        if number < 0:
            return "", set()
        if kind == int(mujoco.mjtObj.mjOBJ_BODY):
            return (repr(body_label(mj, number)) if number else "the world"), {number}
        if kind == int(mujoco.mjtObj.mjOBJ_SITE):
            return f"site {mj.site(number).name!r}", {int(mj.site_bodyid[number])}
        if kind == int(mujoco.mjtObj.mjOBJ_JOINT):
            return f"joint {mj.joint(number).name!r}", {int(mj.jnt_bodyid[number])}
        if kind == int(mujoco.mjtObj.mjOBJ_TENDON):
            return f"tendon {mj.tendon(number).name!r}", tendon_bodies(mj, number)
        return f"flex {number}", set()

    def _loop(self, equality: int, kind: int, of: int) -> Loop:
        """A loop between two bodies or sites.

        Of bodies, the data of a connect are the point in body 1 and in body 2; of a weld the point
        in body 2, then where it is in body 1 and how body 2 is turned against body 1.
        """
        mj = self.mj
        data = np.array(mj.eq_data[equality])
        ids = int(mj.eq_obj1id[equality]), int(mj.eq_obj2id[equality])
        if of == int(mujoco.mjtObj.mjOBJ_SITE):
            bodies = [int(mj.site_bodyid[s]) for s in ids]
            places = [pose(mj.site_pos[s], mj.site_quat[s]) for s in ids]
        elif kind == _CONNECT:
            bodies = list(ids)
            places = [pin.SE3(np.eye(3), data[:3]), pin.SE3(np.eye(3), data[3:6])]
        else:
            bodies = list(ids)
            places = [pose(data[3:6], data[6:10]), pin.SE3(np.eye(3), data[:3])]
        name = mj.eq(equality).name
        label = name or " - ".join(body_label(mj, body) for body in bodies)
        frames, offsets = [], []
        for k, (body, place) in enumerate(zip(bodies, places, strict=True), 1):
            turned = kind == _WELD and np.abs(place.rotation - np.eye(3)).max() > _SAME
            frames.append(
                self._frame(body, place, f"{label} {k}") if turned else body_label(mj, body)
            )
            x, y, z = (0.0, 0.0, 0.0) if turned else map(float, place.translation)
            offsets.append((x, y, z))
        return Loop(
            frames[0],
            frames[1],
            "weld" if kind == _WELD else "ball",
            offsets[0],
            offsets[1],
            name=label,
        )

    def _frame(self, body: int, place: pin.SE3, name: str) -> str:
        """Add a frame to the model, for what is turned against its body."""
        model = self.tree.model
        while model.existFrame(name):
            name += "'"
        joint, axes = self.tree.bodies[body]
        parent = model.getFrameId(body_label(self.mj, body), pin.FrameType.BODY)
        model.addFrame(pin.Frame(name, joint, parent, axes * place, pin.FrameType.OP_FRAME))
        return name

    def _coupling(self, equality: int) -> tuple[Coupling | None, str]:
        """A coupling of two joints; or None and why there is none."""
        mj = self.mj
        first, second = int(mj.eq_obj1id[equality]), int(mj.eq_obj2id[equality])
        polynomial = np.array(mj.eq_data[equality][:5])
        if np.any(polynomial[2:]):
            degree = int(np.flatnonzero(polynomial)[-1])
            return None, f"its polynomial is of degree {degree}, copsense knows straight lines"
        if first not in self.tree.joints or (second >= 0 and second not in self.tree.joints):
            return None, "a joint of the base is not a joint of the robot"
        if second < 0:
            return self._pinned(first, float(polynomial[0]))
        rest = mj.qpos0[mj.jnt_qposadr[first]], mj.qpos0[mj.jnt_qposadr[second]]
        constant, ratio = float(polynomial[0]), float(polynomial[1])
        offset = float(rest[0]) + constant - ratio * float(rest[1])
        names = self.tree.name_of(first), self.tree.name_of(second)
        return Coupling(names[0], names[1], ratio, offset), ""

    def _pinned(self, joint: int, constant: float) -> tuple[Coupling | None, str]:
        """A joint held where it is: it follows another by nothing, q = 0 q_of + b."""
        others = [j for j in self.tree.joints if j != joint and self.mj.jnt_type[j] in _ONE]
        if not others:
            return None, "it is the only joint, and stays where the posture has it"
        at = float(self.mj.qpos0[self.mj.jnt_qposadr[joint]]) + constant
        names = self.tree.name_of(joint), self.tree.name_of(others[0])
        self.notes.append(f"joint {names[0]!r} is held at {at:.4g} rad or m by an equality.")
        return Coupling(names[0], names[1], 0.0, at), ""
