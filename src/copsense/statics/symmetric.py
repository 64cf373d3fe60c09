"""Symmetric: a small symmetric system of equations, scaled and factorised once."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

_ALIKE = 1e-2  # rows whose largest entries differ by less need no scaling
_SOUND = 1e-5  # pivots, relative, from which the matrix is far from losing any direction
_RCOND = 1e-13  # reciprocal condition number under which it counts as singular
_NULL = 1e-10  # singular values, relative, that count as lost


class SymmetricSystem:
    """K y = right, for any number of columns, with one step of refinement.

    Rows and columns are scaled alike first, so that weights of any unit may stand in K.

    Attributes:
        matrix: K (k, k).
    """

    matrix: Float[np.ndarray, "k k"]

    def __init__(self, matrix: Float[np.ndarray, "k k"]) -> None:
        """Scale and factorise."""
        self.matrix = matrix
        entries, scale = np.abs(matrix), np.ones(len(matrix))
        for _ in range(3):
            size = scale * (entries * scale).max(axis=1)
            if size.min() > _ALIKE * size.max():
                break
            scale /= np.sqrt(np.where(size > 0, size, 1.0))
        self._scale, self._scaled = scale, scale[:, None] * matrix * scale
        self._lu, self._pivots, self._info = lapack.dgetrf(self._scaled)
        self._inverse: np.ndarray | None = None

    @cached_property
    def singular(self) -> bool:
        """Whether the matrix has no inverse to working accuracy."""
        sizes = np.abs(self._lu.diagonal())
        if self._info or sizes.min() > _SOUND * sizes.max():
            return bool(self._info)
        norm = float(np.abs(self._scaled).sum(axis=0).max())
        return not lapack.dgecon(self._lu, norm)[0] > _RCOND

    def use_pseudo_inverse(self) -> None:
        """From here on, find a solution of a singular but consistent system."""
        self._inverse = np.linalg.pinv(self._scaled, rcond=_NULL, hermitian=True)

    def solve(self, right: Float[np.ndarray, "k *p"]) -> Float[np.ndarray, "k *p"]:
        """The solution y."""
        y = self._once(right)
        return y + self._once(right - self.matrix.dot(y))

    def _once(self, right: np.ndarray) -> np.ndarray:
        scale = self._scale if right.ndim == 1 else self._scale[:, None]
        scaled = scale * right
        if self._inverse is not None:
            return np.asarray(scale * (self._inverse @ scaled))
        return np.asarray(scale * lapack.dgetrs(self._lu, self._pivots, scaled)[0])
