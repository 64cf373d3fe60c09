"""Sharing: the contact forces that cause a wanted momentum rate, chosen by a criterion.

The step of [Romano2016] Eq. (19) that tells controllers apart. It is a function
`LoadProblem -> forces`, so that a solver with limits can take the place of `ShareByCriterion`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.criterion import Criterion
from copsense.errors import UndeterminedWrenchError
from copsense.stance import Stance

_NULL = 1e-9  # curvature, relative to the cost's size, under which a direction is free


@dataclass(frozen=True, eq=False)
class LoadProblem:
    """Which contact forces f are allowed, and which torques they take.

    J_b' f = base_wrench, and tau = torque_offset - J_s' f (see `balancing` for the letters).

    Attributes:
        base_map: J_b' (6, m), stacked contact forces to the wrench on the base.
        base_wrench: the wanted wrench of all contacts on the base (6,), base axes.
        joint_map: J_s' (n, m).
        torque_offset: (n,) [Nm].
        joint_inertia: M_j (n, n), for a criterion that weighs with its inverse.
    """

    base_map: Float[np.ndarray, "6 m"]
    base_wrench: Float[np.ndarray, " 6"]
    joint_map: Float[np.ndarray, "n m"]
    torque_offset: Float[np.ndarray, " n"]
    joint_inertia: Float[np.ndarray, "n n"]


ShareLoad = Callable[[LoadProblem], Float[np.ndarray, " m"]]


class ShareByCriterion:
    """The forces of least cost, without limits.

    minimise 1/2 tau' W_tau tau + 1/2 (f - f_ref)' W_f (f - f_ref) over the allowed f: with
    f = f_p + Z y, J_b' Z = 0, a system of m - 6 unknowns. Tie-breaks decide, in turn, what a
    criterion leaves free.
    """

    def __init__(self, stance: Stance, criterion: Criterion) -> None:
        """Read the weights; whether they determine the forces shows at the first problem."""
        self.criterion = criterion
        self._levels = []
        level: Criterion | None = criterion
        while level is not None:
            quadratic = level.at(stance)
            one = np.array_equal(quadratic.torque, np.eye(len(quadratic.torque)))
            self._levels.append((quadratic, one and not quadratic.inertia))
            level = level.tie_break

    def __call__(self, problem: LoadProblem) -> Float[np.ndarray, " m"]:
        """Forces of least cost (m,).

        Raises:
            UndeterminedWrenchError: the criterion and its tie-breaks leave several.
        """
        B, A = problem.base_map, problem.joint_map
        forces, Z = _allowed(B, problem.base_wrench)
        for quadratic, plain in self._levels:
            W = quadratic.torque
            if quadratic.inertia:
                W = W + quadratic.inertia * np.linalg.inv(problem.joint_inertia)
            AZ = A @ Z
            # Curvature and slope of the cost along Z.
            WAZ = AZ if plain else W @ AZ
            H = AZ.T @ WAZ + Z.T @ (quadratic.wrench @ Z)
            g = WAZ.T @ (problem.torque_offset - A @ forces)
            g += Z.T @ (quadratic.pull - quadratic.wrench @ forces)
            cholesky, info = lapack.dpotrf(H)
            if info == 0 and np.diag(cholesky).min() ** 2 > _NULL * np.abs(H).max():
                return np.asarray(forces + Z @ lapack.dpotrs(cholesky, g)[0])
            values, vectors = np.linalg.eigh(H)
            seen = values > _NULL * max(float(values[-1]), 1e-300)
            on = vectors[:, seen]
            forces = forces + Z @ (on @ ((on.T @ g) / values[seen]))
            Z = Z @ vectors[:, ~seen]
            if not Z.shape[1]:
                return np.asarray(forces)
        raise UndeterminedWrenchError(
            f"criterion {self.criterion.name!r} leaves {Z.shape[1]} direction(s) of the contact "
            "forces undetermined. Give it a tie_break such as minimum_wrench(1.0)."
        )


def _allowed(
    B: Float[np.ndarray, "6 m"], wrench: Float[np.ndarray, " 6"]
) -> tuple[np.ndarray, np.ndarray]:
    """The smallest forces with B f = wrench, and an orthonormal basis of those with B f = 0.

    One Householder QR of B' gives both.
    """
    m = B.shape[1]
    qr, tau, _, _ = lapack.dgeqrf(B.T)
    full = np.zeros((m, m), order="F")
    full[:, :6] = qr
    Q, _, _ = lapack.dorgqr(full, np.concatenate([tau, np.zeros(m - 6)]))
    y, _ = lapack.dtrtrs(qr[:6], wrench, trans=1)
    return Q[:, :6] @ y, Q[:, 6:]
