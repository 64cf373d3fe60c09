"""The paper's figures: the four-bar's curves, and their counterparts on the iCub."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.paper.closed_form import Curve, FigureData
from copsense.paper.reproduce import UnitOfLength
from copsense.plots.cop_plots import plot_foot_cop
from copsense.plots.reading import DEG, MM
from copsense.plots.robot_plots import plot_robot
from copsense.plots.style import (
    COM_LINE,
    EDGE_LINE,
    INK,
    MUTED,
    add_legend,
    axes_or_new,
    colours,
    new_figure,
    put_legend,
    styled,
)
from copsense.sensitivity import CopSensitivity
from copsense.sweeps import Sweep

_FEET: dict[str, Any] = {"left CoP": "-", "right CoP": (0, (4.5, 1.8))}
_SCALE = {"m": (MM, "mm"), "m/rad": (MM / DEG, "mm/deg"), "1": (1.0, "")}
_ROOF = 1.6  # a CoP with a pole is shown to this many times the CoM's travel


@styled
def plot_figure_3(data: FigureData, criterion: str, *, ax: Axes | None = None) -> Axes:
    """Draw Fig. 3a or 3b: both CoPs and the CoM of the four-bar, poles as dashed verticals.

    Args:
        data: what `figure_3a` or `figure_3b` computed.
        criterion: whose it is, for the colour.
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax)
    colour = colours([criterion])[criterion]
    for label, style in _FEET.items():
        curve = data.curve(label)
        _draw(ax, curve, color=colour, linestyle=style)
        for pole in _poles(curve):
            ax.axvline(pole, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)))
    _draw(ax, data.curve("CoM"), **COM_LINE)
    if _poles(data.curve("left CoP")):
        com = np.concatenate([s.values for s in data.curve("CoM").segments]) * MM
        ax.set_ylim(-_ROOF * np.abs(com).max(), _ROOF * np.abs(com).max())
    ax.set_xlabel(r"leg angle $\Delta\xi$ [deg]")
    ax.set_ylabel("CoPs and CoM, to the right [mm]")
    handles = [Line2D([], [], color=colour, linestyle=s, label=n) for n, s in _FEET.items()]
    handles.append(Line2D([], [], label="CoM", **COM_LINE))
    if _poles(data.curve("left CoP")):
        handles.append(
            Line2D([], [], color=MUTED, linewidth=1, linestyle=(0, (4, 3)), label="a foot unloads")
        )
    put_legend(ax, handles)
    return ax


@styled
def plot_criteria_curves(
    data: FigureData, quantity: str, *, ceiling: float | None = None, ax: Axes | None = None
) -> Axes:
    """Draw Fig. 4 or 5: one curve of the four-bar per criterion.

    Args:
        data: what `figure_4` or `figure_5` computed; its curves are labelled by criterion.
        quantity: what they show, for the axis.
        ceiling: largest value shown, in the unit drawn; a pole goes through it.
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax)
    colour = colours(curve.label for curve in data.curves)
    for curve in data.curves:
        _draw(ax, curve, color=colour[curve.label])
        for pole in _poles(curve):
            ax.axvline(pole, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)))
    if ceiling is not None:
        ax.set_ylim(0.0, ceiling)
    unit = _SCALE[data.curves[0].unit][1]
    ax.set_xlabel(r"leg angle $\Delta\xi$ [deg]")
    ax.set_ylabel(f"{quantity} [{unit}]" if unit else quantity)
    add_legend(ax, colour)
    return ax


@styled
def plot_figure_9a(
    wrench: FigureData, torque: FigureData, reach: float, *, ax: Axes | None = None
) -> Axes:
    """Draw Fig. 9a: the four-bar's left CoP against the leg angle under both criteria.

    Args:
        wrench: Fig. 3a's data.
        torque: Fig. 3b's data.
        reach: largest angle shown to either side [rad].
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax)
    colour = colours(["minimum-wrench", "minimum-torque"])
    lines = four_bar_left_cops(wrench, torque, reach)
    for name, (angles, cops) in lines.items():
        ax.plot(angles, cops, color=colour[name])
    ax.set_xlabel(r"leg angle $\Delta\xi$ [deg]")
    ax.set_ylabel("CoP of the left foot, to the left [mm]")
    add_legend(ax, colour)
    return ax


@styled
def plot_figure_9b(
    dataset: Sweep, wrench: FigureData, torque: FigureData, *, ax: Axes | None = None
) -> Axes:
    """Draw Fig. 9b: the iCub's left CoP against hip roll, the four-bar's beneath it.

    Args:
        dataset: the lateral sweep under both criteria, with ``l_hip_roll`` over its postures.
        wrench: Fig. 3a's data.
        torque: Fig. 3b's data.
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax)
    sideways = dataset["contact_position"].sel(com_axis="y").values
    left = str(dataset["contact"].values[int(np.argmax(sideways))])
    roll = dataset["l_hip_roll"].values
    colour = colours(["minimum-wrench", "minimum-torque"])
    for name, (x, y) in four_bar_left_cops(wrench, torque, float(np.abs(roll).max())).items():
        ax.plot(x, y, color=colour[name], linewidth=1.1, linestyle=(0, (5, 3)), alpha=0.8)
    plot_foot_cop(dataset, left, against="l_hip_roll", ax=ax)
    ax.set_ylabel("CoP of the left foot, to the left [mm]")
    beside = Line2D([], [], color=MUTED, linewidth=1.1, linestyle=(0, (5, 3)), label="four-bar")
    edge = Line2D([], [], label="edge of the sole", **EDGE_LINE)
    add_legend(ax, colour, extra=[beside, edge])
    return ax


@styled
def plot_unit_of_length(unit: UnitOfLength, *, ax: Axes | None = None) -> Axes:
    """Draw how criterion 1's sensitivity depends on the length that makes it add up."""
    ax = axes_or_new(ax)
    colour = colours(["minimum-wrench", "minimum-torque"])
    ax.axhline(unit.minimum_torque, color=colour["minimum-torque"])
    ax.plot(unit.lengths, unit.closed_form, color=colour["minimum-wrench"])
    ax.plot(
        unit.lengths,
        unit.icub,
        "o",
        color=colour["minimum-wrench"],
        markersize=4.5,
        fillstyle="none",
    )
    for length, words in ((unit.distance / 2, "L = d/2"), (1.0, "L = 1 m")):
        ax.axvline(length, color=MUTED, linewidth=1.0, linestyle=(0, (4, 3)))
        ax.annotate(
            words,
            (length, 0.03),
            xytext=(-4, 0),
            textcoords="offset points",
            ha="right",
            fontsize=9,
            color=INK,
        )
    ax.set_xscale("log")
    ticks = [0.01, 0.03, 0.1, 0.3, 1.0]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_ylim(0.0, 1.05)
    ax.set_xlabel("length L of criterion 1 [m]")
    ax.set_ylabel("dCoP$_y$/dCoM$_y$ at the centre [-]")
    dots = Line2D(
        [],
        [],
        color=colour["minimum-wrench"],
        marker="o",
        fillstyle="none",
        linestyle="none",
        label="minimum-wrench",
    )
    line = Line2D([], [], color=colour["minimum-wrench"], label="L² / (L² + d²/4)")
    torque = Line2D([], [], color=colour["minimum-torque"], label="minimum-torque")
    put_legend(ax, [dots, line, torque])
    return ax


@styled
def plot_leaning_robot(found: Sequence[Sequence[CopSensitivity]]) -> Figure:
    """Draw a robot's stick figure from behind at several postures, with the CoPs of criteria.

    Args:
        found: of each posture, a sensitivity per criterion.
    """
    figure = new_figure(9.2, 4.6)
    panels = figure.subplots(1, len(found), sharey=True, squeeze=False)[0]
    for ax, here in zip(panels, found, strict=True):
        stance = here[0].equilibrium.stance
        plot_robot(stance, here, ax=ax, legend=False)
        y = round(stance.com[1] * MM)
        ax.set_title(f"CoM y = {y:+d} mm" if y else "CoM y = 0")
    for ax in panels[1:]:
        ax.set_ylabel("")
    return figure


def four_bar_left_cops(
    wrench: FigureData, torque: FigureData, reach: float
) -> dict[str, tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]]:
    """Criterion -> angle [deg] and left CoP, positive to the left [mm], up to |angle| = reach."""
    lines = {}
    for name, data in (("minimum-wrench", wrench), ("minimum-torque", torque)):
        segment = max(data.curve("left CoP").segments, key=lambda s: len(s.values))
        shown = np.abs(segment.delta_xi) <= reach + 1e-9
        # the four-bar's x is to the right, a robot's y to the left
        lines[name] = (segment.delta_xi[shown] * DEG, -segment.values[shown] * MM)
    return lines


def _draw(ax: Axes, curve: Curve, **style: Any) -> None:
    scale, _ = _SCALE[curve.unit]
    for segment in curve.segments:
        ax.plot(segment.delta_xi * DEG, segment.values * scale, **style)


def _poles(curve: Curve) -> list[float]:
    """Where a curve breaks [deg]: in the middle of each gap between its segments."""
    return [float(a.delta_xi[-1] + b.delta_xi[0]) / 2 * DEG for a, b in pairwise(curve.segments)]
