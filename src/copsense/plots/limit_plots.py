"""What limits do: the clipped centres of pressure and their slopes, and the regions of the CoM."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike

from copsense.plots.cop_plots import plot_cop
from copsense.plots.marking import marks, shade_below_zero
from copsense.plots.reading import MM, abscissa, contact_origins, labels, world_soles
from copsense.plots.sole_plots import draw_ground, frame_ground
from copsense.plots.style import (
    INK,
    LIMIT_LINE,
    MUTED,
    Color,
    Panels,
    add_legend,
    axes_or_new,
    axes_or_pair,
    colours,
    given_axes,
    line_styles,
    looks,
    new_figure,
    styled,
    whole_figure,
)
from copsense.regions import ComRegion
from copsense.sweeps import Sweep

_AT_LIMIT = 1e-9  # m, N or N m: a limit this near to its bound is active
_KIND_TITLES = {"cop": "CoP to the edge", "torque": "joint torque"}
_PATH: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (2, 1.5))}
_DEGENERATE = 3  # vertices: a region with fewer has no area


@styled
def plot_limited(
    sweep: Sweep,
    binding: Mapping[str, Sequence[float]],
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a sweep within limits: each CoP, and its slope with the jumps where a limit binds.

    Args:
        sweep: a lateral sweep evaluated with limits.
        binding: criterion -> CoM y at which its first limit binds, to either side [m].
        axes: where to draw the CoPs and their slopes; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
    """
    left, right = axes_or_pair(axes, ("the CoPs", "their slopes"), 9.2, 3.9)
    x, names = abscissa(sweep), labels(sweep, "criterion")
    look, contacts = looks(names, color, label), labels(sweep, "contact")
    colour = look.colour
    plot_cop(sweep, ax=left, color=colour, legend=False)
    styles = line_styles(contacts)
    slope = sweep["cop_slope"].sel(axis="y").values
    for j, name in enumerate(names):
        ends = sorted(value * MM for value in binding.get(name, ()))
        for at in ends:
            right.axvline(at, color=colour[name], **LIMIT_LINE)
        for k, contact in enumerate(contacts):
            # One line for each piece: jumps are not joined.
            for piece in _pieces(x.values, ends):
                right.plot(
                    x.values[piece],
                    slope[piece, j, k],
                    color=colour[name],
                    linestyle=styles[contact],
                )
    right.set_xlabel(x.label)
    right.set_ylabel("slope of CoP y along the path [m/m]")
    add_legend(right, look.legend, styles)
    return whole_figure(left)


@styled
def plot_regions(
    regions: Mapping[str, ComRegion],
    sweep: Sweep,
    *,
    com: ArrayLike | None = None,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw nested regions of the CoM from above, the widest first, with the soles and its path.

    Args:
        regions: name -> region; one with a criterion's name has that criterion's colour.
        sweep: gives the soles and the path of the CoM.
        com: (2,) world x, y of the CoM at the posture that the regions hold [m].
        ax: where to draw; default a new figure.
        label: what the legend says, before the region's name where there are several.
        color: of the only region, or region -> color; default a criterion's own, grey for others.
    """
    ax = axes_or_new(ax, 6.2, 4.6)
    own = colours([name for name in regions if name in labels(sweep, "criterion")])
    grey = cycle(("#9aa4ae", INK, MUTED))
    usual = {name: own.get(name) or next(grey) for name in regions}
    look = looks(list(regions), color, label, what="regions", usual=usual)
    draw_ground(ax, world_soles(sweep), contact_origins(sweep))
    shown: dict[str, str] = {}
    corners = [np.zeros((0, 2))]
    for number, (name, region) in enumerate(regions.items()):
        shade, words = look.colour[name], look.words[name]
        shown[words if region.bounded else f"{words} (without end)"] = shade
        outline = region.polygon * MM
        corners.append(outline)
        if len(outline) >= _DEGENERATE:
            ax.add_patch(
                Polygon(
                    outline[:, ::-1],
                    facecolor="none",
                    edgecolor=shade,
                    linewidth=1.8,
                    zorder=3,
                )
            )
        else:
            # Segments lie on one another: the later ones are thinner, so that none hides.
            width = max(9.0 - 2.5 * number, 1.8)
            ax.plot(outline[:, 1], outline[:, 0], color=shade, linewidth=width, zorder=3)
    way = sweep["com"].values[:, :2] * MM
    ax.plot(way[:, 1], way[:, 0], color=INK, linewidth=1.0, linestyle=(0, (2, 1.5)), zorder=4)
    path = Line2D(
        [], [], color=INK, linewidth=1.0, linestyle=(0, (2, 1.5)), label="path of the CoM"
    )
    if com is not None:
        x, y = np.asarray(com, dtype=float) * MM
        ax.plot(y, x, "+", color=INK, markersize=13, markeredgewidth=2, zorder=5)
    frame_ground(ax, world_soles(sweep), contact_origins(sweep), np.vstack(corners))
    ax.set_title("where the CoM may be, contacts and joints held")
    add_legend(ax, shown, extra=[path])
    return ax


@styled
def plot_limit_margins(
    sweep: Sweep,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Figure:
    """Draw the smallest margin to each kind of limit along a sweep, and where the first binds.

    Args:
        sweep: a sweep within limits, or from `Sweep.with_limit_margins`.
        axes: where to draw, one for each of `limit_kinds`; default a new figure.
        label: what the legend says, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.
        legend: whether to add a legend of the criteria.
    """
    kinds = limit_kinds(sweep)
    if axes is None:
        axes = new_figure(max(2.9 * len(kinds), 4.2), 3.0).subplots(1, len(kinds), squeeze=False)[0]
    axes = given_axes(axes, kinds)
    x, names = abscissa(sweep), labels(sweep, "criterion")
    look = looks(names, color, label)
    colour = look.colour
    for ax, kind in zip(axes, kinds, strict=True):
        of_kind = sweep["limit_kind"].values == kind
        unit = str(sweep["limit_unit"].values[of_kind][0])
        scale, unit = (MM, "mm") if unit == "m" else (1.0, unit)
        margin = sweep["limit_margin"].values[..., of_kind] * scale
        least = np.where(np.isnan(margin), np.inf, margin).min(axis=-1)
        least = np.where(np.isfinite(least), least, np.nan)
        for j, name in enumerate(names):
            line = least[:, j]
            ax.plot(x.values, line, color=colour[name], label=look.words[name], **marks(sweep))
        shade_below_zero(ax, least, "beyond")
        mark_first_limits(ax, sweep, colour)
        ax.set_title(_KIND_TITLES.get(kind, kind))
        ax.set_xlabel(x.label)
        ax.set_ylabel(f"smallest margin [{unit}]")
    if legend:
        add_legend(axes[0], look.legend)
    return whole_figure(axes[0])


def limit_kinds(sweep: Sweep) -> list[str]:
    """The kinds of limit whose margins a sweep holds, in their order."""
    return list(dict.fromkeys(str(kind) for kind in sweep["limit_kind"].values))


def mark_first_limits(ax: Axes, sweep: Sweep, colour: Mapping[str, str]) -> None:
    """A dotted line where each criterion meets its first limit, to either side of free postures."""
    x = abscissa(sweep).values
    for j, shade in enumerate(colour.values()):
        for at in first_limits(sweep, j):
            ax.axvline(
                float(np.interp(at, np.arange(len(x)), x)),
                color=shade,
                zorder=1,
                **LIMIT_LINE,
            )


def first_limits(sweep: Sweep, criterion: int) -> list[float]:
    """Where free postures end, as indices between postures.

    Interpolated between the last free posture and the first beyond; where the wrenches were held
    at the limit, extrapolated from the last two free ones.
    """
    margins = sweep["limit_margin"].values[:, criterion]
    known = np.where(np.isnan(margins), np.inf, margins)
    failed = sweep["reason"].values[:, criterion] != ""
    free = (known.min(axis=-1, initial=np.inf) > _AT_LIMIT) & ~failed
    ends: list[float] = []
    for i in np.flatnonzero(free[1:] != free[:-1]):
        inside, step = (int(i), 1) if free[i] else (int(i) + 1, -1)
        here, beyond = known[inside], known[inside + step]
        met = np.isfinite(here) & np.isfinite(beyond) & (beyond <= _AT_LIMIT)
        lost = here - beyond
        before = inside - step
        if 0 <= before < len(free) and free[before] and not failed[inside + step]:
            held = beyond > -_AT_LIMIT
            lost = np.where(held, np.maximum(known[before] - here, lost), lost)
        ends.append(inside + step * float(np.min(here[met] / lost[met], initial=1.0)))
    return ends


def _pieces(x: Float[np.ndarray, " N"], ends: Sequence[float]) -> list[np.ndarray]:
    """Indices of the pieces between the jumps."""
    bounds = [-np.inf, *ends, np.inf]
    return [np.flatnonzero((x > low) & (x <= high)) for low, high in pairwise(bounds)]
