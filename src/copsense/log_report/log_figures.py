"""log_figures: the figures of a log's report, with what is said of each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from copsense.logs import LogComparison
from copsense.plots.log_plots import (
    moving_joint,
    plot_log_cop,
    plot_log_intervals,
    plot_log_joint,
    plot_log_load,
    plot_log_slope,
    plot_log_torques,
)
from copsense.reports import ReportFigure


def draw_log_figures(comparison: LogComparison, prefix: str = "log") -> tuple[ReportFigure, ...]:
    """The figures of a comparison, after [Romano2016] Figs. 6 to 9.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        prefix: of their names and of their sections, ``PREFIX-slope`` and ``PREFIX``.
    """
    load = comparison.slopes.get("load", {})
    found = []
    if load and comparison.statics:
        measured = load["measured"]
        found += [
            ReportFigure(
                f"{prefix}_intervals",
                f"{prefix}-slope",
                "How much of the centre of mass's moment moves load from foot to foot.",
                f"Measured {measured.value:.3f}, the grey band its 95 % interval; filled points "
                "have the recorded motion's inertia, hollow ones are at rest.",
                "The load's slope of every criterion with its interval, against a measured band.",
                _drawn(comparison, plot_log_intervals),
            ),
            ReportFigure(
                f"{prefix}_slope",
                f"{prefix}-slope",
                "Load share over the centre of mass.",
                "Points are rows of the log, grey those that the slopes leave out. A line's height "
                "is its own: offsets of sensors and preload between the feet move the points as a "
                "whole.",
                "Load share of the first foot against the CoM: points, and a line per criterion.",
                _drawn(comparison, plot_log_slope),
            ),
        ]
    found.append(
        ReportFigure(
            f"{prefix}_load",
            prefix,
            "After Fig. 6: load share over time.",
            "Black as measured; criteria in colour, with the recorded motion's inertia.",
            "Share of the load on each foot against time, measured and of every criterion.",
            _drawn(comparison, plot_log_load),
        )
    )
    if not comparison.statics:
        return tuple(found)
    has_cops = bool(np.isfinite(comparison.cops).any())
    beside = (
        "Black as measured." if has_cops else "No moments were measured: these are predictions."
    )
    found += [
        ReportFigure(
            f"{prefix}_cop",
            prefix,
            "After Figs. 7 and 8: centres of pressure over time.",
            f"Of each foot in its own frame. {beside}",
            "Centre of pressure of each foot against time, of every criterion.",
            _drawn(comparison, plot_log_cop),
        ),
        ReportFigure(
            f"{prefix}_joint",
            prefix,
            f"After Fig. 9b: centre of pressure over {moving_joint(comparison)}.",
            f"Large points in motion, small ones at rest. {beside}",
            "Centre of pressure of the first foot against the joint that moves most.",
            _drawn(comparison, plot_log_joint),
        ),
        ReportFigure(
            f"{prefix}_torques",
            prefix,
            "Joint torques over time.",
            "Of the joints whose torques move most, in motion. "
            + (
                "Black as measured."
                if comparison.torques is not None
                else "The log has none measured."
            ),
            "Torques of a few joints against time, of every criterion.",
            _drawn(comparison, plot_log_torques),
        ),
    ]
    return tuple(found)


def _drawn(
    comparison: LogComparison, plot: Callable[[LogComparison], Axes]
) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure = plot(comparison).figure
        assert isinstance(figure, Figure)
        return figure

    return draw
