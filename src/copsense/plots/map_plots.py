"""plot_map: a space of postures over two coordinates, criteria side by side, and the worst."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from copsense.errors import InvalidInputError
from copsense.plots.marking import say
from copsense.plots.reading import MM
from copsense.plots.robot_plots import draw_bones
from copsense.plots.style import (
    BAD,
    COM_LINE,
    INK,
    MUTED,
    Panels,
    given_axes,
    new_figure,
    styled,
    whole_figure,
)

if TYPE_CHECKING:
    from copsense.maps.marginals import Marginal

_TRAVEL = "CoM travel until a contact\ntips or unloads [mm]"
# quantity -> (words of the title, of the colours, factor)
_SHOWN = {
    "least_com_travel": ("CoM travel", _TRAVEL, MM),
    "likely_com_travel": ("CoM travel likely left", _TRAVEL, MM),
    "robust_com_travel": ("CoM travel left at worst", _TRAVEL, MM),
    "largest_com_gain": ("CoM gain", "CoM gain [m/m]", 1.0),
}
_NONE = "no posture was evaluated"
_PASSED = "a CoP is off its sole, or a contact pulls"
_UNLIMITED = "without end:\nno contact tips or unloads"
_COLOURS, _CHANGE = "viridis", "RdBu"
_LEVELS = 7  # contour lines
_SHADES = (1.0, 0.55, 0.3)  # of the worst posture, the next and the one after


@styled
def plot_map(
    marginals: Sequence[Marginal],
    worst: Mapping[str, Sequence[Float[np.ndarray, "s 2 3"]]] | None = None,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: str | None = None,
) -> Figure:
    """Draw quantities of a map over two coordinates: heat maps with contour lines.

    A row for each quantity, a column for each criterion, and the difference of the first two. Cells
    in which no posture was evaluated stay pale. Under them, seen from the front, the worst
    postures.

    Args:
        marginals: what `copsense.maps.marginal` gives, of the same map and criteria.
        worst: criterion -> skeletons of its worst postures, the worst first, as
            `copsense.skeleton.skeleton` gives them; three are drawn.
        axes: where to draw, row by row; the bars of the values take some of their room. Default a
            new figure.
        label: what the titles say before the criterion's name.
        color: Matplotlib's name of the values' color map; default ``"viridis"``.

    Raises:
        InvalidInputError: there is no marginal, they have different criteria, `axes` are too few or
            too many, or `color` is not a color map.
    """
    if not marginals or len({m.criteria for m in marginals}) != 1:
        raise InvalidInputError(
            "plot_map needs marginals of one map: [marginal(load_map(path), quantity=...), ...]."
        )
    if color is not None and color not in colormaps:
        raise InvalidInputError(
            f"{color!r} is not a color map of Matplotlib: give a name such as 'magma'."
        )
    criteria = marginals[0].criteria
    columns = len(criteria) + (len(criteria) > 1)
    rows = len(marginals) + bool(worst)
    if axes is None:
        figure: Figure = new_figure(3.7 * columns + 0.6, 3.1 * rows)
        grid = figure.subplots(rows, columns, squeeze=False)
    else:
        across = [*criteria, *["their difference"] * (columns > len(criteria))]
        down = [*(here.quantity for here in marginals), *["the worst postures"] * bool(worst)]
        panels = given_axes(axes, [f"{row} of {column}" for row in down for column in across])
        figure, grid = whole_figure(panels[0]), np.array(panels).reshape(rows, columns)
    words = {name: name if label is None else f"{label}, {name}" for name in criteria}
    for row, here in zip(grid, marginals, strict=False):
        _draw_row(figure, row, here, words, color or _COLOURS)
    for ax, name in zip(grid[-1] if worst else (), criteria, strict=False):
        _draw_postures(ax, words[name], list((worst or {}).get(name, ())))
    if worst and columns > len(criteria):
        grid[-1, -1].set_axis_off()
    notes = {
        f"Pale: {_NONE} there.": any(np.isnan(here.values).any() for here in marginals),
        f"Below zero {_PASSED}.": any((here.values < 0).any() for here in marginals),
    }
    if axes is None and any(notes.values()):
        said = " ".join(note for note, holds in notes.items() if holds)
        figure.supxlabel(said, fontsize=9, color=MUTED)
    return figure


def _draw_row(
    figure: Figure, axes: np.ndarray, here: Marginal, names: Mapping[str, str], colours: str
) -> None:
    words, scale, factor = _SHOWN[here.quantity]
    values = here.values * factor
    shown = np.where(np.isfinite(values), values, np.nan)
    low, high = _range(shown)
    if np.isinf(values).any() and not np.isfinite(values).any():
        for ax in axes:
            say(ax, _UNLIMITED)
    for ax, name, cells in zip(axes, here.criteria, shown, strict=False):
        mesh = _heat(ax, here, cells, cmap=colours, vmin=low, vmax=high)
        ax.set_title(f"{names[name]}\n{here.how} {words}", fontsize=9)
    bar = figure.colorbar(mesh, ax=list(axes[: len(shown)]), aspect=30)
    bar.set_label(scale)
    if len(shown) > 1:
        ax, change = axes[-1], shown[1] - shown[0]
        reach = max(abs(v) for v in _range(change)) or 1.0
        mesh = _heat(ax, here, change, cmap=_CHANGE, vmin=-reach, vmax=reach)
        ax.set_title(f"{names[here.criteria[1]]}\nless {here.criteria[0]}", fontsize=9)
        unit = scale[scale.index("[") :]
        figure.colorbar(mesh, ax=ax, aspect=30).set_label(f"difference {unit}")


def _heat(ax: Axes, here: Marginal, cells: np.ndarray, **colour: Any) -> Any:
    """Cells in colour, and contour lines through their middles."""
    edges = [
        np.degrees(e) if unit == "rad" else e * MM
        for e, unit in zip(here.edges, here.units, strict=True)
    ]
    middles = [(e[1:] + e[:-1]) / 2 for e in edges]
    ax.set_facecolor(BAD)
    ax.grid(visible=False)
    mesh = ax.pcolormesh(*edges, np.ma.masked_invalid(cells.T), shading="flat", **colour)
    mesh.set_rasterized(True)
    known = cells[np.isfinite(cells)]
    if not len(known) and not ax.texts:
        say(ax, _NONE)
    # The same levels across a row, so that a flat map shows no lines.
    levels = MaxNLocator(_LEVELS).tick_values(colour["vmin"], colour["vmax"])
    crossed = [
        level for level in levels if known.min(initial=np.inf) < level < known.max(initial=-np.inf)
    ]
    if min(cells.shape) > 1 and crossed:
        ink, halo = (INK, "white") if colour["cmap"] == _CHANGE else ("white", INK)
        lines = ax.contour(
            *middles, np.ma.masked_invalid(cells.T), levels=crossed, colors=ink, linewidths=0.7
        )
        for label in ax.clabel(lines, fmt=_level, fontsize=7):
            label.set_path_effects([withStroke(linewidth=1.2, foreground=halo)])
    words = [
        f"{name} [{'deg' if unit == 'rad' else 'mm'}]"
        for name, unit in zip(here.names, here.units, strict=True)
    ]
    ax.set_xlabel(words[0])
    ax.set_ylabel(words[1])
    return mesh


def _level(value: float) -> str:
    """A contour's label with all its digits: half a step must not be rounded away."""
    return f"{value + 0.0:.6g}"


def _draw_postures(ax: Axes, name: str, skeletons: Sequence[np.ndarray]) -> None:
    """Skeletons in the frontal plane, seen by someone in front of the robot."""
    for lines, shade in zip(skeletons[: len(_SHADES)], _SHADES, strict=False):
        draw_bones(ax, lines, 1, shade)
    if not skeletons:
        say(ax, "none")
    ax.axhline(0.0, color=MUTED, linewidth=COM_LINE["linewidth"])
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title(f"{name}\npostures of least travel", fontsize=9)
    ax.set_xlabel("world y [m]")
    ax.set_ylabel("world z [m]")


def _range(values: np.ndarray) -> tuple[float, float]:
    """Least and largest number; zero to one where there is none."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return low, high if high > low else low + 1.0
