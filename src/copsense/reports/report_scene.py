"""ReportScene: a view in 3-D of the report, with what is said of it."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ReportScene:
    """A view in 3-D of the report.

    Attributes:
        name: by which links find it.
        section: where it stands, as the page's template has it.
        title: its name.
        caption: what to see in it.
        html: a page of its own that needs no other file and no network, such as
            `copsense.explore.film` makes.
        notices: whose work is in it, for those who get the report.
    """

    name: str
    section: str
    title: str
    caption: str
    html: str = field(repr=False)
    notices: str = field(repr=False)
