"""driving: the motors, springs, couplings and loops of a compiled MJCF.

    actuator on a joint      a motor; joints without one have none, where any has
    on a fixed tendon        a motor of a transmission, by its force along the tendon
    equality connect, weld   a loop
    equality joint           a coupling, q_1 - ref_1 = c_0 + c_1 (q_2 - ref_2)
    stiffness, springref     a spring
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from copsense.drives import Coupling, Drives, Loop, Spring, Transmission
from copsense.mjcf.effort import largest_force
from copsense.mjcf.scene import body_label, listed
from copsense.mjcf.tendons import tendon_bodies, tendon_joints
from copsense.mjcf.tree_model import Tree, actuators_of, pose

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_CONNECT, _WELD = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
_JOINT, _TENDON = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)
# What couplings are between, which MuJoCo does not repeat in `eq_objtype`.
_BETWEEN = {_JOINT: int(mujoco.mjtObj.mjOBJ_JOINT), _TENDON: int(mujoco.mjtObj.mjOBJ_TENDON)}
_SAME = 1e-12


def read_drives(mj: Any, tree: Tree) -> tuple[Drives, tuple[str, ...]]:
    """The drives of a robot, and what was assumed or is not used.

    Frames that loops need are added to the tree's model.

    Args:
        mj: ``mujoco.MjModel``.
        tree: the robot in it.
    """
    reader = _Reader(mj, tree)
    loops, couplings = reader.equalities()
    motors, transmissions = reader.motors({c.joint for c in couplings})
    drives = Drives(
        motors=motors,
        springs=reader.springs(),
        couplings=couplings,
        loops=loops,
        transmissions=transmissions,
    )
    return drives, tuple(reader.notes)


@dataclass(eq=False)
class _Reader:
    mj: Any
    tree: Tree
    notes: list[str] = field(default_factory=list)

    def _disabled(self, flag: mujoco.mjtDisableBit) -> bool:
        return bool(self.mj.opt.disableflags & int(flag))

    def _dofs(self, joint: int) -> list[str]:
        """Labels of a joint's degrees of freedom."""
        name = self.tree.name_of(joint)
        return [f"{name}[{i}]" for i in range(3)] if self._is_ball(joint) else [name]

    def _is_ball(self, joint: int) -> bool:
        return bool(self.mj.jnt_type[joint] == _BALL)

    # Loops and couplings.

    def equalities(self) -> tuple[tuple[Loop, ...], tuple[Coupling, ...]]:
        """Active equalities between links or joints of the robot; others are noted."""
        mj, loops, couplings = self.mj, [], {}
        if self._disabled(mujoco.mjtDisableBit.mjDSBL_EQUALITY):
            return (), ()
        for e in range(mj.neq):
            kind = int(mj.eq_type[e])
            of = _BETWEEN.get(kind, int(mj.eq_objtype[e]))
            ends = [self._end(of, int(number)) for number in (mj.eq_obj1id[e], mj.eq_obj2id[e])]
            if not mj.eq_active0[e] or not any(bodies & self.tree.bodies.keys() for _, bodies in ends):
                continue
            inside = all(bodies and bodies <= self.tree.bodies.keys() for _, bodies in ends)
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
            elif kind == _JOINT:
                why = "a joint that is held at a position is taken to be held by its motor"
            elif inside:
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
        if first not in self.tree.joints or second not in self.tree.joints:
            return None, "a joint of the base is no joint of the robot"
        rest = mj.qpos0[mj.jnt_qposadr[first]], mj.qpos0[mj.jnt_qposadr[second]]
        constant, ratio = float(polynomial[0]), float(polynomial[1])
        offset = float(rest[0]) + constant - ratio * float(rest[1])
        names = self.tree.name_of(first), self.tree.name_of(second)
        return Coupling(names[0], names[1], ratio, offset), ""

    # Springs.

    def springs(self) -> dict[str, Spring]:
        """Linear springs of hinges and slides; others are noted."""
        mj, found, bent = self.mj, {}, []
        if self._disabled(mujoco.mjtDisableBit.mjDSBL_SPRING):
            return {}
        for joint in self.tree.joints:
            if self._is_ball(joint) or mj.jnt_stiffnesspoly[joint].any():
                if mj.jnt_stiffness[joint] or mj.jnt_stiffnesspoly[joint].any():
                    bent.append(self.tree.name_of(joint))
            elif mj.jnt_stiffness[joint]:
                rest = float(mj.qpos_spring[mj.jnt_qposadr[joint]])
                found[self.tree.name_of(joint)] = Spring(float(mj.jnt_stiffness[joint]), rest)
        if bent:
            self.notes.append(
                f"springs (stiffness) of joints {listed(bent)} are not used: they are not linear "
                "in one position."
            )
        return found

    # Motors.

    def motors(
        self, followers: set[str]
    ) -> tuple[tuple[str, ...] | None, tuple[Transmission, ...]]:
        """Joints with a motor of their own, None for all; and transmissions."""
        mj, joints = self.mj, self.tree.joints
        on_joint = {j for j in joints if any(map(self._acts, actuators_of(mj, j)))}
        by_tendon = self._by_tendon()
        other = self._by_other_ways()
        tendons = {j for _, pulled, _ in by_tendon for j in pulled}
        if not (on_joint or tendons or other):
            return None, ()
        partly = [j for j in on_joint if self._is_ball(j) and len(actuators_of(mj, j)) < 3]
        if partly:
            self.notes.append(
                f"ball joints {listed(map(self.tree.name_of, partly))} have fewer actuators than "
                "axes; they are taken to have a motor about each."
            )
        alone = (on_joint | other) - tendons
        transmissions = list(self._transmissions(by_tendon, on_joint | other))
        for joint in list(alone):
            if self.tree.name_of(joint) in followers:  # a follower with a motor of its own
                alone.discard(joint)
                name = self.tree.name_of(joint)
                limit = (self._limit(joint),)
                transmissions.append(Transmission((name,), (name,), np.eye(1), limit))
        idle = [j for j in joints if j not in alone | tendons and j not in on_joint | other]
        idle = [j for j in idle if self.tree.name_of(j) not in followers]
        if idle:
            self.notes.append(
                f"joints {listed(map(self.tree.name_of, idle))} have no actuator, while others "
                "have; they have no motor."
            )
        motors = tuple(dof for j in joints if j in alone for dof in self._dofs(j))
        unlike = idle or any(self.tree.name_of(j) in followers for j in on_joint | other)
        return (motors if unlike else None), tuple(transmissions)

    def _acts(self, actuator: int) -> bool:
        """Whether an actuator is not one of a group that the file switches off."""
        group = int(self.mj.actuator_group[actuator])
        return not (0 <= group < 31 and (int(self.mj.opt.disableactuator) >> group) & 1)

    def _limit(self, joint: int) -> float:
        limit = float(self.tree.model.upperEffortLimit[self.tree.model.joints[self.tree.joints[joint]].idx_v])
        return limit if limit > 0 else np.inf

    def _by_tendon(self) -> list[tuple[str, dict[int, float], float]]:
        """Motors of fixed tendons: name, joint -> how it pulls it, largest force."""
        mj, found = self.mj, []
        for tendon in range(mj.ntendon):
            actuators = [
                a
                for a in range(len(mj.actuator_trntype))
                if mj.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_TENDON)
                and mj.actuator_trnid[a][0] == tendon
                and self._acts(a)
            ]
            pulled = tendon_joints(mj, tendon)
            if not actuators or pulled is None or not pulled.keys() <= self.tree.joints.keys():
                continue
            pulled = {joint: coefficient for joint, coefficient in pulled.items() if coefficient}
            if pulled:
                name = mj.actuator(actuators[0]).name if len(actuators) == 1 else ""
                limit = sum(largest_force(mj, a) for a in actuators)
                if mj.tendon_actfrclimited[tendon]:
                    limit = min(limit, float(np.abs(mj.tendon_actfrcrange[tendon]).min()))
                label = name or mj.tendon(tendon).name or f"tendon {tendon}"
                found.append((label, pulled, limit))
        return found

    def _by_other_ways(self) -> set[int]:
        """Joints moved by actuators on spatial tendons, sites and cranks, with a note."""
        mj, joints, spatial, apart = self.mj, set(), [], []
        known = {a for j in range(mj.njnt) for a in actuators_of(mj, j)}
        for a in range(len(mj.actuator_trntype)):
            kind, number = int(mj.actuator_trntype[a]), int(mj.actuator_trnid[a][0])
            if a in known or not self._acts(a):
                continue
            name = mj.actuator(a).name or f"number {a}"
            if kind == int(mujoco.mjtTrn.mjTRN_TENDON):
                pulled = tendon_joints(mj, number)
                if pulled is not None and pulled.keys() <= self.tree.joints.keys():
                    continue
            moved = {j for j in self._moved(a) if j in self.tree.joints}
            if not moved and not self._acted_on(a) & self.tree.bodies.keys():
                continue
            base = any(j in self.tree.base for j in self._moved(a))
            if moved and not base and kind != int(mujoco.mjtTrn.mjTRN_BODY):
                joints |= moved
                spatial.append(name)
            else:
                apart.append(name)
        if spatial:
            self.notes.append(
                f"actuators {listed(spatial)} do not act on a single joint or a fixed tendon; each "
                f"joint that they move ({listed(self.tree.name_of(j) for j in sorted(joints))}) is "
                "taken to have a motor of its own."
            )
        if apart:
            self.notes.append(f"actuators {listed(apart)} do not act on joints; they are not used.")
        return joints

    def _moved(self, actuator: int) -> set[int]:
        """Joints that an actuator has a lever on at a posture away from the reference."""
        mj = self.mj
        data = mujoco.MjData(mj)
        random = np.random.default_rng(0)
        mujoco.mj_integratePos(mj, data.qpos, 0.2 * random.normal(size=mj.nv), 1.0)
        mujoco.mj_fwdPosition(mj, data)
        moment = np.zeros((mj.nu, mj.nv))
        mujoco.mju_sparse2dense(
            moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        return {int(mj.dof_jntid[dof]) for dof in np.flatnonzero(moment[actuator])}

    def _acted_on(self, actuator: int) -> set[int]:
        """Bodies that an actuator acts on otherwise than by joints."""
        mj = self.mj
        kind, number = mj.actuator_trntype[actuator], int(mj.actuator_trnid[actuator][0])
        if kind == int(mujoco.mjtTrn.mjTRN_TENDON):
            return tendon_bodies(mj, number)
        if kind == int(mujoco.mjtTrn.mjTRN_BODY):
            return {number}
        if kind in (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK)):
            return {int(mj.site_bodyid[number])}
        return set()

    def _transmissions(
        self, by_tendon: list[tuple[str, dict[int, float], float]], own: set[int]
    ) -> Iterator[Transmission]:
        """Motors of tendons, those that share joints together, with these joints' own motors."""
        groups: list[list[tuple[str, dict[int, float], float]]] = []
        for motor in by_tendon:
            touching = [g for g in groups if any(set(m[1]) & set(motor[1]) for m in g)]
            groups = [g for g in groups if g not in touching]
            groups.append([m for g in touching for m in g] + [motor])
        for group in groups:
            joints = sorted({joint for _, pulled, _ in group for joint in pulled})
            motors = [(self.tree.name_of(j), {j: 1.0}, self._limit(j)) for j in joints if j in own]
            taken = {name for name, _, _ in motors}
            motors += [(n if n not in taken else f"{n} (tendon)", p, f) for n, p, f in group]
            columns: list[np.ndarray] = []
            kept = []
            for name, pulled, limit in motors:
                column = np.array([pulled.get(joint, 0.0) for joint in joints])
                if np.linalg.matrix_rank(np.array([*columns, column])) > len(columns):
                    columns.append(column)
                    kept.append((name, limit))
                else:
                    self.notes.append(
                        f"actuator {name!r} pulls the joints as others do already: what it could "
                        "share with them is left out."
                    )
            yield Transmission(
                tuple(name for name, _ in kept),
                tuple(self.tree.name_of(joint) for joint in joints),
                np.array(columns).T,
                tuple(limit if limit > 0 else np.inf for _, limit in kept),
            )
