"""save_figure: a figure as a file, whole or not there."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from copsense.storage import check_output, write_beside

SUFFIXES = (".png", ".svg", ".pdf")
# No date in the file: the same figure is the same file.
_UNDATED = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}, ".png": {}}


def save_figure(
    figure: Figure, path: str | Path, *, overwrite: bool = False, dpi: float = 160.0
) -> Path:
    """Write a figure as PNG, SVG or PDF, by its suffix.

    Args:
        figure: what a plot function returned, or the ``figure`` of its axes.
        path: where; its folder must exist.
        overwrite: whether an existing file may be replaced.
        dpi: dots per inch of a PNG.

    Raises:
        InvalidInputError: another suffix.
        OutputError: the file exists, or cannot be written.
    """
    path = check_output(path, suffixes=SUFFIXES, overwrite=overwrite)

    def write(temporary: Path) -> None:
        with mpl.rc_context({"svg.hashsalt": "copsense", "svg.fonttype": "path"}):
            figure.savefig(temporary, dpi=dpi, metadata=_UNDATED[path.suffix])

    write_beside(path, write)
    return path
