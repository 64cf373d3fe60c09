"""write_report: the page, its figures and its data in a folder, whole or not there."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from copsense.errors import OutputError
from copsense.paper.report.page import render_page
from copsense.paper.report.static_figures import report_figures
from copsense.paper.reproduce import Reproduction
from copsense.plots import lay_out, render_figure

PAGE = "report.html"
_FOLDERS = ("figures", "data")


def check_report_folder(folder: str | Path, *, overwrite: bool = False) -> Path:
    """A folder that a report can be written to, checked before the work starts.

    Raises:
        OutputError: it holds a report (or files in a report's places) and may not be overwritten,
            or it cannot be written.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder} is a file. Give a folder for the report.")
    taken = [name for name in (PAGE, *_FOLDERS) if (folder / name).exists()]
    if taken and not overwrite:
        raise OutputError(
            f"{folder} holds {', '.join(taken)} already. Give another folder, or --force "
            "(overwrite=True)."
        )
    inside = folder if folder.exists() else folder.absolute().parent
    if not inside.is_dir():
        raise OutputError(
            f"there is no folder {folder.parent} to make {folder.name} in. Create it first."
        )
    try:  # permission bits mislead (for root, on /proc, on a full disk)
        tempfile.TemporaryDirectory(dir=inside, prefix=".copsense-").cleanup()
    except OSError as error:
        raise OutputError(
            f"{folder} cannot be written: {error.strerror or error}. Choose another folder."
        ) from None
    return folder


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
    folder = check_report_folder(folder, overwrite=overwrite)
    staging = None
    try:
        parent = folder.absolute().parent
        staging = Path(tempfile.mkdtemp(dir=parent, prefix=f".{folder.name or 'report'}-"))
        _write_everything(reproduction, staging, command)
        _publish(staging, folder)
    except OSError as error:
        raise OutputError(f"the report could not be written to {folder}: {error}.") from None
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)
    return folder / PAGE


def _write_everything(reproduction: Reproduction, folder: Path, command: str) -> None:
    for name in _FOLDERS:
        (folder / name).mkdir()
    figures, pictures = report_figures(reproduction), {}
    for figure in figures:
        drawn = figure.draw()
        lay_out(drawn)
        pictures[figure.name] = render_figure(drawn, ".svg")
        (folder / "figures" / f"{figure.name}.svg").write_bytes(pictures[figure.name])
        (folder / "figures" / f"{figure.name}.png").write_bytes(render_figure(drawn, ".png"))
    _write_data(reproduction, folder / "data")
    page = render_page(reproduction, pictures, figures, command=command)
    (folder / PAGE).write_text(page, encoding="utf-8")


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
    _write_json(
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
    _write_json(
        folder / "errata.json",
        [
            {k: getattr(e.erratum, k) for k in ("equation", "printed", "holds", "note")}
            | {"discrepancy": None if e.discrepancy is None else asdict(e.discrepancy)}
            for e in reproduction.errata
        ],
    )
    _write_json(
        folder / "reference.json",
        [asdict(row) | {"agrees": row.agrees} for row in reproduction.references],
    )
    _write_json(
        folder / "setting.json",
        {
            "parameters": dict(reproduction.parameters),
            "versions": dict(reproduction.versions),
            "seconds": dict(reproduction.timings),
        },
    )
    unit = reproduction.unit_of_length
    _write_table(
        folder / "unit_of_length.csv",
        ("length_m", "icub_slope", "closed_form_slope"),
        zip(unit.lengths, unit.icub, unit.closed_form, strict=True),
    )
    _write_table(
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


def _write_json(path: Path, content: Any) -> None:
    path.write_text(
        json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )


def _write_table(path: Path, head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)


def _publish(staging: Path, folder: Path) -> None:
    """Move what is complete to its place."""
    mask = os.umask(0)
    os.umask(mask)
    staging.chmod(0o777 & ~mask)  # a temporary folder is private to its user
    if not folder.exists():
        staging.rename(folder)
        return
    for name in _FOLDERS:
        (folder / name).mkdir(exist_ok=True)
        for made in sorted((staging / name).iterdir()):
            made.replace(folder / name / made.name)
    (staging / PAGE).replace(folder / PAGE)
