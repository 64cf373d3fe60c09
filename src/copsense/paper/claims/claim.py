"""Claim and Verdict: a statement of the paper, and what the numbers say of it.

A table of claims is a tuple of CheckedClaim over one kind of subject: a FourBar for Section IV, a
sweep of a robot's postures for Section V. A check returns numbers and a predicate of them; no
verdict is written down.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from copsense.errors import InvalidInputError

Subject = TypeVar("Subject")


class Verdict(enum.Enum):
    """What the numbers say of a claim."""

    HOLDS = "holds"
    HOLDS_IF = "holds if"
    DOES_NOT_HOLD = "does not hold"


@dataclass(frozen=True)
class Claim:
    """A statement of [Romano2016].

    Attributes:
        identifier: a short stable name.
        where: section, equation or figure.
        statement: what the paper says, shortened.
    """

    identifier: str
    where: str
    statement: str


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        verdict: from `judge`.
        number: the number that decides, finite.
        unit: its unit, "1" if it has none.
        explanation: what the number is, the tolerance, and the condition if there is one.
    """

    verdict: Verdict
    number: float
    unit: str
    explanation: str

    def __post_init__(self) -> None:
        """Own a plain float, and refuse a number that decides nothing."""
        object.__setattr__(self, "number", float(self.number))
        if not math.isfinite(self.number):
            raise InvalidInputError(
                f"a finding's number must be finite; got {self.number!r} ({self.explanation}). "
                "Evaluate the claim where it is defined."
            )


@dataclass(frozen=True)
class EvaluatedClaim:
    """A claim and what was found of it.

    Attributes:
        claim: the statement.
        verdict: what the numbers say.
        number: the number that decides.
        unit: its unit, "1" if it has none.
        explanation: what the number is, the tolerance, and the condition if there is one.
    """

    claim: Claim
    verdict: Verdict
    number: float
    unit: str
    explanation: str


@dataclass(frozen=True)
class CheckedClaim(Generic[Subject]):
    """A claim with the check that measures it on a subject."""

    claim: Claim
    check: Callable[[Subject], Finding]


def judge(as_stated: object, under_condition: object = False) -> Verdict:
    """Turn predicates into a verdict.

    Args:
        as_stated: whether the claim's predicate is true as the paper states it.
        under_condition: whether it is true under the condition that the explanation names.
    """
    if as_stated:
        return Verdict.HOLDS
    return Verdict.HOLDS_IF if under_condition else Verdict.DOES_NOT_HOLD


def evaluate_claims(
    table: Iterable[CheckedClaim[Subject]], subject: Subject
) -> tuple[EvaluatedClaim, ...]:
    """Evaluate a table of claims on one subject, in the table's order."""
    evaluated = []
    for row in table:
        found = row.check(subject)
        evaluated.append(
            EvaluatedClaim(row.claim, found.verdict, found.number, found.unit, found.explanation)
        )
    return tuple(evaluated)
