"""write_report: a reproduction as a page, with its figures and its data."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

from copsense.paper.report.page import render_page
from copsense.paper.report.report_scenes import report_scenes
from copsense.paper.report.static_figures import report_figures
from copsense.paper.reproduce import Reproduction
from copsense.reports import draw_figures, fill_report_folder, write_json, write_table
from copsense.reports.report_folder import DATA


def write_report(
    reproduction: Reproduction,
    folder: str | Path,
    *,
    overwrite: bool = False,
    command: str = "copsense reproduce",
) -> Path:
    """Write the report on a reproduction.

    Everything is made in a temporary folder beside the one asked for and moved there when it is
    complete, the page last.

    Args:
        reproduction: what to report.
        folder: gets ``report.html`` (self-contained), ``figures/`` (PNG and SVG) and ``data/``
            (netCDF, CSV, JSON). Other files in it are left alone.
        overwrite: whether an earlier report there may be replaced.
        command: the command line that makes this report, for the page to show.

    Returns:
        The path of the page.

    Raises:
        OutputError: the folder holds a report already, or cannot be written.
    """
    return fill_report_folder(
        folder, lambda staging: _make(reproduction, staging, command), overwrite=overwrite
    )


def _make(reproduction: Reproduction, folder: Path, command: str) -> str:
    figures = report_figures(reproduction)
    pictures = draw_figures(figures, folder)
    _write_data(reproduction, folder / DATA)
    scenes = report_scenes(reproduction)
    return render_page(reproduction, pictures, figures, scenes, command=command)


def _write_data(reproduction: Reproduction, folder: Path) -> None:
    reproduction.lateral.save(folder / "icub_lateral.nc")
    reproduction.lateral.save(folder / "icub_lateral.csv")
    reproduction.lateral_at_sole.save(folder / "icub_lateral_at_sole.nc")
    reproduction.within_limits.lateral.save(folder / "icub_within_limits.nc")
    if reproduction.sway:
        for name, recording in reproduction.sway.runs.items():
            plain = re.sub(r"[^a-z]+", "_", name)
            recording.save(folder / f"closed_loop_{plain}.nc")
    if reproduction.benchmark is not None:
        reproduction.benchmark.to_csv(folder / "benchmark.csv", index=False)
    if reproduction.real is not None:
        write_json(folder / "real_robot.json", [asdict(f) for f in reproduction.real.findings])
        write_json(folder / "real_robot_log.json", reproduction.real.comparison.to_dict())
    write_json(
        folder / "claims.json",
        [
            {
                "identifier": c.claim.identifier,
                "where": c.claim.where,
                "statement": c.claim.statement,
                "verdict": c.verdict.value,
                "number": c.number,
                "unit": c.unit,
                "explanation": c.explanation,
                "condition": c.condition,
            }
            for c in reproduction.claims
        ],
    )
    write_json(
        folder / "errata.json",
        [
            {k: getattr(e.erratum, k) for k in ("equation", "printed", "holds", "note")}
            | {"discrepancy": None if e.discrepancy is None else asdict(e.discrepancy)}
            for e in reproduction.errata
        ],
    )
    write_json(
        folder / "reference.json",
        [asdict(row) | {"agrees": row.agrees} for row in reproduction.references],
    )
    write_json(
        folder / "setting.json",
        {
            "parameters": dict(reproduction.parameters),
            "versions": dict(reproduction.versions),
            "seconds": dict(reproduction.timings),
        },
    )
    unit = reproduction.unit_of_length
    write_table(
        folder / "unit_of_length.csv",
        ("length_m", "icub_slope", "closed_form_slope"),
        zip(unit.lengths, unit.icub, unit.closed_form, strict=True),
    )
    write_table(
        folder / "four_bar.csv",
        ("figure", "curve", "unit", "segment", "delta_xi_rad", "value"),
        (
            (data.name, curve.label, curve.unit, number, angle, value)
            for data in reproduction.four_bar_figures
            for curve in data.curves
            for number, segment in enumerate(curve.segments)
            for angle, value in zip(segment.delta_xi, segment.values, strict=True)
        ),
    )
