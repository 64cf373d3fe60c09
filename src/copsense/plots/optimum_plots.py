"""plot_optimum and plot_front: a robot before and after, and what one quantity costs of another."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from copsense.optimisation import QUANTITIES, Front, Optimum, Quantity, Valuation
from copsense.plots.reading import MM
from copsense.plots.robot_plots import SIDES, Side, plot_robot
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Panels,
    axes_or_new,
    given_axes,
    looks,
    new_figure,
    styled,
    whole_figure,
)

_FRONT, _BEFORE = "Pareto front", "before"
_SEEN = {"behind": "from behind", "right": "from its right"}
_WORDS = tuple(f"{when}, {side}" for when in ("before", "after") for side in SIDES)


@styled
def plot_optimum(
    optimum: Optimum,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw the robot before and after, from behind and from its right, with soles, CoM and CoPs.

    Args:
        optimum: what `copsense.optimise` found.
        axes: where to draw: before from behind and from the right, then after; default a new
            figure.
        label: what the titles say first.
        color: of the only criterion's CoPs, or criterion -> color; default as in every figure.
    """
    figure: Figure
    if axes is None:
        figure = new_figure(9.6, 5.2)
        drawn = list(figure.subplots(1, 4, sharey=True))
    else:
        drawn = given_axes(axes, _WORDS)
        figure = whole_figure(drawn[0])
    panels = iter(drawn)
    valuations = (("before", optimum.before), ("after", optimum.after))
    names = list(dict.fromkeys(value.criterion.name for _, value in valuations))
    look, first = looks(names, color), "" if label is None else f"{label}, "
    heights = []
    for when, value in valuations:
        for side in SIDES:
            ax = next(panels)
            _draw(ax, value, side, look.colour[value.criterion.name])
            heights.append(ax.get_ylim())
            ax.set_title(f"{first}{when}, {_SEEN[side]}")
    for number, ax in enumerate(drawn):  # one height, so that what went down is seen
        ax.set_ylim(min(low for low, _ in heights), max(high for _, high in heights))
        ax.set_ylabel("z [mm]" if number == 0 else "")
    if axes is None:
        figure.suptitle(f"{optimum.objective} under {optimum.criterion.name}: {optimum.verdict}")
    return figure


@styled
def plot_front(
    front: Front,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a Pareto front: the postures that no other beats in both, and where the robot stood.

    Args:
        front: what `copsense.optimisation.pareto_front` found.
        ax: where to draw; default a new figure, with the robot at both ends beside it.
        label: what the legend says before each name.
        color: ``"Pareto front"`` or ``"before"`` -> color; default as in every figure.
    """
    figure: Figure
    if ax is None:
        figure = new_figure(8.6, 4.4)
        ax, one, other = figure.subplots(1, 3, width_ratios=(2.2, 1.0, 1.0))
        for robot, point, words in (
            (one, front.points[0], f"best {front.objectives[0]}"),
            (other, front.points[-1], f"best {front.objectives[1]}"),
        ):
            _draw(robot, point.after, "behind")
            robot.set_title(words)
            robot.set_ylabel("")
    else:
        ax = axes_or_new(ax)
        figure = whole_figure(ax)
    look = looks([_FRONT, _BEFORE], color, label, usual={_FRONT: INK, _BEFORE: MUTED})
    first, second = (QUANTITIES[name] for name in front.objectives)
    points = [point.after.quantities for point in front.points]
    x = [_shown(second, value[second.name]) for value in points]
    y = [_shown(first, value[first.name]) for value in points]
    ax.plot(x, y, "o-", color=look.colour[_FRONT], markersize=5, label=look.words[_FRONT])
    before = front.before.quantities
    at = (_shown(second, before[second.name]), _shown(first, before[first.name]))
    ax.plot(*at, "D", color=look.colour[_BEFORE], markersize=8, label=look.words[_BEFORE])
    ax.set_xlabel(_axis(second))
    ax.set_ylabel(_axis(first))
    ax.legend()
    return figure


def _draw(ax: Axes, value: Valuation, side: Side, shade: str | None = None) -> None:
    color = None if shade is None else {value.criterion.name: shade}
    plot_robot(value.stance, [value.sensitivity], side=side, ax=ax, color=color, legend=False)


def _shown(quantity: Quantity, value: float) -> float:
    return value * MM if quantity.unit == "m" else value


def _axis(quantity: Quantity) -> str:
    unit = {"m": " [mm]", "1": ""}.get(quantity.unit, f" [{quantity.unit}]")
    return f"{quantity.name}{unit}"
