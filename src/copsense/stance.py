"""Stance: a robot at a configuration, standing on contacts; its gravity, Jacobian and motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.contact import COMPONENT_NAMES, Contact
from copsense.errors import ContactGeometryError, InsufficientContactsError, InvalidInputError
from copsense.robot import Robot

_LOCAL = pin.ReferenceFrame.LOCAL
# Singular values of the contact Jacobian, lengths in metres, below which a direction is lost.
RANK_TOLERANCE = 1e-9
_MASSLESS = 1e-14  # share of the largest kinetic energy under which a motion moves no mass
_LOST = 1e-9  # singular values of the CoM Jacobian, relative, that count as unreachable
# How far a contact may lie from its stated plane.
POSITION_TOLERANCE = 1e-6  # m
ANGLE_TOLERANCE = 1e-6  # rad


@dataclass(frozen=True, eq=False)
class Stance:
    """A robot at rest on its contacts, which do not move.

    Rows of `jacobian`, of stacked forces and of wrenches follow the contacts' order and, in each
    contact, its components among (fx, fy, fz, mx, my, mz) in contact axes. Columns are Pinocchio's
    velocity: the base in its own frame, then the joints.

    Attributes:
        robot: the robot.
        q: configuration (nq,): base position, quaternion (x, y, z, w), joints.
        contacts: the contacts, at least one; kept as a tuple.
        check: False skips the checks of where the contacts lie and of what they can carry, for
            a solver's intermediate steps.

    Raises:
        InvalidInputError: no contact, two contacts of one name, or a bad configuration.
        UnknownNameError: a contact's frame is not in the model.
        ContactGeometryError: a contact does not lie on its stated plane.
        InsufficientContactsError: the contacts cannot balance every force and moment on the base.
    """

    robot: Robot
    q: Float[np.ndarray, " nq"]
    contacts: Sequence[Contact]
    check: InitVar[bool] = True
    _data: pin.Data = field(init=False, repr=False)

    def __post_init__(self, check: bool) -> None:
        """Check the input and run the kinematics once."""
        contacts = (self.contacts,) if isinstance(self.contacts, Contact) else tuple(self.contacts)
        for contact in contacts:
            if not isinstance(contact, Contact):
                raise InvalidInputError(f"{contact!r} is no contact. Give Contact(frame=...).")
        object.__setattr__(self, "contacts", contacts)
        names = [contact.name for contact in contacts]
        if not names:
            raise InvalidInputError(
                "a stance needs at least one contact. Give Contact(frame=...) for each foot; "
                f"frames of {self.robot.name!r}: {', '.join(self.robot.frame_names)}."
            )
        if len(set(names)) != len(names):
            raise InvalidInputError(
                f"two contacts share a name: {', '.join(names)}. Give each frame once, or name "
                "the contacts apart with Contact(name=...)."
            )
        object.__setattr__(self, "q", self.robot.check_configuration(self.q))
        for contact in contacts:
            if self.robot.frame(contact.frame).parentJoint == 0:
                raise InvalidInputError(
                    f"frame {contact.frame!r} of contact {contact.name!r} is fixed in the world: "
                    "it is no part of the robot. Name a frame of a foot."
                )
        model = self.robot.model
        data = model.createData()
        object.__setattr__(self, "_data", data)
        pin.computeJointJacobians(model, data, self.q)
        if check:
            _check_planes(self)
            _check_support(self)

    def at(self, q: ArrayLike, *, check: bool = True) -> Stance:
        """The same stance at another configuration."""
        if not isinstance(q, np.ndarray):
            q = self.robot.check_configuration(q)
        return replace(self, q=q, check=check)

    def with_contacts(self, contacts: Iterable[Contact]) -> Stance:
        """The same robot and configuration on other contacts."""
        return replace(self, contacts=tuple(contacts))

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts, in order."""
        return tuple(contact.name for contact in self.contacts)

    @cached_property
    def placements(self) -> tuple[pin.SE3, ...]:
        """World placement of each contact frame."""
        found = []
        for contact in self.contacts:
            joint, placement = _attachment(self.robot, contact)
            world = self._data.oMi[joint] * placement
            if contact.kind == "point":
                world = pin.SE3(_plane_axes(contact), world.translation)
            found.append(world)
        return tuple(found)

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Rows of each contact in stacked forces."""
        ends = np.cumsum([0] + [len(contact.components) for contact in self.contacts])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    @cached_property
    def row_names(self) -> tuple[str, ...]:
        """Names of the rows of stacked forces, such as ``"l_sole fz"``."""
        return tuple(f"{c.name} {COMPONENT_NAMES[i]}" for c in self.contacts for i in c.components)

    @cached_property
    def component_index(self) -> np.ndarray:
        """For each row of stacked forces, its component 0..5 among (fx, fy, fz, mx, my, mz)."""
        return np.array([i for contact in self.contacts for i in contact.components])

    @cached_property
    def gravity(self) -> Float[np.ndarray, " nv"]:
        """Generalised gravity G(q) [N, Nm]: what the torques and contacts must balance."""
        model = self.robot.model
        return pin.computeGeneralizedGravity(model, model.createData(), self.q)

    @cached_property
    def jacobian(self) -> Float[np.ndarray, "m nv"]:
        """Stacked contact Jacobian J: velocities of the contact frames, in contact axes."""
        blocks = []
        for contact in self.contacts:
            local = self._local_jacobian(contact)
            if contact.kind == "point":
                local = self._point_axes(contact) @ local[:3]
            else:
                local = local[list(contact.components)]
            blocks.append(local)
        return np.vstack(blocks)

    @cached_property
    def com(self) -> Float[np.ndarray, " 3"]:
        """Centre of mass in the world [m]."""
        return pin.centerOfMass(self.robot.model, self.robot.model.createData(), self.q)

    @cached_property
    def com_jacobian(self) -> Float[np.ndarray, "3 nv"]:
        """Jacobian of the centre of mass, world axes."""
        model = self.robot.model
        return pin.jacobianCenterOfMass(model, model.createData(), self.q)

    @cached_property
    def mass_matrix(self) -> Float[np.ndarray, "nv nv"]:
        """Joint-space inertia M(q), symmetric."""
        model = self.robot.model
        return pin.crba(model, model.createData(), self.q, pin.Convention.WORLD)

    @cached_property
    def joint_limit_excess(self) -> Float[np.ndarray, " n"]:
        """How far each joint stands beyond the model's limits, zero within them [rad, m].

        Nothing here keeps a posture within them: this says where one is not.
        """
        model, excess = self.robot.model, np.zeros(len(self.robot.torque_names))
        for joint in list(model.joints)[2:]:
            if joint.nq == 1:  # others have no limits to exceed
                low, high = (
                    model.lowerPositionLimit[joint.idx_q],
                    model.upperPositionLimit[joint.idx_q],
                )
                beyond = max(low - self.q[joint.idx_q], self.q[joint.idx_q] - high, 0.0)
                excess[joint.idx_v - self.robot.base_nv] = beyond if low < high else 0.0
        return excess

    @cached_property
    def _svd(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        u, s, vt = np.linalg.svd(self.jacobian, full_matrices=True)
        return u, s, vt

    @cached_property
    def rank(self) -> int:
        """Rank of the contact Jacobian; less than its rows when contacts are redundant."""
        singular = self._svd[1]
        return int(np.sum(singular > RANK_TOLERANCE * max(1.0, singular[0])))

    @cached_property
    def admissible_motions(self) -> Float[np.ndarray, "nv p"]:
        """Orthonormal basis Z of the velocities that leave the contacts at rest: J Z = 0."""
        return self._svd[2][self.rank :].T.copy()

    @cached_property
    def energy_motions(self) -> Float[np.ndarray, "nv r"]:
        """Admissible motions Z R of unit kinetic energy, with R R' = (Z' M Z)^-1.

        Motions of massless links alone are left out: they have no energy to be measured by, and
        move no centre of mass.
        """
        Z = self.admissible_motions
        values, vectors = np.linalg.eigh(Z.T @ self.mass_matrix @ Z)
        kept = values > _MASSLESS * values.max(initial=0.0)
        return np.asarray(Z @ (vectors[:, kept] / np.sqrt(values[kept])))

    @cached_property
    def com_motions(self) -> Float[np.ndarray, "nv 2"]:
        """The admissible motion of least kinetic energy per unit of CoM x and y velocity.

        v = Z S J_c' (J_c S J_c')^-1 = Z R (J_c R)^+ with S = (Z' M Z)^-1 = R R' and
        J_c = J_com,xy Z. Where the contacts forbid a horizontal direction (the planar four-bar),
        its part is zero.
        """
        motions = self.energy_motions
        return np.asarray(motions @ np.linalg.pinv(self.com_jacobian[:2] @ motions, rcond=_LOST))

    @property
    def redundant_directions(self) -> tuple[str, ...]:
        """Rows of stacked forces that take part in wrenches no motion can feel (J' f = 0)."""
        null = self._svd[0][:, self.rank :]
        share = np.linalg.norm(null, axis=1)
        return tuple(n for n, s in zip(self.row_names, share, strict=True) if s > 1e-6)

    def stack(self, wrenches: Float[np.ndarray, "nc 6"]) -> Float[np.ndarray, " m"]:
        """Wrenches (nc, 6) as stacked forces (m,), dropping what a contact cannot carry."""
        return np.concatenate(
            [w[list(c.components)] for w, c in zip(wrenches, self.contacts, strict=True)]
        )

    def unstack(self, forces: Float[np.ndarray, "m *p"]) -> Float[np.ndarray, "nc 6 *p"]:
        """Stacked forces (m, ...) as wrenches (nc, 6, ...), zero where a contact carries none."""
        wrenches = np.zeros((len(self.contacts), 6, *forces.shape[1:]))
        for k, (contact, rows) in enumerate(zip(self.contacts, self.rows, strict=True)):
            wrenches[k, list(contact.components)] = forces[rows]
        return wrenches

    def in_world_axes(self, wrenches: Float[np.ndarray, "nc 6"]) -> Float[np.ndarray, "nc 6"]:
        """Wrenches given in contact axes, in world axes about the same points."""
        turned = [
            np.concatenate([place.rotation @ w[:3], place.rotation @ w[3:]])
            for place, w in zip(self.placements, wrenches, strict=True)
        ]
        return np.array(turned)

    def joint_wrenches(self, forces: Float[np.ndarray, " m"]) -> list[pin.Force]:
        """Stacked forces as one spatial force per joint of the model, in the joint's frame."""
        external = [pin.Force.Zero() for _ in range(self.robot.model.njoints)]
        for contact, wrench in zip(self.contacts, self.unstack(forces), strict=True):
            joint, placement = _attachment(self.robot, contact)
            if contact.kind == "point":
                wrench = np.concatenate([self._point_axes(contact).T @ wrench[:3], np.zeros(3)])
            external[joint] += placement.act(pin.Force(wrench))
        return external

    def balance_derivative(
        self, forces: Float[np.ndarray, " m"], model: pin.Model | None = None
    ) -> Float[np.ndarray, "nv nv"]:
        """A = d(G - J' f)/dq at fixed f in contact axes, along velocities of the model.

        Args:
            forces: stacked forces f (m,).
            model: the robot's model with another gravity, for whoever needs the curvature of a
                centre of mass rather than of the weight.

        Exact along admissible motions; for surface contacts everywhere.
        """
        model = model or self.robot.model
        derivative = pin.computeStaticTorqueDerivatives(
            model, model.createData(), self.q, self.joint_wrenches(forces)
        )
        # Pinocchio turns the force with its joint. A surface does not turn; a point foot does, and
        # its force stays fixed in the world: J_l' [f]x J_a is what that takes away.
        for contact, rows in zip(self.contacts, self.rows, strict=True):
            if contact.kind == "point":
                local = self._local_jacobian(contact)
                force = self._point_axes(contact).T @ forces[rows]
                derivative -= local[:3].T @ pin.skew(force) @ local[3:]
        return derivative

    def motion_derivative(self, velocity: Float[np.ndarray, " nv"]) -> Float[np.ndarray, "m nv"]:
        """D = d(J v)/dq at fixed v, along velocities of the model."""
        model, data = self.robot.model, self.robot.model.createData()
        zero = np.zeros(model.nv)
        pin.computeForwardKinematicsDerivatives(model, data, self.q, velocity, zero)
        blocks = []
        for contact in self.contacts:
            joint, placement = _attachment(self.robot, contact)
            derivative = pin.getFrameVelocityDerivatives(model, data, joint, placement, _LOCAL)[0]
            if contact.kind == "point":
                local = self._local_jacobian(contact)
                turned = derivative[:3] - pin.skew(local[:3] @ velocity) @ local[3:]
                blocks.append(self._point_axes(contact) @ turned)
            else:
                blocks.append(derivative[list(contact.components)])
        return np.vstack(blocks)

    def inertia_derivative(self, acceleration: Float[np.ndarray, " nv"]) -> np.ndarray:
        """d(M a)/dq at fixed a (nv x nv), along velocities of the model."""
        model, zero = self.robot.model, np.zeros(self.robot.model.nv)
        at_rest = pin.computeGeneralizedGravityDerivatives(model, model.createData(), self.q)
        data = model.createData()  # kept alive: what comes back is a view of it
        moving = pin.computeRNEADerivatives(model, data, self.q, zero, acceleration)[0]
        return np.asarray(moving - at_rest)

    def _local_jacobian(self, contact: Contact) -> Float[np.ndarray, "6 nv"]:
        joint, placement = _attachment(self.robot, contact)
        return pin.getFrameJacobian(self.robot.model, self._data, joint, placement, _LOCAL)

    def _point_axes(self, contact: Contact) -> Float[np.ndarray, "3 3"]:
        """Rotation from the foot's local axes to a point contact's axes, fixed in the world."""
        joint, placement = _attachment(self.robot, contact)
        world = self._data.oMi[joint].rotation @ placement.rotation
        return _plane_axes(contact).T @ world


def _attachment(robot: Robot, contact: Contact) -> tuple[int, pin.SE3]:
    """The joint that carries a contact, and the contact frame's placement on it."""
    frame = robot.frame(contact.frame)
    return int(frame.parentJoint), frame.placement * pin.SE3(
        contact.rotation, np.array(contact.offset)
    )


def _plane_axes(contact: Contact) -> Float[np.ndarray, "3 3"]:
    """World axes of a point contact: z the plane's normal, x the nearest to the world's x."""
    z = np.array(contact.plane.normal if contact.plane else (0.0, 0.0, 1.0))
    nearest = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = nearest - z * (z @ nearest)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _check_planes(stance: Stance) -> None:
    for contact, world in zip(stance.contacts, stance.placements, strict=True):
        if contact.plane is None:
            continue
        normal = np.array(contact.plane.normal)
        height = float(normal @ (world.translation - np.array(contact.plane.point)))
        tilt = float(np.linalg.norm(np.cross(world.rotation[:, 2], normal)))
        turned = contact.kind != "point" and (
            tilt > ANGLE_TOLERANCE or world.rotation[:, 2] @ normal < 0
        )
        if abs(height) > POSITION_TOLERANCE or turned:
            degrees = np.degrees(np.arctan2(tilt, world.rotation[:, 2] @ normal))
            raise ContactGeometryError(
                f"contact {contact.name!r} is not on its plane: its origin is {height * 1e3:+.3f} "
                f"mm off along the normal"
                + ("" if contact.kind == "point" else f" and its z axis {degrees:.3f} deg away")
                + ". Move the base or the joints (copsense.solve_posture places the feet), "
                "correct the contact's offset or rotation, or drop its plane."
            )


def _check_support(stance: Stance) -> None:
    nb = stance.robot.base_nv
    base = stance.jacobian[:, :nb]
    rank = np.linalg.matrix_rank(base, tol=RANK_TOLERANCE * max(1.0, np.abs(base).max()))
    if rank < nb:
        kinds = ", ".join(f"{c.name} ({c.kind})" for c in stance.contacts)
        raise InsufficientContactsError(
            f"the contacts of {stance.robot.name!r} ({kinds}) cannot balance every force and "
            f"moment on its base: they span {rank} of {nb} directions. Use at least one surface "
            "contact, or three point contacts that are not on one line."
        )
