"""The report on a robot's own log: one self-contained HTML page, its figures and its data."""

from __future__ import annotations

from copsense.log_report.log_figures import draw_log_figures
from copsense.log_report.log_page import render_log_page, write_log_report
from copsense.log_report.log_scenes import draw_log_scenes
from copsense.log_report.log_words import slope_rows

__all__ = [
    "draw_log_figures",
    "draw_log_scenes",
    "render_log_page",
    "slope_rows",
    "write_log_report",
]
