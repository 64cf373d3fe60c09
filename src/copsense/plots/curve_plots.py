"""Curves of a sweep against its coordinate: load, margin, travel, sensitivity, torques."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from copsense.plots.marking import mark_failed, marks, say, shade_below_zero
from copsense.plots.reading import MM, abscissa, first_to_go, labels
from copsense.plots.style import (
    MUTED,
    Color,
    Panels,
    add_legend,
    axes_or_new,
    axes_or_pair,
    line_styles,
    looks,
    styled,
    whole_figure,
)
from copsense.sweeps import Sweep

_TALL = 6.0  # how many times the least criterion's travel is shown


@styled
def plot_load(
    sweep: Sweep,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw each contact's share of the weight, f_z / (m g).

    Args:
        sweep: the sweep.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to add a legend of the criteria.
    """
    ax = axes_or_new(ax)
    share = sweep["wrench"].sel(component="fz").values / sweep.attrs["weight"]
    _draw_per_contact(ax, sweep, share, label, color, legend=legend)
    ax.axhline(0.0, color=MUTED, linewidth=0.8)
    ax.set_ylabel("load share, $f_z/(m g)$")
    return ax


@styled
def plot_margin(
    sweep: Sweep,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw how far inside its sole each CoP is.

    Args:
        sweep: the sweep.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to add a legend of the criteria.
    """
    ax = axes_or_new(ax)
    margin = sweep["margin"].values * MM
    shown = np.where(np.isfinite(margin), margin, np.nan)
    _draw_per_contact(ax, sweep, shown, label, color, legend=legend)
    shade_below_zero(ax, margin, "off the sole")
    if not np.any(np.isfinite(margin)):
        say(ax, "no contact has a sole: none can tip")
    ax.set_ylabel("CoP to nearest edge [mm]")
    return ax


@styled
def plot_travel(
    sweep: Sweep,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw how far the CoM may go before the first contact tips or unloads, to first order.

    Args:
        sweep: the sweep.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to add a legend of the criteria.
    """
    ax = axes_or_new(ax)
    x, names = abscissa(sweep), labels(sweep, "criterion")
    look, travel = looks(names, color, label), first_to_go(sweep)
    colour = look.colour
    for j, name in enumerate(names):
        ax.plot(x.values, travel[:, j], color=colour[name], label=look.words[name], **marks(sweep))
    mark_failed(ax, sweep, colour)
    _keep_readable(ax, colour, travel)
    shade_below_zero(ax, travel, "a contact tips or pulls")
    blind = str(sweep.attrs.get("without_sole", ""))
    if blind:
        say(ax, f"no sole known under {blind}:\nthe travel to unloading, not to tipping")
    elif not np.any(np.isfinite(travel)):
        say(ax, "no contact tips or unloads, to first order")
    ax.set_xlabel(x.label)
    ax.set_ylabel("CoM travel left [mm]")
    if legend:
        add_legend(ax, look.legend)
    return ax


@styled
def plot_sensitivity(
    sweep: Sweep,
    *,
    axis: str = "y",
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw the sensitivity: the CoP's slope along the path, and its gain per CoM travel.

    Args:
        sweep: the sweep.
        axis: ``"x"`` or ``"y"``, of the CoP in its contact's axes and of the CoM.
        axes: where to draw the slope and the gain; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    left, right = axes_or_pair(axes, ("the slope", "the gain"), 9.2, 3.7)
    unit = str(sweep[str(sweep.attrs["coordinate"])].attrs.get("units", "1"))
    # slopes in m per unit of the path: m/m stays, m/rad is shown as mm/deg
    scale = {"m": 1.0, "rad": MM * np.pi / 180.0}.get(unit, MM)
    words = {"m": "m/m", "rad": "mm/deg"}.get(unit, "mm per posture")
    slope = sweep["cop_slope"].sel(axis=axis).values * scale
    gain = sweep["cop_gain"].sel(axis=axis, com_direction=axis).values
    _draw_per_contact(left, sweep, slope, label, color, legend=True)
    _draw_per_contact(right, sweep, gain, label, color, legend=True)
    left.set_ylabel(f"slope of CoP {axis} along the path [{words}]")
    right.set_ylabel(f"gain dCoP$_{axis}$/dCoM$_{axis}$ [m/m]")
    return whole_figure(left)


@styled
def plot_torques(
    sweep: Sweep,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw the norm of the torques along the path, and the range of each joint's torque.

    Args:
        sweep: the sweep.
        axes: where to draw the norm and the ranges; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    names, joints = labels(sweep, "criterion"), labels(sweep, "joint")
    high = max(3.4, 0.24 * len(joints) + 1.0)
    left, right = axes_or_pair(axes, ("the norm", "the ranges"), 9.2, high, (1.0, 1.15))
    look = looks(names, color, label)
    x, colour, torque = abscissa(sweep), look.colour, sweep["torque"].values
    height = 0.8 / len(names)
    for j, name in enumerate(names):
        norm = np.linalg.norm(torque[:, j], axis=-1)
        left.plot(x.values, norm, color=colour[name], label=look.words[name], **marks(sweep))
        known = torque[:, j][np.all(np.isfinite(torque[:, j]), axis=-1)]
        if len(known):
            low, high = known.min(axis=0), known.max(axis=0)
            rows = np.arange(len(joints)) + (j - (len(names) - 1) / 2) * height
            # a dot, for a torque that is constant
            right.hlines(rows, low, high, color=colour[name], linewidth=160 * height / len(joints))
            right.plot((low + high) / 2, rows, ".", color=colour[name], markersize=3)
    mark_failed(left, sweep, colour)
    right.axvline(0.0, color=MUTED, linewidth=0.8)
    right.set_yticks(np.arange(len(joints)), joints, fontsize=8)
    if not right.yaxis_inverted():
        right.invert_yaxis()
    right.set_xlabel("torque, least to most [N m]")
    left.set_xlabel(x.label)
    left.set_ylabel("norm of the joint torques [N m]")
    left.set_ylim(bottom=0.0)
    add_legend(left, look.legend)
    return whole_figure(left)


def _draw_per_contact(
    ax: Axes,
    sweep: Sweep,
    values: Float[np.ndarray, "N criterion contact"],
    label: str | None,
    color: Color,
    *,
    legend: bool,
) -> None:
    """One line per criterion (colour) and contact (style)."""
    x, names, contacts = abscissa(sweep), labels(sweep, "criterion"), labels(sweep, "contact")
    look, style = looks(names, color, label), line_styles(contacts)
    for j, name in enumerate(names):
        for k, contact in enumerate(contacts):
            ax.plot(
                x.values,
                values[:, j, k],
                color=look.colour[name],
                linestyle=style[contact],
                label=None if k else look.words[name],
                **marks(sweep),
            )
    mark_failed(ax, sweep, look.colour)
    ax.set_xlabel(x.label)
    if legend:
        add_legend(ax, look.legend, style)


def _keep_readable(
    ax: Axes, colour: dict[str, str], travel: Float[np.ndarray, "N criterion"]
) -> None:
    """Cut off a criterion whose travel is very long, so that the others are visible, and say so."""
    largest = {
        n: np.max(t[np.isfinite(t)], initial=-np.inf) for n, t in zip(colour, travel.T, strict=True)
    }
    known = [value for value in largest.values() if value > 0]
    if not known or max(known) <= _TALL * min(known):
        return
    top = _TALL * min(known)
    ax.set_ylim(min(float(np.nanmin(travel)), 0.0) - 0.04 * top, top)
    beyond = [name for name, value in largest.items() if value > top]
    for row, name in enumerate(beyond):
        ax.annotate(
            f"↑ {name}: up to {largest[name] / MM:.3g} m",
            (0.02, 0.97 - 0.07 * row),
            xycoords="axes fraction",
            va="top",
            fontsize=8.5,
            color=colour[name],
        )
