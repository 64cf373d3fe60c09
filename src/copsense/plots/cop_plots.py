"""Where each CoP goes along a sweep, between the edges of its sole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from copsense.plots.marking import mark_failed, marks
from copsense.plots.reading import (
    MM,
    abscissa,
    contact_origins,
    edges,
    labels,
    world_cops,
)
from copsense.plots.style import (
    COM_LINE,
    EDGE_LINE,
    MUTED,
    OFF_SOLE,
    SOLE,
    Color,
    add_legend,
    axes_or_new,
    looks,
    styled,
)
from copsense.sweeps import Sweep

_OVER_LINE = 6.0  # points between the line of a contact without a sole and its name


@styled
def plot_cop(
    sweep: Sweep,
    *,
    axis: str = "y",
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw where each CoP is in the world while the path is followed.

    Each sole is a band between its two edges; the line is dotted where a CoP is off its sole or its
    contact would have to pull. The CoM is drawn beside them.

    Args:
        sweep: the sweep.
        axis: ``"x"`` or ``"y"`` of the world.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to add a legend of the criteria.
    """
    ax = axes_or_new(ax)
    x, index = abscissa(sweep), "xy".index(axis)
    names, contacts = labels(sweep, "criterion"), labels(sweep, "contact")
    look = looks(names, color, label)
    colour, cops, good = look.colour, world_cops(sweep)[..., index], sweep.planted.values
    pulling = sweep["pulling"].values.astype(bool)
    _draw_edges(ax, sweep, axis, contacts)
    com = sweep["com"].sel(com_axis=axis).values * MM
    ax.plot(x.values, com, **COM_LINE)
    for j, name in enumerate(names):
        for k in range(len(contacts)):
            line = cops[:, j, k]
            for part in (pulling[:, j, k], ~pulling[:, j, k]):  # between them is a pole
                shown = np.where(part, line, np.nan)
                ax.plot(x.values, shown, color=colour[name], **OFF_SOLE)
            ax.plot(
                x.values,
                np.where(good[:, j, k], line, np.nan),
                color=colour[name],
                label=None if k else look.words[name],
                **marks(sweep),
            )
    mark_failed(ax, sweep, colour)
    _limit(ax, sweep, axis, cops, com)
    ax.set_xlabel(x.label)
    ax.set_ylabel(f"CoP {axis}, world [mm]")
    if legend:
        com_line = Line2D([], [], label="CoM", **COM_LINE)
        off = Line2D([], [], color=MUTED, label="off its sole", **OFF_SOLE)
        extra = [com_line] if np.all(good | sweep.failed.values[..., None]) else [com_line, off]
        add_legend(ax, look.legend, extra=extra)
    return ax


@styled
def plot_foot_cop(
    sweep: Sweep,
    contact: str,
    *,
    axis: str = "y",
    against: str | None = None,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw one contact's CoP in its own axes, with the sole's edges as dotted lines.

    Args:
        sweep: the sweep.
        contact: the contact's name.
        axis: ``"x"`` or ``"y"`` of the contact.
        against: a coordinate over postures to have along the horizontal axis; default the path's.
        ax: where to draw; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    ax = axes_or_new(ax)
    x, names = abscissa(sweep, against), labels(sweep, "criterion")
    look, k = looks(names, color, label), labels(sweep, "contact").index(contact)
    found = edges(sweep, axis)[k]
    for edge in found or ():
        place = edge - contact_origins(sweep)[k]["xy".index(axis)]
        ax.axhline(place, **EDGE_LINE)
    for name in names:
        cop = sweep["cop"].sel(criterion=name, contact=contact, axis=axis).values * MM
        ax.plot(x.values, cop, color=look.colour[name], label=look.words[name], **marks(sweep))
    mark_failed(ax, sweep, look.colour, against)
    ax.set_xlabel(x.label)
    ax.set_ylabel(f"CoP {axis} of {contact} [mm]")
    edge_line = Line2D([], [], label="edge of the sole", **EDGE_LINE)
    add_legend(ax, look.legend, extra=[edge_line] if found else [])
    return ax


def _draw_edges(ax: Axes, sweep: Sweep, axis: str, contacts: Sequence[str]) -> None:
    """Each sole as a band between its edges; a contact without one as its name alone."""
    at: dict[tuple[float, float], list[str]] = {}
    for k, found in enumerate(edges(sweep, axis)):
        if found is None:
            middle, over = float(contact_origins(sweep)[k, "xy".index(axis)]), _OVER_LINE
        else:
            ax.axhspan(*found, color=SOLE, zorder=0.5, linewidth=0)
            for edge in found:
                ax.axhline(edge, color=MUTED, linewidth=1.0, zorder=0.6)
            # just inside the lower edge, where the curves seldom are
            middle, over = found[0] + 3.0, 0.0
        at.setdefault((round(middle, 1), over), []).append(contacts[k])
    for (middle, over), here in at.items():
        ax.annotate(
            ", ".join(here),
            (0.012, middle),
            xytext=(0.0, over),
            xycoords=ax.get_yaxis_transform(),
            textcoords="offset points",
            color=MUTED,
            fontsize=8.5,
            va="bottom",
            zorder=3,
            bbox={"facecolor": "white", "alpha": 0.65, "linewidth": 0, "pad": 1.2},
        )


def _limit(ax: Axes, sweep: Sweep, axis: str, cops: np.ndarray, com: np.ndarray) -> None:
    """Set the limits so that a CoP that diverges does not flatten everything else."""
    bounds = [e for e in edges(sweep, axis) if e is not None]
    places = contact_origins(sweep)[:, "xy".index(axis)]
    marks = np.concatenate([np.ravel(bounds), places, com[np.isfinite(com)]])
    span = max(float(np.ptp(marks)), 1.0)
    shown = cops[np.isfinite(cops)]
    inside = shown[(shown > marks.min() - span / 2) & (shown < marks.max() + span / 2)]
    everything = np.concatenate([marks, inside])
    names = 0.15 if any(e is None for e in edges(sweep, axis)) else 0.05  # room for one on top
    ax.set_ylim(everything.min() - 0.05 * span, everything.max() + names * span)
