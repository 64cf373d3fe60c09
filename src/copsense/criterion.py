"""Criterion: what a distribution of the load among the contacts minimises.

A criterion is a small frozen value, a sum of quadratic terms (theory.md, Criteria):

    minimise  1/2 tau' W_tau tau + 1/2 (f - f_ref)' W_f (f - f_ref)   subject to the statics.

The named ones are functions that return such a value; a new one is a new function here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, finite_number
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.robot import PLACEHOLDER_EFFORT
from copsense.stance import Stance

TorqueWeights = ArrayLike | Mapping[str, float] | Literal["1/limit^2", "inverse inertia"]
WrenchWeights = ArrayLike | Mapping[str, ArrayLike]


@dataclass(frozen=True, eq=False)
class TorqueTerm:
    """1/2 scale tau' W tau.

    Attributes:
        weights: a number for every joint; joint name -> number (others 0); a vector (n,); a
            symmetric positive-definite matrix (n, n); ``"1/limit^2"`` for the model's effort
            limits; or ``"inverse inertia"`` for the inverse of the joint block of M(q), which
            depends on which link is the model's base.
        scale: factor of the term, positive.
    """

    weights: TorqueWeights = 1.0
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class WrenchTerm:
    """1/2 scale (f - f_ref)' W (f - f_ref), wrenches in contact axes, force first.

    Attributes:
        weights: six numbers for every contact, contact name -> six numbers (others 0), or a
            symmetric positive-semidefinite matrix over the stance's stacked forces (m, m).
        reference: f_ref (nc, 6) [N, Nm], or None for zero.
        scale: factor of the term, positive.
    """

    weights: WrenchWeights
    reference: Float[np.ndarray, "nc 6"] | None = None
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Criterion:
    """What a robot minimises when it shares its load among its contacts.

    Attributes:
        name: how it is called in results.
        terms: the quadratic terms, at least one.
        tie_break: the criterion that chooses where `terms` leave several minimisers.
    """

    name: str
    terms: tuple[TorqueTerm | WrenchTerm, ...]
    tie_break: Criterion | None = None

    def __post_init__(self) -> None:
        """Refuse an empty sum and factors that would turn a minimum into a maximum."""
        if not self.terms:
            raise InvalidInputError(f"criterion {self.name!r} has no term to minimise. Give one.")
        if not isinstance(self.tie_break, Criterion | None):
            raise InvalidInputError(
                f"criterion {self.name!r}: the tie-break {self.tie_break!r} is no criterion. Give "
                "one, such as minimum_wrench(1.0)."
            )
        for term in self.terms:
            finite_number(
                term.scale, f"the scale of a term of criterion {self.name!r}", positive=True
            )

    def named(self, name: str) -> Criterion:
        """The same criterion under another name."""
        return replace(self, name=name)

    def at(self, stance: Stance) -> Quadratic:
        """The criterion's matrices at a stance.

        Raises:
            InvalidInputError: weights that do not fit the stance, or are indefinite.
        """
        nj, m = len(stance.robot.torque_names), len(stance.component_index)
        torque, inertia = np.zeros((nj, nj)), 0.0
        wrench, pull = np.zeros((m, m)), np.zeros(m)
        for term in self.terms:
            if isinstance(term, WrenchTerm):
                W = term.scale * _wrench_matrix(self.name, term, stance)
                wrench += W
                if term.reference is not None:
                    pull += W @ stance.stack(_reference(self.name, term.reference, stance))
            elif isinstance(term.weights, str) and term.weights == "inverse inertia":
                inertia += term.scale
            else:
                torque += term.scale * _torque_matrix(self.name, term, stance)
        return Quadratic(torque, inertia, wrench, pull)


@dataclass(frozen=True, eq=False)
class Quadratic:
    """A criterion's matrices at one stance: W_tau = torque + inertia * M_j^-1, W_f, W_f f_ref.

    Attributes:
        torque: the constant part of W_tau (n, n).
        inertia: the factor of the inverse joint-space inertia in W_tau.
        wrench: W_f (m, m).
        pull: W_f f_ref (m,).
    """

    torque: Float[np.ndarray, "n n"]
    inertia: float
    wrench: Float[np.ndarray, "m m"]
    pull: Float[np.ndarray, " m"]

    def active(self) -> np.ndarray:
        """Joints (n,) whose torque has a cost; the others are free to take any."""
        if self.inertia:
            return np.ones(len(self.torque), dtype=bool)
        return np.asarray(np.any(self.torque != 0, axis=1))

    def compliance(self, stance: Stance) -> Float[np.ndarray, "a a"]:
        """P = W_tau^-1 over the active joints; no inverse of the inertia is formed."""
        on = self.active()
        if self.inertia:
            # P = (D + c M^-1)^-1 = M (D M + c 1)^-1, which holds for a singular M too.
            M = _joint_inertia(stance)
            return np.linalg.solve((self.torque @ M + self.inertia * np.eye(len(M))).T, M.T).T
        return np.asarray(np.linalg.inv(self.torque[np.ix_(on, on)]))

    def compliance_derivative(
        self, stance: Stance, multipliers: Float[np.ndarray, " nv"]
    ) -> Float[np.ndarray, "a nv"]:
        """d(P nu_j)/dq at fixed nu: zero unless the weight follows the inertia."""
        on, nb = self.active(), stance.robot.base_nv
        if not self.inertia:
            return np.zeros((int(on.sum()), len(multipliers)))
        # With S = D M + c 1: dP nu = (1 - P D) dM S^-1 nu.
        M = _joint_inertia(stance)
        S = self.torque @ M + self.inertia * np.eye(len(M))
        inner = np.zeros_like(multipliers)
        inner[nb:] = np.linalg.solve(S, multipliers[nb:])
        change = stance.inertia_derivative(inner)[nb:]
        return np.asarray(change - self.compliance(stance) @ (self.torque @ change))


def minimum_wrench(characteristic_length: float, *, name: str = "minimum-wrench") -> Criterion:
    """Criterion 1 of [Romano2016]: the least norm of the contact wrenches.

    A norm of forces and moments depends on the unit of length, so the length is explicit: a moment
    counts as a force at that arm, W_f = diag(1, 1, 1, 1/L^2, 1/L^2, 1/L^2). The paper means 1 m.

    Args:
        characteristic_length: L [m], positive.
        name: how it is called in results.
    """
    return Criterion(name, (WrenchTerm(_norm_weights(characteristic_length)),))


def minimum_torque(
    *, tie_break: Criterion | None = None, name: str = "minimum-torque"
) -> Criterion:
    """Criterion 2 of [Romano2016]: the least norm of the joint torques.

    Args:
        tie_break: chooses among wrenches that no torque can feel (redundant contacts).
        name: how it is called in results.
    """
    return Criterion(name, (TorqueTerm(1.0),), tie_break)


def weighted_torque(
    weights: TorqueWeights,
    *,
    tie_break: Criterion | None = None,
    name: str = "weighted-torque",
) -> Criterion:
    """The least weighted norm of the joint torques; see `TorqueTerm` for the weights."""
    return Criterion(name, (TorqueTerm(weights),), tie_break)


def minimum_tangential(tie_break: Criterion, *, name: str = "minimum-tangential") -> Criterion:
    """The least tangential force ([Romano2016] Lemma 3), which leaves a family of minimisers.

    Args:
        tie_break: chooses in that family. With `minimum_wrench` and coplanar feet the result is
            the minimum wrench's; with `minimum_torque` it is not.
        name: how it is called in results.
    """
    tangential = WrenchTerm(np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    return Criterion(name, (tangential,), tie_break)


def reference_wrench(
    reference: ArrayLike, characteristic_length: float, *, name: str = "reference-wrench"
) -> Criterion:
    """The wrenches nearest to a reference, in the norm of `minimum_wrench`.

    Args:
        reference: wrenches (nc, 6) in contact axes, force first [N, Nm].
        characteristic_length: L [m] of the norm.
        name: how it is called in results.
    """
    weights = _norm_weights(characteristic_length)
    wrenches = finite_array(
        reference, f"the reference of criterion {name!r}", (None, 6), "fx, fy, fz, mx, my, mz"
    )
    return Criterion(name, (WrenchTerm(weights, wrenches),))


def mixed(
    *parts: tuple[Criterion, float], tie_break: Criterion | None = None, name: str = "mixed"
) -> Criterion:
    """A weighted sum of criteria.

    Args:
        *parts: pairs (criterion, positive factor).
        tie_break: chooses where the sum leaves several minimisers.
        name: how it is called in results.
    """
    terms = tuple(
        replace(
            term,
            scale=term.scale
            * finite_number(factor, "the factor of a mixed criterion", positive=True),
        )
        for part, factor in parts
        for term in part.terms
    )
    return Criterion(name, terms, tie_break)


# The criteria that the command line can name; each takes the characteristic length [m].
CRITERIA: dict[str, Callable[[float], Criterion]] = {
    "minimum-wrench": minimum_wrench,
    "minimum-torque": lambda length: minimum_torque(),
    "limit-weighted-torque": lambda length: weighted_torque(
        "1/limit^2", name="limit-weighted-torque"
    ),
    "inertia-weighted-torque": lambda length: weighted_torque(
        "inverse inertia", name="inertia-weighted-torque"
    ),
    "minimum-tangential": lambda length: minimum_tangential(minimum_wrench(length)),
}


def criterion_named(name: str, characteristic_length: float = 1.0) -> Criterion:
    """A criterion by its name.

    Raises:
        UnknownNameError: no such criterion.
    """
    if name not in CRITERIA:
        raise UnknownNameError("criterion", name, CRITERIA)
    return CRITERIA[name](characteristic_length)


def _norm_weights(characteristic_length: float) -> Float[np.ndarray, " 6"]:
    what = "the characteristic length L [m]"
    length = finite_number(characteristic_length, what, positive=True)
    # Beyond these no solver of double precision keeps force and moment apart from nothing.
    if not 1e-6 <= length <= 1e6:
        raise InvalidInputError(
            f"{what} is {length:g}: a force or a moment would count for nothing. Give a length "
            "between 1e-6 and 1e6; the paper means 1."
        )
    moment = 1.0 / length**2
    return np.array([1.0, 1.0, 1.0, moment, moment, moment])


def _joint_inertia(stance: Stance) -> np.ndarray:
    nb = stance.robot.base_nv
    return stance.mass_matrix[nb:, nb:]


def _torque_matrix(criterion: str, term: TorqueTerm, stance: Stance) -> np.ndarray:
    names, weights = stance.robot.torque_names, term.weights
    if isinstance(weights, str):
        if weights != "1/limit^2":
            raise UnknownNameError("torque weight", weights, ("1/limit^2", "inverse inertia"))
        limits = stance.robot.effort_limits
        bad = [n for n, limit in zip(names, limits, strict=True) if np.isinf(limit)]
        if bad:
            raise InvalidInputError(
                f"criterion {criterion!r} weighs by 1/limit^2, but the model gives only a "
                f"placeholder (none, zero, or {PLACEHOLDER_EFFORT:g} and more) as the effort limit "
                f"of {', '.join(bad)}. Give weights as {{joint: 1 / limit**2}}; a joint left out "
                "costs nothing."
            )
        return np.diag(1.0 / limits**2)
    if isinstance(weights, Mapping):
        for joint in weights:
            if joint not in names:
                raise UnknownNameError(f"joint in the weights of {criterion!r}", joint, names)
        weights = [weights.get(joint, 0.0) for joint in names]
    array = _as_numbers(criterion, weights)
    if array.ndim == 0:
        array = np.full(len(names), float(array))
    return _weight_matrix(criterion, "torque", array, len(names), definite=array.ndim == 2)


def _wrench_matrix(criterion: str, term: WrenchTerm, stance: Stance) -> np.ndarray:
    weights, m = term.weights, len(stance.component_index)
    if isinstance(weights, Mapping):
        for contact in weights:
            if contact not in stance.contact_names:
                raise UnknownNameError(
                    f"contact in the weights of {criterion!r}", contact, stance.contact_names
                )
        rows = [_as_numbers(criterion, weights.get(n, np.zeros(6))) for n in stance.contact_names]
    else:
        array = _as_numbers(criterion, weights)
        if array.ndim == 2:
            return _weight_matrix(criterion, "wrench", array, m, definite=False)
        rows = [array] * len(stance.contacts)
    if any(row.shape != (6,) for row in rows):
        raise InvalidInputError(
            f"criterion {criterion!r}: the wrench weights have another shape than the contacts. "
            f"Give six numbers (fx, fy, fz, mx, my, mz), or a ({m}, {m}) matrix."
        )
    return _weight_matrix(criterion, "wrench", stance.stack(np.array(rows)), m, definite=False)


def _as_numbers(criterion: str, weights: ArrayLike) -> np.ndarray:
    try:
        return np.asarray(weights, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"criterion {criterion!r}: the weights {weights!r} are no numbers. Give numbers."
        ) from None


def _weight_matrix(
    criterion: str, what: str, array: np.ndarray, size: int, *, definite: bool
) -> np.ndarray:
    """A vector or matrix of weights as a checked matrix."""
    matrix = np.diag(array) if array.ndim == 1 else array
    if matrix.shape != (size, size):
        raise InvalidInputError(
            f"criterion {criterion!r}: {what} weights have shape {array.shape}. Give shape "
            f"({size},) or ({size}, {size}) for this stance."
        )
    if not np.all(np.isfinite(matrix)):
        raise InvalidInputError(
            f"criterion {criterion!r}: {what} weights are not finite. Give finite numbers."
        )
    largest = float(np.abs(matrix).max(initial=0.0))
    if not np.all(np.abs(matrix - matrix.T) <= 1e-10 * largest):
        raise InvalidInputError(
            f"criterion {criterion!r}: {what} weights are not symmetric. Give (W + W') / 2."
        )
    if not size:
        return matrix
    lowest = float(np.linalg.eigvalsh(matrix)[0])
    if lowest < -1e-12 * largest or (definite and lowest <= 1e-12 * largest):
        need = "positive definite" if definite else "positive semidefinite"
        raise InvalidInputError(
            f"criterion {criterion!r}: {what} weights must be {need}; their smallest eigenvalue is "
            f"{lowest:.3g}. Give every direction a "
            f"{'positive' if definite else 'non-negative'} cost."
        )
    return matrix


def _reference(criterion: str, reference: np.ndarray, stance: Stance) -> np.ndarray:
    what = f"the reference of criterion {criterion!r}"
    return finite_array(
        reference, what, (len(stance.contacts), 6), "fx, fy, fz, mx, my, mz of each contact"
    )
