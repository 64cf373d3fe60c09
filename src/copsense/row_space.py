"""RowSpace: what a matrix sees, what it leaves free, and the smallest solution of its equations."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.arrays import read_only

_APART = 1e-3  # pivots, relative, from which no row comes near to depending on others


class RowSpace:
    """The row space of a matrix A (k, m).

    By QR with pivoting where its rows are far from depending on each other, else by SVD.

    Attributes:
        rank: of A.
        apart: whether its rows are far from depending on each other.
        null: orthonormal basis of what A leaves free (m, m - rank), A null = 0.
        redundant: orthonormal basis of the combinations of rows that vanish (k, k - rank).
    """

    rank: int
    apart: bool
    null: Float[np.ndarray, "m z"]
    redundant: Float[np.ndarray, "k d"]

    def __init__(
        self, matrix: Float[np.ndarray, "k m"], tolerance: float, *, least: float = 0.0
    ) -> None:
        """Factorise.

        Args:
            matrix: A.
            tolerance: singular values, relative to the largest, that count as lost.
            least: the largest singular value counts as no less than this.
        """
        k, m = matrix.shape
        self.apart = 0 < k <= m
        if self.apart:
            factor, order, tau, _, _ = lapack.dgeqp3(matrix.T)  # A'[:, order] = Q R
            pivots = np.abs(factor.diagonal())
            self.apart = bool(pivots[-1] > _APART * pivots[0])
        if self.apart:
            reflectors = np.zeros((m, m), order="F")
            reflectors[:, :k] = factor
            Q, _, _ = lapack.dorgqr(reflectors, tau, overwrite_a=True)
            self.rank, self.redundant = k, read_only(np.zeros((k, 0)))
            self._factors = Q[:, :k], factor[:k], order - 1
            null = Q[:, k:]
        else:
            u, s, vt = np.linalg.svd(matrix)
            self.rank = r = int(np.sum(s > tolerance * max(least, s.max(initial=0.0))))
            self.redundant = read_only(u[:, r:].copy())
            self._factors = u[:, :r], s[:r], vt[:r]
            null = vt[r:].T
        self.null = read_only(null.copy())

    def __repr__(self) -> str:
        """Its rank, and what it leaves free."""
        return f"RowSpace(rank {self.rank}, {self.null.shape[1]} of {len(self.null)} free)"

    def least_solution(self, right: Float[np.ndarray, " k"]) -> Float[np.ndarray, " m"]:
        """The smallest x with A x = right; what A cannot reach is left out."""
        if self.apart:
            Q, R, order = self._factors
            return np.asarray(Q.dot(lapack.dtrtrs(R, right[order], trans=1)[0]))
        u, s, vt = self._factors
        return np.asarray((u.T.dot(right) / s).dot(vt))
