"""plot_log: a robot's log beside what criteria say, after [Romano2016] Figures 6 to 9.

Black is what was measured, a colour a criterion: dotted at rest, solid in motion.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.reading import DEG, MM
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Looks,
    Panels,
    axes_or_new,
    given_axes,
    line_styles,
    looks,
    new_figure,
    put_legend,
    styled,
    whole_figure,
)

if TYPE_CHECKING:
    from copsense.logs import LogComparison
    from copsense.logs.log_statics import LogStatics

_MEASURED: dict[str, Any] = {"color": INK, "linewidth": 1.0}
_REST: dict[str, Any] = {"linewidth": 1.1, "linestyle": (0, (1.2, 1.4))}
_BEGINNING = "#c3c9cf"  # of a log, which the slopes leave out
_MOST = 4  # joints whose torques are drawn


@styled
def plot_log(
    comparison: LogComparison,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a comparison: load over time and over the CoM, CoPs and torques over time.

    In the second panel the beginning that the slopes leave out is grey.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        axes: where to draw these four; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    look, given = _looks(comparison, color, label), axes is not None
    panels = list(new_figure(12.0, 7.4).subplots(2, 2).flat) if axes is None else axes
    load, slope, cop, torques = given_axes(panels, ("load", "slope", "CoPs", "torques"))
    figure = whole_figure(load)
    plot_log_load(comparison, ax=load, label=label, color=look.colour, legend=given)
    plot_log_slope(comparison, ax=slope, label=label, color=look.colour)
    plot_log_cop(comparison, ax=cop, label=label, color=look.colour, legend=given)
    plot_log_torques(comparison, ax=torques, label=label, color=look.colour)
    if given:
        return figure
    handles = _handles(comparison, look)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    figure.suptitle(comparison.heading, x=0.01, ha="left", fontsize=12.5, fontweight="bold")
    return figure


@styled
def plot_log_load(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw the share of the load on each contact over time, after Fig. 6; of criteria in motion.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to explain the lines.
    """
    ax = axes_or_new(ax)
    look, names = _looks(comparison, color, label), comparison.contact_names
    styles = line_styles(names)
    for k, name in enumerate(names):
        for each in _in_motion(comparison):
            line = _line(each, look) | {"linestyle": styles[name]}
            ax.plot(comparison.times, each.shares[:, k], **line)
        ax.plot(
            comparison.times, comparison.shares[:, k], **(_MEASURED | {"linestyle": styles[name]})
        )
    ax.set_xlabel("time [s]")
    ax.set_ylabel("load share, in motion")
    _explain(ax, comparison, look, legend)
    return ax


@styled
def plot_log_slope(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the load share of the first contact over the CoM, with the line of every criterion.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    ax = axes_or_new(ax)
    look = _looks(comparison, color, label)
    travel = comparison.travel * MM
    late = comparison.times >= comparison.skipped
    share = comparison.shares[:, 0]
    ax.plot(travel[~late], share[~late], ".", color=_BEGINNING, markersize=2)
    ax.plot(travel[late], share[late], ".", color=INK, markersize=2.5)
    ends = np.array([travel.min(), travel.max()])
    load = comparison.slopes.get("load", {})
    middle = float(comparison.travel[late].mean()) * MM if late.any() else 0.0
    for each in comparison.statics:
        slope = load.get(each.name)
        if slope is not None and comparison.distance is not None:
            line = slope.middle + slope.value / (comparison.distance * MM) * (ends - middle)
            ax.plot(
                ends, line, label=f"{_words(each, look)}: {slope.value:.3f}", **_line(each, look)
            )
    if "measured" in load:
        found = load["measured"]
        text = f"measured: {found.value:.3f} [{found.low:.3f}, {found.high:.3f}]"
        ax.plot([], [], ".", color=INK, label=text)
    ax.set_xlabel("CoM along the line between the feet [mm]")
    ax.set_ylabel(f"share of the load on {comparison.contact_names[0]}")
    if load:
        ax.legend(fontsize=8, loc="best")
    return ax


@styled
def plot_log_cop(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw the CoP of each contact in its own frame over time, after Figs. 7 and 8.

    Of both axes the one along which the CoPs move most; of criteria in motion.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to explain the lines' colours.
    """
    ax = axes_or_new(ax)
    look, axis = _looks(comparison, color, label), _cop_axis(comparison)
    styles = line_styles(comparison.contact_names)
    for k, name in enumerate(comparison.contact_names):
        for each in _in_motion(comparison):
            line = _line(each, look) | {"linestyle": styles[name]}
            ax.plot(comparison.times, each.cops[:, k, axis] * MM, **line)
        cops = comparison.cops[:, k, axis]
        if np.isfinite(cops).any():
            ax.plot(comparison.times, cops * MM, **(_MEASURED | {"linestyle": styles[name]}))
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"CoP {'xy'[axis]} in the foot, in motion [mm]")
    _explain(ax, comparison, look, legend, bool(np.isfinite(comparison.cops).any()))
    return ax


@styled
def plot_log_joint(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the first contact's CoP over the joint that moves most, after Fig. 9b.

    What was measured is drawn where moments were; criteria in motion, and dotted at rest.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    ax = axes_or_new(ax)
    log, axis = comparison.log, _cop_axis(comparison)
    look = _looks(comparison, color, label)
    name = moving_joint(comparison)
    known = np.isfinite(log.positions[:, log.joint_names.index(name)])
    angle = np.interp(
        comparison.times,
        log.times[known],
        log.positions[known, log.joint_names.index(name)] * DEG,
    )
    for each in comparison.statics:
        size = 2.0 if each.inertia else 1.0
        cop = each.cops[:, 0, axis] * MM
        ax.plot(angle, cop, ".", color=look.colour[each.criterion], markersize=size)
    cops = comparison.cops[:, 0, axis] * MM
    if np.isfinite(cops).any():
        ax.plot(angle, cops, ".", color=INK, markersize=2.0)
    ax.set_xlabel(f"{name} [deg]")
    ax.set_ylabel(f"CoP {'xy'[axis]} in {comparison.contact_names[0]} [mm]")
    lines = [Line2D([], [], color=c, label=n) for n, c in look.legend.items()]
    if np.isfinite(cops).any():
        lines.append(Line2D([], [], label="measured", **_MEASURED))
    put_legend(ax, lines)
    return ax


@styled
def plot_log_torques(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the joints whose torques the criteria see move most, over time.

    Args:
        comparison: what `copsense.logs.compare_log` returned.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    ax = axes_or_new(ax)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("torque, in motion [Nm]")
    if not comparison.statics:
        return ax
    look = _looks(comparison, color, label)
    spans = np.max([np.ptp(s.torques, axis=0) for s in comparison.statics], axis=0)
    joints = np.argsort(-spans)[: min(_MOST, len(spans))]
    styles = line_styles([comparison.torque_names[j] for j in joints])
    for j in joints:
        name = comparison.torque_names[j]
        for each in _in_motion(comparison):
            line = _line(each, look) | {"linestyle": styles[name]}
            ax.plot(comparison.times, each.torques[:, j], **line)
        if comparison.torques is not None and not math.isnan(float(comparison.torques[0, j])):
            line = _MEASURED | {"linestyle": styles[name]}
            ax.plot(comparison.times, comparison.torques[:, j], **line)
    lines = [Line2D([], [], color=MUTED, linestyle=s, label=name) for name, s in styles.items()]
    named = look.legend.items() if label else ()
    put_legend(ax, [*(Line2D([], [], color=c, label=words) for words, c in named), *lines])
    return ax


@styled
def plot_log_intervals(
    comparison: LogComparison,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the load's slope with its 95 % interval: a band measured, a point each criterion.

    Args:
        comparison: what `copsense.logs.compare_log` returned, with slopes of the load.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    load, look = comparison.slopes["load"], _looks(comparison, color, label)
    ax = axes_or_new(ax, height=0.9 + 0.42 * len(load))
    measured = load["measured"]
    ax.axvspan(measured.low, measured.high, color=INK, alpha=0.12, linewidth=0)
    ax.axvline(measured.value, color=INK, linewidth=1.0)
    for row, each in enumerate(comparison.statics):
        slope = load[each.name]
        ax.plot(
            [slope.low, slope.high], [row, row], color=look.colour[each.criterion], linewidth=2.0
        )
        face = look.colour[each.criterion] if each.inertia else "white"
        ax.plot(slope.value, row, "o", color=look.colour[each.criterion], markerfacecolor=face)
    ax.set_yticks(range(len(comparison.statics)), [_words(s, look) for s in comparison.statics])
    ax.set_ylim(len(comparison.statics) - 0.5, -0.5)
    ax.set_xlim(left=min(0.0, *(s.low for s in load.values())))
    ax.set_xlabel("slope of the load [1]")
    put_legend(ax, [Line2D([], [], label="measured, 95 % interval", **_MEASURED)])
    return ax


def moving_joint(comparison: LogComparison) -> str:
    """The joint of a log that moves most."""
    span = np.nanmax(comparison.log.positions, axis=0) - np.nanmin(comparison.log.positions, axis=0)
    return comparison.log.joint_names[int(np.nanargmax(span))]


def _looks(comparison: LogComparison, color: Color, label: str | None) -> Looks:
    return looks(list(dict.fromkeys(s.criterion for s in comparison.statics)), color, label)


def _words(statics: LogStatics, look: Looks) -> str:
    """What a legend calls a criterion at rest, or in motion."""
    return statics.name.replace(statics.criterion, look.words[statics.criterion], 1)


def _in_motion(comparison: LogComparison) -> list[LogStatics]:
    return [s for s in comparison.statics if s.inertia]


def _line(statics: LogStatics, look: Looks) -> dict[str, Any]:
    found = {"color": look.colour[statics.criterion], "linewidth": 1.3}
    return found if statics.inertia else found | _REST


def _cop_axis(comparison: LogComparison) -> int:
    """The axis of the contacts along which the CoPs move most."""
    spans = [np.nanmax(np.ptp(s.cops, axis=0), axis=0) for s in comparison.statics]
    return int(np.argmax(np.max(spans, axis=0))) if spans else 1


def _handles(comparison: LogComparison, look: Looks) -> list[Line2D]:
    return [
        Line2D([], [], label="measured", **_MEASURED),
        *(Line2D([], [], label=_words(s, look), **_line(s, look)) for s in comparison.statics),
    ]


def _explain(
    ax: Axes, comparison: LogComparison, look: Looks, whole: bool, measured: bool = True
) -> None:
    """A legend of the contacts' line styles, and of the colours where it is to be whole."""
    styles = line_styles(comparison.contact_names)
    lines = [Line2D([], [], color=MUTED, linestyle=s, label=name) for name, s in styles.items()]
    if not (measured or whole):
        lines.append(Line2D([], [], color="none", label="(no moments measured)"))
    if whole:
        named = look.legend.items()
        lines = [Line2D([], [], color=c, label=words) for words, c in named] + lines
        if measured:
            lines.insert(0, Line2D([], [], label="measured", **_MEASURED))
    put_legend(ax, lines)
