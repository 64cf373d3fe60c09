"""save_figure: a figure as a file, written whole or not at all.

Matplotlib draws a figure twice to save it: once to lay it out and once into the file. A figure for
several files is laid out once, by `lay_out`; each file then costs one drawing.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from copsense.files import check_output, write_beside

SUFFIXES = (".png", ".svg", ".pdf")
# No date in the file: the same figure gives the same bytes.
_UNDATED: dict[str, dict[str, None]] = {
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
    ".png": {},
}
_VECTOR_DPI = 72.0  # at which Matplotlib lays an SVG out
_UNCHANGING = {"figure.autolayout": False, "figure.constrained_layout.use": False}


def save_figure(
    figure: Figure | Axes, path: str | Path, *, overwrite: bool = False, dpi: float = 160.0
) -> Path:
    """Write a figure as PNG, SVG or PDF, by its suffix.

    Args:
        figure: what a plot function returned; of axes, the whole figure they are in.
        path: where; its folder must exist.
        overwrite: whether an existing file may be replaced.
        dpi: dots per inch of a PNG.

    Raises:
        InvalidInputError: another suffix.
        OutputError: the file exists, or cannot be written.
    """
    path = check_output(path, suffixes=SUFFIXES, overwrite=overwrite)
    content = render_figure(figure, path.suffix, dpi=dpi)
    write_beside(path, lambda temporary: temporary.write_bytes(content))
    return path


def render_figure(figure: Figure | Axes, suffix: str, *, dpi: float = 160.0) -> bytes:
    """A figure as the content of a file with that suffix; the same figure gives the same bytes."""
    content = BytesIO()
    whole = figure.get_figure(root=True)
    assert whole is not None
    with mpl.rc_context({"svg.hashsalt": "copsense", "svg.fonttype": "path"}):
        whole.savefig(content, format=suffix[1:], dpi=dpi, metadata=_UNDATED[suffix])
    return content.getvalue()


def lay_out(figure: Figure) -> None:
    """Place what a figure holds for good, as in an SVG of it; saving it then costs half the time.

    An SVG has the same bytes as without. A PNG has the same layout, where its own would differ from
    the SVG's by the rounding of text to pixels.
    """
    engine = figure.get_layout_engine()
    if engine is None:
        return
    canvas, dpi = figure.canvas, figure.dpi
    FigureCanvasSVG(figure)  # becomes the figure's own
    try:
        figure.dpi = _VECTOR_DPI
        engine.execute(figure)
    finally:
        figure.dpi = dpi
        figure.set_canvas(canvas)
    with mpl.rc_context(_UNCHANGING):  # type: ignore[arg-type]  # None means what these say
        figure.set_layout_engine(None)
