"""Sharing: the contact forces that cause a wanted momentum rate, chosen by a criterion.

The step of [Romano2016] Eq. (19) that tells controllers apart. It is a function
`LoadProblem -> forces`, so that a solver with limits can take the place of `ShareByCriterion`.

Matrices this small are multiplied with `dot`: it takes half the time of `@`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.criterion import Criterion
from copsense.errors import UndeterminedWrenchError
from copsense.load_problem import LoadProblem
from copsense.quadratic import Quadratic
from copsense.row_space import RowSpace
from copsense.stance import Stance

_NULL = 1e-11  # curvature, relative to the largest, under which a direction is free: the statics'
_SAFE = 1e-9  # pivots, relative, from which no curvature comes near to that
_UNFELT = 1e-9  # share of a force that contacts may feel
_ROUNDING = 1e-13  # likewise, relative to the cost's entries, if it sees nothing at all
_DEPENDENT = 1e-6  # singular values, relative, under which rows of joints depend on others


ShareLoad = Callable[[LoadProblem], Float[np.ndarray, " m"]]


class Choice(NamedTuple):
    """One cost 1/2 f' H f - g' f of several in turn, and what it leaves to the next.

    Attributes:
        H: (m, m).
        g: (m,).
        free: orthonormal directions along which it and those before it are flat (m, k).
    """

    H: Float[np.ndarray, "m m"]
    g: Float[np.ndarray, " m"]
    free: Float[np.ndarray, "m k"]


class ShareByCriterion:
    """The forces of least cost, without limits.

    minimise 1/2 tau' W_tau tau + 1/2 (f - f_ref)' W_f (f - f_ref) over the allowed f: with
    f = f_p + Z y, J_b' Z = 0, a system of m - 6 unknowns. Tie-breaks decide, in turn, what a
    criterion leaves free.

    What no torque feels at the stance counts as free in motion too: as soon as legs of five joints
    lean by a microradian their motors feel their internal forces, and a criterion that made use of
    that would ask for a thousand times the weight.
    """

    def __init__(self, stance: Stance, criterion: Criterion) -> None:
        """Read the weights; whether they determine the forces shows at the first problem."""
        self.criterion = criterion
        self._contact_rows = len(stance.row_names)
        self._levels: list[_Level] = []
        problem = LoadProblem.of(stance)
        _, Z = allowed(problem.base_map, problem.base_wrench)
        level: Criterion | None = criterion
        while level is not None:
            quadratic, free = level.at(stance), 0
            if Z.shape[1]:
                Z = Z @ _seen_and_free(quadratic.over_forces(problem)[0], Z)[2]
                free = Z.shape[1]
            self._levels.append(_Level(quadratic, free))
            level = level.tie_break

    def __call__(self, problem: LoadProblem) -> Float[np.ndarray, " m"]:
        """Forces of least cost (m,).

        Raises:
            UndeterminedWrenchError: the criterion and its tie-breaks leave several.
        """
        return self.among(problem, *allowed(problem.base_map, problem.base_wrench))

    def among(
        self, problem: LoadProblem, forces: Float[np.ndarray, " m"], Z: Float[np.ndarray, "m z"]
    ) -> Float[np.ndarray, " m"]:
        """Those of least cost (m,) among forces + Z y, see `allowed`.

        Raises:
            UndeterminedWrenchError: the criterion and its tie-breaks leave several.
        """
        if not Z.shape[1]:  # one foot has no choice
            return np.asarray(forces)
        for level in self._levels:
            # The cost along Z from these forces: curvature, and minus the slope.
            cost, pull = level.quadratic.over_forces(problem)
            pull = pull - cost.dot(forces)
            if not level.free:
                H = Z.T.dot(cost.dot(Z))
                cholesky, y, info = lapack.dposv(H, Z.T.dot(pull))
                if info == 0 and well_determined(H, cholesky, _SAFE):
                    return np.asarray(forces + Z.dot(y))
            values, on, off = _seen_and_free(cost, Z, level.free)
            on = Z.dot(on)
            forces = forces + on.dot(on.T.dot(pull) / values)
            Z = Z.dot(off)
            if not Z.shape[1]:
                return np.asarray(forces)
        if np.abs(Z[: self._contact_rows]).max() < _NULL:
            # Forces of loops alone, which no contact feels: as the statics, the smallest.
            return np.asarray(forces - Z @ (Z.T @ forces))
        raise UndeterminedWrenchError(
            f"criterion {self.criterion.name!r} leaves {Z.shape[1]} direction(s) of the contact "
            "forces undetermined. Give it a tie_break such as minimum_wrench(1.0), or take that "
            "alone (--criterion minimum-wrench)."
        )

    def choices(self, problem: LoadProblem, Z: Float[np.ndarray, "m z"]) -> list[Choice]:
        """The costs that choose among f + Z y in turn; the last leaves nothing free."""
        found: list[Choice] = []
        for level in self._levels:
            H, g = level.quadratic.over_forces(problem)
            Z = Z @ _seen_and_free(H, Z, level.free)[2] if Z.shape[1] else Z
            found.append(Choice(H, g, Z))
            if not Z.shape[1]:
                return found
        # Forces of loops alone, which no contact feels: the smallest.
        m = len(Z)
        return [*found, Choice(np.eye(m), np.zeros(m), Z[:, :0])]


class _Level(NamedTuple):
    """A cost, and how many directions it leaves free at the stance."""

    quadratic: Quadratic
    free: int


def _seen_and_free(
    cost: Float[np.ndarray, "m m"], Z: Float[np.ndarray, "m z"], least: int = 0
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "z s"], Float[np.ndarray, "z f"]]:
    """A cost's curvatures over Z that count, their directions, and those it is flat along.

    Args:
        cost: its matrix.
        Z: orthonormal.
        least: how many directions count as flat in any case, those of least curvature.
    """
    values, vectors = np.linalg.eigh(Z.T.dot(cost.dot(Z)))
    nothing = max(_NULL * float(values[-1]), _ROUNDING * float(np.abs(cost).max()), 1e-300)
    first = max(least, int(np.sum(values <= nothing)))
    return values[first:], vectors[:, first:], vectors[:, :first]


def well_determined(matrix: np.ndarray, factor: np.ndarray, least: float) -> bool:
    """Whether no pivot of a positive semidefinite matrix is under `least` of its largest entry.

    Args:
        matrix: whose largest entry stands on its diagonal, as it must.
        factor: its Cholesky factor.
        least: relative.
    """
    pivots, entries = factor.diagonal().tolist(), matrix.diagonal().tolist()
    return bool(min(pivots) ** 2 > least * max(entries))


def allowed(
    B: Float[np.ndarray, "b m"], wrench: Float[np.ndarray, " b"]
) -> tuple[np.ndarray, np.ndarray]:
    """The smallest forces with B f = wrench, and an orthonormal basis of those with B f = 0.

    One Householder QR of B' gives both. With rows of joints without a motor, which may depend on
    the base's, it takes a factorisation that finds the rank.
    """
    m = B.shape[1]
    if len(B) != 6:
        space = RowSpace(B, _DEPENDENT)
        return space.least_solution(wrench), space.null
    full = np.zeros((m, m), order="F")
    full[:, :6] = B.T
    # The columns of zeros add reflectors that do nothing.
    qr, tau, _, _ = lapack.dgeqrf(full, overwrite_a=1)
    y = lapack.dtrtrs(qr[:6, :6], wrench, trans=1)[0]
    Q = lapack.dorgqr(qr, tau, overwrite_a=1)[0]
    return Q[:, :6].dot(y), Q[:, 6:]
