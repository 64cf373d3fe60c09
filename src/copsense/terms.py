"""Terms: the quadratic costs that a criterion is a sum of, and their matrices on a robot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, read_only
from copsense.contact import Contact
from copsense.content import ByContent, own, plain, show
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.patterns import by_name
from copsense.quadratic import Quadratic
from copsense.robot import PLACEHOLDER_EFFORT, Robot

TorqueWeights = ArrayLike | Mapping[str, float] | Literal["1/limit^2", "inverse inertia"]
WrenchWeights = ArrayLike | Mapping[str, ArrayLike]


@dataclass(frozen=True, eq=False, repr=False)
class TorqueTerm(ByContent):
    """1/2 scale tau' W tau.

    Attributes:
        weights: a number for every joint; joint name -> number, a name with a star being of every
            joint that it fits, ``"*hip*"``, and a star alone of the rest (others 0); a vector
            (n,); a symmetric positive-definite matrix (n, n); ``"1/limit^2"`` for the model's
            effort limits; or ``"inverse inertia"`` for the inverse of the joint block of M(q),
            which depends on which link is the model's base.
        scale: factor of the term, positive.
    """

    weights: TorqueWeights = 1.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Own the weights."""
        object.__setattr__(self, "weights", own(self.weights))

    def _fields(self) -> tuple[object, ...]:
        return self.weights, self.scale

    def __repr__(self) -> str:
        """The weights, and the scale where it is not one."""
        return f"TorqueTerm({show(self.weights)}{_show_scale(self.scale)})"

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in `Criterion.to_dict`."""
        return {"kind": "torque", "weights": plain(self.weights), "scale": float(self.scale)}


@dataclass(frozen=True, eq=False, repr=False)
class WrenchTerm(ByContent):
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

    def __post_init__(self) -> None:
        """Own the weights and the reference."""
        object.__setattr__(self, "weights", own(self.weights))
        object.__setattr__(self, "reference", own(self.reference))

    def _fields(self) -> tuple[object, ...]:
        return self.weights, self.reference, self.scale

    def __repr__(self) -> str:
        """The weights, the reference where there is one, and the scale where it is not one."""
        near = "" if self.reference is None else f", reference={show(self.reference)}"
        return f"WrenchTerm({show(self.weights)}{near}{_show_scale(self.scale)})"

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in `Criterion.to_dict`."""
        found = {"kind": "wrench", "weights": plain(self.weights), "scale": float(self.scale)}
        if self.reference is not None:
            found["reference"] = plain(self.reference)
        return found


@dataclass(frozen=True, eq=False, repr=False)
class PreloadTerm(ByContent):
    """e' f: a command that would have the contacts where the ground does not let them be.

    Beside the elastic energy of the joints (`copsense.stiffness`). A foot that is commanded lower
    pushes harder.

    Attributes:
        displacement: e, of each contact's commanded place from where it stands: six numbers by
            contact name (others 0), or (nc, 6), along and about the contact's axes [m, rad].
        scale: factor of the term, positive.
    """

    displacement: Mapping[str, ArrayLike] | ArrayLike
    scale: float = 1.0

    def __post_init__(self) -> None:
        """Own the displacement."""
        object.__setattr__(self, "displacement", own(self.displacement))

    def _fields(self) -> tuple[object, ...]:
        return self.displacement, self.scale

    def __repr__(self) -> str:
        """The displacement, and the scale where it is not one."""
        return f"PreloadTerm({show(self.displacement)}{_show_scale(self.scale)})"

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in `Criterion.to_dict`."""
        found = plain(self.displacement)
        return {"kind": "preload", "displacement": found, "scale": float(self.scale)}


Term = TorqueTerm | WrenchTerm | PreloadTerm


def quadratic_sum(
    criterion: str,
    terms: Sequence[Term],
    robot: Robot,
    contacts: Sequence[Contact],
) -> Quadratic:
    """The matrices of a sum of terms.

    Args:
        criterion: whose terms they are, for messages.
        terms: the terms.
        robot: gives the joints.
        contacts: give the stacked forces.

    Raises:
        InvalidInputError: weights that do not fit, or are indefinite.
        UnknownNameError: weights of a joint or contact that is not there.
    """
    nj, m = len(robot.torque_names), sum(len(contact.components) for contact in contacts)
    torque, inertia = np.zeros((nj, nj)), 0.0
    wrench, pull = np.zeros((m, m)), np.zeros(m)
    for term in terms:
        if isinstance(term, PreloadTerm):
            pull -= term.scale * _displacement(criterion, term.displacement, contacts)
        elif isinstance(term, WrenchTerm):
            W = term.scale * _wrench_matrix(criterion, term, contacts)
            wrench += W
            if term.reference is not None:
                pull += W @ _reference(criterion, term.reference, contacts)
        elif isinstance(term.weights, str) and term.weights == "inverse inertia":
            inertia += term.scale
        else:
            torque += term.scale * _torque_matrix(criterion, term, robot)
    return Quadratic(read_only(torque), inertia, read_only(wrench), read_only(pull))


def _show_scale(scale: float) -> str:
    return "" if scale == 1 else f", scale={scale:g}"


def _torque_matrix(criterion: str, term: TorqueTerm, robot: Robot) -> np.ndarray:
    names, weights = robot.torque_names, term.weights
    if isinstance(weights, str):
        if weights != "1/limit^2":
            raise UnknownNameError("torque weight", weights, ("1/limit^2", "inverse inertia"))
        limits = robot.effort_limits
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
        weights = _by_joint(criterion, weights, names)
    array = _as_numbers(criterion, weights)
    if array.ndim == 0:
        array = np.full(len(names), float(array))
    return _weight_matrix(criterion, "torque", array, len(names), definite=array.ndim == 2)


def _by_joint(criterion: str, weights: Mapping[str, float], names: Sequence[str]) -> list[float]:
    """Weights in the joints' order; a name with a star is of every joint that it fits."""
    found = by_name(
        weights, names, f"joint in the weights of {criterion!r}", f"criterion {criterion!r}"
    )
    return [found.get(name, ("", 0.0))[1] for name in names]


def _wrench_matrix(criterion: str, term: WrenchTerm, contacts: Sequence[Contact]) -> np.ndarray:
    weights, names = term.weights, [contact.name for contact in contacts]
    m = sum(len(contact.components) for contact in contacts)
    if isinstance(weights, Mapping):
        for contact in weights:
            if contact not in names:
                raise UnknownNameError(f"contact in the weights of {criterion!r}", contact, names)
        rows = [_as_numbers(criterion, weights.get(n, np.zeros(6))) for n in names]
    else:
        array = _as_numbers(criterion, weights)
        if array.ndim == 2:
            return _weight_matrix(criterion, "wrench", array, m, definite=False)
        rows = [array] * len(contacts)
    if any(row.shape != (6,) for row in rows):
        raise InvalidInputError(
            f"criterion {criterion!r}: the wrench weights have another shape than the contacts. "
            f"Give six numbers (fx, fy, fz, mx, my, mz), or a ({m}, {m}) matrix."
        )
    return _weight_matrix(criterion, "wrench", _stack(rows, contacts), m, definite=False)


def _as_numbers(criterion: str, weights: ArrayLike) -> np.ndarray:
    try:
        return np.asarray(weights, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"criterion {criterion!r}: the weights {weights!r} are not numbers. Give numbers."
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


def _reference(criterion: str, reference: np.ndarray, contacts: Sequence[Contact]) -> np.ndarray:
    what = f"the reference of criterion {criterion!r}"
    shape, meaning = (len(contacts), 6), "fx, fy, fz, mx, my, mz of each contact"
    return _stack(finite_array(reference, what, shape, meaning), contacts)


def _displacement(
    criterion: str, displacement: Mapping[str, ArrayLike] | ArrayLike, contacts: Sequence[Contact]
) -> np.ndarray:
    what = f"the preload of criterion {criterion!r}"
    if isinstance(displacement, Mapping):
        names = [contact.name for contact in contacts]
        for name in displacement:
            if name not in names:
                raise UnknownNameError(f"contact in the preload of {criterion!r}", name, names)
        rows = [_as_numbers(criterion, displacement.get(name, np.zeros(6))) for name in names]
        if any(row.shape != (6,) for row in rows):
            raise InvalidInputError(f"{what} is not six numbers [m, rad] for each contact.")
        return _stack(rows, contacts)
    shape, meaning = (len(contacts), 6), "x, y, z [m] and turns about them [rad] of each contact"
    return _stack(finite_array(displacement, what, shape, meaning), contacts)


def _stack(wrenches: Iterable[np.ndarray], contacts: Sequence[Contact]) -> np.ndarray:
    """Six numbers of each contact as stacked forces, dropping what it cannot carry."""
    parts = [w[list(c.components)] for w, c in zip(wrenches, contacts, strict=True)]
    return np.concatenate(parts)
