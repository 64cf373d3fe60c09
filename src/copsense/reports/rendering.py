"""render_template: values and pictures as one HTML page that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files

from jinja2 import DictLoader, Environment, StrictUndefined

from copsense.reports.report_figure import ReportFigure
from copsense.reports.report_scene import ReportScene
from copsense.reports.typesetting import typeset

_SHELL = "copsense.reports"  # the page's frame, its style and its macros
_TEMPLATE = ".html.jinja"
_ROUNDING = 1e-9


def render_template(
    name: str,
    packages: Sequence[str],
    figures: Iterable[ReportFigure],
    pictures: Mapping[str, bytes],
    values: Mapping[str, object],
    scenes: Iterable[ReportScene] = (),
) -> str:
    """Render a page; the same input gives the same text.

    Args:
        name: of the template, without its suffix. It extends ``shell.html.jinja``.
        packages: whose templates it may use, beside those of `copsense.reports`.
        figures: the figures, in order; each section's are drawn by ``figure_grid(section)``.
        pictures: figure's name -> its SVG.
        values: what the template shows.
        scenes: the views in 3-D, in order; each section's are shown by ``scene_frames(section)``.

    Returns:
        HTML that needs no other file and no network.
    """
    sources = {
        entry.name: entry.read_text("utf-8")
        for package in (_SHELL, *packages)
        for entry in files(package).iterdir()
        if entry.name.endswith(_TEMPLATE)
    }
    environment = Environment(
        loader=DictLoader(sources),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["typeset"] = typeset
    shown: dict[str, list[dict[str, object]]] = {}
    for figure in figures:
        address = base64.b64encode(pictures[figure.name]).decode("ascii")
        shown.setdefault(figure.section, []).append(
            {"figure": figure, "source": f"data:image/svg+xml;base64,{address}"}
        )
    frames: dict[str, list[ReportScene]] = {}
    for scene in scenes:
        frames.setdefault(scene.section, []).append(scene)
    style = (files(_SHELL) / "report.css").read_text("utf-8")
    return environment.get_template(name + _TEMPLATE).render(
        {"style": style, "figures": shown, "scenes": frames} | dict(values)
    )


def read_number(value: float, unit: str = "1") -> str:
    """A number to read: four digits, millimetres for short lengths, no unit if it has none."""
    if unit == "m" and 1e-6 < abs(value) < 1.0:
        return f"{value * 1e3:.4g} mm"
    if abs(value) < _ROUNDING:
        text = f"{value:.0e}" if value else "0"  # its digits say nothing
    else:
        text = f"{value:.1e}" if abs(value) < 1e-4 else f"{value:.4g}"
    return text if unit == "1" else f"{text} {unit}"
