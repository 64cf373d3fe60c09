"""plot_log: a robot's log beside what criteria say, after [Romano2016] Figures 6 to 9."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.reading import MM
from copsense.plots.style import INK, MUTED, colours, line_styles, new_figure, put_legend, styled

if TYPE_CHECKING:
    from copsense.logs import LogComparison

_MEASURED: dict[str, Any] = {"color": INK, "linewidth": 1.0}
_REST: dict[str, Any] = {"linewidth": 1.1, "linestyle": (0, (1.2, 1.4))}
_MOST = 4  # joints whose torques are drawn


@styled
def plot_log(comparison: LogComparison) -> Figure:
    """Draw a comparison: load over time and over the CoM, CoPs and torques over time.

    Black is what was measured, a colour a criterion: dotted at rest, solid in motion. In the second
    panel the beginning that the slopes leave out is grey.
    """
    figure = new_figure(12.0, 7.4)
    panels = figure.subplots(2, 2)
    colour = colours(dict.fromkeys(s.criterion for s in comparison.statics))
    _draw_load(panels[0, 0], comparison, colour)
    _draw_law(panels[0, 1], comparison, colour)
    _draw_cops(panels[1, 0], comparison, colour)
    _draw_torques(panels[1, 1], comparison, colour)
    for ax in (panels[0, 0], *panels[1]):
        ax.set_xlabel("time [s]")
    handles = _handles(comparison, colour)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    figure.suptitle(comparison.heading, x=0.01, ha="left", fontsize=12.5, fontweight="bold")
    return figure


def _look(statics: Any, colour: dict[str, str]) -> dict[str, Any]:
    found = {"color": colour[statics.criterion], "linewidth": 1.3}
    return found if statics.inertia else found | _REST


def _handles(comparison: LogComparison, colour: dict[str, str]) -> list[Line2D]:
    lines = [Line2D([], [], label="measured", **_MEASURED)]
    return lines + [Line2D([], [], label=s.name, **_look(s, colour)) for s in comparison.statics]


def _draw_load(ax: Axes, comparison: LogComparison, colour: dict[str, str]) -> None:
    times, name = comparison.times, comparison.contact_names[0]
    for each in comparison.statics:
        ax.plot(times, each.shares[:, 0], **_look(each, colour))
    ax.plot(times, comparison.shares[:, 0], **_MEASURED)
    ax.set_ylabel(f"share of the load on {name}")


def _draw_law(ax: Axes, comparison: LogComparison, colour: dict[str, str]) -> None:
    travel = comparison.travel * MM
    late = comparison.times >= comparison.skipped
    share = comparison.shares[:, 0]
    ax.plot(travel[~late], share[~late], ".", color="#c3c9cf", markersize=2)
    ax.plot(travel[late], share[late], ".", color=INK, markersize=2.5)
    ends = np.array([travel.min(), travel.max()])
    load = comparison.slopes.get("load", {})
    middle = float(comparison.travel[late].mean()) * MM if late.any() else 0.0
    for each in comparison.statics:
        slope = load.get(each.name)
        if slope is not None and comparison.distance is not None:
            line = slope.middle + slope.value / (comparison.distance * MM) * (ends - middle)
            ax.plot(ends, line, label=f"{each.name}: {slope.value:.3f}", **_look(each, colour))
    if "measured" in load:
        found = load["measured"]
        ax.plot(
            [],
            [],
            ".",
            color=INK,
            label=f"measured: {found.value:.3f} [{found.low:.3f}, {found.high:.3f}]",
        )
    ax.set_xlabel("CoM along the line between the feet [mm]")
    ax.set_ylabel(f"share of the load on {comparison.contact_names[0]}")
    if load:
        ax.legend(fontsize=8, loc="best")


def _draw_cops(ax: Axes, comparison: LogComparison, colour: dict[str, str]) -> None:
    """The axis of the contact along which the CoPs move most."""
    spans = [np.nanmax(np.ptp(s.cops, axis=0), axis=0) for s in comparison.statics]
    axis = int(np.argmax(np.max(spans, axis=0))) if spans else 1
    styles = line_styles(comparison.contact_names)
    for k, name in enumerate(comparison.contact_names):
        for each in comparison.statics:
            if each.inertia:
                look = _look(each, colour) | {"linestyle": styles[name]}
                ax.plot(comparison.times, each.cops[:, k, axis] * MM, **look)
        cops = comparison.cops[:, k, axis]
        if np.isfinite(cops).any():
            ax.plot(comparison.times, cops * MM, **(_MEASURED | {"linestyle": styles[name]}))
    ax.set_ylabel(f"CoP {'xy'[axis]} in the foot, in motion [mm]")
    lines = [
        Line2D([], [], color=MUTED, linestyle=styles[name], label=name)
        for name in comparison.contact_names
    ]
    if not np.isfinite(comparison.cops).any():
        lines.append(Line2D([], [], color="none", label="(no moments measured)"))
    put_legend(ax, lines)


def _draw_torques(ax: Axes, comparison: LogComparison, colour: dict[str, str]) -> None:
    """The joints whose torques the criteria see move most."""
    if not comparison.statics:
        return
    spans = np.max([np.ptp(s.torques, axis=0) for s in comparison.statics], axis=0)
    joints = np.argsort(-spans)[: min(_MOST, len(spans))]
    styles = line_styles([comparison.torque_names[j] for j in joints])
    for j in joints:
        name = comparison.torque_names[j]
        for each in comparison.statics:
            if each.inertia:
                look = _look(each, colour) | {"linestyle": styles[name]}
                ax.plot(comparison.times, each.torques[:, j], **look)
        if comparison.torques is not None and not math.isnan(float(comparison.torques[0, j])):
            look = _MEASURED | {"linestyle": styles[name]}
            ax.plot(comparison.times, comparison.torques[:, j], **look)
    ax.set_ylabel("torque, in motion [Nm]")
    put_legend(
        ax, [Line2D([], [], color=MUTED, linestyle=s, label=name) for name, s in styles.items()]
    )
