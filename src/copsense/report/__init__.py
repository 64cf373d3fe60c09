"""The report on a reproduction: one self-contained HTML file, its figures and data beside it."""

from __future__ import annotations

from copsense.report.figure import ReportFigure
from copsense.report.figures import report_figures
from copsense.report.page import render_page
from copsense.report.writing import check_report_folder, write_report

__all__ = [
    "ReportFigure",
    "check_report_folder",
    "render_page",
    "report_figures",
    "write_report",
]
