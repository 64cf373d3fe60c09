"""plot_results: a sweep in one figure."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.cop_plots import plot_cop
from copsense.plots.curve_plots import plot_load, plot_travel
from copsense.plots.limit_plots import (
    first_limits,
    limit_kinds,
    mark_first_limits,
    plot_limit_margins,
)
from copsense.plots.reading import (
    MM,
    abscissa,
    contact_origins,
    labels,
    world_cops,
    world_soles,
)
from copsense.plots.sole_plots import draw_ground, draw_track, frame_ground
from copsense.plots.style import (
    COM_LINE,
    LIMIT_LINE,
    MUTED,
    OFF_SOLE,
    Color,
    Looks,
    Panels,
    given_axes,
    line_styles,
    looks,
    new_figure,
    put_legend,
    styled,
    whole_figure,
)
from copsense.sweeps import Sweep

_FOUR = ("the CoPs from above", "the CoPs between edges", "the loads", "the travel")
_LINE, _HANDLE = 130, 8  # characters across the figure, and of a handle, in the legend's font


@styled
def plot_results(
    sweep: Sweep,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a sweep in one figure: from above, CoPs and edges, load shares, CoM travel.

    Margins to limits, of a sweep within limits or from `Sweep.with_limit_margins`, are drawn below,
    with a dotted line in each panel where a criterion meets its first limit.

    Args:
        sweep: the sweep.
        axes: where to draw these four, and each kind of limit; the legend then is over the first of
            them. Default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    kinds = limit_kinds(sweep) if "limit_margin" in sweep else []
    look = looks(labels(sweep, "criterion"), color, label)
    colour = look.colour
    panels = _panels(kinds) if axes is None else given_axes(axes, (*_FOUR, *kinds))
    figure, (above, cop, load, travel, *below) = whole_figure(panels[0]), panels
    _draw_above(above, sweep, colour)
    plot_cop(sweep, axis=widest_axis(sweep), ax=cop, color=colour, legend=False)
    plot_load(sweep, ax=load, color=colour, legend=False)
    plot_travel(sweep, ax=travel, color=colour, legend=False)
    if kinds:
        plot_limit_margins(sweep, axes=below, color=colour, legend=False)
        for ax in below[1:]:
            ax.set_ylabel(ax.get_ylabel().replace("smallest margin ", ""))
        for ax in (cop, load, travel):
            mark_first_limits(ax, sweep, colour)
    above.set_title("where the CoPs go, from above")
    cop.set_title("CoPs between the soles' edges")
    load.set_title("who carries the weight")
    travel.set_title("how far the CoM may still go")
    handles = _handles(sweep, look)
    if axes is not None:
        put_legend(above, handles)
        return figure
    coordinate = abscissa(sweep).label.partition(" [")[0]
    count = sweep.sizes["posture"]
    figure.suptitle(
        f"{sweep.attrs['robot']}: {count} posture{'s' * (count != 1)} along {coordinate}",
        x=0.01,
        ha="left",
        fontsize=12.5,
        fontweight="bold",
    )
    needed = sum(len(str(handle.get_label())) + _HANDLE for handle in handles)
    columns = math.ceil(len(handles) / math.ceil(needed / _LINE))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=9)
    figure.get_layout_engine().set(w_pad=0.07, h_pad=0.07)  # type: ignore[union-attr,call-arg]
    return figure


def _panels(kinds: list[str]) -> list[Axes]:
    """The panels of a figure of its own."""
    figure = new_figure(9.0, 10.0 if kinds else 7.2)
    n = max(len(kinds), 1)
    grid = figure.add_gridspec(3 if kinds else 2, 2 * n)
    four = [figure.add_subplot(grid[i, j * n : (j + 1) * n]) for i in (0, 1) for j in (0, 1)]
    return four + [figure.add_subplot(grid[2, 2 * i : 2 * i + 2]) for i in range(len(kinds))]


def widest_axis(sweep: Sweep) -> str:
    """The world axis along which the CoM moves most."""
    com = sweep["com"].values[:, :2]
    known = com[np.all(np.isfinite(com), axis=1)]
    if not len(known):
        return "y"
    across, along = np.ptp(known, axis=0)[::-1]
    return "y" if across >= along else "x"


def _draw_above(ax: Axes, sweep: Sweep, colour: dict[str, str]) -> None:
    """Every criterion's tracks in one picture, the later ones thinner so that all are visible."""
    names, cops, good = labels(sweep, "criterion"), world_cops(sweep), sweep.planted.values
    origins = contact_origins(sweep)
    pulling = sweep["pulling"].values.astype(bool)
    draw_ground(ax, world_soles(sweep), origins)
    for j, name in enumerate(names):
        for k in range(sweep.sizes["contact"]):
            width = max(5.5 - 2.8 * j, 1.2)
            # a contact that pulls has no centre of pressure
            track = np.where(pulling[:, j, k, None], np.nan, cops[:, j, k])
            draw_track(ax, track, good[:, j, k], colour[name], width)
    com = sweep["com"].values[:, :2] * MM
    ax.plot(com[:, 1], com[:, 0], zorder=10, **COM_LINE)
    frame_ground(ax, world_soles(sweep), origins, np.vstack([com, cops.reshape(-1, 2)]))


def _handles(sweep: Sweep, look: Looks) -> list[Line2D]:
    names, contacts = labels(sweep, "criterion"), labels(sweep, "contact")
    handles = [Line2D([], [], color=c, label=n) for n, c in look.legend.items()]
    handles += [
        Line2D([], [], color=MUTED, linestyle=style, label=f"load on {name}")
        for name, style in line_styles(contacts).items()
    ]
    handles.append(Line2D([], [], label="CoM", **COM_LINE))
    if "limit_margin" in sweep and any(first_limits(sweep, j) for j in range(len(names))):
        handles.append(Line2D([], [], label="first limit met", color=MUTED, **LIMIT_LINE))
    if not np.all(sweep.planted.values | sweep.failed.values[..., None]):
        handles.append(Line2D([], [], color=MUTED, label="CoP off its sole", **OFF_SOLE))
    return handles
