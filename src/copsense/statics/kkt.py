"""Kkt: the one system of equations that gives wrenches, torques and every derivative.

With nu the multiplier of the statics, nu_j = W_tau tau:

    [ P   J' ] [nu]   [ G        ]        P = blkdiag(0, W_tau^-1)
    [ J  -W_f ] [ f] = [ -W_f f_ref ]     (rows of joints without a torque cost are dropped)

and along an admissible V the same matrix with right-hand side [A V - dP nu; -D V], where
A = d(G - J'f)/dq at fixed f and D = d(J nu)/dq at fixed nu.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg
from jaxtyping import Float

from copsense.criterion import Criterion, Quadratic
from copsense.errors import InvalidInputError, UndeterminedWrenchError
from copsense.stance import Stance

if TYPE_CHECKING:
    from copsense.statics.equilibrium import StaticEquilibrium

# Reciprocal condition number under which the KKT matrix is examined for lost directions.
_RCOND = 1e-13
_NULL = 1e-10  # singular values, relative, that count as lost


class Kkt:
    """The KKT matrix of a stance and a criterion, factorised."""

    def __init__(self, stance: Stance, criterion: Criterion) -> None:
        """Lay the matrix out, factorise it and solve for the wrenches."""
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
            self.tie = TieBreak(self, criterion)
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
        """Derivatives of forces and torques along admissible velocities V."""
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


class TieBreak:
    """A second criterion that decides the forces F z which the first leaves free.

    Its cost over the forces, tau = G_j - J_j' f, has gradient H f - g with
    H = J_j W J_j' + W_f, g = J_j W G_j + W_f f_ref; the choice is F' (H f - g) = 0.
    """

    def __init__(self, first: Kkt, criterion: Criterion) -> None:
        """Take the cost of the second criterion over the forces left free."""
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
