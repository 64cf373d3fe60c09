"""Figs. 6 to 9 from closed loop: forces and CoPs against time, and against the hip roll."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.reading import DEG, MM, contact_origins, labels, world_soles
from copsense.plots.style import (
    COM_LINE,
    EDGE_LINE,
    MUTED,
    SOLE,
    STATIC_LINE,
    add_legend,
    axes_or_new,
    colours,
    new_figure,
    put_legend,
    styled,
)
from copsense.polygon import Polygon
from copsense.simulation import Recording

_FEET = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
_TIP: dict[str, Any] = {"color": "#b3261e", "linewidth": 1.1, "linestyle": (0, (4, 2))}


@styled
def plot_sway_load(recording: Recording, *, ax: Axes | None = None) -> Axes:
    """Draw the measured normal force of each foot against time."""
    ax = axes_or_new(ax)
    share = recording["wrench"].sel(component="fz").values[1:] / recording.attrs["weight"]
    names = labels(recording, "contact")
    for k, name in enumerate(names):
        ax.plot(recording["time"][1:], share[:, k], color=_FEET[k % len(_FEET)], label=name)
    ax.set_ylim(0.0, 1.0)
    ax.set_ylabel("load share, $f_z/(m g)$")
    _finish(ax, recording, _feet(names))
    return ax


@styled
def plot_sway_cop(recording: Recording, *, ax: Axes | None = None, legend: bool = True) -> Axes:
    """Draw the measured CoP y of each foot against time, the soles as bands, the static one under.

    The static prediction is the analysis's at the CoM of each instant.
    """
    ax = axes_or_new(ax)
    names, origins = labels(recording, "contact"), contact_origins(recording)
    soles, time = world_soles(recording), recording["time"].values
    y = recording["com"].sel(com_axis="y").values
    travel = recording["static_travel"].values
    for k in range(len(names)):
        sole, turn = soles[k], recording["contact_rotation"].values[k, 1, :2]
        if sole is not None:
            found = Polygon.hull(sole).section("y", float(origins[k, 0]))
            if found:
                ax.axhspan(*found, color=SOLE, zorder=0.5, linewidth=0)
                for edge in found:
                    ax.axhline(edge, **EDGE_LINE)
        world = origins[k, 1] + recording["cop"].values[:, k] @ turn * MM
        static = origins[k, 1] + recording["static_cop"].values[:, k] @ turn * MM
        ax.plot(time, np.interp(y - y[0], travel, static), **STATIC_LINE)
        ax.plot(time, world, color=_FEET[k % len(_FEET)], linewidth=1.5, zorder=2.5)
    ax.plot(time, y * MM, **COM_LINE)
    edges = np.vstack([origins, *(s for s in soles if s is not None)])[:, 1]
    room = 0.1 * max(float(np.ptp(edges)), 10.0)
    ax.set_ylim(edges.min() - room, edges.max() + room)
    ax.set_ylabel("CoP y, world [mm]")
    _finish(ax, recording, _handles(names) if legend else [])
    return ax


@styled
def plot_sway_hip_roll(
    recordings: Mapping[str, Sequence[Recording]],
    *,
    joint: str = "l_hip_roll",
    ax: Axes | None = None,
) -> Axes:
    """Draw Fig. 9b from closed loop: the left foot's CoP against a joint, the static one beneath.

    Args:
        recordings: criterion's name -> its recordings, each drawn until a foot tips.
        joint: the joint along the horizontal axis.
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax)
    colour = colours(list(recordings))
    for name, runs in recordings.items():
        for run in runs:
            left = int(np.argmax(run["contact_position"].sel(com_axis="y").values))
            standing = run.before_first_tip.settled
            angle = standing["joint_position"].sel(joint=joint).values * DEG
            there = run["static_joint"].sel(joint=joint).values * DEG
            shown = (there >= angle.min() - 0.1) & (there <= angle.max() + 0.1)
            static = np.where(shown, run["static_cop"].values[:, left, 1] * MM, np.nan)
            ax.plot(there, static, **STATIC_LINE)
            ax.plot(angle, standing["cop"].values[:, left, 1] * MM, color=colour[name])
            if "sole_polygon" in run:
                sole = Polygon.hull(run["sole_polygon"].values[left] * MM)
                for edge in sole.section("y", 0.0) or ():
                    ax.axhline(edge, **EDGE_LINE)
    ax.set_xlabel(f"{joint} [deg]")
    ax.set_ylabel("CoP of the left foot, to the left [mm]")
    static_line = Line2D([], [], label="static", color=STATIC_LINE["color"], linewidth=4.0)
    edge_line = Line2D([], [], label="edge of the sole", **EDGE_LINE)
    add_legend(ax, colour, extra=[static_line, edge_line])
    return ax


@styled
def plot_sway_limits(recordings: Mapping[str, Recording]) -> Figure:
    """Draw the CoPs of several recordings side by side."""
    figure = new_figure(4.6 * len(recordings), 4.0)
    panels = figure.subplots(1, len(recordings), sharey=True, squeeze=False)[0]
    for ax, (name, recording) in zip(panels, recordings.items(), strict=True):
        plot_sway_cop(recording, ax=ax, legend=False)
        ax.set_title(name)
    for ax in panels[1:]:
        ax.set_ylabel("")
    handles = _handles(labels(next(iter(recordings.values())), "contact"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _feet(names: Sequence[str]) -> list[Line2D]:
    return [Line2D([], [], color=_FEET[k % len(_FEET)], label=name) for k, name in enumerate(names)]


def _handles(names: Sequence[str]) -> list[Line2D]:
    static = Line2D([], [], label="static", color=STATIC_LINE["color"], linewidth=4.0)
    return [*_feet(names), static, Line2D([], [], label="CoM", **COM_LINE)]


def _finish(ax: Axes, recording: Recording, handles: list[Line2D]) -> None:
    tip = float(recording.attrs["tip_time"])
    if np.isfinite(tip):
        ax.axvline(tip, **_TIP)
        handles = [*handles, Line2D([], [], label="tip", **_TIP)] if handles else []
    ax.set_xlabel("time [s]")
    ax.axhline(0.0, color=MUTED, linewidth=0.6, zorder=0.8)
    if handles:
        put_legend(ax, handles)
