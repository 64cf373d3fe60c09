"""fit_family: Gauss-Newton over the logarithms of a family's parameters, exact derivatives.

What is left after an offset per channel is scaled by its own size, and by how few independent rows
it is worth: the covariance is (X'X)^-1 of the scaled sensitivities, sigma^2 and n/n_eff included.
Where a direction would be known to no better than a factor of ten it is not seen, and stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.design import Family
from copsense.errors import CopsenseError
from copsense.identification.families import built, weight_changes
from copsense.identification.measurements import Measurements
from copsense.identification.parameter_fit import Estimate, ParameterFit
from copsense.logs.sway_fit import NORMAL, inflation
from copsense.statics.kkt import Kkt

_STEPS = 12
_SETTLED = 1e-2  # standard deviations by which a step moves the parameters
_LONGEST = 1.5  # of a step, of a logarithm
_UNKNOWN = math.log(10.0)  # half-width of an interval, of a logarithm, from which nothing is seen
_HALVINGS = 6
_AT_BOUND = 1e-3  # of a logarithm
_BLOCKS = 5
_TINY = 1e-12
_EXACT = 1e-3  # of its own spread: no channel is believed better than that
_FEW = 40  # rows that a coarse grid is looked at by
_GRID, _COARSE = 9, 5  # its points for one parameter, and for each of several

Progress = Callable[[int], object]


def fit_family(
    family: Family,
    measurements: Measurements,
    start: Sequence[float] | None = None,
    *,
    progress: Progress = lambda _: None,
) -> ParameterFit:
    """The parameters of a family that explain measurements best.

    Args:
        family: such as one of `copsense.identification.families.identifiable`.
        measurements: what was measured, and where.
        start: of the parameters; default one where the bounds allow it, or where that sees nothing
            the best of a coarse grid.
        progress: called with the rows evaluated.

    Raises:
        CopsenseError: the family has no answer at a posture.
    """
    low, high = np.log(np.array(family.bounds, dtype=float)).T
    u = np.clip(np.zeros(len(low)) if start is None else np.log(start), low, high)
    values, slopes = evaluate(family, u, measurements, progress)
    weights, effective = _weights(measurements.values - values, measurements.values.std(axis=0))
    X = _centred(slopes) * weights[:, None]
    if start is None and not _solve(X, _centred(values) * weights, effective)[1].any():
        # Nothing is seen from here, as of a length that is far too long.
        u = _look(family, measurements, u)
        values, slopes = evaluate(family, u, measurements, progress)
        weights, effective = _weights(measurements.values - values, measurements.values.std(axis=0))
    converged, steps = False, 0
    for number in range(1, _STEPS + 1):
        steps = number
        rest = _centred(measurements.values - values) * weights
        X = _centred(slopes) * weights[:, None]
        step, _ = _solve(X, rest, effective)
        # A parameter at its bound that would leave is held; the others move on.
        for _ in range(len(u)):
            leaving = ((u <= low) & (step < 0)) | ((u >= high) & (step > 0))
            if not leaving.any():
                break
            step, _ = _solve(X * ~leaving, rest, effective)
            step[leaving] = 0.0
        step *= min(1.0, _LONGEST / max(float(np.abs(step).max(initial=0.0)), _TINY))
        before, tried = float((rest**2).sum()), u
        for _ in range(_HALVINGS):
            tried = np.clip(u + step, low, high)
            values_there, slopes_there = evaluate(family, tried, measurements, progress)
            after = float(((_centred(measurements.values - values_there) * weights) ** 2).sum())
            if after <= before * (1 + 1e-12):
                break
            step /= 2
        else:  # nothing better near: rounding is all that is left
            converged = True
            break
        moved = float(np.linalg.norm(X.reshape(-1, len(u)) @ (tried - u)))
        u, values, slopes = tried, values_there, slopes_there
        weights, effective = _weights(measurements.values - values, measurements.values.std(axis=0))
        if moved < _SETTLED:
            converged = True
            break
    return _result(family, u, measurements, values, slopes, steps, converged)


def _look(family: Family, measurements: Measurements, usual: np.ndarray) -> np.ndarray:
    """Logarithms of the best parameters on a coarse grid, by a few of the rows."""
    every = max(1, len(measurements.stances) // _FEW)
    few = measurements.subset(np.arange(0, len(measurements.stances), every))
    low, high = np.log(np.array(family.bounds, dtype=float)).T
    count = _GRID if len(low) == 1 else _COARSE
    grid = product(*(np.linspace(a, b, count) for a, b in zip(low, high, strict=True)))
    spread = few.values.std(axis=0)

    def unexplained(u: np.ndarray) -> float:
        values, _ = predict(built(family, u), few)
        return float(((_centred(few.values - values) / spread) ** 2).sum())

    best, least = usual, unexplained(usual)
    for point in grid:
        u = np.array(point)
        found = unexplained(u)
        if found < least:
            best, least = u, found
    return best


def evaluate(
    family: Family, u: np.ndarray, measurements: Measurements, progress: Progress = lambda _: None
) -> tuple[Float[np.ndarray, "N c"], Float[np.ndarray, "N c p"]]:
    """Predicted channels at logarithms of a family's parameters, and their derivatives by them."""
    first = measurements.stances[0]
    criterion = built(family, u)
    return predict(criterion, measurements, weight_changes(family, u.tolist(), first), progress)


def predict(
    criterion: Criterion,
    measurements: Measurements,
    changes: Sequence[object] = (),
    progress: Progress = lambda _: None,
) -> tuple[Float[np.ndarray, "N c"], Float[np.ndarray, "N c p"]]:
    """The channels that a criterion predicts, and how they change as its weights do."""
    forces, torques, by_weight, torque_by_weight = [], [], [], []
    for row, stance in enumerate(measurements.stances):
        try:
            system = Kkt(stance, criterion)
            f, tau, nu = system.share(system.problem)
            both = [system.weight_derivative(f, nu, change) for change in changes]  # type: ignore[arg-type]
        except CopsenseError as error:
            error.add_note(f"It is row {row} of the measurements.")
            raise
        forces.append(f)
        torques.append(tau)
        by_weight.append(np.array([df for df, _ in both]).reshape(len(changes), len(f)).T)
        torque_by_weight.append(np.array([dt for _, dt in both]).reshape(len(changes), len(tau)).T)
        progress(1)
    values = measurements.predicted(np.array(forces), np.array(torques))
    slopes = measurements.predicted(np.array(by_weight), np.array(torque_by_weight))
    if measurements.shares:
        normal = np.array([measurements.stances[0].unstack(f)[:, 2].sum() for f in forces])
        changed = np.array(
            [measurements.stances[0].unstack(d)[:, 2].sum(axis=0) for d in by_weight]
        )
        for i in measurements.shares:
            values[:, i] /= normal
            slopes[:, i] = (slopes[:, i] - values[:, i, None] * changed) / normal[:, None]
    return values, slopes


def cross_validated(
    build: Callable[[Measurements], Criterion], measurements: Measurements
) -> tuple[float, Float[np.ndarray, " c"]]:
    """Error of what was fitted on the other blocks of a record, held against each block.

    Args:
        build: some rows -> the criterion fitted to them.
        measurements: all rows.

    Returns:
        The root mean square over channels of each error in units of the channel's own spread, and
        the error of each channel (c,) in its unit. Offsets are those of the rows fitted.
    """
    blocks = np.array_split(np.arange(len(measurements.stances)), _BLOCKS)
    squares = np.zeros(len(measurements.names))
    for block in blocks:
        others = np.setdiff1d(np.arange(len(measurements.stances)), block)
        criterion = build(measurements.subset(others))
        values, _ = predict(criterion, measurements)
        rest = measurements.values - values
        squares += ((rest[block] - rest[others].mean(axis=0)) ** 2).sum(axis=0)
    errors = np.sqrt(squares / len(measurements.stances))
    spread = measurements.values.std(axis=0)
    return float(np.sqrt(np.mean((errors / spread) ** 2))), errors


def _weights(
    rest: Float[np.ndarray, "N c"], spread: Float[np.ndarray, " c"]
) -> tuple[Float[np.ndarray, " c"], float]:
    """1 / (size sqrt(n/n_eff)) of each channel's rest, and the rows' independent number."""
    centred = _centred(rest)
    worth = np.array([len(rest) / inflation(column) for column in centred.T])
    size = np.sqrt((centred**2).sum(axis=0) / len(rest))
    size = np.maximum(size, _EXACT * spread + _TINY)
    # sigma^2 of the effective degrees of freedom, an offset taken off.
    size = size * np.sqrt(worth / np.maximum(1.0, worth - 1.0))
    return np.sqrt(worth / len(rest)) / size, float(worth.sum())


def _solve(X: np.ndarray, rest: np.ndarray, effective: float) -> tuple[np.ndarray, np.ndarray]:
    """Least squares over the directions that are seen, and which of them are (p,)."""
    s, vt = _directions(X)
    seen = s > _student(effective, len(vt)) / _UNKNOWN
    V = vt[seen].T
    flat = X.reshape(-1, X.shape[2])
    step = V @ ((V.T @ (flat.T @ rest.reshape(-1))) / s[seen] ** 2)
    return step, seen


def _directions(X: Float[np.ndarray, "N c p"]) -> tuple[np.ndarray, np.ndarray]:
    """Singular values (p,) of the sensitivities, and the directions (p, p), a row each."""
    # Of the triangle alone: the left vectors of thousands of rows take seconds.
    _, s, vt = np.linalg.svd(np.linalg.qr(X.reshape(-1, X.shape[2]), mode="r"))
    return np.pad(s, (0, len(vt) - len(s))), vt


def _student(effective: float, parameters: int) -> float:
    from scipy.stats import t

    return float(t.ppf(0.975, max(1.0, effective - parameters)))


def _result(
    family: Family,
    u: np.ndarray,
    measurements: Measurements,
    values: np.ndarray,
    slopes: np.ndarray,
    steps: int,
    converged: bool,
) -> ParameterFit:
    rest = measurements.values - values
    weights, effective = _weights(rest, measurements.values.std(axis=0))
    X = _centred(slopes) * weights[:, None]
    s, vt = _directions(X)
    reach = _student(effective, len(u))
    seen = s > reach / _UNKNOWN
    covariance = (vt[seen].T / s[seen] ** 2) @ vt[seen]
    by_encoders = _by_encoders(family, u, measurements, values, X, weights, vt[seen].T)
    half = np.hypot(reach * np.sqrt(np.diag(covariance)), NORMAL * by_encoders)
    low, high = np.log(np.array(family.bounds)).T
    estimates = {}
    for i, name in enumerate(family.parameters):
        value = math.exp(u[i])
        blind = float((vt[~seen, i] ** 2).sum()) > 0.5
        ends = math.exp(u[i] - half[i]), math.exp(u[i] + half[i])
        if u[i] <= low[i] + _AT_BOUND and "share" in name:
            estimates[name] = Estimate(math.nan, math.nan, math.exp(u[i] + half[i]), "none")
        elif min(u[i] - low[i], high[i] - u[i]) <= _AT_BOUND:
            estimates[name] = Estimate(value, *ends, "at bound")
        elif blind:
            estimates[name] = Estimate(value, math.nan, math.nan, "not identified")
        else:
            estimates[name] = Estimate(value, *ends, encoders=float(by_encoders[i]))
    criterion = built(family, u)
    return ParameterFit(
        family.name,
        criterion,
        estimates,
        s,
        vt,
        tuple(int(i) for i in np.flatnonzero(~seen)),
        rest.mean(axis=0),
        _centred(rest).std(axis=0),
        effective,
        steps,
        converged,
    )


def _by_encoders(
    family: Family,
    u: np.ndarray,
    measurements: Measurements,
    values: np.ndarray,
    X: np.ndarray,
    weights: np.ndarray,
    V: np.ndarray,
) -> Float[np.ndarray, " p"]:
    """Standard deviation of each logarithm by the encoders' constant errors.

    An error changes what is left, y - p, by D; least squares over the directions seen then move by
    V (X V)^+ D, for each encoder, and the squares add up.
    """
    errors = measurements.encoders
    if errors is None or not V.shape[1]:
        return np.zeros(len(u))
    rest = (measurements.values - values)[errors.rows]
    inverse = V @ np.linalg.pinv(_centred(X[errors.rows]).reshape(-1, len(u)) @ V)
    square = np.zeros(len(u))
    for shifted in errors.shifted:
        there, _ = predict(built(family, u), shifted)
        change = _centred(shifted.values - there - rest) * weights
        square += (inverse @ change.reshape(-1)) ** 2
    return np.sqrt(square)


def _centred(values: np.ndarray) -> np.ndarray:
    return np.asarray(values - values.mean(axis=0))
