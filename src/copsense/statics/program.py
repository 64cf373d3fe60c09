"""Program: a quadratic program's exact optimum, from an active set that is validated first.

    minimise 1/2 x' H x - g' x   subject to   E' x = e,   A x <= b

A solver finds which rows hold; with these held the optimum solves

    [ 0   E'   0  ] [nu]   [ e ]
    [ E  -H  -A_h'] [ x] = [-g ]
    [ 0  -A_h  0  ] [ l]   [-b_h]

whose solution is then held against every optimality condition. If one fails, a second solver of
another kind names the rows; if that fails too, an error says so.

This is what to call for wrenches that are reported and differentiated. `qp` is beneath it: call
that where the solver's own precision is enough, in a control loop or for a linear program.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import scipy.linalg
from jaxtyping import Float, Int

from copsense import qp
from copsense.content import ShortRepr
from copsense.errors import CopsenseError, UnsolvedError
from copsense.row_space import RowSpace
from copsense.statics.symmetric import SymmetricSystem

_FEASIBLE = 1e-9  # violation of a row, in shares of the unit, that rounding may leave
# The same, to the solver: of two rows that nearly meet it must not take the wrong one. Where rows
# all but meet in one corner it can do no better than the former.
_SOLVED = 1e-12
_DEPENDENT = 1e-9  # share of a row, or column of E, that the others must leave of it
_ZERO = 1e-12  # norm of a row that limits nothing
_FAR = 1e4  # units: no x is looked for farther out
# A gradient is taken as no less than this share of what an x of the unit has: where all of it
# cancels, as of tangential forces on flat ground, rounding is left, 1e-16 of that.
_LEAST = 1e-6


class NoPointError(CopsenseError):
    """The rows exclude each other; the caller reports it in the words of the problem.

    Attributes:
        violation: the least amount by which every row would have to be relaxed, in its own unit.
        rows: indices of the rows that demand it.
    """

    def __init__(self, violation: float, rows: Int[np.ndarray, " k"]) -> None:
        """Store both."""
        self.violation = violation
        self.rows = rows
        super().__init__(f"infeasible by {violation:.3g}")


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(ShortRepr):
    """The optimum of a program.

    Attributes:
        x: the optimum (m,).
        equality: multipliers nu of E' x = e (k,), zero for columns that depend on others.
        multipliers: l (r,), zero off the held rows.
        error: largest violation of an optimality condition, relative.
    """

    x: Float[np.ndarray, " m"]
    equality: Float[np.ndarray, " k"]
    multipliers: Float[np.ndarray, " r"]
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class Program(ShortRepr):
    """A strictly convex quadratic program (on the null space of E').

    Attributes:
        H: (m, m), symmetric.
        g: (m,).
        E: (m, k).
        e: (k,).
        A: (r, m).
        b: (r,).
        unit: the size of x that errors are relative to, such as the weight.
        tolerance: violation of an optimality condition, relative, above which an optimum is
            rejected.
        known: the row space of E', where it was factorised before.
    """

    H: Float[np.ndarray, "m m"]
    g: Float[np.ndarray, " m"]
    E: Float[np.ndarray, "m k"]
    e: Float[np.ndarray, " k"]
    A: Float[np.ndarray, "r m"]
    b: Float[np.ndarray, " r"]
    unit: float
    tolerance: float = 1e-8
    known: RowSpace | None = None

    def __getstate__(self) -> dict[str, object]:
        """What is pickled: systems are factorised again where they are needed."""
        return {k: v for k, v in self.__dict__.items() if k != "_systems"}

    @cached_property
    def scale(self) -> Float[np.ndarray, " r"]:
        """Norm of each row; 1 for a row that is zero, such as the torque of a free arm."""
        return _lengths(self.A)

    @property
    def null(self) -> Float[np.ndarray, "m z"]:
        """Orthonormal basis of what E' x = e leaves free."""
        return self._equations.null

    @cached_property
    def start(self) -> Float[np.ndarray, " m"]:
        """The smallest x with E' x = e."""
        return self._equations.least_solution(self.e)

    @cached_property
    def _equations(self) -> RowSpace:
        return self.known or RowSpace(self.E.T, max(self.E.shape) * np.finfo(float).eps)

    @cached_property
    def reduced_cost(self) -> Float[np.ndarray, "z z"]:
        """The cost over the null space."""
        return np.asarray(self.null.T.dot(self.H).dot(self.null))

    @cached_property
    def curvature(self) -> Float[np.ndarray, " z"]:
        """Eigenvalues of the cost over the null space, rising."""
        return np.asarray(np.linalg.eigvalsh(self.reduced_cost))

    @property
    def modes(self) -> tuple[Float[np.ndarray, " z"], Float[np.ndarray, "z z"]]:
        """The same with their eigenvectors, coordinates over `null`."""
        values, vectors = np.linalg.eigh(self.reduced_cost)
        return np.asarray(values), np.asarray(vectors)

    def solve(self) -> Optimum:
        """The optimum.

        Raises:
            NoPointError: no x respects the rows.
            UnsolvedError: neither solver found an x that meets the optimality conditions.
        """
        errors = []
        for solver in (
            partial(self._active_by_daqp, _SOLVED),
            partial(self._active_by_daqp, _FEASIBLE),
            self._active_by_nnls,
        ):
            held = solver()
            if held is None:
                continue
            found = self.optimum(held)
            if found.error <= self.tolerance:
                return found
            errors.append(found.error)
        violation, rows = self._conflict()
        if violation > _FEASIBLE * self.unit:
            raise NoPointError(violation, rows)
        raise UnsolvedError(min(errors, default=np.inf))

    def optimum(self, held: np.ndarray) -> Optimum:
        """The optimum with these rows held, those that depend on others left out."""
        held = held[self._independent(held)]
        x, nu, pressing = self.hold(held, self.g, self.e, self.b[held])
        l = np.zeros(len(self.b))
        l[held] = pressing
        return Optimum(x, nu, l, self.violation(x, nu, l))

    def violation(self, x: np.ndarray, nu: np.ndarray, l: np.ndarray) -> float:
        """Largest violation of an optimality condition, in shares of the unit or the gradient."""
        gradient, size = self.H @ x - self.g, self.gradient_size(x)
        slack, pressure = (self.b - self.A @ x) / self.scale, l * self.scale
        parts = [
            np.abs(gradient + self.A.T @ l - self.E @ nu).max() / size,
            np.abs(self.E.T @ x - self.e).max(initial=0.0) / self.unit,
            np.max(-slack, initial=0.0) / self.unit,
            np.max(-pressure, initial=0.0) / size,
            np.max(np.abs(pressure * slack), initial=0.0) / (size * self.unit),
        ]
        worst = float(max(parts))
        return worst if np.isfinite(worst) else np.inf

    def gradient_size(self, x: np.ndarray) -> float:
        """The largest entry of the cost's gradient, that multipliers are relative to."""
        least = _LEAST * self.unit * float(np.abs(self.H).max(initial=0.0))
        return max(float(np.abs(self.H @ x - self.g).max()), least, 1e-300)

    def hold(
        self, held: np.ndarray, g: np.ndarray, e: np.ndarray, b: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x, nu and the held rows' l of the system above, for other right-hand sides.

        Args:
            held: independent rows.
            g: (m, ...).
            e: (k, ...).
            b: of the held rows (a, ...).

        Columns of E that depend on others are left out; their nu is zero.
        """
        columns = self._columns
        k, m = len(columns), len(self.g)
        y = self._system(held).solve(np.concatenate([e[columns], -g, -b]))
        nu = np.zeros((len(self.e), *y.shape[1:]))
        nu[columns] = y[:k]
        return y[k : k + m], nu, y[k + m :]

    def _system(self, held: np.ndarray) -> SymmetricSystem:
        """The system with these rows held, factorised once."""
        key = held.tobytes()
        if key not in self._systems:
            columns = self._columns
            k, m, a = len(columns), len(self.g), len(held)
            K = np.zeros((k + m + a, k + m + a))
            K[k : k + m, :k] = self.E[:, columns]
            K[:k, k : k + m] = K[k : k + m, :k].T
            K[k : k + m, k : k + m] = -self.H
            K[k + m :, k : k + m] = -self.A[held]
            K[k : k + m, k + m :] = K[k + m :, k : k + m].T
            self._systems[key] = SymmetricSystem(K)
        return self._systems[key]

    @cached_property
    def _systems(self) -> dict[bytes, SymmetricSystem]:
        return {}

    @cached_property
    def _columns(self) -> np.ndarray:
        """Columns of E that do not depend on others."""
        if self._equations.apart:
            return np.arange(self.E.shape[1])
        return _independent(self.E)

    def _independent(self, held: np.ndarray) -> np.ndarray:
        """Which of some rows do not depend on E and the others."""
        if not len(held):
            return held
        if len(held) == 1:  # the solver holds it against what the others leave of it
            left = np.linalg.norm(self.null.T.dot(self.A[held[0]])) / self.scale[held[0]]
            return np.zeros(int(left > _DEPENDENT), dtype=int)
        return _independent(self.null.T @ (self.A[held] / self.scale[held, None]).T, size=1.0)

    @cached_property
    def _reduced(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The program over the null space with rows of length one: H, h, A, b."""
        N, scale = self.null, self.scale
        return (
            self.reduced_cost,
            N.T @ (self.H @ self.start - self.g),
            np.ascontiguousarray(self.A @ N / scale[:, None]),
            (self.b - self.A @ self.start) / scale,
        )

    def _active_by_daqp(self, tolerance: float) -> np.ndarray | None:
        """Rows that hold at the optimum by daqp's dual active-set method; None if it fails.

        The tolerance is the solver's own, in shares of the unit.
        """
        H, h, A, b = self._reduced
        if not len(b) or not len(h):
            return np.zeros(0, dtype=int)
        size = self.curvature[-1]
        _, flag, l = qp.dual_active_set(
            H / size, h / size, A, b, primal_tol=tolerance * self.unit, dual_tol=1e-12
        )
        return None if flag < 1 else np.flatnonzero(np.abs(l) > 0)

    def _active_by_nnls(self) -> np.ndarray | None:
        """The same by non-negative least squares.

        With H = R' R and y = (R z + R^-T h) / unit the program is: the shortest y with A' y <= b'.
        """
        H, h, A, b = self._reduced
        if not len(b) or not len(h):
            return None  # nothing that the first solver did not see
        try:
            R = np.linalg.cholesky(H).T
            offset = scipy.linalg.solve_triangular(R, h, trans="T")
            rows = scipy.linalg.solve_triangular(R, A.T, trans="T").T
        except (np.linalg.LinAlgError, ValueError):
            return None
        length = _lengths(rows)
        u = qp.least_distance_multipliers(rows / length[:, None], (b + rows @ offset) / length)
        return None if u is None else np.flatnonzero(u > 0)

    def _conflict(self) -> tuple[float, np.ndarray]:
        """The least violation of all rows that leaves a point, and the rows that demand it."""
        # Bounded, or what rounding leaves of a zero becomes a way out at 1e9 times the unit.
        left, far = self.b - self.A @ self.start, _FAR * self.unit
        found = qp.least_relaxation(self.A @ self.null, left, np.ones(len(left)), far)
        if found is None:
            return 0.0, np.zeros(0, dtype=int)
        return found[0], np.flatnonzero(found[1] > 1e-9)


def _lengths(rows: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(rows, axis=1)
    return np.where(lengths > _ZERO, lengths, 1.0)


def _independent(columns: np.ndarray, size: float | None = None) -> np.ndarray:
    """Indices of a largest set of independent columns, in rising order."""
    if not columns.size:
        return np.zeros(0, dtype=int)
    R, order = scipy.linalg.qr(columns, mode="r", pivoting=True)
    pivots = np.abs(np.diag(R))
    largest = pivots[0] if size is None else size
    return np.sort(order[: int(np.sum(pivots > _DEPENDENT * largest))])
