"""Erratum: one place where the paper's printed text differs from what holds, and its numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.closed_form.discrepancy import Discrepancy
from copsense.paper.errata.formula import Formula
from copsense.paper.errata.quantities import Quantity

FORMULA = re.compile(r"\$([^$]+)\$")


@dataclass(frozen=True)
class Erratum:
    """One correction to [Romano2016].

    A part of the text between ``$`` signs is a `Formula`, and each has its quantity: the tests
    evaluate the one against the other.

    Attributes:
        equation: where.
        printed_text: what the paper says.
        holding_text: what holds instead.
        note: why, or under which reading the print is right.
        check: measures it on a four-bar; None where no number on a four-bar decides.
        printed_quantities: what the formulas of `printed_text` are, in order.
        holding_quantities: what the formulas of `holding_text` are, in order.
    """

    equation: str
    printed_text: str
    holding_text: str
    note: str
    check: Callable[[FourBar], Discrepancy] | None = None
    printed_quantities: tuple[Quantity, ...] = ()
    holding_quantities: tuple[Quantity, ...] = ()

    @property
    def printed(self) -> str:
        """What the paper says, in plain text."""
        return FORMULA.sub(r"\1", self.printed_text)

    @property
    def holds(self) -> str:
        """What holds instead, in plain text."""
        return FORMULA.sub(r"\1", self.holding_text)

    @property
    def formulas(self) -> tuple[tuple[Formula, Quantity], ...]:
        """Each formula with what it is, the printed ones first."""
        pairs: list[tuple[Formula, Quantity]] = []
        for text, quantities in (
            (self.printed_text, self.printed_quantities),
            (self.holding_text, self.holding_quantities),
        ):
            pairs += zip(map(Formula, FORMULA.findall(text)), quantities, strict=True)
        return tuple(pairs)


@dataclass(frozen=True)
class EvaluatedErratum:
    """An erratum with its numbers.

    Attributes:
        erratum: the correction.
        discrepancy: how far the print is off, and that the reason given explains it; None where
            the erratum has no check.
    """

    erratum: Erratum
    discrepancy: Discrepancy | None
