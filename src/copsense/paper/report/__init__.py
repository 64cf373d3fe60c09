"""The report on a reproduction: one self-contained HTML file, its figures and data beside it."""

from __future__ import annotations

from copsense.paper.report.errata_page import errata_markdown
from copsense.paper.report.page import render_page
from copsense.paper.report.report_files import write_report
from copsense.paper.report.static_figures import report_figures

__all__ = [
    "errata_markdown",
    "render_page",
    "report_figures",
    "write_report",
]
