"""Kkt: the one system of equations that gives wrenches, torques and every derivative.

With nu the multiplier of the statics, nu_j = W_tau tau:

    [ P   J' ] [nu]   [ G        ]        P = blkdiag(0, W_tau^-1)
    [ J  -W_f ] [ f] = [ -W_f f_ref ]     (rows of joints without a torque cost are dropped)

and as the stance changes the same matrix with right-hand side [d(G - J'f) - dP nu; -d(J nu)], the
first at fixed f, the others at fixed nu (`StanceChange`); along an admissible V it is
[A V - dP nu; -D V].
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from copsense.changes import StanceChange
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.freedom import missing_joints
from copsense.load_problem import LoadProblem
from copsense.quadratic import Quadratic
from copsense.stance import Stance
from copsense.statics.symmetric import SymmetricSystem
from copsense.unheld import moved_joints

if TYPE_CHECKING:
    from copsense.statics.equilibrium import StaticEquilibrium

_NULL = 1e-10  # singular values, relative, that count as lost
_ROUNDING = 1e-12  # share of a row's largest entry


class Kkt:
    """The KKT matrix of a stance and a criterion, factorised."""

    def __init__(self, stance: Stance, criterion: Criterion) -> None:
        """Lay the matrix out and factorise it."""
        self.stance = stance
        self.problem: LoadProblem = LoadProblem.of(stance)
        self.quadratic: Quadratic = criterion.at(stance)
        self.nb: int = stance.robot.unactuated_nv
        quadratic = self.quadratic
        # Columns in the order of `Robot.by_drive`.
        J: Float[np.ndarray, "m nv"] = stance.robot.by_drive(stance.constraints.T).T
        self.on: Bool[np.ndarray, " nv"] = np.concatenate(
            [np.ones(self.nb, bool), quadratic.active]
        )
        self.size: int = int(self.on.sum())
        size = self.size
        on = J if size == J.shape[1] else J[:, self.on]
        if stance.closures is not None and size < J.shape[1]:
            # A loop between two limbs with motors has rounding on the base, which scaling would
            # take for a lever: what no row in K feels is nothing.
            felt = np.abs(on).max(axis=1) > _ROUNDING * np.abs(J).max(axis=1)
            on = on * felt[:, None]
        K = np.zeros((size + len(J), size + len(J)))
        if size > self.nb:
            K[self.nb : size, self.nb : size] = quadratic.compliance(self.problem)
        K[size:, :size] = on
        K[:size, size:] = K[size:, :size].T
        K[size:, size:] = -quadratic.wrench
        self.system: SymmetricSystem = SymmetricSystem(K)
        self.free: Float[np.ndarray, "m z"] = np.zeros((len(J), 0))
        self._unfelt = self.free
        if self.system.singular:
            # Forces that no cost sees, F = null([J_on'; W_f]), stay free. The multipliers may be
            # free too (a massless foot), which changes neither forces nor torques.
            _, s, vt = np.linalg.svd(np.vstack([on.T, quadratic.wrench]))
            self.free = vt[int(np.sum(s > _NULL * s[0])) :].T
            # Forces of loops alone may be free: contacts and motors do not feel them.
            if np.abs(self.free[: len(stance.row_names)]).max(initial=0.0) < _NULL:
                self._unfelt, self.free = self.free, self.free[:, :0]
            self.system.use_pseudo_inverse()
        self.tie: TieBreak | None = None
        if self.free.shape[1]:
            if criterion.tie_break is None:
                raise UndeterminedWrenchError(*_undetermined(stance, criterion, self.free))
            self.tie = TieBreak(self, criterion)

    def share(
        self, problem: LoadProblem
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"], Float[np.ndarray, " nv"]]:
        """Forces, torques and multipliers nu of a load.

        Args:
            problem: the stance's own, or one with another base wrench or torque offset.
        """
        load = np.concatenate([problem.base_wrench, problem.torque_offset])
        x = self.system.solve(np.concatenate([load[self.on], -self.quadratic.pull]))
        if self.tie:
            x[self.size :] += self.tie.move(problem, x[self.size :])
        nu = np.zeros(len(self.on))
        nu[self.on], forces = x[: self.size], x[self.size :]
        if self._unfelt.shape[1]:  # the smallest, whatever the scaling of the system
            forces = forces - self._unfelt @ (self._unfelt.T @ forces)
        return forces, problem.torques(forces), self.stance.robot.from_drives(nu)

    def derivative(
        self,
        at: StaticEquilibrium,
        change: StanceChange,
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """Derivatives of forces and torques as the stance changes, see its callers."""
        stance = self.stance
        load = change.balance(stance, at.forces)
        right = np.empty((self.size + len(self.free), load.shape[1]))
        right[: self.size] = load[self.on]
        if self.quadratic.inertia:
            nu = stance.robot.in_drives(at.multipliers)
            right[self.nb : self.size] -= self.quadratic.compliance_change(
                stance, self.problem, nu, change
            )
        right[self.size :] = -change.constraint(stance, at.multipliers)
        dx = self.system.solve(right)
        if self.system.singular:
            left = np.abs(self.system.matrix @ dx - right).max(initial=0.0)
            if left > 1e-7 * max(1.0, np.abs(right).max(initial=0.0)):
                loose = moved_joints(stance.robot, stance.unheld_motions)
                lacking = "; ".join(missing_joints(stance))
                raise UndeterminedWrenchError(
                    "the contacts lose rank at this very posture: the wrenches have no derivative "
                    "here. "
                    + (
                        f"No motor holds {', '.join(loose)}: fix them by --lock, or by a coupling "
                        "of ratio 0 (--couple JOINT=0*OTHER+POSITION). "
                        if loose
                        else ""
                    )
                    + (f"{lacking[0].upper()}{lacking[1:]}. " if lacking else "")
                    + "Move the posture off the singularity: bend a leg that is straight, and put "
                    "legs that stand exactly parallel a little apart or together (width=, --width)."
                )
        df = dx[self.size :]
        if self.tie:
            df = df + self.tie.move_derivative(at, change, load, df)
        return df, load[self.nb :] - self.problem.joint_map.dot(df)

    def weight_derivative(
        self,
        forces: Float[np.ndarray, " m"],
        multipliers: Float[np.ndarray, " nv"],
        change: Quadratic,
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " n"]]:
        """How forces and torques change as the weights do, at a held posture and load.

        The same matrix with right-hand side [-dP nu; dW_f f - d(W_f f_ref)], dP = -P dW_tau P.

        Args:
            forces: of `share` (m,).
            multipliers: of `share` (nv,).
            change: dW_tau, dW_f and d(W_f f_ref); the joints that cost anything stay the same.

        Raises:
            InvalidInputError: the weights leave forces undetermined, or follow the inertia.
        """
        if self.tie is not None or self.quadratic.inertia or change.inertia:
            raise InvalidInputError(
                "derivatives by weights are of criteria that determine the wrenches by themselves, "
                "with constant weights."
            )
        nu = self.stance.robot.in_drives(multipliers)[self.nb :][self.quadratic.active]
        P, on = self.quadratic.compliance(self.problem), self.quadratic.active
        right = np.zeros(self.size + len(forces))
        right[self.nb : self.size] = P @ (change.torque[np.ix_(on, on)] @ (P @ nu))
        right[self.size :] = change.wrench @ forces - change.pull
        df = self.system.solve(right)[self.size :]
        return df, -self.problem.joint_map.dot(df)


class TieBreak:
    """A second criterion that decides the forces F z which the first leaves free.

    Its cost over the forces has gradient H f - g (`Quadratic.over_forces`); the choice is
    F' (H f - g) = 0.
    """

    def __init__(self, first: Kkt, criterion: Criterion) -> None:
        """Take the cost of the second criterion over the forces left free."""
        assert criterion.tie_break is not None
        second = criterion.tie_break.at(first.stance)
        if second.inertia:
            raise InvalidInputError(
                f"criterion {criterion.tie_break.name!r} follows the inertia and cannot be a tie-"
                "break. Use minimum_wrench, minimum_torque or constant weights."
            )
        self.first = first
        self.second: Quadratic = second
        self.F: Float[np.ndarray, "m z"] = first.free
        H, _ = second.over_forces(first.problem)
        self.curvature: Float[np.ndarray, "z z"] = self.F.T @ H @ self.F
        lowest = float(np.linalg.eigvalsh(self.curvature)[0])
        if lowest <= _NULL * float(np.abs(H).max()):
            raise UndeterminedWrenchError(
                f"the tie-break {criterion.tie_break.name!r} leaves wrenches undetermined too. "
                "Use minimum_wrench(characteristic_length), which never does."
            )

    def move(self, problem: LoadProblem, forces: np.ndarray) -> np.ndarray:
        """The free forces F z to add."""
        H, g = self.second.over_forces(problem)
        return self.F @ np.linalg.solve(self.curvature, self.F.T @ (g - H @ forces))

    def move_derivative(
        self, at: StaticEquilibrium, change: StanceChange, load: np.ndarray, df: np.ndarray
    ) -> np.ndarray:
        """The part F dz of the forces' derivative; `load` is d(N - J' f).

        The gradient lies in the range of the first KKT matrix K, K (w, y) = -(0, H f - g); that
        stays so as the stance changes, and F' K = 0 removes the unknown derivative of (w, y).
        """
        first, stance, nb = self.first, self.first.stance, self.first.nb
        H, g = self.second.over_forces(first.problem)
        W = self.second.torque_weight(first.problem)
        x = first.system.solve(np.concatenate([np.zeros(first.size), g - H @ at.forces]))
        w = np.zeros(len(first.on))
        w[first.on] = x[: first.size]
        w[nb:] -= W @ at.torques
        moved = (
            change.constraint(stance, stance.robot.from_drives(w))
            - first.problem.joint_map.T @ W @ load[nb:]
            + H @ df
        )
        return -self.F @ np.linalg.solve(self.curvature, self.F.T @ moved)


def _undetermined(
    stance: Stance, criterion: Criterion, free: np.ndarray
) -> tuple[str, tuple[str, ...]]:
    share = np.linalg.norm(free[: len(stance.row_names)], axis=1)  # those of loops follow
    rows = tuple(n for n, s in zip(stance.row_names, share, strict=True) if s > 1e-6)
    return (
        f"criterion {criterion.name!r} leaves {free.shape[1]} direction(s) of the wrenches "
        f"undetermined at this stance, in {', '.join(rows)} (contact Jacobian: rank {stance.rank} "
        f"of {len(stance.constraints)} rows). Give it a tie_break such as minimum_wrench(1.0), "
        "take that alone (--criterion minimum-wrench), or bend a straight leg.",
        rows,
    )
