"""Equilibrium: the wrenches and torques that a criterion chooses, and their derivatives.

One symmetric KKT system gives both. With nu the multiplier of the statics, nu_j = W_tau tau:

    [ P   J' ] [nu]   [ G        ]        P = blkdiag(0, W_tau^-1)
    [ J  -W_f ] [ f] = [ -W_f f_ref ]     (rows of joints without a torque cost are dropped)

and along an admissible V the same matrix with right-hand side [A V - dP nu; -D V], where
A = d(G - J'f)/dq at fixed f and D = d(J nu)/dq at fixed nu.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
import scipy.linalg
from jaxtyping import Float

from copsense.arrays import finite_array
from copsense.criterion import Criterion, Quadratic
from copsense.errors import CopsenseError, InvalidInputError, UndeterminedWrenchError
from copsense.stance import Stance

# Reciprocal condition number under which the KKT matrix is examined for lost directions.
_RCOND = 1e-13
_NULL = 1e-10  # singular values, relative, that count as lost
UNLOADED = 1e-9  # share of the weight under which a normal force counts as none
_BALANCE = 1e-6  # share of the weight by which wrenches may miss the balance

PROJECT = "Project it: Z @ (Z.T @ v), Z = stance.admissible_motions."

WrenchLaw = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class StaticEquilibrium:
    """A stance at rest: the contact wrenches and joint torques that hold it.

    Attributes:
        stance: the stance.
        criterion: what chose the wrenches; a `Criterion` or a user's law q -> wrenches.
        forces: stacked contact forces (m,), contact axes [N, Nm].
        torques: joint torques (n,) [Nm, or N for a prismatic joint].
        multipliers: nu (nv,), the sensitivity of the cost to the gravity terms; zero for a law.
    """

    stance: Stance
    criterion: Criterion | WrenchLaw
    forces: Float[np.ndarray, " m"]
    torques: Float[np.ndarray, " n"]
    multipliers: Float[np.ndarray, " nv"]

    @property
    def wrenches(self) -> Float[np.ndarray, "nc 6"]:
        """Wrench of the environment on the robot at each contact [N, Nm].

        Force, then moment about the contact frame's origin, in contact axes.
        """
        return self.stance.unstack(self.forces)

    @property
    def world_wrenches(self) -> Float[np.ndarray, "nc 6"]:
        """The same wrenches in world axes, about the same points [N, Nm]."""
        turned = [
            np.concatenate([place.rotation @ w[:3], place.rotation @ w[3:]])
            for place, w in zip(self.stance.placements, self.wrenches, strict=True)
        ]
        return np.array(turned)

    @property
    def unloaded(self) -> tuple[str, ...]:
        """Names of the contacts without normal force."""
        return self._where(lambda fz: abs(fz) <= UNLOADED * self.stance.robot.weight)

    @property
    def pulling(self) -> tuple[str, ...]:
        """Names of the contacts that would have to pull: the ground cannot."""
        return self._where(lambda fz: fz < -UNLOADED * self.stance.robot.weight)

    def residual(self) -> float:
        """Largest imbalance [N, Nm], recomputed from the stance by inverse dynamics at rest."""
        robot = self.stance.robot
        zero = np.zeros(robot.model.nv)
        needed = pin.rnea(
            robot.model,
            robot.model.createData(),
            self.stance.q,
            zero,
            zero,
            self.stance.joint_wrenches(self.forces),
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
                "a law has no analytic derivative. Use cop_sensitivity, which differentiates it "
                "numerically."
            )
        nv = self.stance.robot.model.nv
        directions = finite_array(directions, "the directions", (nv, None), "columns with J V = 0")
        if not is_admissible(self.stance, directions):
            raise InvalidInputError(f"a direction moves a contact. {PROJECT}")
        return self._system.derivative(self, directions)

    @cached_property
    def _system(self) -> _Kkt:
        assert isinstance(self.criterion, Criterion)
        return _Kkt(self.stance, self.criterion)

    def _where(self, test: Callable[[float], bool]) -> tuple[str, ...]:
        normal = self.wrenches[:, 2]
        names = self.stance.contact_names
        return tuple(name for name, fz in zip(names, normal, strict=True) if test(fz))


def solve_static(stance: Stance, criterion: Criterion | WrenchLaw) -> StaticEquilibrium:
    """The static equilibrium that a criterion chooses ([Romano2016] Eq. (7), (9)).

    Args:
        stance: robot, configuration and contacts.
        criterion: a `Criterion`, or a callable q -> wrenches (nc, 6) in contact axes, such as a
            controller's own.

    Raises:
        UndeterminedWrenchError: several wrenches are equally good; the message names them.
        InvalidInputError: weights that do not fit, or a law whose wrenches do not balance gravity.
    """
    if not isinstance(criterion, Criterion):
        forces = _law_forces(stance, criterion)
        torques = (stance.gravity - stance.jacobian.T @ forces)[stance.robot.base_nv :]
        return StaticEquilibrium(stance, criterion, forces, torques, np.zeros_like(stance.gravity))
    system = _Kkt(stance, criterion)
    equilibrium = StaticEquilibrium(stance, criterion, *system.solution)
    if not _imbalance(stance, equilibrium.forces) <= _BALANCE * stance.robot.weight:
        raise InvalidInputError(
            f"criterion {criterion.name!r} cannot be solved to working accuracy at this stance: "
            "its weights are too large, too small or too far apart. Bring them nearer to one."
        )
    # Kept for the derivatives, which use the same factorisation.
    equilibrium.__dict__["_system"] = system
    return equilibrium


class _Kkt:
    """The KKT matrix of a stance and a criterion, factorised."""

    def __init__(self, stance: Stance, criterion: Criterion) -> None:
        self.stance, self.nb = stance, stance.robot.base_nv
        self.quadratic = criterion.at(stance)
        J, G = stance.jacobian, stance.gravity
        on = np.concatenate([np.ones(self.nb, bool), self.quadratic.active()])
        self.on, self.size = on, int(on.sum())
        P = np.zeros((self.size, self.size))
        P[self.nb :, self.nb :] = self.quadratic.compliance(stance)
        self.matrix = np.block([[P, J[:, on].T], [J[:, on], -self.quadratic.wrench]])
        self.free = np.zeros((len(J), 0))
        self._factorise()
        self.tie = None
        if self.free.shape[1]:
            if criterion.tie_break is None:
                raise UndeterminedWrenchError(*_undetermined(stance, criterion, self.free))
            self.tie = _TieBreak(self, criterion)
        x = self.solve(np.concatenate([G[on], -self.quadratic.pull]))
        if self.tie:
            x[self.size :] += self.tie.move(x[self.size :])
        self.solution = self._unpack(x)

    def _factorise(self) -> None:
        # Weights of any unit (1/limit^2, say) are brought to a common size first: s K s.
        self.scale = np.ones(len(self.matrix))
        for _ in range(3):
            rows = np.abs(self.scaled).max(axis=1)
            self.scale /= np.sqrt(np.where(rows > 0, rows, 1.0))
        scaled = self.scaled
        lu, pivots, info = scipy.linalg.lapack.dgetrf(scaled)
        norm = np.abs(scaled).sum(axis=0).max()
        if info == 0 and scipy.linalg.lapack.dgecon(lu, norm)[0] > _RCOND:
            self.lu, self.pinv = (lu, pivots), None
            return
        # Singular: forces that no cost sees, F = null([J_on'; W_f]), stay free. The multipliers
        # may be free too (a massless foot), which changes neither forces nor torques.
        seen = np.vstack([self.stance.jacobian[:, self.on].T, self.quadratic.wrench])
        _, s, vt = np.linalg.svd(seen)
        rank = int(np.sum(s > _NULL * s[0]))
        self.free = vt[rank:].T
        self.pinv = np.linalg.pinv(scaled, rcond=_NULL, hermitian=True)

    @property
    def scaled(self) -> np.ndarray:
        """The matrix with rows and columns scaled alike."""
        return self.scale[:, None] * self.matrix * self.scale

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve, with one step of refinement; a solution of a singular consistent system."""
        x = self._once(right)
        return x + self._once(right - self.matrix @ x)

    def _once(self, right: np.ndarray) -> np.ndarray:
        scaled = (self.scale * right.T).T
        if self.pinv is not None:
            y = self.pinv @ scaled
        else:
            y = scipy.linalg.lu_solve(self.lu, scaled, check_finite=False)
        return np.asarray((self.scale * y.T).T)

    def _unpack(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        nu = np.zeros(len(self.on))
        nu[self.on] = x[: self.size]
        forces = x[self.size :]
        torques = (self.stance.gravity - self.stance.jacobian.T @ forces)[self.nb :]
        return forces, torques, nu

    def derivative(
        self, at: StaticEquilibrium, V: Float[np.ndarray, "nv p"]
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        stance, on = self.stance, self.on
        AV = stance.balance_derivative(at.forces) @ V
        top = AV[on]
        if self.quadratic.inertia:
            top[self.nb :] -= self.quadratic.compliance_derivative(stance, at.multipliers) @ V
        right = np.vstack([top, -stance.motion_derivative(at.multipliers) @ V])
        dx = self.solve(right)
        if self.pinv is not None:
            left = np.abs(self.matrix @ dx - right).max()
            if left > 1e-7 * max(1.0, np.abs(right).max()):
                raise UndeterminedWrenchError(
                    "the contacts lose rank at this very posture (a straight leg, say): the "
                    "wrenches have no derivative here. Move the posture off the singularity."
                )
        df = dx[self.size :]
        if self.tie:
            df = df + self.tie.move_derivative(at, V, AV, df)
        return df, (AV - stance.jacobian.T @ df)[self.nb :]


class _TieBreak:
    """A second criterion that decides the forces F z which the first leaves free.

    Its cost over the forces, tau = G_j - J_j' f, has gradient H f - g with
    H = J_j W J_j' + W_f, g = J_j W G_j + W_f f_ref; the choice is F' (H f - g) = 0.
    """

    def __init__(self, first: _Kkt, criterion: Criterion) -> None:
        assert criterion.tie_break is not None
        second: Quadratic = criterion.tie_break.at(first.stance)
        if second.inertia:
            raise InvalidInputError(
                f"criterion {criterion.tie_break.name!r} follows the inertia and cannot be a tie-"
                "break. Use minimum_wrench, minimum_torque or constant weights."
            )
        self.first, self.second = first, second
        self.Jj = first.stance.jacobian[:, first.nb :]
        self.H = self.Jj @ second.torque @ self.Jj.T + second.wrench
        self.g = self.Jj @ second.torque @ first.stance.gravity[first.nb :] + second.pull
        self.F = first.free
        self.curvature = self.F.T @ self.H @ self.F
        lowest = float(np.linalg.eigvalsh(self.curvature)[0])
        if lowest <= _NULL * float(np.abs(self.H).max()):
            raise UndeterminedWrenchError(
                f"the tie-break {criterion.tie_break.name!r} leaves wrenches undetermined too. "
                "Use minimum_wrench(characteristic_length), which never does."
            )

    def move(self, forces: np.ndarray) -> np.ndarray:
        """The free forces F z to add."""
        return self.F @ np.linalg.solve(self.curvature, self.F.T @ (self.g - self.H @ forces))

    def move_derivative(
        self, at: StaticEquilibrium, V: np.ndarray, AV: np.ndarray, df: np.ndarray
    ) -> np.ndarray:
        """The part F dz of the forces' derivative.

        The gradient lies in the range of the first KKT matrix K, K (w, y) = -(0, H f - g); that
        stays so along V, and F' K = 0 removes the unknown derivative of (w, y).
        """
        first, stance, nb = self.first, self.first.stance, self.first.nb
        gradient = self.H @ at.forces - self.g
        x = first.solve(np.concatenate([np.zeros(first.size), -gradient]))
        w = np.zeros(len(first.on))
        w[first.on] = x[: first.size]
        w[nb:] -= self.second.torque @ at.torques
        change = (
            stance.motion_derivative(w) @ V - self.Jj @ self.second.torque @ AV[nb:] + self.H @ df
        )
        return -self.F @ np.linalg.solve(self.curvature, self.F.T @ change)


def _law_forces(stance: Stance, law: WrenchLaw) -> np.ndarray:
    what, nc, m = f"the law {law_name(law)!r}", len(stance.contacts), len(stance.component_index)
    try:
        returned = law(stance.q)
    except CopsenseError:
        raise
    except Exception as error:
        raise InvalidInputError(
            f"{what} raised {type(error).__name__}: {error}. Mend it at this posture, or keep the "
            "posture out."
        ) from error
    stacked = isinstance(returned, np.ndarray) and returned.ndim == 1
    wrenches = finite_array(
        returned,
        f"what {what} returned",
        (m,) if stacked else (nc, 6),
        "stacked forces" if stacked else "wrenches in contact axes, force first",
    )
    if not stacked:
        wrenches = stance.stack(wrenches)
    imbalance = _imbalance(stance, wrenches)
    if imbalance > _BALANCE * stance.robot.weight:
        raise InvalidInputError(
            f"the wrenches of {what} do not balance gravity: {imbalance:.3g} N or Nm remain on "
            "the base. Give what the ground does to the robot, contact axes, force first."
        )
    return wrenches


def is_admissible(stance: Stance, directions: np.ndarray) -> bool:
    """Whether velocities (nv,) or (nv, p) leave the contacts at rest, within 1e-6."""
    moved = np.abs(stance.jacobian @ directions).max(initial=0.0)
    return bool(moved <= 1e-6 * max(1.0, float(np.abs(directions).max(initial=0.0))))


def law_name(law: object) -> str:
    """How a law is called in results: the name of its function, or of its class.

    Raises:
        InvalidInputError: it is no law, for it cannot be called.
    """
    if not callable(law):
        raise InvalidInputError(
            f"{law!r} is neither a Criterion nor a callable q -> wrenches. Give one of them, such "
            "as criterion_named('minimum-torque')."
        )
    return str(getattr(law, "__name__", type(law).__name__))


def _imbalance(stance: Stance, forces: np.ndarray) -> float:
    """Largest force or moment on the base that contact forces leave unbalanced [N, Nm]."""
    nb = stance.robot.base_nv
    return float(np.abs(stance.jacobian[:, :nb].T @ forces - stance.gravity[:nb]).max())


def _undetermined(
    stance: Stance, criterion: Criterion, free: np.ndarray
) -> tuple[str, tuple[str, ...]]:
    share = np.linalg.norm(free, axis=1)
    rows = tuple(n for n, s in zip(stance.row_names, share, strict=True) if s > 1e-6)
    return (
        f"criterion {criterion.name!r} leaves {free.shape[1]} direction(s) of the wrenches "
        f"undetermined at this stance, in {', '.join(rows)} (contact Jacobian: rank {stance.rank} "
        f"of {len(stance.component_index)} rows). Give it a tie_break such as minimum_wrench(1.0), "
        "or bend a straight leg.",
        rows,
    )


def wrench_law(torques: Callable[[np.ndarray], np.ndarray], stance: Stance) -> WrenchLaw:
    """The wrenches that a user's static torques cause, as a law ([Romano2016] Eq. (9)).

    Args:
        torques: callable q -> joint torques (n,) that hold the robot at rest.
        stance: gives robot and contacts.

    Raises:
        UndeterminedWrenchError: no torque can feel some wrenches (redundant contacts).
    """

    def law(q: np.ndarray) -> np.ndarray:
        here = stance.at(q)
        if here.rank < len(here.component_index):
            raise UndeterminedWrenchError(
                "torques do not determine the wrenches here: no torque can feel "
                f"{', '.join(here.redundant_directions)}. Give a law of wrenches instead.",
                here.redundant_directions,
            )
        balance = here.gravity.copy()
        balance[here.robot.base_nv :] -= finite_array(
            torques(q), "the torques returned", (len(here.robot.torque_names),), "one per joint"
        )
        # J' f = G - B tau: consistent where the torques hold the robot, so any inverse serves.
        return here.unstack(np.linalg.lstsq(here.jacobian.T, balance, rcond=None)[0])

    return law
