"""Margin plot: the least margin over the CoM's y or over time, with a line at now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from copsense.explore.drawing import Colour
from copsense.explore.panel_html import css
from copsense.explore.view import View
from copsense.posture_run import PostureRun

_HEIGHT = 150  # pixels
_DEEPEST = {"mm": 40.0, "%": 20.0}  # what is shown below zero: far outside no one compares


class MarginPlot:
    """A plot of a panel; feet without soles have shares of the weight instead of margins."""

    def __init__(self, gui: Any, run: PostureRun | None = None) -> None:
        """Keep its place.

        Args:
            gui: of a viser server.
            run: what is played, if anything.
        """
        self._gui, self._run = gui, run
        self._place = gui.add_folder(None)
        # One for each number of curves: what is removed may still get a message.
        self._plots: dict[int, Any] = {}

    def show(self, view: View, colours: Mapping[str, Colour]) -> None:
        """Draw a view's curve; nothing where it has none."""
        curves, what, unit, scale = view.curve_margin, "margin", "mm", 1e3
        if not np.isfinite(curves).any():
            curves, what, unit, scale = view.curve_share, "load of a contact", "%", 100.0
        if not np.isfinite(curves).any():
            self._show_only(-1)
            return
        over, y, now = self._axis(view)
        # What has no answer here has a curve, perhaps, but no colour.
        known = [name in colours for name in view.curve_criteria]
        rows = [row * scale for row, on in zip(curves, known, strict=True) if on]
        lines = tuple((n, colours[n]) for n in view.curve_criteria if n in colours)
        low, high = _span(rows)
        low = max(low, -_DEEPEST[unit])
        room = 0.05 * (high - low) + 1.0
        scales = {
            # Said outright: left to the browser, it now and then stays at 0 to 1.
            "x": {"time": False, "auto": False, "range": (float(y.min()), float(y.max()) + 1e-9)},
            "y": {"auto": False, "range": (low - room, high + room)},
        }
        # The cursor: an upright line at the CoM's y, two points of a series of its own.
        near = 1e-6 * max(float(np.ptp(y)), 1e-9)
        at = np.sort(np.append(y, [now - near, now + near]))
        margins = [np.interp(at, y, row, left=np.nan, right=np.nan) for row in rows]
        cursor = np.full(len(at), np.nan)
        first = int(np.searchsorted(at, now - 1.5 * near))
        cursor[first : first + 2] = low - room, high + room
        data = (at, *margins, cursor)
        title = f"least {what} [{unit}] over {over}"
        series: tuple[Any, ...] = (
            {"label": over},
            *({"label": name, "stroke": css(colour), "width": 2} for name, colour in lines),
            {"label": "now", "stroke": "#888", "width": 1.5},
        )
        if len(lines) not in self._plots:
            with self._place:
                self._plots[len(lines)] = self._gui.add_uplot(
                    data,
                    series,
                    title=title,
                    scales=scales,
                    height=_HEIGHT,
                    legend={"show": False},
                )
        plot = self._plots[len(lines)]
        for name, value in (("series", series), ("title", title), ("scales", scales)):
            if getattr(plot, name) != value:
                setattr(plot, name, value)
        plot.data = data
        self._show_only(len(lines))

    def _show_only(self, count: int) -> None:
        for number, plot in self._plots.items():
            if plot.visible != (number == count):
                plot.visible = number == count

    def _axis(self, view: View) -> tuple[str, np.ndarray, float]:
        """What the curve is over, its values, and where it is now; lengths in mm."""
        name, unit, now = "CoM y", "m", float(view.com[1])
        if self._run is not None:
            name, unit = self._run.axis, self._run.unit
            now = float(self._run.values[view.row or 0])
        scale, shown = (1e3, "mm") if unit == "m" else (1.0, unit)
        return f"{name} [{shown}]" if shown else name, view.curve_y * scale, now * scale


def _span(rows: Sequence[np.ndarray]) -> tuple[float, float]:
    found = np.concatenate([row[np.isfinite(row)] for row in rows] or [np.zeros(1)])
    return (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
