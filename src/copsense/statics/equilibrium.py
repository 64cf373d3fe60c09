"""Equilibrium: the wrenches and torques that a criterion chooses, and their derivatives."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from copsense import rigid_body
from copsense.arrays import array_property, finite_array, owned
from copsense.changes import StanceChange
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UnbalancedError
from copsense.load_problem import LoadProblem
from copsense.stance import Stance
from copsense.statics.kkt import Kkt
from copsense.statics.policy import BALANCE, WrenchPolicy, policy_forces, policy_name

UNLOADED = 1e-9  # share of the weight under which a normal force counts as none
PROJECT = "Project it: Z @ (Z.T @ v), Z = stance.admissible_motions."

_FARTHEST = 100.0  # weights: what takes more force than that is held by nothing


@dataclass(frozen=True, eq=False, repr=False)
class StaticEquilibrium:
    """A stance at rest: the contact wrenches and joint torques that hold it.

    Attributes:
        stance: the stance.
        criterion: what chose the wrenches; a `Criterion` or a `WrenchPolicy`, q -> wrenches.
        forces: stacked contact forces, contact axes [N, Nm], then those that keep the robot's own
            loops and couplings closed (c,); see `wrenches` and `loop_forces`.
        torques: motor torques (n,) [Nm, or N for a prismatic joint], of every joint that has a
            motor; see `joint_torques`.
        multipliers: nu (nv,), the sensitivity of the cost to the gravity terms; zero for a policy.
    """

    stance: Stance
    criterion: Criterion | WrenchPolicy
    forces: Float[np.ndarray, " m"]
    torques: Float[np.ndarray, " n"]
    multipliers: Float[np.ndarray, " nv"]
    # Factorised once, for the values and their derivatives.
    _system: Kkt | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Own the arrays."""
        for name in ("forces", "torques", "multipliers"):
            object.__setattr__(self, name, owned(getattr(self, name)))

    def __repr__(self) -> str:
        """Criterion, robot and each contact's share of the weight."""
        criterion, robot = self.criterion, self.stance.robot
        name = criterion.name if isinstance(criterion, Criterion) else policy_name(criterion)
        shares = ", ".join(
            f"{contact} {share:.1%}"
            for contact, share in zip(
                self.stance.contact_names, self.wrenches[:, 2] / robot.weight, strict=True
            )
        )
        return (
            f"{type(self).__name__}({name} on {robot.name!r}; load {shares}; "
            f"largest torque {np.abs(self.torques).max(initial=0.0):.4g})"
        )

    @property
    def contact_forces(self) -> Float[np.ndarray, " m"]:
        """Stacked forces of the contacts alone (m,), contact axes [N, Nm]."""
        return self.forces[: len(self.stance.row_names)]

    @array_property
    def wrenches(self) -> Float[np.ndarray, "nc 6"]:
        """Wrench of the environment on the robot at each contact [N, Nm].

        Force, then moment about the contact frame's origin, in contact axes.
        """
        return self.stance.unstack(self.forces)

    @array_property
    def world_wrenches(self) -> Float[np.ndarray, "nc 6"]:
        """The same wrenches in world axes, about the same points [N, Nm]."""
        return self.stance.in_world_axes(self.wrenches)

    @property
    def loop_forces(self) -> dict[str, float]:
        """What keeps the robot's loops and couplings closed: name of the row -> force [N, Nm].

        Of a ball joint, the force on its first frame in world axes; of a weld, force and moment in
        the frame's axes. Where rows depend on each other, as in a loop that moves in a plane, it is
        the smallest of the sets of forces that do the same.
        """
        if self.stance.closures is None:
            return {}
        found = self.stance.loop_forces(self.forces).tolist()
        return dict(zip(self.stance.closures.names, found, strict=True))

    @array_property
    def joint_torques(self) -> Float[np.ndarray, " n"]:
        """Torque of the motors on each joint (n,), zero where none drives it [Nm, or N]."""
        return np.array(self.stance.robot.joint_torques(self.torques))

    @property
    def unloaded(self) -> tuple[str, ...]:
        """Names of the contacts without normal force."""
        least = UNLOADED * self.stance.robot.weight
        return tuple(name for name, load in self._loads if abs(load) <= least)

    @property
    def pulling(self) -> tuple[str, ...]:
        """Names of the contacts that would have to pull: the ground cannot."""
        least = UNLOADED * self.stance.robot.weight
        return tuple(name for name, load in self._loads if load < -least)

    def residual(self) -> float:
        """Largest imbalance [N, Nm], recomputed from the stance by inverse dynamics."""
        stance, robot = self.stance, self.stance.robot
        needed = np.array(
            rigid_body.inverse_dynamics(
                robot, stance.q, stance.motion, stance.spatial_forces(self.forces)
            )
        )
        needed -= stance.joint_loads(self.forces)
        needed[robot.base_nv :] -= self.joint_torques
        return float(np.abs(needed).max())

    def derivative(
        self,
        directions: Float[np.ndarray, "nv p"],
        load_rate: Float[np.ndarray, "nv p"] | None = None,
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """Derivatives of forces and torques along admissible motions, exact.

        Args:
            directions: velocities V with J V = 0, as columns.
            load_rate: how N (`Stance.balance`) changes besides as the posture does [N, Nm], as
                the inertia of a motion does; None for nothing. With zero directions the answer is
                to this alone.

        Returns:
            d forces (m, p) and d torques (n, p).

        Raises:
            InvalidInputError: a direction moves a contact.
            UndeterminedWrenchError: the rank of the contacts changes at this very posture.
        """
        if directions is not self.stance.admissible_motions:
            nv, columns = self.stance.robot.model.nv, "columns with J V = 0"
            directions = finite_array(directions, "the directions", (nv, None), columns)
            if not is_admissible(self.stance, directions):
                raise InvalidInputError(f"a direction moves a contact. {PROJECT}")
        return self.response(StanceChange(directions, load_rate))

    def response(
        self, change: StanceChange, rows: Float[np.ndarray, "p r m"] | None = None
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """How forces and torques change as the stance does, exact to first order.

        Args:
            change: of posture, load, contact frames and masses, one way per column. Directions
                that move a contact are those of ground that moves.
            rows: how the rows A of the limits change, A f <= b; none here, see
                `ConstrainedEquilibrium`.

        Returns:
            d forces (m, p) and d torques (n, p); forces in contact axes, about the contact frames
            where they come to lie.

        Raises:
            InvalidInputError: the equilibrium is that of a policy.
            UndeterminedWrenchError: the rank of the contacts changes at this very posture.
        """
        if not isinstance(self.criterion, Criterion):
            raise InvalidInputError(
                "a policy has no analytic derivative. Use cop_sensitivity, which differentiates it "
                "numerically."
            )
        system = self._system or Kkt(self.stance, self.criterion)
        return system.derivative(self, change)

    @property
    def _loads(self) -> Iterable[tuple[str, float]]:
        """Name and normal force of each contact."""
        return zip(self.stance.contact_names, self.wrenches[:, 2].tolist(), strict=True)


def solve_static(stance: Stance, criterion: Criterion | WrenchPolicy) -> StaticEquilibrium:
    """The static equilibrium that a criterion chooses ([Romano2016] Eq. (7), (9)).

    Args:
        stance: robot, configuration and contacts.
        criterion: a `Criterion`, or a callable q -> wrenches (nc, 6) in contact axes, such as a
            controller's own.

    Raises:
        UndeterminedWrenchError: several wrenches are equally good; the message names them.
        InvalidInputError: weights that do not fit, or a policy whose wrenches do not balance
            gravity.
    """
    if not isinstance(criterion, Criterion):
        forces = policy_forces(stance, criterion)
        torques = LoadProblem.of(stance).torques(forces)
        return StaticEquilibrium(stance, criterion, forces, torques, np.zeros_like(stance.gravity))
    system = Kkt(stance, criterion)
    forces, torques, nu = _balanced(system, criterion, system.problem)
    return StaticEquilibrium(stance, criterion, forces, torques, nu, _system=system)


def share_load(
    stance: Stance, criterion: Criterion, problem: LoadProblem
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"]]:
    """The forces and torques that a criterion chooses for another load than the stance's own.

    Args:
        stance: robot, configuration and contacts.
        criterion: what shares the load.
        problem: ``LoadProblem.of(stance)`` with another base wrench or torque offset, such as
            those of the weight with the centre of mass elsewhere.

    Returns:
        Stacked forces (m,) and torques (n,).

    Raises:
        UndeterminedWrenchError: several wrenches are equally good; the message names them.
        InvalidInputError: weights that do not fit.
    """
    forces, torques, _ = _balanced(Kkt(stance, criterion), criterion, problem)
    return forces, torques


def _balanced(
    system: Kkt, criterion: Criterion, problem: LoadProblem
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The system's solution of a load, validated."""
    found = system.share(problem)
    require_balance(system.stance, problem)
    if not problem.imbalance(found[0]) <= BALANCE * system.stance.robot.weight:
        raise InvalidInputError(
            f"criterion {criterion.name!r} cannot be solved to working accuracy at this stance: "
            "its weights are too large, too small or too far apart. Bring them nearer to one."
        )
    return found


def require_balance(stance: Stance, problem: LoadProblem) -> None:
    """Reject a load that joints without a motor leave without an answer, whatever shares it.

    A direction that takes more than a hundred times the weight counts as held by nothing: so do
    rods and contacts that hold a joint at the end of a lever of a micrometre.

    Raises:
        UnbalancedError: nothing can hold the robot; says which joints lack how much.
    """
    robot = stance.robot
    if robot.unactuated_nv == robot.base_nv and stance.closures is None:
        return
    left, s, _ = np.linalg.svd(problem.base_map)
    wanted = left.T @ problem.base_wrench
    lost = np.ones(len(wanted), dtype=bool)
    lost[: len(s)] = np.abs(wanted[: len(s)]) > _FARTHEST * robot.weight * s
    rest = np.concatenate([left[:, lost] @ wanted[lost], np.zeros(len(problem.torque_offset))])
    missing = robot.from_drives(rest)
    if np.abs(missing).max() > BALANCE * robot.weight:
        largest = np.argsort(-np.abs(missing))[:6]
        names = robot.velocity_names
        lacking = {
            names[i]: float(missing[i]) for i in largest if abs(missing[i]) > BALANCE * robot.weight
        }
        raise UnbalancedError(robot.name, lacking)


def is_admissible(stance: Stance, directions: np.ndarray) -> bool:
    """Whether velocities (nv,) or (nv, p) leave the contacts at rest, within 1e-6."""
    moved = np.abs(stance.constraints @ directions).max(initial=0.0)
    return bool(moved <= 1e-6 * max(1.0, float(np.abs(directions).max(initial=0.0))))
