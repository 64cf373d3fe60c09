"""Constrained equilibrium: a criterion's wrenches within limits, and their one-sided derivatives.

Over the contact forces alone, tau = G_j - J_j' f, a criterion within limits is the QP

    minimise 1/2 f' H f - g' f   subject to   J_b' f = G_b,   A f <= b,
    H = J_j W_tau J_j' + W_f,    g = J_j W_tau G_j + W_f f_ref,

with a row of A for each contact limit and, for a torque limit |tau_i| <= t_i, the rows
-/+ J_i' f <= t_i -/+ G_i. With the active rows held, f and its multipliers solve

    [ 0     J_b'   0  ] [nu_b]   [ G_b ]
    [ J_b  -H    -A_a'] [ f  ] = [ -g  ]
    [ 0    -A_a    0  ] [ l  ]   [-b_a ]

and along an admissible V the same matrix gives the derivatives. Where a row is weakly active (on
its bound without pressing) the derivative depends on the side: the set of weak rows that stay held
is found by trying them, a complementarity problem of their number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import daqp
import numpy as np
import scipy.linalg
import scipy.optimize
from jaxtyping import Float

from copsense.criterion import Criterion, Quadratic
from copsense.equilibrium.static import StaticEquilibrium
from copsense.errors import InfeasibleError, InvalidInputError, UndeterminedWrenchError
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.stance import Stance

_PRESSING = 1e-9  # multipliers, relative to the largest gradient, under which a row does not press
_TOUCHING = 1e-9  # slack, relative to the weight, under which a row is on its bound
_SINGULAR = 1e-11  # eigenvalues of the cost, relative, that leave forces undetermined
_MOST_WEAK = 12  # weakly active rows beyond which their combinations are too many to try


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that holds with equality.

    Attributes:
        name: such as ``"l_sole: CoP at the +y (left) edge"`` or ``"torque of l_knee"``.
        kind: ``"normal force"``, ``"friction"``, ``"cop"``, ``"torsion"``, ``"wrench cone"`` or
            ``"torque"``.
        multiplier: how hard the criterion presses against it; 0 where it only touches.
    """

    name: str
    kind: str
    multiplier: float

    @property
    def weak(self) -> bool:
        """Whether the limit is only touched, so that the two sides differ."""
        return self.multiplier == 0.0


@dataclass(frozen=True, eq=False)
class Rates:
    """One-sided derivatives of a constrained equilibrium along a motion.

    Attributes:
        forces: d f (m,).
        torques: d tau (n,).
        multipliers: d l (r,), zero where a row stays inactive.
        slack: d (b - A f) (r,).
    """

    forces: Float[np.ndarray, " m"]
    torques: Float[np.ndarray, " n"]
    multipliers: Float[np.ndarray, " r"]
    slack: Float[np.ndarray, " r"]


@dataclass(frozen=True, eq=False)
class ConstrainedEquilibrium(StaticEquilibrium):
    """An equilibrium within limits; see `StaticEquilibrium` for the rest.

    Attributes:
        limits: the limits.
        names: what each row limits (r,).
        kinds: the kind of each row (r,).
        slack: b - A f (r,), non-negative [N, Nm].
        row_multipliers: l (r,), non-negative, zero off the active rows.
    """

    limits: Limits
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    slack: Float[np.ndarray, " r"]
    row_multipliers: Float[np.ndarray, " r"]

    @property
    def active(self) -> tuple[ActiveLimit, ...]:
        """The limits that hold with equality, the hardest pressed first."""
        touching = np.flatnonzero(self._problem.strong | self._problem.weak)
        order = sorted(touching, key=lambda i: -self.row_multipliers[i])
        return tuple(
            ActiveLimit(self.names[i], self.kinds[i], float(self.row_multipliers[i])) for i in order
        )

    def optimality(self) -> float:
        """Largest violation of the QP's optimality conditions.

        Balance and limits in shares of the weight, stationarity and complementarity in shares of
        the cost's gradient; recomputed from the stance.
        """
        return self._problem.optimality(self)

    def derivative(
        self, directions: Float[np.ndarray, "nv p"]
    ) -> tuple[Float[np.ndarray, "m p"], Float[np.ndarray, "n p"]]:
        """Derivatives with the pressing limits held, and the touching ones ignored.

        Where nothing only touches this is the derivative; elsewhere use `rates`.
        """
        solved = self._problem.differentiate(self, directions, np.flatnonzero(self._problem.strong))
        return solved[0], solved[1]

    def rates(self, direction: Float[np.ndarray, " nv"]) -> Rates:
        """The one-sided derivative along an admissible motion: what happens when it begins."""
        return self._problem.rates(self, direction)

    @cached_property
    def _problem(self) -> _Problem:
        assert isinstance(self.criterion, Criterion)
        return _Problem(self.stance, self.criterion, self.limits)


def solve_constrained(
    stance: Stance, criterion: Criterion, limits: Limits
) -> ConstrainedEquilibrium:
    """The equilibrium that a criterion chooses within limits.

    Args:
        stance: robot, configuration and contacts.
        criterion: what to minimise.
        limits: what to respect.

    Raises:
        InfeasibleError: no wrench respects the limits; says which demand how much more.
        UndeterminedWrenchError: several wrenches are equally good.
    """
    problem = _Problem(stance, criterion, limits)
    f, nu, multipliers, slack = problem.solve()
    torques = (stance.gravity - stance.jacobian.T @ f)[stance.robot.base_nv :]
    found = ConstrainedEquilibrium(
        stance,
        criterion,
        f,
        torques,
        nu,
        limits,
        problem.names,
        problem.kinds,
        slack,
        multipliers,
    )
    found.__dict__["_problem"] = problem
    return found


class _Problem:
    """The QP of a stance, a criterion and limits."""

    def __init__(self, stance: Stance, criterion: Criterion, limits: Limits) -> None:
        self.stance, self.criterion = stance, criterion
        self.nb = nb = stance.robot.base_nv
        self.Jb, self.Jj = stance.jacobian[:, :nb], stance.jacobian[:, nb:]
        self.Gb, self.Gj = stance.gravity[:nb], stance.gravity[nb:]
        self.quadratic: Quadratic = criterion.at(stance)
        self.W = _torque_weight(self.quadratic, stance)
        self.H = self.Jj @ self.W @ self.Jj.T + self.quadratic.wrench
        self.g = self.Jj @ self.W @ self.Gj + self.quadratic.pull
        rows: LimitRows = limit_rows(stance, limits)
        limited = np.flatnonzero(np.isfinite(rows.torque))
        names = stance.robot.torque_names
        # s tau_i <= t_i for s = +1, -1: the row is -s J_i' f <= t_i - s G_i.
        self.joint = np.concatenate([np.full(len(rows.bound), -1), np.repeat(limited, 2)])
        self.sign = np.concatenate([np.zeros(len(rows.bound)), np.tile([1.0, -1.0], len(limited))])
        torque = self.joint >= 0
        J = self.Jj.T[self.joint[torque]]
        s = self.sign[torque]
        self.A = np.vstack([rows.matrix, -s[:, None] * J])
        self.b = np.concatenate(
            [rows.bound, rows.torque[self.joint[torque]] - s * self.Gj[self.joint[torque]]]
        )
        self.names = rows.names + tuple(f"torque of {names[i]}" for i in self.joint[torque])
        self.kinds = rows.kinds + ("torque",) * int(torque.sum())
        self.scale = np.maximum(np.linalg.norm(self.A, axis=1), 1e-300)
        self.weight = stance.robot.weight
        self.strong = self.weak = np.zeros(len(self.b), dtype=bool)

    def solve(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Forces, multipliers of the statics and of the rows, slack."""
        self._null = scipy.linalg.null_space(self.Jb.T)
        start = np.linalg.lstsq(self.Jb.T, self.Gb, rcond=None)[0]
        held = self._active_rows(start)
        f, l = self._polish(held)
        multipliers = np.zeros(len(self.b))
        multipliers[held] = l
        slack = self.b - self.A @ f
        gradient = max(float(np.abs(self.H @ f - self.g).max()), 1e-300)
        touching = slack <= _TOUCHING * self.weight * self.scale
        self.strong = multipliers * self.scale > _PRESSING * gradient
        self.weak = touching & ~self.strong
        multipliers[~self.strong] = 0.0
        slack[self.strong] = 0.0
        tau = self.Gj - self.Jj.T @ f
        nu = np.zeros(len(self.Gb) + len(self.Gj))
        nu[self.nb :] = self.W @ tau
        np.add.at(
            nu, self.nb + self.joint[self.joint >= 0], (self.sign * multipliers)[self.joint >= 0]
        )
        contact = self.joint < 0
        left = (
            self.quadratic.wrench @ f
            - self.quadratic.pull
            + self.A[contact].T @ multipliers[contact]
            - self.Jj @ nu[self.nb :]
        )
        nu[: self.nb] = np.linalg.lstsq(self.Jb, left, rcond=None)[0]
        return f, nu, multipliers, slack

    def _active_rows(self, start: np.ndarray) -> np.ndarray:
        """Indices of linearly independent rows that hold at the optimum, from the QP solver."""
        N, scale = self._null, self.scale[:, None]
        H = N.T @ self.H @ N
        h = N.T @ (self.H @ start - self.g)
        values = np.linalg.eigvalsh(H)
        if values[0] <= _SINGULAR * values[-1]:
            raise UndeterminedWrenchError(
                f"criterion {self.criterion.name!r} leaves wrenches undetermined, and limits with "
                "a tie-break are not supported. Add a small share of another criterion: "
                "mixed((criterion, 1.0), (minimum_wrench(1.0), 1e-3))."
            )
        if not len(self.b):
            return np.zeros(0, dtype=int)
        A = np.ascontiguousarray(self.A @ N / scale)
        b = (self.b - self.A @ start) / self.scale
        size = values[-1]
        solution, _, flag, info = daqp.solve(
            np.ascontiguousarray(H / size),
            np.ascontiguousarray(h / size),
            A,
            b,
            np.full(len(b), -1e30),
            np.zeros(len(b), dtype=np.int32),
            primal_tol=1e-9 * self.weight,
            dual_tol=1e-12,
        )
        if flag < 1:
            raise self._infeasible(start)
        del solution
        return np.flatnonzero(np.abs(np.asarray(info["lam"])) > 0)

    def _polish(self, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The exact optimum with these rows held."""
        x = self._bordered(held)(np.concatenate([self.Gb, -self.g, -self.b[held]]))
        m = len(self.g)
        return x[self.nb : self.nb + m], x[self.nb + m :]

    def _bordered(self, held: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """A solver of the KKT system with these rows held, scaled and refined."""
        nb, m, a = self.nb, len(self.g), len(held)
        K = np.zeros((nb + m + a, nb + m + a))
        K[:nb, nb : nb + m] = self.Jb.T
        K[nb : nb + m, :nb] = self.Jb
        K[nb : nb + m, nb : nb + m] = -self.H
        K[nb : nb + m, nb + m :] = -self.A[held].T
        K[nb + m :, nb : nb + m] = -self.A[held]
        d = np.ones(len(K))
        for _ in range(3):
            size = np.abs(d[:, None] * K * d).max(axis=1)
            d /= np.sqrt(np.where(size > 0, size, 1.0))
        lu = scipy.linalg.lu_factor(d[:, None] * K * d, check_finite=False)

        def solve(right: np.ndarray) -> np.ndarray:
            def once(r: np.ndarray) -> np.ndarray:
                return (d * scipy.linalg.lu_solve(lu, (d * r.T).T, check_finite=False).T).T

            x = once(right)
            return x + once(right - K @ x)

        return solve

    def differentiate(
        self, at: ConstrainedEquilibrium, V: Float[np.ndarray, "nv p"], held: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """d f, d tau and d l of the held rows along V, with these rows held."""
        nb = self.nb
        AV = self.stance.balance_derivative(at.forces) @ V
        # Stationarity: J nu = W_f (f - f_ref) + A_c' l, nu_j = W tau + s l, here at fixed f and l.
        change = self.stance.motion_derivative(at.multipliers) @ V
        change += self.Jj @ (self.W @ AV[nb:])
        if self.quadratic.inertia:
            change += self.Jj @ self._weight_change(at.torques, V)
        torque_rows = self.joint[held] >= 0
        rows = np.zeros((len(held), V.shape[1]))
        rows[torque_rows] = (
            self.sign[held][torque_rows, None] * AV[nb:][self.joint[held][torque_rows]]
        )
        x = self._bordered(held)(np.vstack([AV[:nb], -change, rows]))
        df = x[nb : nb + len(self.g)]
        return df, AV[nb:] - self.Jj.T @ df, x[nb + len(self.g) :]

    def _weight_change(self, torques: np.ndarray, V: np.ndarray) -> np.ndarray:
        """(dW) tau for W = D + c M^-1: -c M^-1 dM M^-1 tau."""
        nb = self.nb
        M = self.stance.mass_matrix[nb:, nb:]
        inner = np.zeros(nb + len(torques))
        inner[nb:] = np.linalg.solve(M, torques)
        moved = self.stance.inertia_derivative(inner)[nb:] @ V
        return -self.quadratic.inertia * np.linalg.solve(M, moved)

    def rates(self, at: ConstrainedEquilibrium, v: np.ndarray) -> Rates:
        strong, weak = np.flatnonzero(self.strong), np.flatnonzero(self.weak)
        if len(weak) > _MOST_WEAK:
            raise InvalidInputError(
                f"{len(weak)} limits are touched without pressing at this very posture: too many "
                "to tell the sides apart. Move a little along the path."
            )
        for count in range(len(weak) + 1):
            for extra in combinations(weak, count):
                held = np.concatenate([strong, np.array(extra, dtype=int)])
                found = self._try(
                    at, v, held, np.setdiff1d(weak, extra), np.array(extra, dtype=int)
                )
                if found:
                    return found
        raise InvalidInputError(
            "the limits touched here are degenerate (dependent rows), and no one-sided derivative "
            "was found. Move a little along the path."
        )

    def _try(
        self,
        at: ConstrainedEquilibrium,
        v: np.ndarray,
        held: np.ndarray,
        left: np.ndarray,
        extra: np.ndarray,
    ) -> Rates | None:
        """The derivative with these rows held, if no touched row is crossed or pulled at."""
        try:
            df, dtau, dl = (x[:, 0] for x in self.differentiate(at, v[:, None], held))
        except (np.linalg.LinAlgError, ValueError):
            return None
        if not np.all(np.isfinite(df)):
            return None
        slack = -self.A @ df
        on = self.joint >= 0
        slack[on] = -(self.sign * dtau[self.joint])[on]
        multipliers = np.zeros(len(self.b))
        multipliers[held] = dl
        speed = max(float(np.abs(df).max()), 1e-300)
        crossed = np.any(slack[left] < -1e-9 * speed * self.scale[left])
        pulled = np.any(multipliers[extra] < -1e-9 * float(np.abs(self.H).max()) * speed)
        if crossed or pulled:
            return None
        slack[held] = 0.0
        return Rates(df, dtau, multipliers, slack)

    def optimality(self, at: ConstrainedEquilibrium) -> float:
        f, l = at.forces, at.row_multipliers
        gradient = self.H @ f - self.g
        size = max(float(np.abs(gradient).max()), 1e-9 * self.weight * float(np.abs(self.H).max()))
        pressing = gradient + self.A.T @ l
        # What the rows leave of the gradient must be a combination of the balance's rows.
        left = pressing - self.Jb @ np.linalg.lstsq(self.Jb, pressing, rcond=None)[0]
        slack = (self.b - self.A @ f) / self.scale
        parts = [
            np.abs(left).max() / size,
            np.abs(self.Jb.T @ f - self.Gb).max() / self.weight,
            np.max(-slack, initial=0.0) / self.weight,
            np.max(-l * self.scale, initial=0.0) / size,
            np.max(np.abs(l * self.scale * slack), initial=0.0) / (size * self.weight),
        ]
        return float(max(parts))

    def _infeasible(self, start: np.ndarray) -> InfeasibleError:
        """The least violation that would make the limits feasible, and who demands it."""
        N = self._null
        A = np.column_stack([self.A @ N / self.scale[:, None], -np.ones(len(self.b))])
        b = (self.b - self.A @ start) / self.scale
        k = N.shape[1]
        found = scipy.optimize.linprog(
            np.eye(k + 1)[k], A_ub=A, b_ub=b, bounds=[(None, None)] * k + [(0, None)]
        )
        violation = float(found.x[k]) if found.status == 0 else float("nan")
        demands: tuple[str, ...] = ()
        if found.status == 0:
            pressed = np.flatnonzero(-found.ineqlin.marginals > 1e-9)
            demands = tuple(dict.fromkeys(self.names[i] for i in pressed))
        return InfeasibleError(violation, demands)


def _torque_weight(quadratic: Quadratic, stance: Stance) -> Float[np.ndarray, "n n"]:
    if not quadratic.inertia:
        return quadratic.torque
    nb = stance.robot.base_nv
    M = stance.mass_matrix[nb:, nb:]
    if np.linalg.cond(M) > 1e12:
        raise InvalidInputError(
            "a weight that follows the inertia needs every joint to move some mass when limits are "
            "on. Give constant weights instead."
        )
    return quadratic.torque + quadratic.inertia * np.linalg.inv(M)
