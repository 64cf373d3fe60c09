"""Stance: a robot at a configuration, standing on contacts; its gravity, Jacobian and motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import InitVar, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense import rigid_body
from copsense.arrays import array_property, check_type, read_only
from copsense.closures import RANK as CLOSURE_RANK
from copsense.closures import Closures
from copsense.contact import Contact
from copsense.contact_layout import ContactLayout, check_plane, lay_out
from copsense.errors import (
    InsufficientContactsError,
    InvalidInputError,
    UnknownNameError,
)
from copsense.free_motions import Folds, find_folds, least_energy, unit_energy
from copsense.loads import (
    AnyLoad,
    AppliedLoads,
    apply_loads,
    doubt_loads,
    known_loads,
    turning,
)
from copsense.motion import Motion
from copsense.robot import Robot
from copsense.row_space import RowSpace
from copsense.unheld import unheld_motions

if TYPE_CHECKING:
    from copsense.explore.showing import ShownPage

# Singular values of the contact Jacobian, lengths in metres, below which a direction is lost. A
# posture is known to 1e-12, and where contacts hold a direction to second order only, as legs
# without ankle roll do, its singular value is then known to the root of that.
RANK_TOLERANCE = 1e-6
_ROUNDING = 1e-13  # of the largest column of J: what is smaller moves no contact and no loop
# How fast, per unit of motion, contacts and loops come to hold what they leave free at a posture.
_PASSING = 1e-3
_INDIFFERENT = 1e-7  # m, of the weight: a motion whose balance changes less hangs nowhere
AT_LIMIT = 1e-6  # rad or m: a joint this far beyond its limit is at it


@dataclass(frozen=True, eq=False, repr=False)
class Stance:
    """A robot on its contacts, which do not move; at rest, or at an instant of a motion.

    Rows of `jacobian`, of stacked forces and of wrenches follow the contacts' order and, in each
    contact, its components among (fx, fy, fz, mx, my, mz) in contact axes. Columns are Pinocchio's
    velocity: the base in its own frame, then the joints. Arrays are read-only.

    A robot with loops or couplings has forces of its own as well, which keep these closed. They
    stand behind the contacts' forces, (c,), wherever all of them are meant.

    Attributes:
        robot: the robot.
        q: configuration (nq,): base position, quaternion (x, y, z, w), joints.
        contacts: the contacts, at least one; kept as a tuple.
        loads: known forces on the robot beside its weight; kept as a tuple.
        motion: how the robot moves, whose inertia is carried too; None at rest.
        check: False skips the checks of where the contacts lie and of what they can carry, for
            a solver's intermediate steps.

    Raises:
        InvalidInputError: no contact, two contacts of one name, or a bad configuration.
        UnknownNameError: a contact's frame is not in the model.
        ContactGeometryError: a contact does not lie on its stated plane.
        InsufficientContactsError: the contacts cannot balance every force and moment on the base.
        OpenLoopError: a loop or coupling of the robot is open at this configuration.
    """

    robot: Robot
    q: Float[np.ndarray, " nq"]
    contacts: Sequence[Contact]
    check: InitVar[bool] = True
    loads: Sequence[AnyLoad] = ()
    motion: Motion | None = None
    _layout: ContactLayout = field(init=False)
    # World placement of the contact frames as the foot carries them, and their local Jacobians.
    _feet: tuple[pin.SE3, ...] = field(init=False)
    _local: Float[np.ndarray, "nc 6 nv"] = field(init=False)

    def __post_init__(self, check: bool) -> None:
        """Validate the input and run the kinematics once."""
        check_type(self.robot, Robot, "a robot", "Give one, such as copsense.load_robot(...).")
        given: object = self.contacts
        contacts: Any = tuple(given) if isinstance(given, Iterable) else (given,)
        layout = lay_out(self.robot, contacts)
        q = self.robot.check_configuration(self.q)
        feet, local = rigid_body.place(self.robot, q, layout.attachments)
        for name, value in (
            ("contacts", contacts),
            ("loads", known_loads(self.loads)),
            ("q", q),
            ("_layout", layout),
            ("_feet", feet),
            ("_local", read_only(local)),
        ):
            object.__setattr__(self, name, value)
        if check:
            self.robot.check_positions(q)
            for k, contact in enumerate(contacts):
                check_plane(contact, feet[k])
            check_support(self)
            if self.closures is not None:
                self.closures.check()

    @classmethod
    def from_model(
        cls,
        model: pin.Model,
        q: ArrayLike,
        contacts: Iterable[Contact | str],
        *,
        name: str | None = None,
    ) -> Stance:
        """A stance of a ready ``pin.Model``.

        Args:
            model: its first joint is a floating base; copied.
            q: configuration (nq,): base position, quaternion (x, y, z, w), joints.
            contacts: the contacts, or the frames of flat feet by name.
            name: how the robot is called in results; default the model's name.

        Raises:
            CopsenseError: as `Robot.from_model` and `Stance`.
        """
        given = [Contact(frame=c) if isinstance(c, str) else c for c in contacts]
        robot = Robot.from_model(model, name=name)
        return cls(robot, robot.check_configuration(q), given)

    def __repr__(self) -> str:
        """Robot, contacts and centre of mass."""
        contacts = ", ".join(f"{c.name} ({c.kind})" for c in self.contacts)
        x, y, z = self.com
        return (
            f"Stance({self.robot.name!r} on {contacts}; CoM at ({x:.4g}, {y:.4g}, {z:.4g}) m, "
            f"{self.robot.weight:.4g} N)"
        )

    def at(self, q: ArrayLike, *, check: bool = True) -> Stance:
        """The same stance at another configuration."""
        place: Any = q
        return Stance(self.robot, place, self.contacts, check, self.loads, self.motion)

    def with_contacts(self, contacts: Iterable[Contact]) -> Stance:
        """The same robot, configuration and loads on other contacts."""
        given = tuple(contacts) if isinstance(contacts, Iterable) else contacts
        return Stance(self.robot, self.q, given, loads=self.loads, motion=self.motion)

    def with_loads(self, loads: Iterable[AnyLoad]) -> Stance:
        """The same robot, configuration and contacts under other loads."""
        given = known_loads(loads)
        found = Stance(self.robot, self.q, self.contacts, loads=given, motion=self.motion)
        if found.applied is not None:
            doubt_loads(given, found.applied, self.robot)
        return found

    def moving(self, velocity: ArrayLike, acceleration: ArrayLike) -> Stance:
        """The same stance in motion: what is solved on it carries the robot's inertia.

        The wrenches, centres of pressure and margins are then those of the instant: the centre of
        pressure of the whole robot is its zero-moment point. Derivatives over postures hold the
        numbers of velocity and acceleration.

        Args:
            velocity: v (nv,), base in its own frame, then joints [m/s, rad/s]. Contacts at rest
                ask for J v = 0, which is not checked.
            acceleration: dv/dt (nv,), componentwise [m/s^2, rad/s^2].

        Raises:
            InvalidInputError: not finite numbers (nv,).
        """
        motion = Motion.of(self.robot, velocity, acceleration)
        return Stance(self.robot, self.q, self.contacts, False, self.loads, motion)

    def at_rest(self) -> Stance:
        """The same stance without its motion."""
        return Stance(self.robot, self.q, self.contacts, False, self.loads)

    def show(self) -> ShownPage:
        """The stance in 3-D under the paper's two criteria, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self)

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts, in order."""
        return self._layout.names

    @cached_property
    def placements(self) -> tuple[pin.SE3, ...]:
        """World placement of each contact frame."""
        return tuple(
            foot if axes is None else pin.SE3(axes, foot.translation)
            for foot, axes in zip(self._feet, self._layout.fixed_axes, strict=True)
        )

    @property
    def rows(self) -> tuple[slice, ...]:
        """Rows of each contact in stacked forces."""
        return self._layout.rows

    @property
    def row_names(self) -> tuple[str, ...]:
        """Names of the rows of stacked forces, such as ``"l_sole fz"``."""
        return self._layout.row_names

    @property
    def component_index(self) -> Int[np.ndarray, " m"]:
        """For each row of stacked forces, its component 0..5 among (fx, fy, fz, mx, my, mz)."""
        return self._layout.component_index

    @property
    def edge_rows(self) -> Float[np.ndarray, "e k"]:
        """Rows of the soles' edges: times wrenches (nc, 6), stacked, the edges' slacks [m].

        The slack of an edge is w (b - a . p), with w the contact's share of the weight. See
        `Contact.edge_rows`.
        """
        return self._layout.edge_rows

    @property
    def edges(self) -> tuple[slice, ...]:
        """Rows of each contact in `edge_rows`, none where it has no sole."""
        return self._layout.edges

    @property
    def line_edges(self) -> tuple[slice, ...]:
        """Those of the contacts whose sole is a line."""
        return self._layout.line_edges

    @array_property
    def gravity(self) -> Float[np.ndarray, " nv"]:
        """Generalised gravity G(q) [N, Nm]."""
        return rigid_body.gravity(self.robot, self.q)

    @array_property
    def balance(self) -> Float[np.ndarray, " nv"]:
        """N [N, Nm], what motors, contacts and loops must balance.

        Gravity, and in motion inertia, less the loads, the springs of the joints and the torques
        held on them.
        """
        drives, inertial = self.robot.drives, self.gravity
        if self.motion is not None:
            inertial = rigid_body.inverse_dynamics(self.robot, self.q, self.motion)
        if not (self.loads or drives.springs or drives.held):
            return inertial
        found = np.array(inertial)
        if self.applied is not None:
            found -= self.applied.balanced
        return found - self.robot.joint_forces(self.q)

    @cached_property
    def applied(self) -> AppliedLoads | None:
        """What the loads do at this configuration; None where there are none."""
        return apply_loads(self.loads, self.robot, self.q) if self.loads else None

    @cached_property
    def closures(self) -> Closures | None:
        """The robot's loops and couplings at this configuration; None where it has none."""
        drives = self.robot.drives
        return Closures(self.robot, self.q) if drives.loops or drives.couplings else None

    @array_property
    def jacobian(self) -> Float[np.ndarray, "m nv"]:
        """Stacked contact Jacobian J: velocities of the contact frames, in contact axes."""
        return self._stacked(self._local)

    @property
    def constraints(self) -> Float[np.ndarray, "c nv"]:
        """J over the independent rows of loops and couplings: what may not move, (c, nv)."""
        return self.jacobian if self.closures is None else self._constraints

    @array_property
    def _constraints(self) -> Float[np.ndarray, "c nv"]:
        assert self.closures is not None
        rows = np.concatenate([self.jacobian, self.closures.independent])
        # A rod that spins about its own axis moves nothing: what rounding leaves of its column
        # would be scaled up into a row of the balance that no force but a huge one meets.
        size = np.linalg.norm(rows, axis=0)
        rows[:, size < _ROUNDING * size.max(initial=0.0)] = 0.0
        return rows

    @array_property
    def com(self) -> Float[np.ndarray, " 3"]:
        """Centre of mass in the world [m]."""
        return rigid_body.com(self.robot, self.q)

    @array_property
    def com_jacobian(self) -> Float[np.ndarray, "3 nv"]:
        """Jacobian of the centre of mass, world axes."""
        return rigid_body.com_jacobian(self.robot, self.q)

    @array_property
    def mass_matrix(self) -> Float[np.ndarray, "nv nv"]:
        """Joint-space inertia M(q), symmetric."""
        return rigid_body.mass_matrix(self.robot, self.q)

    @array_property
    def joint_limit_excess(self) -> Float[np.ndarray, " n"]:
        """How far each joint stands beyond the model's limits, zero within them [rad, m].

        Nothing here keeps a posture within them: this says where one is not.
        """
        (lower, upper), excess = self.robot.position_limits, np.zeros(len(self.robot.dof_names))
        at, q = self.robot.single_joints
        beyond = np.maximum(lower[at] - self.q[q], self.q[q] - upper[at])
        excess[at] = np.maximum(beyond, 0.0)
        return excess

    def limb(self, contact: Contact | str) -> tuple[int, ...]:
        """Joints of the model between the base and a contact, the base's own left out.

        Args:
            contact: one of the stance's contacts, or its name.

        Raises:
            UnknownNameError: no contact has this name.
        """
        if isinstance(contact, str):
            if contact not in self.contact_names:
                raise UnknownNameError("contact", contact, self.contact_names)
            contact = self.contacts[self.contact_names.index(contact)]
        return self.robot.limb(contact.on(self.robot).joint)

    @cached_property
    def _motions(self) -> RowSpace:
        tolerance = RANK_TOLERANCE if self.closures is None else CLOSURE_RANK
        return RowSpace(self.constraints, tolerance, least=1.0)

    @array_property
    def unheld_motions(self) -> Float[np.ndarray, "nv u"]:
        """Orthonormal motions u that no motor, contact, loop or coupling holds (nv, u).

        At rest u' N = 0, for only weight, loads, springs and held torques act along them.
        """
        if self.robot.actuation is None:
            return np.zeros((self.robot.model.nv, 0))
        return unheld_motions(self.robot, self.constraints)

    @property
    def hanging_motions(self) -> Float[np.ndarray, "nv h"]:
        """Those unheld motions along which the posture decides whether the robot is at rest.

        Without what is at rest anywhere, such as a rod that spins about its own axis, and without
        what is free to first order only, such as a rod that lies along an axis of its joint.
        """
        return self._hanging[0]

    @property
    def hanging_balance(self) -> Float[np.ndarray, " h"]:
        """u' N along `hanging_motions`: zero at rest [Nm, N, per unit of motion]."""
        return read_only(self.hanging_motions.T.dot(self.balance))

    @property
    def hanging_derivative(self) -> Float[np.ndarray, "h nv"]:
        """d(u' N)/dq along `hanging_motions` (h, nv): a motion must leave them at rest."""
        return self._hanging[1]

    @cached_property
    def _hanging(self) -> tuple[np.ndarray, np.ndarray]:
        U, robot = self.unheld_motions, self.robot
        if U.shape[1]:
            # With forces f that balance what they can, u turns with the posture so that
            # d(u' N) = u' A: u' J' = 0 stays, hence du' J' f = -u' dJ' f.
            nb = robot.unactuated_nv
            E, N = robot.by_drive(self.constraints.T)[:nb], robot.by_drive(self.balance)[:nb]
            left, s, right = np.linalg.svd(E)
            count = nb - U.shape[1]
            f = right[:count].T @ ((left[:, :count].T @ N) / s[:count])
            Y = right[count:].T
            if Y.shape[1]:  # u that some motion lets forces Y hold is free to first order only
                Z = self._motions.null
                # y' d(J u)/dq = u' d(J' y)/dq: whichever are fewer.
                if U.shape[1] <= Y.shape[1]:
                    held = np.array([Y.T @ self.motion_derivative(u) @ Z for u in U.T])
                else:
                    weightless = np.zeros(3)
                    turned = [U.T @ self.curvature(y, weightless) @ Z for y in Y.T]
                    held = np.array(turned).transpose(1, 0, 2)
                tall = held.reshape(U.shape[1], -1).T
                _, s, vt = np.linalg.svd(tall, full_matrices=tall.shape[0] < tall.shape[1])
                U = U @ vt[int(np.sum(s > _PASSING)) :].T
            A = self.balance_derivative(f)
            left, s, _ = np.linalg.svd(U.T @ A, full_matrices=False)
            U = U @ left[:, s > _INDIFFERENT * robot.weight]
        return read_only(U), read_only(U.T @ A if U.shape[1] else np.zeros((0, robot.model.nv)))

    @property
    def rank(self) -> int:
        """Rank of `constraints`; less than its rows when contacts are redundant."""
        return self._motions.rank

    @array_property
    def admissible_motions(self) -> Float[np.ndarray, "nv p"]:
        """Orthonormal basis Z of the velocities that move no contact and open no loop: J Z = 0.

        Without the `false_motions`, which J alone would allow. What hangs follows as gravity and
        springs have it.
        """
        Z = self._motions.null
        count = self.false_motions.shape[1]
        if count:
            Z = Z @ np.linalg.svd(self.false_motions.T @ Z)[2][count:].T
        if not self.hanging_motions.shape[1]:
            return Z
        rows = self.hanging_derivative @ Z
        _, s, vt = np.linalg.svd(rows)
        lost = int(np.sum(s > CLOSURE_RANK * max(s.max(initial=0.0), self.robot.weight * 1e-3)))
        return np.asarray(Z @ vt[lost:].T)

    @array_property
    def false_motions(self) -> Float[np.ndarray, "nv k"]:
        """Orthonormal motions v with J v = 0 that can be followed to first order only.

        Where J is deficient, y' J = 0, a motion moves the contacts by v' Q v / 2 along y to second
        order, Q = d(J' y)/dq. Where Q is definite on some motions and zero on the others, as for
        the pelvis' roll on two legs without ankle roll, those cannot be followed at all.
        """
        return self._folds.motions

    @property
    def fold_equations(self) -> tuple[Float[np.ndarray, "k nv"], Float[np.ndarray, " k"]]:
        """Rows F and errors e, F dq = -e, by which J comes to be deficient along `false_motions`.

        Contacts that hold a motion to second order are in place where e = 0, and Newton's method on
        them alone only halves its error.
        """
        return self._folds.equations, self._folds.errors

    @property
    def branching(self) -> bool:
        """Whether motions part here, as of two legs without a yaw that stand exactly parallel.

        Q, see `false_motions`, then has both signs: J is deficient at this very posture, and on the
        way along most motions it is not, so that wrenches have no derivative.
        """
        return self._folds.branching

    @cached_property
    def _folds(self) -> Folds:
        return find_folds(
            self._motions, self.constraints, lambda y: -self.curvature(y, np.zeros(3))
        )

    @array_property
    def energy_motions(self) -> Float[np.ndarray, "nv r"]:
        """Admissible motions Z R of unit kinetic energy, with R R' = (Z' M Z)^-1.

        Motions of massless links alone are left out: they have no energy to be measured by, and
        move no centre of mass.
        """
        return unit_energy(self.admissible_motions, self.mass_matrix)

    @array_property
    def com_motions(self) -> Float[np.ndarray, "nv 2"]:
        """The admissible motion of least kinetic energy per unit of CoM x and y velocity.

        v = Z S J_c' (J_c S J_c')^-1 = Z R (J_c R)^+ with S = (Z' M Z)^-1 = R R' and
        J_c = J_com,xy Z. Where the contacts forbid a horizontal direction (the planar four-bar),
        its part is zero.
        """
        motions = self.energy_motions
        speeds = self.com_jacobian[:2].dot(motions)
        return least_energy(motions, speeds, folded=bool(self.false_motions.shape[1]))

    @property
    def redundant_directions(self) -> tuple[str, ...]:
        """Rows of stacked forces that take part in wrenches no motion can feel (J' f = 0)."""
        null = self._motions.redundant[: len(self.row_names)]
        share = np.linalg.norm(null, axis=1)
        return tuple(n for n, s in zip(self.row_names, share, strict=True) if s > 1e-6)

    def stack(self, wrenches: Float[np.ndarray, "nc 6 *p"]) -> Float[np.ndarray, "m *p"]:
        """Wrenches (nc, 6, ...) as stacked forces (m, ...), dropping what no contact carries."""
        wrenches = np.asarray(wrenches)
        return wrenches.reshape(6 * len(self.contacts), *wrenches.shape[2:])[self._layout.places]

    def unstack(self, forces: Float[np.ndarray, "m *p"]) -> Float[np.ndarray, "nc 6 *p"]:
        """Stacked forces (m, ...) as wrenches (nc, 6, ...), zero where a contact carries none.

        Forces of loops behind them are left out.
        """
        forces = forces[: len(self._layout.row_names)]
        shape = (len(self.contacts), 6, *forces.shape[1:])
        if len(forces) == shape[0] * 6:
            return np.array(forces).reshape(shape)
        wrenches = np.zeros((shape[0] * 6, *shape[2:]))
        wrenches[self._layout.places] = forces
        return wrenches.reshape(shape)

    def in_world_axes(self, wrenches: Float[np.ndarray, "nc 6"]) -> Float[np.ndarray, "nc 6"]:
        """Wrenches given in contact axes, in world axes about the same points."""
        turned = [
            np.concatenate([place.rotation @ w[:3], place.rotation @ w[3:]])
            for place, w in zip(self.placements, wrenches, strict=True)
        ]
        return np.array(turned)

    def loop_forces(self, forces: Float[np.ndarray, " c"]) -> Float[np.ndarray, " l"]:
        """The part of stacked forces that keeps loops and couplings closed, row by row (l,).

        Rows as `Closures.names`. Where rows depend on each other it is the smallest of the sets
        of forces that do the same.
        """
        if self.closures is None:
            return np.zeros(0)
        return np.asarray(self.closures.basis @ forces[len(self.row_names) :])

    def joint_wrenches(self, forces: Float[np.ndarray, " m"]) -> dict[int, pin.Force]:
        """Stacked forces as spatial forces: joint of the model -> force in the joint's frame."""
        external: dict[int, pin.Force] = {}
        if self.closures is not None and len(forces) > len(self.row_names):
            external = self.closures.forces(self.loop_forces(forces))
        wrenches = self.unstack(forces)
        for k, (joint, placement) in enumerate(self._layout.attachments):
            wrench = wrenches[k]
            if self._layout.fixed_axes[k] is not None:
                wrench = np.concatenate([self._turn(k).T @ wrench[:3], np.zeros(3)])
            rigid_body.add_force(external, joint, placement.act(pin.Force(wrench)))
        return external

    def spatial_forces(self, forces: Float[np.ndarray, " c"]) -> dict[int, pin.Force]:
        """Stacked forces and the loads as spatial forces, as `joint_wrenches`."""
        found = self.joint_wrenches(forces)
        for joint, force in self.applied.forces.items() if self.applied else ():
            rigid_body.add_force(found, joint, force)
        return found

    def joint_loads(self, forces: Float[np.ndarray, " c"]) -> Float[np.ndarray, " nv"]:
        """Springs, held torques and couplings: what acts between joints (nv,) [Nm, or N]."""
        found = self.robot.joint_forces(self.q)
        count = len(self.robot.drives.couplings)
        if self.closures is not None and count:
            lam = self.loop_forces(forces)
            found += self.closures.jacobian[-count:].T @ lam[-count:]
        return found

    def balance_derivative(self, forces: Float[np.ndarray, " c"]) -> Float[np.ndarray, "nv nv"]:
        """A = d(N - J' f)/dq at fixed f in contact axes, along velocities of the model.

        In motion at fixed numbers of velocity and acceleration; see `motion_load_rate`.

        Args:
            forces: stacked forces f (c,).

        Exact along admissible motions; for surface contacts everywhere.
        """
        return self._balance_derivative(forces, None)

    def motion_load_rate(
        self, velocity_rate: Float[np.ndarray, " nv"], acceleration_rate: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, " nv"]:
        """How N changes as the numbers of velocity and acceleration do, at this configuration.

        Args:
            velocity_rate: change of v per unit of something (nv,).
            acceleration_rate: change of dv/dt (nv,).
        """
        by_velocity = rigid_body.inverse_dynamics_derivatives(self.robot, self.q, self.motion, {})
        return np.asarray(by_velocity[1] @ velocity_rate + self.mass_matrix @ acceleration_rate)

    def curvature(
        self, forces: Float[np.ndarray, " c"], gravity: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, "nv nv"]:
        """d(G - J' f)/dq without loads and springs, under a gravity of its own (3,) [m/s^2].

        The second derivative of sums of the constraints and of the CoM's coordinates.
        """
        return self._balance_derivative(forces, gravity)

    def _balance_derivative(
        self, forces: Float[np.ndarray, " c"], gravity: Float[np.ndarray, " 3"] | None
    ) -> Float[np.ndarray, "nv nv"]:
        applied = self.applied if gravity is None else None
        external = self.spatial_forces(forces) if gravity is None else self.joint_wrenches(forces)
        if self.motion is None or gravity is not None:
            derivative = rigid_body.static_torque_derivative(self.robot, self.q, external, gravity)
        else:
            derivative, _ = rigid_body.inverse_dynamics_derivatives(
                self.robot, self.q, self.motion, external
            )
        if applied is not None:
            derivative += applied.derivative
        if gravity is None:
            for joint, spring in self.robot.drives.springs.items():
                i = self.robot.velocity_index(joint)
                derivative[i, i] += spring.stiffness
        if self.closures is not None and len(forces) > len(self.row_names):
            derivative -= self.closures.turning(self.loop_forces(forces))
        # Pinocchio turns the force with its joint. A surface does not turn; a point foot does, and
        # its force stays fixed in the world: J_l' [f]x J_a is what that takes away.
        for k, rows in enumerate(self.rows):
            if self._layout.fixed_axes[k] is not None:
                own = np.concatenate([self._turn(k).T @ forces[rows], np.zeros(3)])
                derivative -= turning(self._local[k], own)
        return derivative

    def motion_derivative(self, velocity: Float[np.ndarray, " nv"]) -> Float[np.ndarray, "c nv"]:
        """D = d(J v)/dq of `constraints` at fixed v, along velocities of the model."""
        derivatives = rigid_body.velocity_derivatives(
            self.robot, self.q, velocity, self._layout.attachments
        )
        for k, axes in enumerate(self._layout.fixed_axes):
            if axes is not None:
                local = self._local[k]
                derivatives[k, :3] -= pin.skew(local[:3] @ velocity) @ local[3:]
        found = self._stacked(derivatives)
        if self.closures is None:
            return found
        own = self.closures.basis.T @ self.closures.motion_derivative(velocity)
        return np.concatenate([found, own])

    def inertia_derivative(
        self, acceleration: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "nv nv"]:
        """d(M a)/dq at fixed a (nv x nv), along velocities of the model."""
        return rigid_body.inertia_derivative(self.robot, self.q, acceleration)

    def _stacked(self, local: Float[np.ndarray, "nc 6 nv"]) -> Float[np.ndarray, "m nv"]:
        """Rows in the feet's own axes as stacked rows in contact axes."""
        for k, axes in enumerate(self._layout.fixed_axes):
            if axes is not None:
                local = local.copy()
                local[k, :3] = self._turn(k) @ local[k, :3]
        return self.stack(local)

    def _turn(self, k: int) -> Float[np.ndarray, "3 3"]:
        """Rotation from a foot's own axes to those of its point contact, fixed in the world."""
        axes = self._layout.fixed_axes[k]
        assert axes is not None
        return np.asarray(axes.T @ self._feet[k].rotation)


def check_stance(stance: object) -> None:
    """Reject what is not a stance.

    Raises:
        InvalidInputError: it is something else, such as a robot's name.
    """
    given = repr(stance) if isinstance(stance, str) else "..."
    remedy = f"Make one with copsense.load_stance({given})."
    check_type(stance, Stance, "a stance", remedy)


def check_at_rest(stance: Stance, what: str) -> None:
    """Reject a stance in motion where only one at rest makes sense.

    Args:
        stance: the stance.
        what: what needs it, such as ``"a region of the CoM"``.

    Raises:
        InvalidInputError: it moves.
    """
    if stance.motion is not None:
        raise InvalidInputError(
            f"{what} is of a robot at rest, and this stance moves. Give stance.at_rest()."
        )


def check_support(stance: Stance) -> None:
    """Reject contacts that cannot balance the base. A surface contact always can.

    Raises:
        InsufficientContactsError: a force or moment on the base is beyond them.
    """
    if any(contact.kind == "surface" for contact in stance.contacts):
        return
    nb = stance.robot.base_nv
    base = stance.jacobian[:, :nb]
    rank = np.linalg.matrix_rank(base, tol=RANK_TOLERANCE * max(1.0, np.abs(base).max()))
    if rank < nb:
        kinds = ", ".join(f"{c.name} ({c.kind})" for c in stance.contacts)
        two = [c.kind for c in stance.contacts] == ["point", "point"]
        raise InsufficientContactsError(
            f"the contacts of {stance.robot.name!r} ({kinds}) cannot balance every force and "
            f"moment on its base: they span {rank} of {nb} directions"
            + (", as two points carry no moment about the line through them" if two else "")
            + ". Use at least one surface contact, or three point contacts that are not on one "
            "line."
        )
