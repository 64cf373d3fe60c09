"""write_log_report: a robot's own log beside every criterion, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from copsense.log_report.log_figures import draw_log_figures
from copsense.log_report.log_scenes import draw_log_scenes
from copsense.log_report.log_words import answer, reach, slope_tables
from copsense.logs import LogComparison
from copsense.logs.finding import Finding
from copsense.provenance import versions
from copsense.reports import (
    ReportFigure,
    ReportScene,
    draw_figures,
    fill_report_folder,
    render_template,
    write_json,
    write_table,
)
from copsense.reports.report_folder import DATA

TEMPLATES = "copsense.log_report"


def write_log_report(
    comparison: LogComparison,
    folder: str | Path,
    *,
    overwrite: bool = False,
    command: str = "",
) -> Path:
    """Write the report on a log.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        folder: gets ``report.html`` (self-contained), ``figures/`` (PNG and SVG) and ``data/``
            (JSON, CSV). Other files in it are left alone.
        overwrite: whether an earlier report there may be replaced.
        command: the command line that makes this report, for the page to show.

    Returns:
        The path of the page.

    Raises:
        OutputError: the folder holds a report already, or cannot be written.
    """

    def make(staging: Path) -> str:
        figures = draw_log_figures(comparison)
        pictures = draw_figures(figures, staging)
        write_json(staging / DATA / "comparison.json", comparison.to_dict())
        write_table(staging / DATA / "rows.csv", *_rows(comparison))
        scenes = draw_log_scenes(comparison)
        return render_log_page(comparison, pictures, figures, scenes, command=command)

    return fill_report_folder(folder, make, overwrite=overwrite)


def render_log_page(
    comparison: LogComparison,
    pictures: Mapping[str, bytes],
    figures: Iterable[ReportFigure],
    scenes: Iterable[ReportScene] = (),
    *,
    command: str = "",
) -> str:
    """Render the report; the same input gives the same text.

    Args:
        comparison: what to report.
        pictures: figure's name -> its SVG.
        figures: the figures, in order.
        scenes: the views in 3-D.
        command: the command line that makes this report; may be empty.

    Returns:
        HTML that needs no other file and no network.
    """
    values = {
        "log": comparison.log.source,
        "robot": comparison.robot,
        "answer": answer(comparison),
        "tables": slope_tables(comparison),
        "findings": [_finding(f) for f in comparison.findings],
        "notes": comparison.notes,
        "reach": reach(comparison),
        "command": command,
        "setting": _setting(comparison),
        "versions": versions(("pin", "numpy", "scipy")),
    }
    return render_template("log_report", [TEMPLATES], figures, pictures, values, scenes)


def _finding(finding: Finding) -> dict[str, str]:
    when = "" if finding.start is None else f"{finding.start:.2f} to {finding.stop:.2f} s"
    return {
        "kind": finding.kind,
        "about": finding.about,
        "message": finding.message,
        "when": when,
    }


def _setting(comparison: LogComparison) -> dict[str, str]:
    log = comparison.log
    distance = comparison.distance
    return {
        "log": f"{log.source}: {log.times[-1]:.2f} s, {len(log.times)} rows at {log.rate:.4g} Hz, "
        f"{len(log.joint_names)} joints",
        "compared": f"{len(comparison.times)} rows; slopes after {comparison.skipped:g} s",
        "robot": f"{comparison.robot}, {comparison.weight:.1f} N",
        "contacts": ", ".join(comparison.contact_names)
        + ("" if distance is None else f", {distance * 1e3:.1f} mm apart"),
        "base": "from the first contact on, by the joints"
        if comparison.base == "feet"
        else "as recorded",
        "smoothing": f"Savitzky-Golay filter, cubic, {comparison.window:.3g} s",
    }


def _rows(comparison: LogComparison) -> tuple[list[str], np.ndarray]:
    """Head and rows of the table of what was compared."""
    head = ["time_s", "com_x_m", "com_y_m", "com_z_m", "travel_m"]
    columns = [comparison.times, *comparison.com.T, comparison.travel]
    for source, shares, cops in (
        ("measured", comparison.shares, comparison.cops),
        *((s.name, s.shares, s.cops) for s in comparison.statics),
    ):
        for k, contact in enumerate(comparison.contact_names):
            head += [f"{source}: {what} of {contact}" for what in ("share", "cop_x_m", "cop_y_m")]
            columns += [shares[:, k], *cops[:, k].T]
    return head, np.column_stack(columns)
