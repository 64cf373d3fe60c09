"""Reports: one self-contained HTML page, its figures and data beside it, whole or not there."""

from __future__ import annotations

from copsense.extras import require

require("jinja2", "the report")  # before the modules that import it

from copsense.reports.rendering import read_number, render_template
from copsense.reports.report_figure import ReportFigure
from copsense.reports.report_folder import (
    check_report_folder,
    draw_figures,
    fill_report_folder,
    write_json,
    write_table,
)
from copsense.reports.report_scene import ReportScene

__all__ = [
    "ReportFigure",
    "ReportScene",
    "check_report_folder",
    "draw_figures",
    "fill_report_folder",
    "read_number",
    "render_template",
    "write_json",
    "write_table",
]
