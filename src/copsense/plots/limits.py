"""What limits do: the clipped centres of pressure and their slopes, and the regions of the CoM."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from copsense.plots.cops import plot_cop
from copsense.plots.reading import MM, abscissa, contact_origins, labels, world_soles
from copsense.plots.soles import draw_ground, frame_ground
from copsense.plots.style import (
    INK,
    MUTED,
    add_legend,
    axes_or_new,
    colours,
    line_styles,
    new_figure,
    styled,
)
from copsense.regions import ComRegion

_DEGENERATE = 3  # vertices from which a region has an area


@styled
def plot_limited(dataset: xr.Dataset, binding: Mapping[str, Sequence[float]]) -> Figure:
    """Draw a sweep within limits: each CoP, and its slope with the jumps where a limit binds.

    Args:
        dataset: a lateral sweep evaluated with limits.
        binding: criterion -> CoM y at which its first limit binds, to either side [m].
    """
    figure = new_figure(9.2, 3.9)
    left, right = figure.subplots(1, 2)
    plot_cop(dataset, ax=left, legend=False)
    x, names = abscissa(dataset), labels(dataset, "criterion")
    contacts, colour = labels(dataset, "contact"), colours(names)
    styles = line_styles(contacts)
    slope = dataset["cop_slope"].sel(axis="y").values
    for j, name in enumerate(names):
        ends = sorted(value * MM for value in binding.get(name, ()))
        for at in ends:
            right.axvline(at, color=colour[name], linewidth=0.9, linestyle=(0, (1, 2)))
        for k, contact in enumerate(contacts):
            # A line a piece: what jumps is not joined.
            for piece in _pieces(x.values, ends):
                right.plot(
                    x.values[piece],
                    slope[piece, j, k],
                    color=colour[name],
                    linestyle=styles[contact],
                )
    right.set_xlabel(x.label)
    right.set_ylabel("slope of CoP y along the path [m/m]")
    add_legend(right, colour, styles)
    return figure


@styled
def plot_regions(
    regions: Mapping[str, ComRegion],
    dataset: xr.Dataset,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw nested regions of the CoM from above, the widest first, with the soles and its path.

    Args:
        regions: what each is called -> the region; a criterion's own has that criterion's colour.
        dataset: a sweep, for the soles and the path of the CoM.
        ax: where to draw; default a new figure.
    """
    ax = axes_or_new(ax, 6.2, 4.6)
    colour = colours([name for name in regions if name in labels(dataset, "criterion")])
    draw_ground(ax, world_soles(dataset), contact_origins(dataset))
    grey = iter(("#9aa4ae", INK, MUTED))
    shown: dict[str, str] = {}
    corners = [np.zeros((0, 2))]
    for name, region in regions.items():
        shown[name] = colour.get(name) or next(grey)
        outline = region.polygon * MM
        corners.append(outline)
        if len(outline) >= _DEGENERATE:
            ax.add_patch(
                Polygon(
                    outline[:, ::-1],
                    facecolor="none",
                    edgecolor=shown[name],
                    linewidth=1.8,
                    zorder=3,
                )
            )
        else:
            ax.plot(outline[:, 1], outline[:, 0], color=shown[name], linewidth=1.8, zorder=3)
    com = dataset["com"].values[:, :2] * MM
    ax.plot(com[:, 1], com[:, 0], color=INK, linewidth=1.0, linestyle=(0, (2, 1.5)), zorder=4)
    frame_ground(ax, world_soles(dataset), contact_origins(dataset), np.vstack(corners))
    add_legend(ax, shown)
    return ax


def _pieces(x: Float[np.ndarray, " N"], ends: Sequence[float]) -> list[np.ndarray]:
    """Indices of the stretches between the jumps."""
    bounds = [-np.inf, *ends, np.inf]
    return [np.flatnonzero((x > low) & (x <= high)) for low, high in pairwise(bounds)]
