"""Figures of results; they draw and compute nothing.

Functions take results (a `Sweep`, a `Recording`, a `Design`, what `cop_sensitivity` gives) and
return Axes, or a Figure where they draw several. They open no window and keep no global state.

Every function takes `ax`, or `axes` where it draws several panels: the caller's Axes to draw in.
The rest of their figure stays as it is, and a legend there is added to. `label` and `color` tell
results apart that are drawn into the same Axes. Notebooks show what is returned.
"""

from __future__ import annotations

from copsense.extras import require

require("matplotlib", "a figure")  # before the modules that import it

from copsense.plots.benchmark_plots import plot_benchmark
from copsense.plots.cop_plots import plot_cop, plot_foot_cop
from copsense.plots.curve_plots import (
    plot_load,
    plot_margin,
    plot_sensitivity,
    plot_torques,
    plot_travel,
)
from copsense.plots.design_plots import plot_design
from copsense.plots.hardware_plots import plot_hardware, plot_hardware_sweep
from copsense.plots.limit_plots import plot_limit_margins, plot_limited, plot_regions
from copsense.plots.log_plots import plot_log
from copsense.plots.map_plots import plot_map
from copsense.plots.optimum_plots import plot_front, plot_optimum
from copsense.plots.push_plots import plot_pushes
from copsense.plots.recording_plots import plot_rollout
from copsense.plots.robot_plots import plot_robot
from copsense.plots.saving import lay_out, render_figure, save_figure
from copsense.plots.sole_plots import plot_soles
from copsense.plots.stance_plots import plot_stance
from copsense.plots.sweep_plots import plot_results

__all__ = [
    "lay_out",
    "plot_benchmark",
    "plot_cop",
    "plot_design",
    "plot_foot_cop",
    "plot_front",
    "plot_hardware",
    "plot_hardware_sweep",
    "plot_limit_margins",
    "plot_limited",
    "plot_load",
    "plot_log",
    "plot_map",
    "plot_margin",
    "plot_optimum",
    "plot_pushes",
    "plot_regions",
    "plot_results",
    "plot_robot",
    "plot_rollout",
    "plot_sensitivity",
    "plot_soles",
    "plot_stance",
    "plot_torques",
    "plot_travel",
    "render_figure",
    "save_figure",
]
