"""Equilibrium: the wrenches and torques that a criterion chooses, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from copsense import rigid_body
from copsense.arrays import array_property, finite_array, owned
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.load_problem import LoadProblem
from copsense.stance import Stance
from copsense.statics.kkt import Kkt
from copsense.statics.policy import BALANCE, WrenchPolicy, policy_forces, policy_name

UNLOADED = 1e-9  # share of the weight under which a normal force counts as none
PROJECT = "Project it: Z @ (Z.T @ v), Z = stance.admissible_motions."


@dataclass(frozen=True, eq=False, repr=False)
class StaticEquilibrium:
    """A stance at rest: the contact wrenches and joint torques that hold it.

    Attributes:
        stance: the stance.
        criterion: what chose the wrenches; a `Criterion` or a `WrenchPolicy`, q -> wrenches.
        forces: stacked contact forces (m,), contact axes [N, Nm].
        torques: joint torques (n,) [Nm, or N for a prismatic joint].
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
    def unloaded(self) -> tuple[str, ...]:
        """Names of the contacts without normal force."""
        return self._named(np.abs(self.wrenches[:, 2]) <= UNLOADED * self.stance.robot.weight)

    @property
    def pulling(self) -> tuple[str, ...]:
        """Names of the contacts that would have to pull: the ground cannot."""
        return self._named(self.wrenches[:, 2] < -UNLOADED * self.stance.robot.weight)

    def residual(self) -> float:
        """Largest imbalance [N, Nm], recomputed from the stance by inverse dynamics at rest."""
        stance, robot = self.stance, self.stance.robot
        needed = np.array(
            rigid_body.torques_at_rest(robot, stance.q, stance.joint_wrenches(self.forces))
        )
        needed[robot.base_nv :] -= self.torques
        return float(np.abs(needed).max())

    def derivative(
        self, directions: Float[np.ndarray, "nv p"]
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """Derivatives of forces and torques along admissible motions, exact.

        Args:
            directions: velocities V with J V = 0, as columns.

        Returns:
            d forces (m, p) and d torques (n, p).

        Raises:
            InvalidInputError: a direction moves a contact.
            UndeterminedWrenchError: the rank of the contacts changes at this very posture.
        """
        if not isinstance(self.criterion, Criterion):
            raise InvalidInputError(
                "a policy has no analytic derivative. Use cop_sensitivity, which differentiates it "
                "numerically."
            )
        if directions is not self.stance.admissible_motions:
            nv, columns = self.stance.robot.model.nv, "columns with J V = 0"
            directions = finite_array(directions, "the directions", (nv, None), columns)
            if not is_admissible(self.stance, directions):
                raise InvalidInputError(f"a direction moves a contact. {PROJECT}")
        system = self._system or Kkt(self.stance, self.criterion)
        return system.derivative(self, directions)

    def _named(self, those: Bool[np.ndarray, " nc"]) -> tuple[str, ...]:
        names = self.stance.contact_names
        return tuple(names[k] for k in np.flatnonzero(those)) if those.any() else ()


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
    if not problem.imbalance(found[0]) <= BALANCE * system.stance.robot.weight:
        raise InvalidInputError(
            f"criterion {criterion.name!r} cannot be solved to working accuracy at this stance: "
            "its weights are too large, too small or too far apart. Bring them nearer to one."
        )
    return found


def is_admissible(stance: Stance, directions: np.ndarray) -> bool:
    """Whether velocities (nv,) or (nv, p) leave the contacts at rest, within 1e-6."""
    moved = np.abs(stance.jacobian @ directions).max(initial=0.0)
    return bool(moved <= 1e-6 * max(1.0, float(np.abs(directions).max(initial=0.0))))
