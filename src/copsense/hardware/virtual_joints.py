"""VirtualJoints: a robot whose joints and contacts may also move on the links that carry them.

Each place that an alteration moves becomes a joint of its own, of three translations, which stands
at zero. To change a shape is then a motion like any other: the derivatives by postures that the
stance has already, exact, are those by shapes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.contact import Contact
from copsense.content import ShortRepr, freeze
from copsense.hardware.parameter import Alteration
from copsense.robot import Robot
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class VirtualJoints(ShortRepr):
    """A robot with joints more, and which of its motions each alteration is.

    Attributes:
        robot: with the virtual joints among its own.
        contacts: the same, on frames that virtual joints carry.
        q_index: where the robot's own configuration is in this one's (nq,).
        v_index: where its own velocities are (nv,).
        columns: velocity per unit of each alteration (nv + 3 k, p).
    """

    robot: Robot
    contacts: tuple[Contact, ...]
    q_index: Int[np.ndarray, " nq"]
    v_index: Int[np.ndarray, " nv"]
    columns: Float[np.ndarray, "k p"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "q_index", "v_index", "columns")

    @classmethod
    def of(cls, stance: Stance, alterations: Sequence[Alteration]) -> VirtualJoints:
        """The robot and contacts of a stance with a joint for each place that is moved."""
        robot, model = stance.robot, stance.robot.model
        moved = {joint for change in alterations for joint in change.joints}
        feet = {name for change in alterations for name in change.contacts}
        on = {contact.name: contact.on(robot).joint for contact in stance.contacts}
        made, index, at = pin.Model(), {0: 0}, dict[int | str, int]()
        made.name, made.gravity = model.name, model.gravity
        for joint in range(1, model.njoints):
            parent, place = index[int(model.parents[joint])], model.jointPlacements[joint]
            if joint in moved:
                here = pin.SE3(np.eye(3), place.translation)
                parent = at[joint] = _slide(made, parent, here, f"place of {model.names[joint]}")
                place = pin.SE3(place.rotation, np.zeros(3))
            index[joint] = made.addJoint(parent, model.joints[joint], place, model.names[joint])
            made.inertias[index[joint]] = model.inertias[joint]
            for name in (n for n in stance.contact_names if n in feet and on[n] == joint):
                at[name] = _slide(made, index[joint], pin.SE3.Identity(), f"place of {name}")
        for frame in list(model.frames)[1:]:
            own = pin.Frame(
                frame.name, index[int(frame.parentJoint)], 0, frame.placement, frame.type
            )
            made.addFrame(own, False)
        contacts = []
        for contact in stance.contacts:
            if contact.name in at:
                name = f"place of {contact.name}"
                place = robot.frame(contact.frame).placement
                made.addFrame(
                    pin.Frame(name, at[contact.name], 0, place, pin.FrameType.OP_FRAME), False
                )
                contact = replace(contact, frame=name)
            contacts.append(contact)
        q_index, v_index = _places(model, made, index)
        armature = np.zeros(made.nv)
        armature[v_index] = model.armature
        made.armature = armature
        columns = np.zeros((made.nv, len(alterations)))
        for i, change in enumerate(alterations):
            moves = [(at[joint], d) for joint, d in change.joints.items()]
            moves += [(at[contact], d) for contact, d in change.contacts.items()]
            for joint, d in moves:
                start = made.joints[joint].idx_v
                columns[start : start + 3, i] = d
        whole = replace(robot, model=made)
        return cls(whole, tuple(contacts), q_index, v_index, columns)

    def at(self, stance: Stance) -> Stance:
        """The same posture, virtual joints at zero."""
        q = np.zeros(self.robot.model.nq)
        q[self.q_index] = stance.q
        return Stance(self.robot, q, self.contacts, False, stance.loads)

    def balance_rates(
        self, stance: Stance, forces: Float[np.ndarray, " c"]
    ) -> Float[np.ndarray, "nv p"]:
        """d(N - J' f) per unit of each alteration, at fixed posture and forces f."""
        there = _at(self, stance)
        return self._moved(there.balance_derivative(_in_rows(stance, there, forces)))

    def curvature_rates(
        self, stance: Stance, forces: Float[np.ndarray, " c"], gravity: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, "nv p"]:
        """The same of G - J' f under a gravity of its own."""
        there = _at(self, stance)
        return self._moved(there.curvature(_in_rows(stance, there, forces), gravity))

    def motion_rates(
        self, stance: Stance, velocity: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "c p"]:
        """d(J v) per unit of each alteration, at a fixed velocity."""
        there = _at(self, stance)
        return _out_rows(stance, there, there.motion_derivative(self._whole(velocity))) @ (
            self.columns
        )

    def inertia_rates(
        self, stance: Stance, acceleration: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "nv p"]:
        """d(M a) per unit of each alteration, at a fixed acceleration."""
        return self._moved(_at(self, stance).inertia_derivative(self._whole(acceleration)))

    def place_rates(self, stance: Stance) -> Float[np.ndarray, "c p"]:
        """How fast contacts move, and loops open, per unit of each alteration, posture held."""
        there = _at(self, stance)
        return _out_rows(stance, there, there.constraints) @ self.columns

    def com_rates(self, stance: Stance) -> Float[np.ndarray, "3 p"]:
        """How fast the centre of mass moves, posture held [m]."""
        return _at(self, stance).com_jacobian @ self.columns

    def _whole(self, velocity: Float[np.ndarray, " nv"]) -> Float[np.ndarray, " k"]:
        found = np.zeros(self.robot.model.nv)
        found[self.v_index] = velocity
        return found

    def _moved(self, derivative: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "nv p"]:
        return derivative[self.v_index] @ self.columns


@lru_cache(maxsize=8)  # of one posture several derivatives are asked
def _at(virtual: VirtualJoints, stance: Stance) -> Stance:
    return virtual.at(stance)


def _slide(made: pin.Model, parent: int, place: pin.SE3, name: str) -> int:
    return int(made.addJoint(parent, pin.JointModelTranslation(), place, name))


def _places(
    model: pin.Model, made: pin.Model, index: dict[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    q, v = np.zeros(model.nq, dtype=int), np.zeros(model.nv, dtype=int)
    for joint in range(1, model.njoints):
        own, other = model.joints[joint], made.joints[index[joint]]
        q[own.idx_q : own.idx_q + own.nq] = np.arange(other.idx_q, other.idx_q + own.nq)
        v[own.idx_v : own.idx_v + own.nv] = np.arange(other.idx_v, other.idx_v + own.nv)
    return q, v


def _in_rows(
    stance: Stance, there: Stance, forces: Float[np.ndarray, " c"]
) -> Float[np.ndarray, " c"]:
    """Forces in the rows of the other stance: loops have another basis of the same rows."""
    if stance.closures is None or there.closures is None:
        return forces
    m = len(stance.row_names)
    return np.concatenate([forces[:m], there.closures.basis.T @ stance.loop_forces(forces)])


def _out_rows(
    stance: Stance, there: Stance, rows: Float[np.ndarray, "c k"]
) -> Float[np.ndarray, "c k"]:
    """Rows of the other stance in those of this one."""
    if stance.closures is None or there.closures is None:
        return rows
    m = len(stance.row_names)
    own = stance.closures.basis.T @ (there.closures.basis @ rows[m:])
    return np.concatenate([rows[:m], own])
