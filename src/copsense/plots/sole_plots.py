"""Soles from above: outlines in the world, with the CoPs and the CoM over them.

The picture is as the robot sees its feet: x up the page is forward, y to the left is left.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from copsense.plots.reading import (
    MM,
    abscissa,
    contact_origins,
    labels,
    world_cops,
    world_soles,
)
from copsense.plots.style import (
    INK,
    MUTED,
    OFF_SOLE,
    SOLE,
    Color,
    Panels,
    given_axes,
    looks,
    new_figure,
    styled,
    whole_figure,
)
from copsense.sweeps import Sweep

_ROOM = 0.12  # of the feet's extent, around them


@styled
def plot_soles(
    sweep: Sweep,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw from above where the CoPs go: a panel per criterion, coloured along the path.

    Args:
        sweep: the sweep.
        axes: where to draw, one for each criterion, without the bar of the path's colours; default
            a new figure.
        label: what the titles say, before the criterion's name where there are several.
        color: of the title: of the only criterion, or criterion -> color; default as in every
            figure.
    """
    names = labels(sweep, "criterion")
    look = looks(names, color, label)
    if axes is None:
        figure: Figure = new_figure(4.1 * len(names) + 1.0, 4.6)
        panels = list(figure.subplots(1, len(names), sharey=True, squeeze=False)[0])
    else:
        panels = given_axes(axes, names)
        figure = whole_figure(panels[0])
    x, ramp = abscissa(sweep), _ramp()
    shade = Normalize(float(x.values.min()), float(x.values.max()))
    cops, com = world_cops(sweep), sweep["com"].values[:, :2] * MM
    for j, (ax, name) in enumerate(zip(panels, names, strict=True)):
        draw_ground(ax, world_soles(sweep), contact_origins(sweep))
        for k in range(sweep.sizes["contact"]):
            _draw_ramp(ax, cops[:, j, k], x.values, ramp, shade)
        ax.plot(com[:, 1], com[:, 0], color=INK, linewidth=1.0, linestyle=(0, (2, 1.5)), zorder=4)
        frame_ground(ax, world_soles(sweep), contact_origins(sweep), cops)
        ax.set_title(look.words[name], color=look.colour[name])
    for ax in panels[1:]:
        ax.set_ylabel("")
    if axes is not None:
        return figure
    ramp_of = ScalarMappable(shade, ramp)
    bar = figure.colorbar(ramp_of, ax=list(panels), location="bottom", shrink=0.6, aspect=40)
    bar.set_label(f"{x.label}; dashed: the CoM's own track", fontsize=9)
    bar.outline.set_visible(False)
    return figure


def draw_ground(
    ax: Axes, soles: Sequence[np.ndarray | None], origins: Float[np.ndarray, "contact 2"]
) -> None:
    """Draw outlines of soles [mm], and a ring for each contact that has none."""
    for sole, origin in zip(soles, origins, strict=True):
        if sole is None or len(sole) < 3:
            ax.plot(origin[1], origin[0], "o", color=MUTED, fillstyle="none", markersize=11)
        else:
            ax.add_patch(
                Polygon(sole[:, ::-1], facecolor=SOLE, edgecolor=MUTED, linewidth=1.1, zorder=1)
            )
    if all(sole is None for sole in soles) and len(origins) > 2:
        # point feet: the support polygon between them
        middle = origins.mean(axis=0)
        around = np.argsort(np.arctan2(*(origins - middle).T))
        ax.add_patch(
            Polygon(
                origins[around][:, ::-1],
                facecolor=SOLE,
                edgecolor=MUTED,
                linewidth=0.8,
                linestyle="--",
                zorder=0.9,
            )
        )


def frame_ground(
    ax: Axes,
    soles: Sequence[np.ndarray | None],
    origins: Float[np.ndarray, "contact 2"],
    points: Float[np.ndarray, "... 2"],
) -> None:
    """Set limits around the feet and what lies near them; equal scales, left on the left."""
    feet = np.vstack([origins, *[s for s in soles if s is not None]])
    low, high = feet.min(axis=0), feet.max(axis=0)
    room = _ROOM * float((high - low).max()) + 5.0
    flat = points.reshape(-1, 2)
    near = flat[np.all((flat > low - 4 * room) & (flat < high + 4 * room), axis=1)]
    if len(near):
        low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    ax.set_xlim(high[1] + room, low[1] - room)
    ax.set_ylim(low[0] - room, high[0] + room)
    ax.set_aspect("equal")
    ax.set_xlabel("← left        y [mm]        right →")
    ax.set_ylabel("x, forward [mm]")


def draw_track(
    ax: Axes,
    track: Float[np.ndarray, "N 2"],
    good: Bool[np.ndarray, " N"],
    colour: str,
    width: float,
) -> None:
    """Draw where a CoP goes [mm]: dotted where it is off its sole, a dot if it stands still."""
    if stands_still(track):
        here = track[np.all(np.isfinite(track), axis=1)][:1]
        ax.plot(here[:, 1], here[:, 0], "o", color=colour, markersize=width + 3.0, zorder=3)
        return
    ax.plot(track[:, 1], track[:, 0], color=colour, zorder=2.9, **OFF_SOLE)
    on = np.where(good[:, None], track, np.nan)
    ax.plot(on[:, 1], on[:, 0], color=colour, linewidth=width, solid_capstyle="butt", zorder=3.0)


def stands_still(track: Float[np.ndarray, "N 2"]) -> bool:
    """Whether a CoP does not move, as on a point contact, or is known at fewer than two places."""
    known = track[np.all(np.isfinite(track), axis=1)]
    return len(known) < 2 or float(np.ptp(known, axis=0).max()) < 1e-6


def _draw_ramp(
    ax: Axes, track: Float[np.ndarray, "N 2"], along: np.ndarray, ramp: Colormap, shade: Normalize
) -> None:
    points = track[:, ::-1]
    if stands_still(track):
        here = points[np.all(np.isfinite(points), axis=1)][:1]
        ax.plot(*here.T, "o", color=INK, markersize=6, zorder=3)
        return
    segments = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        cmap=ramp,
        norm=shade,
        linewidths=4.0,
        capstyle="projecting",
        zorder=3,
    )
    segments.set_array((along[:-1] + along[1:]) / 2)
    ax.add_collection(segments, autolim=False)


def _ramp() -> ListedColormap:
    """Viridis without its palest end, which is hard to see on white."""
    return ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.92, 256)))
