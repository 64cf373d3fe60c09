"""Pushes: how hard a robot can be pushed, by direction, seen from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from copsense.errors import InvalidInputError
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    axes_or_new,
    colours,
    looks,
    new_axes,
    put_legend,
    styled,
)

if TYPE_CHECKING:
    from copsense.pushes import Pushes

_DIRECTIONS = 721


@styled
def plot_pushes(
    pushes: Pushes,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the largest push by its direction: any equilibrium shaded, each criterion a line.

    The robot's world x points up, y to the left, as seen from above; a dot marks the weakest
    direction of each.

    Args:
        pushes: what `copsense.pushes.push_limits` gives.
        ax: polar axes to draw in (``projection="polar"``); default a new figure.
        label: what the legend says, before each name.
        color: criterion -> color; default as in every figure.

    Raises:
        InvalidInputError: `ax` is not polar, or `color` is of nothing here.
    """
    if ax is None:
        ax = new_axes(5.4, 5.4, "polar")
    elif axes_or_new(ax).name != "polar":
        raise InvalidInputError(
            'pushes are drawn in polar axes: make them with figure.add_subplot(projection="polar").'
        )
    ax.set_theta_zero_location("N")  # type: ignore[attr-defined]
    angles = np.linspace(0.0, 2 * np.pi, _DIRECTIONS)
    # Corners of the polygons too, which a grid of directions would round off.
    usual = {pushes.any.name: MUTED} | colours(region.name for region in pushes.criteria)
    look = looks(list(usual), color, label, usual=usual)
    colour = look.colour
    handles: list[Line2D] = []
    top = ax.get_rmax() if ax.has_data() else 0.0  # type: ignore[attr-defined]
    for region in pushes.regions:
        if not region.stands:
            continue
        corners = np.arctan2(region.polygon[:, 1], region.polygon[:, 0]) % (2 * np.pi)
        at = np.unique(np.concatenate([angles, corners]))
        sizes = np.array([region.largest((np.cos(a), np.sin(a))) for a in at])
        shade = region is pushes.any
        words = look.words[region.name]
        (line,) = ax.plot(
            at, sizes, color=colour[region.name], lw=1.0 if shade else 1.9, label=words
        )
        if shade:
            ax.fill(at, sizes, color=colour[region.name], alpha=0.13)
        force, angle, _ = region.weakest
        ax.plot([angle], [force], "o", color=colour[region.name], ms=5)
        handles.append(line)
        top = max(top, 1.05 * float(sizes.max()))
    ticks = np.arange(0.0, 360.0, 45.0)
    ax.set_thetagrids(ticks, ["+x", "", "+y", "", "-x", "", "-y", ""], color=INK)  # type: ignore[attr-defined]
    ax.set_rlabel_position(22.5)  # type: ignore[attr-defined]
    ax.set_rlim(0.0, top or 1.0)  # type: ignore[attr-defined]
    ax.set_xlabel(f"largest push at {pushes.frame} [N], seen from above", color=INK)
    put_legend(ax, handles)
    legend = ax.get_legend()
    assert legend is not None
    legend.set_bbox_to_anchor((0.0, 1.06))  # clear of the label of +x
    return ax
