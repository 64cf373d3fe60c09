"""plot_design: what a designed criterion gains, and what it costs in torque."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from copsense.design import Design, Score, pareto
from copsense.plots.reading import MM
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Looks,
    Panels,
    axes_or_pair,
    colours,
    looks,
    styled,
    whole_figure,
)

_ALL, _FRONT, _DESIGNED = "candidates", "Pareto set", "designed"


@styled
def plot_design(
    design: Design,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw every candidate's CoM gain and CoM travel against its torque norm.

    The line joins the Pareto set: candidates that no other beats in both. The paper's two criteria
    and the designed one stand beside them.

    Args:
        design: what was designed.
        axes: where to draw the gain and the travel, without a legend around them: their lines are
            labelled for one; default a new figure.
        label: what a legend says, before each name.
        color: criterion -> color, ``"designed"`` for the designed one; default as in every figure.
    """
    gain, travel = axes_or_pair(axes, ("the gain", "the travel"), 9.2, 4.2)
    figure = whole_figure(gain)
    names = [_ALL, _FRONT, *(s.criterion for s in design.baselines), _DESIGNED]
    usual = {_ALL: "#b9c2ca", _FRONT: MUTED, _DESIGNED: INK} | colours(names[2:-1])
    look = looks(names, color, label, usual=usual)
    _draw(gain, design, look, lambda s: s.worst_gain, 1.0)
    _draw(travel, design, look, lambda s: s.travel * MM, -1.0)
    gain.set_ylabel("largest |dCoP/dCoM| [m/m]")
    travel.set_ylabel("CoM travel to the first limit [mm]")
    gain.set_title("sensitivity: the lower the better")
    travel.set_title("travel: the higher the better")
    near = f"within {design.score.range * MM:.0f} mm of the middle"
    for ax in (gain, travel):
        ax.set_xlabel(f"torque norm [N m], rms {near}")
    if axes is not None:
        return figure
    handles, names = gain.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(names))
    return figure


def _draw(
    ax: Axes, design: Design, look: Looks, value: Callable[[Score], float], sign: float
) -> None:
    """Candidates as points, those that no other beats joined; `sign` +1 where less is better."""
    points = np.array([(s.torque_norm, value(s)) for s in design.candidates])
    colour, words = look.colour, look.words
    ax.plot(*points.T, ".", color=colour[_ALL], markersize=4, label=words[_ALL], zorder=2)
    front = pareto(design.candidates, lambda s: sign * value(s))
    line = np.array([(s.torque_norm, value(s)) for s in front])
    ax.plot(*line.T, color=colour[_FRONT], linewidth=1.4, drawstyle="steps-post", zorder=3)
    ax.plot(*line.T, "o", color=colour[_FRONT], markersize=4, label=words[_FRONT], zorder=3)
    for score in design.baselines:
        at, name = (score.torque_norm, value(score)), score.criterion
        ax.plot(*at, "D", color=colour[name], markersize=8, label=words[name], zorder=4)
    at = (design.score.torque_norm, value(design.score))
    designed = f"{words[_DESIGNED]} ({design.objective})"
    ax.plot(*at, "*", color=colour[_DESIGNED], markersize=15, label=designed, zorder=5)
    # A candidate with very large torques would squeeze the others against the axis.
    low, high = points[:, 0].min(), np.median(points[:, 0])
    shown = [s.torque_norm for s in (*design.baselines, *front, design.score)]
    high = max(2 * high - low, *shown)
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    ax.set_xlim(low - room, high + room)
