"""motors: which joints the actuators of a compiled MJCF drive, and together with which.

on a joint           a motor; joints without one have none, where any has
on a fixed tendon    a motor of a transmission, by its force along the tendon
another way          a motor on each joint that it moves, with a note
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from copsense.drives import Transmission
from copsense.listing import first_few
from copsense.mjcf.effort import largest_force
from copsense.mjcf.tendons import tendon_bodies, tendon_joints
from copsense.mjcf.tree_model import Tree, actuators_of

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_ON_TENDON, _ON_BODY = int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtTrn.mjTRN_BODY)
_NO_LEVER = 1e-9  # m, or none
_ON_SITE = (int(mujoco.mjtTrn.mjTRN_SITE), int(mujoco.mjtTrn.mjTRN_SLIDERCRANK))


@dataclass(eq=False)
class Motors:
    """The actuators of a robot.

    Attributes:
        mj: ``mujoco.MjModel``.
        tree: the robot in it, with its effort limits.
        followers: names of the joints that follow others.
        notes: what was assumed, or is not used.
    """

    mj: Any
    tree: Tree
    followers: set[str]
    notes: list[str] = field(default_factory=list)

    def read(self) -> tuple[tuple[str, ...] | None, tuple[Transmission, ...]]:
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
                f"ball joints {first_few(map(self.tree.name_of, partly))} have fewer actuators "
                "than axes; they are taken to have a motor about each."
            )
        alone = (on_joint | other) - tendons
        transmissions = list(self._transmissions(by_tendon, on_joint | other))
        for joint in list(alone):
            if self.tree.name_of(joint) in self.followers:  # a follower with a motor of its own
                alone.discard(joint)
                name = self.tree.name_of(joint)
                limit = (self._limit(joint),)
                transmissions.append(Transmission((name,), (name,), np.eye(1), limit))
        idle = [j for j in joints if j not in alone | tendons and j not in on_joint | other]
        idle = [j for j in idle if self.tree.name_of(j) not in self.followers]
        if idle:
            self.notes.append(
                f"joints {first_few(map(self.tree.name_of, idle))} have no actuator, while others "
                "have; they have no motor."
            )
        motors = tuple(dof for j in joints if j in alone for dof in self._dofs(j))
        unlike = idle or any(self.tree.name_of(j) in self.followers for j in on_joint | other)
        return (motors if unlike else None), tuple(transmissions)

    def _acts(self, actuator: int) -> bool:
        """Whether an actuator is not one of a group that the file switches off."""
        group = int(self.mj.actuator_group[actuator])
        return not (0 <= group < 31 and (int(self.mj.opt.disableactuator) >> group) & 1)

    def _limit(self, joint: int) -> float:
        model = self.tree.model
        limit = float(model.upperEffortLimit[model.joints[self.tree.joints[joint]].idx_v])
        return limit if limit > 0 else np.inf

    def _is_ball(self, joint: int) -> bool:
        return bool(self.mj.jnt_type[joint] == _BALL)

    def _dofs(self, joint: int) -> list[str]:
        """Labels of a joint's degrees of freedom."""
        name = self.tree.name_of(joint)
        return [f"{name}[{i}]" for i in range(3)] if self._is_ball(joint) else [name]

    def _by_tendon(self) -> list[tuple[str, dict[int, float], float]]:
        """Motors of fixed tendons: name, joint -> how it pulls it, largest force."""
        mj, found = self.mj, []
        for tendon in range(mj.ntendon):
            actuators = [
                a
                for a in range(len(mj.actuator_trntype))
                if mj.actuator_trntype[a] == _ON_TENDON
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
            if kind == _ON_TENDON:
                pulled = tendon_joints(mj, number)
                if pulled is not None and pulled.keys() <= self.tree.joints.keys():
                    continue
            moved = {j for j in self._moved(a) if j in self.tree.joints}
            if not moved and not self._acted_on(a) & self.tree.bodies.keys():
                continue
            base = any(j in self.tree.base for j in self._moved(a))
            if moved and not base and kind != _ON_BODY:
                joints |= moved
                spatial.append(name)
            else:
                apart.append(name)
        if spatial:
            self.notes.append(
                f"actuators {first_few(spatial)} do not act on a single joint or a fixed tendon; "
                "each joint that they move "
                f"({first_few(self.tree.name_of(j) for j in sorted(joints))}) is taken "
                "to have a motor of its own."
            )
        if apart:
            self.notes.append(
                f"actuators {first_few(apart)} do not act on joints; they are not used."
            )
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
        levers = np.abs(moment[actuator])
        return {int(mj.dof_jntid[dof]) for dof in np.flatnonzero(levers > _NO_LEVER)}

    def _acted_on(self, actuator: int) -> set[int]:
        """Bodies that an actuator acts on otherwise than by joints."""
        mj = self.mj
        kind, number = mj.actuator_trntype[actuator], int(mj.actuator_trnid[actuator][0])
        if kind == _ON_TENDON:
            return tendon_bodies(mj, number)
        if kind == _ON_BODY:
            return {number}
        if kind in _ON_SITE:
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
