"""Qp: the solvers of quadratic and linear programs, their answers validated.

No other module calls daqp, or SciPy's linear programs and bounded least squares.
`dual_active_set` is the call, for `statics.program.Program`, which solves exactly, with
`least_distance_multipliers` in reserve; `quick_optimum` is for a control loop, where microseconds
count and the solver's own precision is enough; `linear_minimum` and `least_relaxation` are linear
programs.
"""

from __future__ import annotations

import warnings
from typing import Any

import daqp
import numpy as np
from jaxtyping import Float

_FEASIBLE = 1e-9  # violation of a row, in shares of the unit, that rounding may leave
_SLIGHT = 1e-7  # likewise, where rows that all but meet in one corner leave no finer one
_ZERO = 1e-12  # norm of a row that limits nothing
_UNBOUNDED = 1e30  # as the solver writes infinity
_QUICK = 1e-6  # violation of a condition, relative, that a control loop accepts
_FLAT = 1e-6  # curvature of a proximal step along flat directions, relative to the cost's largest
_STEPS = 20  # proximal steps; one to three are usual
_NOTHING = 1e-9  # of the unit: a slope so small, of a cost whose curvature is 1, is none
_EXACT = 1e-9  # violation of the cost's own conditions under which no further step is taken
_PROOF = 1e-10  # what a linear program's solution may leave
_LINEAR_TOLERANCES = (1e-10, 1e-9, 1e-8, 1e-7)  # of the slower solver, in the order tried


def dual_active_set(
    H: np.ndarray, h: np.ndarray, A: np.ndarray, b: np.ndarray, **settings: float
) -> tuple[np.ndarray, int, np.ndarray]:
    """The only call of the solver: its point, its exit flag (1 and more are good), multipliers."""
    x, _, flag, info = daqp.solve(
        np.ascontiguousarray(H),
        np.ascontiguousarray(h),
        np.ascontiguousarray(A),
        np.ascontiguousarray(b),
        np.full(len(b), -_UNBOUNDED),
        np.zeros(len(b), dtype=np.int32),
        **settings,
    )
    return np.asarray(x), int(flag), np.asarray(info["lam"])


def least_distance_multipliers(
    A: Float[np.ndarray, "r z"], b: Float[np.ndarray, " r"]
) -> Float[np.ndarray, " r"] | None:
    """What presses at the shortest y with A y <= b (Lawson and Hanson); None where it failed.

    The multipliers, but for their scale, are the non-negative combination u of rows nearest to
    (0, .., 0, 1).
    """
    from scipy.optimize import nnls

    C = np.vstack([-A.T, -b / max(float(np.abs(b).max(initial=0.0)), 1e-300)])
    try:
        u, _ = nnls(C, np.eye(len(C))[-1], maxiter=30 * C.shape[1])
    except (RuntimeError, ValueError):
        return None
    return np.asarray(u)


def bounded_least_squares(
    A: Float[np.ndarray, "r z"], b: Float[np.ndarray, " r"], lower: Float[np.ndarray, " z"]
) -> Float[np.ndarray, " z"]:
    """The x of least |A x - b| that is nowhere below `lower`; the caller looks at what remains."""
    from scipy.optimize import lsq_linear

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = lsq_linear(A, b, bounds=(lower, np.inf), tol=1e-14, max_iter=500)
    return np.asarray(found.x)


def quick_optimum(
    H: Float[np.ndarray, "z z"],
    h: Float[np.ndarray, " z"],
    A: Float[np.ndarray, "r z"],
    b: Float[np.ndarray, " r"],
    unit: float,
    flat: Float[np.ndarray, "z k"] | None = None,
) -> Float[np.ndarray, " z"] | None:
    """minimise 1/2 y' H y + h' y subject to A y <= b, for a control loop.

    Args:
        H: positive definite, but along `flat`.
        h: the cost's slope at zero.
        A: rows.
        b: their bounds.
        unit: the size of y that errors are relative to.
        flat: orthonormal directions that are to cost nothing, whatever H and h say; None for none.

    Returns:
        The optimum, of several one, or None where there is none or none that meets its conditions
        was found.
    """
    size = float(np.abs(H).max()) or 1.0
    length = np.maximum(np.sqrt((A * A).sum(axis=1)), _ZERO)
    rows, bound, H, h = A / length[:, None], b / length, H / size, h / size
    if flat is not None:
        H, h = H - flat.dot(flat.T.dot(H)), h - flat.dot(flat.T.dot(h))
        H = H - H.dot(flat).dot(flat.T)
    for tolerance in (_FEASIBLE, _SLIGHT):
        best = _proximal_steps(H, h, rows, bound, unit, flat, tolerance)
        if best is not None:
            return best
    return None


def _proximal_steps(
    H: Float[np.ndarray, "z z"],
    h: Float[np.ndarray, " z"],
    rows: Float[np.ndarray, "r z"],
    bound: Float[np.ndarray, " r"],
    unit: float,
    flat: Float[np.ndarray, "z k"] | None,
    tolerance: float,
) -> Float[np.ndarray, " z"] | None:
    """The optimum of a cost of unit size that is flat along `flat`; None where none was found."""
    curved = H if flat is None else H + _FLAT * flat.dot(flat.T)
    drawn, best = h, None
    for _ in range(1 if flat is None else _STEPS):
        y, flag, l = dual_active_set(curved, drawn, rows, bound, primal_tol=tolerance * unit)
        if flag < 1:
            break
        # Of the cost itself: what a proximal step pulls is an error.
        slope = H.dot(y) + h
        off = float(np.abs(slope + l.dot(rows)).max()) / max(
            float(np.abs(slope).max()), float(np.abs(h).max()), _NOTHING * unit
        )
        over = float((rows.dot(y) - bound).max(initial=0.0))
        if off <= _QUICK and over <= _QUICK * unit and l.min(initial=0.0) >= 0.0:
            best = y
        if flat is None or off <= _EXACT:
            break
        drawn = h - _FLAT * flat.dot(flat.T.dot(y))
    return best


def linear_minimum(
    cost: Float[np.ndarray, " z"], A: Float[np.ndarray, "r z"], b: Float[np.ndarray, " r"]
) -> Float[np.ndarray, " z"] | None:
    """minimise cost y subject to A y <= b, rows of about unit length; None where none was found."""
    y = _linear_by_dual_active_set(cost, A, b)
    if y is not None:
        return y
    found = _linear_program(cost, A, b)
    return None if found is None else np.asarray(found.x)


def least_relaxation(
    A: Float[np.ndarray, "r z"],
    b: Float[np.ndarray, " r"],
    soft: Float[np.ndarray, " r"],
    far: float | None = None,
) -> tuple[float, Float[np.ndarray, " r"]] | None:
    """minimise s >= 0 subject to A y - s soft <= b: how far rows must be relaxed to leave a point.

    Args:
        A: rows.
        b: their bounds.
        soft: how much each row is relaxed per unit of s, 0 for one that is not.
        far: the largest entry that y may have; None for any.

    Returns:
        s, and each row's multiplier (r,), zero where it does not press; None if unsolved.
    """
    v = A.shape[1]
    rows = np.vstack([np.hstack([A, -soft[:, None]]), -np.eye(v + 1)[-1:]])
    cost = np.append(np.zeros(v), 1.0)
    bounds = (None, None) if far is None else [(-far, far)] * v + [(None, None)]
    found = _linear_program(cost, rows, np.append(b, 0.0), bounds)
    if found is None:
        return None
    return float(found.fun), -np.asarray(found.ineqlin.marginals)[:-1]


def _linear_program(
    cost: Float[np.ndarray, " z"],
    A: Float[np.ndarray, "r z"],
    b: Float[np.ndarray, " r"],
    bounds: object = (None, None),
) -> Any:
    """SciPy's answer to: minimise cost y subject to A y <= b; None where it has none."""
    from scipy.optimize import linprog

    for tolerance in _LINEAR_TOLERANCES:  # some faces are too slight for the finest
        options = {
            "primal_feasibility_tolerance": tolerance,
            "dual_feasibility_tolerance": tolerance,
        }
        found = linprog(cost, A, b, bounds=bounds, method="highs-ds", options=options)
        if found.status == 0:
            return found
    return None


def _linear_by_dual_active_set(cost: np.ndarray, A: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """The minimum of cost y, if the solver's multipliers l prove it: cost + A' l = 0, l >= 0.

    Then cost y >= -l b for every feasible y, which has to be met.
    """
    v = A.shape[1]
    A, b = np.array(A), np.array(b)  # the solver takes no read-only arrays
    # A linear program as proximal steps, until the steps no longer move.
    steps = {"eps_prox": 1e-4, "eta_prox": 1e-12, "iter_limit": 1000}
    y, flag, l = dual_active_set(
        np.zeros((v, v)), cost, A, b, primal_tol=1e-11, dual_tol=1e-12, **steps
    )
    if flag != 1 or not np.all(np.isfinite(y)):
        return None
    proofs = (A @ y - b, -l, np.abs(cost + A.T @ l), cost @ y + l @ b)
    return y if max(float(np.max(p, initial=0.0)) for p in proofs) <= _PROOF else None
