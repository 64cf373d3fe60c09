"""Solver: SciPy's SLSQP on a posture program, its optimality residual, and what is infeasible.

SLSQP is restarted from where it ended, with a fresh model of the curvature, until it gains no more.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr, freeze
from copsense.errors import CopsenseError
from copsense.optimisation.posture_program import Point, PostureProgram
from copsense.qp import bounded_least_squares

_REGION = 1.0  # of the variables, to either side of where a round begins: 0.1 m, 57 deg
_PRECISION = 1e-6  # of t: a round that gains less is the last
_ROUNDS, _ROUND = 30, 150  # and iterations of one
_ACTIVE = 1e-5  # of the constraints, from which a bound is reached
_CROSSED = 1e-6  # of the constraints, by which none may be broken
_ASTRAY = 0.1  # of the constraints [10 mm, 0.01 rad]: a round that ends so far out has failed
_SMALLER, _LEAST_REGION = 0.25, 0.02
_SMALL = 0.05  # of the largest multiplier: what has less does not matter


@dataclass(frozen=True, eq=False, repr=False)
class Solution(ShortRepr):
    """Where a search ended.

    Attributes:
        x: the variables.
        value: the objective there, in its own unit.
        residual: of the KKT conditions, relative to the objective's own gradient.
        violation: by how much a constraint is broken [units of 0.1 m or rad].
        iterations: of SLSQP.
        finished: whether it ended by itself.
        message: what SLSQP said last.
        multipliers: what is active there -> its multiplier, in units of t per unit of the
            constraint; by name, largest first.
        bounds: likewise of the bounds: variable -> multiplier, positive at the upper one.
    """

    x: Float[np.ndarray, " k"]
    value: float
    residual: float
    violation: float
    iterations: int
    finished: bool
    message: str
    multipliers: Mapping[str, float]
    bounds: Mapping[int, float]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "x", "multipliers", "bounds")

    @property
    def feasible(self) -> bool:
        """Whether no constraint is broken."""
        return self.violation <= _CROSSED


class _Memory:
    """The program's values and derivatives where they were asked for last."""

    def __init__(self, program: PostureProgram) -> None:
        self.program = program
        self._points: dict[bytes, Point] = {}
        self._slopes: dict[bytes, Point] = {}

    def point(self, x: np.ndarray) -> Point:
        key = x.tobytes()
        if key not in self._points:
            self._points = {key: self.program.at(x)} | dict(list(self._points.items())[:3])
        return self._points[key]

    def slopes(self, x: np.ndarray) -> Point:
        key = x.tobytes()
        if key not in self._slopes:
            self._slopes = {key: self.program.slopes(x, self.point(x))}
        return self._slopes[key]


def solve(
    program: PostureProgram,
    start: Float[np.ndarray, " k"],
    *,
    iterations: int,
    region: float = _REGION,
    progress: Callable[[int], object] | None = None,
) -> Solution:
    """Maximise t from a start.

    Args:
        program: what is to be optimised.
        start: the variables to begin with.
        iterations: of SLSQP, in all.
        region: of the variables, to either side of where a round begins.
        progress: called with 1 after each.
    """
    variables, k = program.variables, len(start)
    x, best, taken, message, finished, anchor = start, -np.inf, 0, "", False, start
    for _ in range(_ROUNDS):
        found, steps, message, by_itself = _round(
            program, x, min(iterations - taken, _ROUND), region, progress, elastic=False
        )
        taken += steps
        x = np.clip(found[:k], variables.lower, variables.upper)
        point = program.at(x)
        if _broken(point) > _ASTRAY:  # it stepped too far: again from where it was, with care
            x, region = anchor, region * _SMALLER
        if _broken(point) > _CROSSED:
            if taken >= iterations or region < _LEAST_REGION:
                break
            continue
        anchor, t = x, float(point.rows.min())
        finished = bool(by_itself and t - best < _PRECISION * max(abs(t), 1.0))
        best = max(t, best)
        if finished or taken >= iterations:
            break
    return judge(program, _best_kept(program, start, x), taken, finished, message)


def judge(
    program: PostureProgram,
    x: Float[np.ndarray, " k"],
    iterations: int,
    finished: bool,
    message: str,
) -> Solution:
    """What some variables are worth, and how far they are from an optimum."""
    residual, multipliers, bounds = optimality(program, x)
    point = program.at(x)
    return Solution(
        x,
        program.value(point),
        residual,
        _broken(point),
        iterations,
        finished,
        message,
        multipliers,
        bounds,
    )


def _best_kept(program: PostureProgram, start: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Where the search ended, brought into place; or its start, where that is what can be kept."""
    if _broken(program.at(x)) <= _CROSSED:
        return x
    candidates = [x]
    with suppress(CopsenseError):
        candidates.append(program.projected(x))
    candidates.append(start)
    points = [program.at(each) for each in candidates]
    kept = [i for i, point in enumerate(points) if _broken(point) <= _CROSSED]
    best = max(kept, key=lambda i: float(points[i].rows.min()), default=0)
    return candidates[best]


def least_violation(
    program: PostureProgram, start: Float[np.ndarray, " k"], *, iterations: int
) -> tuple[Float[np.ndarray, " k"], float, tuple[str, ...]]:
    """The variables that break the constraints least, by how much, and which ones demand it.

    Every constraint but the bounds may be broken by s, the same for all, and s is minimised.

    Returns:
        The variables, s, and the names of the constraints that hold it up.
    """
    k, x, taken, region = len(start), start, 0, _REGION
    size = _broken(program.at(x), standing=program.objective.sign > 0)
    for _ in range(_ROUNDS):
        left = min(iterations - taken, _ROUND)
        found, steps, _, _ = _round(program, x, left, region, None, elastic=True)
        taken += steps
        there = np.clip(found[:k], program.variables.lower, program.variables.upper)
        now = _broken(program.at(there), standing=program.objective.sign > 0)
        gained = size - now
        if gained > 0:
            x, size = there, now
        if gained < _PRECISION * 100 * max(size, 1e-3):
            region *= _SMALLER
        if size < _CROSSED or region < _LEAST_REGION or taken >= iterations:
            break
    return x, size, _demands(program, x, program.at(x), size)


def optimality(
    program: PostureProgram, x: Float[np.ndarray, " k"]
) -> tuple[float, dict[str, float], dict[int, float]]:
    """Residual of the KKT conditions at some variables, and the multipliers that leave the least.

    The gradient of t is one, and the multipliers of the objective's rows sum to one: the residual
    is relative to them.

    Returns:
        The residual; multipliers of the active constraints by name; of the bounds by variable.
    """
    point = program.at(x)
    return _multipliers(program, x, point, float(point.rows.min()), None)


def _demands(program: PostureProgram, x: np.ndarray, point: Point, s: float) -> tuple[str, ...]:
    """Which constraints keep the violation up."""
    if s < _CROSSED:
        return ()
    _, multipliers, bounds = _multipliers(program, x, point, 0.0, s)
    v = program.variables
    named = {v.above[i] if value > 0 else v.below[i]: abs(value) for i, value in bounds.items()}
    return tuple(
        name
        for kind in (multipliers, named)
        for name, value in sorted(kind.items(), key=lambda pair: -pair[1])
        if value > _SMALL * max(kind.values())
    )


def _multipliers(
    program: PostureProgram, x: np.ndarray, point: Point, t: float, s: float | None
) -> tuple[float, dict[str, float], dict[int, float]]:
    """Of the program, or, with a violation s, of the least violation."""
    v, k = program.variables, len(x)
    slopes = program.slopes(x, point, fine=True)
    near = _ACTIVE if s is None else max(_ACTIVE, 0.02 * s)
    level = -s if s is not None else 0.0
    rows = np.flatnonzero(point.rows - t <= level + near)
    rest = np.flatnonzero(point.rest <= level + near)
    if s is not None and program.objective.sign < 0:
        rows = rows[:0]  # what is made smaller has no bound of its own
    # Columns: gradients over (x, t or s) of what is active, the last entry that of t or s.
    one = -1.0 if s is None else 1.0
    columns: list[np.ndarray] = []
    labels: list[str | None] = []
    if s is None:
        basis = program.independent(slopes.equal)
        for column in basis.T @ slopes.equal:
            columns.append(np.r_[column, 0.0])
            labels.append(None)
        free = len(columns)
    else:
        free = 0
        for i in np.flatnonzero(np.abs(point.equal) >= s - near):
            columns.append(np.r_[-np.sign(point.equal[i]) * slopes.equal[i], one])
            labels.append(program.equal_names[i])
    for i in rows:
        columns.append(np.r_[slopes.rows[i], one])
        labels.append(program.row_names[i])
    for i in rest:
        columns.append(np.r_[slopes.rest[i], 0.0 if s is None else one])
        labels.append(program.rest_names[i])
    low = np.flatnonzero(x - v.lower <= _ACTIVE)
    high = np.flatnonzero(v.upper - x <= _ACTIVE)
    columns += [np.r_[np.eye(k)[i], 0.0] for i in low] + [np.r_[-np.eye(k)[i], 0.0] for i in high]
    if not columns:
        return 1.0, {}, {}
    A = np.array(columns).T
    # Maximise t: -grad t = sum of multipliers times gradients; minimise s: grad s = the same.
    b = np.r_[np.zeros(k), -1.0 if s is None else 1.0]
    found = bounded_least_squares(A, b, np.r_[np.full(free, -np.inf), np.zeros(A.shape[1] - free)])
    residual = float(np.abs(A @ found - b).max())
    named: dict[str, float] = {}
    for name, value in zip(labels[free:], found[free : len(labels)], strict=True):
        if value > 1e-8:
            named[str(name)] = named.get(str(name), 0.0) + float(value)
    bounds = {
        int(i): sign * float(value)
        for i, sign, value in zip(
            [*low, *high],
            [-1.0] * len(low) + [1.0] * len(high),
            found[len(labels) :],
            strict=True,
        )
        if value > 1e-8
    }
    return residual, dict(sorted(named.items(), key=lambda p: -p[1])), bounds


def _broken(point: Point, *, standing: bool = False) -> float:
    """By how much a point breaks the constraints; with `standing`, t < 0 counts too."""
    found = max(float(np.abs(point.equal).max(initial=0.0)), float(-point.rest.min(initial=0.0)))
    return max(found, float(-point.rows.min(initial=0.0))) if standing else found


def _round(
    program: PostureProgram,
    start: np.ndarray,
    iterations: int,
    region: float,
    progress: Callable[[int], object] | None,
    *,
    elastic: bool,
) -> tuple[np.ndarray, int, str, bool]:
    """One run of SLSQP: variables and t (or s), iterations, what it says, whether it is done."""
    from scipy.optimize import minimize

    v, k, memory = program.variables, len(start), _Memory(program)
    point = memory.point(start)
    basis = program.independent(memory.slopes(start).equal)
    limited = program.objective.sign > 0  # its rows are to be positive
    last = _broken(point, standing=limited) if elastic else float(point.rows.min())
    sign = 1.0 if elastic else -1.0

    def values(y: np.ndarray) -> np.ndarray:
        at = memory.point(y[:k])
        if not elastic:
            return np.concatenate([at.rows - y[k], at.rest])
        rows = at.rows if limited else at.rows[:0]
        return np.concatenate([rows, at.rest, at.equal, -at.equal]) + y[k]

    def gradients(y: np.ndarray) -> np.ndarray:
        at = memory.slopes(y[:k])
        if not elastic:
            side = np.r_[-np.ones(len(at.rows)), np.zeros(len(at.rest))]
            return np.column_stack([np.vstack([at.rows, at.rest]), side])
        rows = at.rows if limited else at.rows[:0]
        all_ = np.vstack([rows, at.rest, at.equal, -at.equal])
        return np.column_stack([all_, np.ones(len(all_))])

    constraints = [{"type": "ineq", "fun": values, "jac": gradients}]
    if not elastic and basis.shape[1]:
        constraints.append(
            {
                "type": "eq",
                "fun": lambda y: basis.T @ memory.point(y[:k]).equal,
                "jac": lambda y: np.column_stack(
                    [basis.T @ memory.slopes(y[:k]).equal, np.zeros(basis.shape[1])]
                ),
            }
        )
    low, high = np.maximum(v.lower, start - region), np.minimum(v.upper, start + region)
    ends = [*zip(low, high, strict=True), (0.0, None) if elastic else (None, None)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # values clipped to the bounds
        found = minimize(
            lambda y: sign * y[k],
            np.r_[start, last],
            jac=lambda y: np.r_[np.zeros(k), sign],
            bounds=ends,
            constraints=constraints,
            method="SLSQP",
            callback=(lambda _: progress(1)) if progress else None,
            options={"maxiter": max(iterations, 1), "ftol": _PRECISION},
        )
    y = np.asarray(found.x)
    if not np.isfinite(y).all():
        y = np.r_[start, last]
    return y, int(found.nit), str(found.message), bool(found.success)
