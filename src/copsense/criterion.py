"""Criterion: what a distribution of the load among the contacts minimises.

A criterion is a small frozen value, a sum of quadratic terms (theory.md, Criteria):

    minimise  1/2 tau' W_tau tau + 1/2 (f - f_ref)' W_f (f - f_ref)   subject to the statics.

The named ones are functions that return such a value; a new one is a new function here.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import check_keys, check_name, check_type, finite_array, finite_number
from copsense.contact import Contact
from copsense.content import ByContent
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.magnitudes import doubt_length
from copsense.quadratic import Quadratic
from copsense.robot import Robot
from copsense.stance import Stance
from copsense.terms import (
    PreloadTerm,
    Term,
    TorqueTerm,
    TorqueWeights,
    WrenchTerm,
    WrenchWeights,
    quadratic_sum,
)

__all__ = [
    "CRITERIA",
    "Criterion",
    "PreloadTerm",
    "Quadratic",
    "TorqueTerm",
    "TorqueWeights",
    "WrenchTerm",
    "WrenchWeights",
    "criterion_named",
    "minimum_tangential",
    "minimum_torque",
    "minimum_wrench",
    "mixed",
    "reference_wrench",
    "weighted_torque",
]


_TERMS = (TorqueTerm, WrenchTerm, PreloadTerm)


@dataclass(frozen=True, eq=False, repr=False)
class Criterion(ByContent):
    """What a robot minimises when it shares its load among its contacts.

    Criteria compare and hash by content, name included.

    Attributes:
        name: how it is called in results.
        terms: the quadratic terms, at least one.
        tie_break: the criterion that chooses where `terms` leave several minimisers.
    """

    name: str
    terms: tuple[Term, ...]
    tie_break: Criterion | None = None

    def __post_init__(self) -> None:
        """Reject an empty sum and factors that would turn a minimum into a maximum."""
        check_name(self.name, "the name of a criterion")
        terms = self.terms
        if not isinstance(terms, tuple | list) or not all(isinstance(t, _TERMS) for t in terms):
            raise InvalidInputError(
                f"the terms of criterion {self.name!r} are {reprlib.repr(terms)}. Give a tuple of "
                "TorqueTerm and WrenchTerm values, or use minimum_torque() or minimum_wrench(1.0)."
            )
        object.__setattr__(self, "terms", tuple(terms))
        if not self.terms:
            raise InvalidInputError(f"criterion {self.name!r} has no term to minimise. Give one.")
        if not isinstance(self.tie_break, Criterion | None):
            raise InvalidInputError(
                f"criterion {self.name!r}: the tie-break {self.tie_break!r} is not a criterion. "
                "Give one, such as minimum_wrench(1.0)."
            )
        for term in self.terms:
            finite_number(
                term.scale, f"the scale of a term of criterion {self.name!r}", positive=True
            )

    def _fields(self) -> tuple[object, ...]:
        return self.name, self.terms, self.tie_break

    def __repr__(self) -> str:
        """Name, terms and tie-break."""
        terms = ", ".join(repr(term) for term in self.terms)
        tie = f", tie_break={self.tie_break!r}" if self.tie_break else ""
        return f"Criterion({self.name!r}, {terms}{tie})"

    def named(self, name: str) -> Criterion:
        """The same criterion under another name."""
        return replace(self, name=name)

    def at(self, stance: Stance) -> Quadratic:
        """The criterion's matrices on a stance's robot and contacts, the same at every posture.

        Raises:
            InvalidInputError: weights that do not fit the stance, or are indefinite.
        """
        found = _quadratic(self, stance.robot, tuple(stance.contacts))
        if stance.closures is None:
            return found
        return found.padded(stance.closures.basis.shape[1])

    def to_dict(self) -> dict[str, Any]:
        """Plain data of this criterion, for JSON or TOML: `from_dict` reads it back.

        Name, terms (kind, weights, scale, reference) and tie-break; keys without a value are
        left out.
        """
        found: dict[str, Any] = {
            "name": self.name,
            "terms": [term.to_dict() for term in self.terms],
        }
        if self.tie_break is not None:
            found["tie_break"] = self.tie_break.to_dict()
        return found

    @classmethod
    def from_dict(cls, data: object) -> Criterion:
        """The criterion that `to_dict` wrote.

        Raises:
            InvalidInputError: something is missing, or of the wrong kind.
            UnknownNameError: an unknown key or kind of term.
        """
        if not isinstance(data, Mapping) or not isinstance(data.get("terms"), list | tuple):
            raise InvalidInputError(
                "a criterion in a file needs a name and a list of terms, as Criterion.to_dict() "
                f"writes them; this is {data!r}."
            )
        check_keys(data, ("name", "terms", "tie_break"), "a criterion")
        tie = data.get("tie_break")
        terms = tuple(_term(each) for each in data["terms"])
        name = str(data.get("name", "criterion"))
        return cls(name, terms, None if tie is None else cls.from_dict(tie))


def _term(data: object) -> Term:
    """The term that its `to_dict` wrote."""
    if not isinstance(data, Mapping):
        raise InvalidInputError(f"{data!r} is not a term of a criterion. Give a table of its keys.")
    kind, rest = data.get("kind"), {k: v for k, v in data.items() if k != "kind"}
    if kind == "torque":
        check_keys(rest, ("weights", "scale"), "a torque term")
        return TorqueTerm(**rest)
    if kind == "wrench":
        check_keys(rest, ("weights", "reference", "scale"), "a wrench term")
        if "weights" not in rest:
            raise InvalidInputError("a wrench term has no weights. Give six numbers.")
        if rest.get("reference") is not None:
            what = "the reference of a wrench term"
            rest["reference"] = finite_array(rest["reference"], what, (None, 6))
        return WrenchTerm(**rest)
    if kind == "preload":
        check_keys(rest, ("displacement", "scale"), "a preload term")
        if "displacement" not in rest:
            raise InvalidInputError("a preload term has no displacement. Give six numbers each.")
        return PreloadTerm(**rest)
    raise UnknownNameError(
        "kind of term of a criterion", str(kind), ("torque", "wrench", "preload")
    )


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
    for each in parts:
        if not (isinstance(each, tuple) and len(each) == 2 and isinstance(each[0], Criterion)):
            raise InvalidInputError(
                f"{reprlib.repr(each)} is not a criterion with its factor. Give pairs, one by one: "
                "mixed((minimum_torque(), 1.0), (minimum_wrench(1.0), 0.1))."
            )
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


def check_criterion(criterion: object) -> None:
    """Reject what is not a criterion.

    Raises:
        InvalidInputError: it is something else, such as a policy or a list.
    """
    named = isinstance(criterion, str) and criterion in CRITERIA
    given = repr(criterion) if named else "'minimum-torque'"
    remedy = f"Give one, such as criterion_named({given})."
    check_type(criterion, Criterion, "a criterion", remedy)


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
    doubt_length(length, what)
    moment = 1.0 / length**2
    return np.array([1.0, 1.0, 1.0, moment, moment, moment])


@lru_cache(maxsize=128)  # a path's stances share theirs
def _quadratic(criterion: Criterion, robot: Robot, contacts: tuple[Contact, ...]) -> Quadratic:
    return quadratic_sum(criterion.name, criterion.terms, robot, contacts)
