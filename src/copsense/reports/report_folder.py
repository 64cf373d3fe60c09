"""Report folder: a page, ``figures/`` and ``data/``, made beside it and moved there when whole."""

from __future__ import annotations

import csv
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from copsense.errors import OutputError
from copsense.plots import lay_out, render_figure
from copsense.reports.report_figure import ReportFigure

PAGE = "report.html"
FIGURES, DATA = "figures", "data"
_FOLDERS = (FIGURES, DATA)


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


def fill_report_folder(
    folder: str | Path, make: Callable[[Path], str], *, overwrite: bool = False
) -> Path:
    """Make a report in a temporary folder beside the one asked for, and move it there, page last.

    Args:
        folder: gets ``report.html``, ``figures/`` and ``data/``. Other files in it are left alone.
        make: given a folder that has ``figures/`` and ``data/``, fills these and returns the page.
        overwrite: whether an earlier report there may be replaced.

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
        for name in _FOLDERS:
            (staging / name).mkdir()
        (staging / PAGE).write_text(make(staging), encoding="utf-8")
        _publish(staging, folder)
    except OSError as error:
        raise OutputError(f"the report could not be written to {folder}: {error}.") from None
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)
    return folder / PAGE


def draw_figures(figures: Iterable[ReportFigure], folder: Path) -> dict[str, bytes]:
    """Draw figures into ``figures/`` of a folder, as SVG and PNG; name -> SVG."""
    pictures = {}
    for figure in figures:
        drawn = figure.draw()
        lay_out(drawn)
        pictures[figure.name] = render_figure(drawn, ".svg")
        (folder / FIGURES / f"{figure.name}.svg").write_bytes(pictures[figure.name])
        (folder / FIGURES / f"{figure.name}.png").write_bytes(render_figure(drawn, ".png"))
    return pictures


def write_json(path: Path, content: Any) -> None:
    """Write plain data; numbers are finite."""
    path.write_text(
        json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )


def write_table(path: Path, head: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write a CSV file."""
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
