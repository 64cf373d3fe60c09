"""ReportFigure: one figure of the report, with what is said of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from copsense.plots.style import Figure


@dataclass(frozen=True)
class ReportFigure:
    """One figure of the report.

    Attributes:
        name: file name without suffix.
        section: where it stands, as the page's template has it, such as ``"overview"``.
        title: its number or name.
        caption: what to see in it.
        alt: what it shows, for who cannot see it.
        shape: ``"half"`` of the page's width, ``"wide"``, or ``"alone"``, half with its caption
            beside it.
        draw: draws it.
    """

    name: str
    section: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], Figure]
    shape: str = "half"
