"""errata_markdown: the table of errata for the documentation, from the data that is tested."""

from __future__ import annotations

import re

from copsense.paper.errata import ERRATA, Formula
from copsense.paper.errata.erratum import FORMULA
from copsense.reports.typesetting import typeset


def errata_markdown() -> str:
    """A Markdown table, one row per erratum, with formulas as LaTeX between ``$`` signs."""
    lines = ["| where | printed | what holds | note |", "|---|---|---|---|"]
    for erratum in ERRATA:
        cells = (erratum.equation, erratum.printed_text, erratum.holding_text, erratum.note)
        lines.append(f"| {' | '.join(_cell(text) for text in cells)} |")
    return "\n".join(lines)


def _cell(text: str) -> str:
    # words at even places, formulas at odd ones
    parts = FORMULA.split(text)
    return "".join(
        f"${Formula(part).latex}$" if place % 2 else _words(part)
        for place, part in enumerate(parts)
    )


def _words(text: str) -> str:
    """Typeset as in the report; what Markdown would read as its own is escaped."""
    return re.sub(r"([\\`*\[\]|])", r"\\\1", str(typeset(text)))
