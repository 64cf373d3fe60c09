"""Claim: a statement of the paper with the check that measures it, and Verdict: what is found.

A check is a function of one subject: a FourBar for Section IV, a sweep of a robot's postures or its
runs in closed loop for Section V. It returns numbers and a predicate of them; no verdict is written
down. `claim` makes a Claim of a check, so that each statement stands once, above what measures it.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from copsense.errors import InvalidInputError

Subject = TypeVar("Subject")
Other = TypeVar("Other")


class Verdict(enum.Enum):
    """What the numbers say of a claim; VERDICT_STANDARD says when each is given."""

    HOLDS = "holds"
    HOLDS_IF = "holds if"
    DOES_NOT_HOLD = "does not hold"


VERDICT_STANDARD: Mapping[Verdict, str] = MappingProxyType(
    {
        Verdict.HOLDS: "the sentence or formula is true as printed, with the lengths and masses "
        "that the paper gives and L = 1 m, which its formulas amount to.",
        Verdict.HOLDS_IF: "it is true as printed for some value of a length, a mass ratio, an "
        "amplitude or a tie-break, or for a part of the motion, which the row names as its "
        "condition. Where the paper itself gives another value, the condition contradicts the "
        "paper, and the row says so.",
        Verdict.DOES_NOT_HOLD: "no such value makes it true. It may become true when what is "
        "printed is changed (another letter, one more row): that is a correction, which stands "
        "among the errata, and not a condition.",
    }
)


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        verdict: from `judge`.
        number: the number that decides, finite.
        unit: its unit, "1" if it has none.
        explanation: what the number is, and the tolerance.
        condition: under which the claim holds; "" if there is none.
    """

    verdict: Verdict
    number: float
    unit: str
    explanation: str
    condition: str = ""

    def __post_init__(self) -> None:
        """Own a plain float; reject a number that decides nothing, or a condition left unsaid."""
        object.__setattr__(self, "number", float(self.number))
        if not math.isfinite(self.number):
            raise InvalidInputError(
                f"a finding's number must be finite; got {self.number!r} ({self.explanation}). "
                "Evaluate the claim where it is defined."
            )
        if self.verdict is Verdict.HOLDS_IF and not self.condition:
            raise InvalidInputError(
                f"a claim that holds under a condition must name it ({self.explanation})."
            )


@dataclass(frozen=True)
class Claim(Generic[Subject]):
    """A statement of [Romano2016] with the check that measures it.

    Attributes:
        identifier: a short stable name.
        where: section, equation or figure.
        statement: what the paper says, shortened.
        check: measures it on a subject.
    """

    identifier: str
    where: str
    statement: str
    check: Callable[[Subject], Finding]

    def again(self, identifier: str) -> Callable[[Callable[[Other], Finding]], Claim[Other]]:
        """The same statement judged on another subject: a decorator, as `claim`."""
        return claim(identifier, self.where, self.statement)


@dataclass(frozen=True)
class EvaluatedClaim:
    """A claim and what was found of it.

    Attributes:
        claim: the statement.
        verdict: what the numbers say.
        number: the number that decides.
        unit: its unit, "1" if it has none.
        explanation: what the number is, and the tolerance.
        condition: under which the claim holds, where the verdict needs one; else "".
    """

    claim: Claim[Any]
    verdict: Verdict
    number: float
    unit: str
    explanation: str
    condition: str


def claim(
    identifier: str, where: str, statement: str
) -> Callable[[Callable[[Subject], Finding]], Claim[Subject]]:
    """A decorator that makes a Claim of its check."""
    return lambda check: Claim(identifier, where, statement, check)


def judge(as_stated: object, under_condition: object = False) -> Verdict:
    """Turn predicates into a verdict.

    Args:
        as_stated: whether the claim's predicate is true as the paper states it.
        under_condition: whether it is true under the finding's condition.
    """
    if as_stated:
        return Verdict.HOLDS
    return Verdict.HOLDS_IF if under_condition else Verdict.DOES_NOT_HOLD


def evaluate_claims(
    table: Iterable[Claim[Subject]], subject: Subject
) -> tuple[EvaluatedClaim, ...]:
    """Evaluate a table of claims on one subject, in the table's order."""
    evaluated = []
    for row in table:
        found = row.check(subject)
        # A condition counts only where the claim needs it.
        condition = found.condition if found.verdict is Verdict.HOLDS_IF else ""
        evaluated.append(
            EvaluatedClaim(
                row, found.verdict, found.number, found.unit, found.explanation, condition
            )
        )
    return tuple(evaluated)
