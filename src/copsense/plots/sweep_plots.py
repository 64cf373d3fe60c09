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
    colours,
    line_styles,
    new_figure,
    styled,
)
from copsense.sweeps import Sweep

_LINE, _HANDLE = 130, 8  # characters across the figure, and of a handle, in the legend's font


@styled
def plot_results(sweep: Sweep) -> Figure:
    """Draw a sweep in one figure: from above, CoPs and edges, load shares, CoM travel.

    Margins to limits, of a sweep within limits or from `Sweep.with_limit_margins`, are drawn below,
    with a dotted line in each panel where a criterion meets its first limit.
    """
    kinds = limit_kinds(sweep) if "limit_margin" in sweep else []
    figure = new_figure(9.0, 10.0 if kinds else 7.2)
    n = max(len(kinds), 1)
    grid = figure.add_gridspec(3 if kinds else 2, 2 * n)
    above, cop, load, travel = (
        figure.add_subplot(grid[i, j * n : (j + 1) * n]) for i in (0, 1) for j in (0, 1)
    )
    _draw_above(above, sweep)
    plot_cop(sweep, axis=widest_axis(sweep), ax=cop, legend=False)
    plot_load(sweep, ax=load, legend=False)
    plot_travel(sweep, ax=travel, legend=False)
    if kinds:
        below = [figure.add_subplot(grid[2, 2 * i : 2 * i + 2]) for i in range(n)]
        plot_limit_margins(sweep, axes=below, legend=False)
        for ax in below[1:]:
            ax.set_ylabel(ax.get_ylabel().replace("smallest margin ", ""))
        for ax in (cop, load, travel):
            mark_first_limits(ax, sweep)
    above.set_title("where the CoPs go, from above")
    cop.set_title("CoPs between the soles' edges")
    load.set_title("who carries the weight")
    travel.set_title("how far the CoM may still go")
    coordinate = abscissa(sweep).label.partition(" [")[0]
    count = sweep.sizes["posture"]
    figure.suptitle(
        f"{sweep.attrs['robot']}: {count} posture{'s' * (count != 1)} along {coordinate}",
        x=0.01,
        ha="left",
        fontsize=12.5,
        fontweight="bold",
    )
    handles = _handles(sweep)
    needed = sum(len(str(handle.get_label())) + _HANDLE for handle in handles)
    columns = math.ceil(len(handles) / math.ceil(needed / _LINE))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=9)
    figure.get_layout_engine().set(w_pad=0.07, h_pad=0.07)  # type: ignore[union-attr,call-arg]
    return figure


def widest_axis(sweep: Sweep) -> str:
    """The world axis along which the CoM moves most."""
    com = sweep["com"].values[:, :2]
    known = com[np.all(np.isfinite(com), axis=1)]
    if not len(known):
        return "y"
    across, along = np.ptp(known, axis=0)[::-1]
    return "y" if across >= along else "x"


def _draw_above(ax: Axes, sweep: Sweep) -> None:
    """Every criterion's tracks in one picture, the later ones thinner so that all are visible."""
    names, cops, good = labels(sweep, "criterion"), world_cops(sweep), sweep.planted.values
    colour, origins = colours(names), contact_origins(sweep)
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


def _handles(sweep: Sweep) -> list[Line2D]:
    names, contacts = labels(sweep, "criterion"), labels(sweep, "contact")
    handles = [Line2D([], [], color=c, label=n) for n, c in colours(names).items()]
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
