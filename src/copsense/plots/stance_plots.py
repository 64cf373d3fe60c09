"""plot_stance: one posture, and where its CoPs go when its CoM moves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.errors import InvalidInputError
from copsense.plots.reading import MM, criterion_name
from copsense.plots.robot_plots import RING, SIDES, plot_robot
from copsense.plots.sole_plots import draw_ground, frame_ground
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Panels,
    given_axes,
    looks,
    new_figure,
    styled,
    whole_figure,
)
from copsense.sensitivity import CopSensitivity
from copsense.skeleton import skeleton
from copsense.stance import Stance
from copsense.uncertainty import Spread

_STEP = 20.0  # mm that the CoM moves for the arrows
_FLATTEST = 0.6  # height of what is drawn from above, by its width
_NARROW, _NARROWEST = 0.8, 0.9  # of points, width by length; and of what is drawn of them
_SHORTEST = 0.5  # mm: a shorter arrow is all head
_UNSEEN = 0.1  # mm: smaller is nothing to see
_WORST: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (4, 2))}
_FORWARD, _LEFT = "#009E73", "#CC79A7"


@styled
def plot_stance(
    stance: Stance,
    sensitivities: Sequence[CopSensitivity],
    spreads: Sequence[Spread] | None = None,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a stance: the robot from behind and from its right, and each criterion from above.

    From above, from each CoP an arrow goes to where, to first order, it would be with the CoM 20 mm
    farther forward, and one for 20 mm to the left. Beside each contact stand its share of the
    weight and how far the CoM may move before the contact tips or unloads.

    Args:
        stance: the stance.
        sensitivities: of that stance, one per criterion, at least one.
        spreads: what errors of the model make of each (`copsense.uncertainty`), in the same order:
            then the ellipse round each CoP and the outline of its worst case are drawn too.
        axes: where to draw the criteria from above, one for each, without the robot (`plot_robot`
            draws it) and without a legend; default a new figure of both.
        label: what the titles say, before the criterion's name where there are several.
        color: of the only criterion, or criterion -> color; default as in every figure.

    Raises:
        InvalidInputError: there is no sensitivity, or one has another number of contacts; other
            than one of `spreads` or `axes` for each.
    """
    if not sensitivities or any(len(s.cop) != len(stance.contacts) for s in sensitivities):
        raise InvalidInputError(
            "plot_stance needs sensitivities of the stance it draws, one per criterion: "
            "[cop_sensitivity(stance, criterion), ...]."
        )
    if spreads is not None and len(spreads) != len(sensitivities):
        raise InvalidInputError(
            f"there are {len(spreads)} spreads for {len(sensitivities)} sensitivities. Give one of "
            "each criterion, or none."
        )
    places = stance.placements
    origins = np.array([place.translation[:2] for place in places]) * MM
    soles = [
        None
        if contact.sole is None
        else origins[k] + contact.sole.vertices @ places[k].rotation[:2, :2].T * MM
        for k, contact in enumerate(stance.contacts)
    ]
    com = stance.com[:2] * MM
    names = [criterion_name(s.equilibrium.criterion) for s in sensitivities]
    look = looks(names, color, label)
    colour = look.colour
    if axes is None:
        figure, panels = _with_robot(
            stance, sensitivities, colour, _handles(sensitivities, spreads)
        )
    else:
        panels = given_axes(axes, names)
        figure = whole_figure(panels[0])
    turned = [place.rotation[:2, :2] for place in places]
    drawn = [
        _Drawn(s, origins, turned, spread)
        for s, spread in zip_longest(sensitivities, spreads or ())
    ]
    reach = np.vstack([com, *[d.points() for d in drawn]])
    for ax, result, name in zip(panels, drawn, names, strict=True):
        draw_ground(ax, soles, origins)
        _draw_spreads(ax, result, colour[name])
        _draw_arrows(ax, result, colour[name])
        ax.plot(com[1], com[0], "+", color=INK, markersize=13, markeredgewidth=2, zorder=6)
        frame_ground(ax, soles, origins, reach)
        _write_loads(ax, stance, result.result, soles, origins)
        ax.set_title(look.words[name], color=colour[name])
    for ax in panels[1:]:
        ax.set_ylabel("")
    return figure


def _with_robot(
    stance: Stance,
    sensitivities: Sequence[CopSensitivity],
    colour: Mapping[str, str],
    handles: list[Line2D],
) -> tuple[Figure, list[Axes]]:
    """A figure with the robot on its left; the panels that are still to be drawn."""
    across, along, height = np.ptp(skeleton(stance).reshape(-1, 3), axis=0)
    tall = height > max(across, along)
    robot = [1.9, 1.9] if tall else [3.0]
    widths = [*robot, *[4.1] * len(sensitivities)]
    figure = new_figure(sum(widths) + 0.5, 5.0)
    grid = figure.add_gridspec(2, len(widths), width_ratios=widths)
    for k, side in enumerate(SIDES):
        ax = figure.add_subplot(grid[:, k] if tall else grid[k, 0])
        plot_robot(stance, sensitivities, side=side, ax=ax, color=colour, legend=False)
        if tall and k:
            ax.set_ylabel("")
    above: list[Axes] = []
    for column in range(len(robot), len(widths)):
        above.append(figure.add_subplot(grid[:, column], sharey=above[0] if above else None))
    columns = 5 if len(handles) == 5 else 4
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)
    return figure, above


class _Drawn:
    """A sensitivity laid out in the world [mm]."""

    def __init__(
        self,
        result: CopSensitivity,
        origins: np.ndarray,
        axes: Sequence[np.ndarray],
        spread: Spread | None = None,
    ) -> None:
        self.result = result
        turned = [r @ p * MM for r, p in zip(axes, result.cop, strict=True)]
        self.cops = origins + np.array(turned)
        self.moves = np.array(
            [r @ gain * _STEP for r, gain in zip(axes, result.com_gain, strict=True)]
        )  # (nc, 2, 2): columns for the CoM forward and to the left
        around = () if spread is None else (spread.outlines, spread.worst_outlines)
        self.ellipses, self.worst = (
            [o + p @ r.T * MM for o, r, p in zip(origins, axes, outlines, strict=False)]
            for outlines in around or ((), ())
        )

    def points(self) -> np.ndarray:
        """The places where something is drawn (k, 2) [mm]."""
        moved = (self.cops + self.moves[:, :, j] for j in (0, 1))
        return np.vstack([self.cops, *moved, *self.worst])


def _draw_spreads(ax: Axes, drawn: _Drawn, colour: str) -> None:
    """The ellipse of each CoP, and round it the outline of its worst case."""
    for ellipse, worst in zip(drawn.ellipses, drawn.worst, strict=True):
        if np.ptp(ellipse, axis=0).max() < _UNSEEN:
            continue  # a point contact's does not move
        ax.fill(ellipse[:, 1], ellipse[:, 0], color=colour, alpha=0.25, linewidth=0, zorder=2)
        ax.plot(ellipse[:, 1], ellipse[:, 0], color=colour, linewidth=1.2, zorder=2.1)
        closed = np.vstack([worst, worst[:1]])
        ax.plot(closed[:, 1], closed[:, 0], color=colour, **_WORST, zorder=2.1)


def _draw_arrows(ax: Axes, drawn: _Drawn, dot: str) -> None:
    for cop, moves in zip(drawn.cops, drawn.moves, strict=True):
        for j, colour in enumerate((_FORWARD, _LEFT)):
            tip = cop + moves[:, j]
            if np.linalg.norm(moves[:, j]) > _SHORTEST:
                ax.annotate(
                    "",
                    (tip[1], tip[0]),
                    (cop[1], cop[0]),
                    arrowprops={
                        "arrowstyle": "-|>",
                        "color": colour,
                        "linewidth": 2.0,
                        "shrinkA": 0,
                        "shrinkB": 0,
                        "mutation_scale": 13,
                    },
                    zorder=4,
                )
        ax.plot(cop[1], cop[0], "o", color=dot, markersize=7, zorder=5)


def _write_loads(
    ax: Axes,
    stance: Stance,
    result: CopSensitivity,
    soles: Sequence[np.ndarray | None],
    origins: np.ndarray,
) -> None:
    """Name, load and travel left of each contact, in front of it (behind it for a hind foot)."""
    front = np.median(origins[:, 0])
    points = all(sole is None for sole in soles)
    reach, spread = np.ptp(origins[:, :2], axis=0)
    aside = points and spread < _NARROW * reach  # words go out from the middle, lest they meet
    axis = (origins[:, 1].min() + origins[:, 1].max()) / 2
    for k, contact in enumerate(stance.contacts):
        share = result.equilibrium.wrenches[k, 2] / stance.robot.weight
        lines = [contact.name, f"{share:.0%} of the weight"]
        for travel, event in (
            (result.com_travel[k], "tips after"),
            (result.unloading_travel[k], "unloads after"),
        ):
            if math.isfinite(travel) and not (event == "unloads after" and soles[k] is not None):
                lines.append("is off its sole" if travel < 0 else f"{event} {_length(travel)}")
        sole, ahead = soles[k], origins[k, 0] >= front - 1.0
        edge = origins[k, 0] if sole is None else sole[:, 0].max() if ahead else sole[:, 0].min()
        middle = origins[k, 1] if sole is None else (sole[:, 1].min() + sole[:, 1].max()) / 2
        side = _side(middle - axis) if aside else "center"
        ax.annotate(
            "\n".join(lines),
            (middle if side == "center" else axis, edge),
            xytext=({"right": -5, "left": 5}.get(side, 0), 9 if ahead else -9),
            textcoords="offset points",
            ha=side,
            va="bottom" if ahead else "top",
            fontsize=8.5,
            color=INK,
            linespacing=1.25,
        )
    # room for the text
    low, high = ax.get_ylim()
    behind = any(origin[0] < front - 1.0 for origin in origins)
    ax.set_ylim(low - 0.22 * behind * (high - low), high + 0.22 * (high - low))
    if points:
        left, right = ax.get_xlim()
        ax.set_xlim(left + 0.3 * (left - right), right - 0.3 * (left - right))
    low, high = ax.get_ylim()
    left, right = ax.get_xlim()
    if aside:
        narrow = max(_NARROWEST * (high - low) - (left - right), 0.0)
        ax.set_xlim(left + narrow / 2, right - narrow / 2)
    left, right = ax.get_xlim()
    thin = max(_FLATTEST * (left - right) - (high - low), 0.0)  # feet in a line: no room for words
    ax.set_ylim(low - thin / 2, high + thin / 2)


def _side(left: float) -> str:
    """Words of a left foot end at the middle, of a right foot start there: they do not meet."""
    return "center" if abs(left) < 1.0 else "right" if left > 0 else "left"


def _length(travel: float) -> str:
    """In mm, or in m where that would be longer than it is exact."""
    return f"{travel:.1f} m" if travel >= 1.0 else f"{travel * MM:.0f} mm"


def _handles(
    sensitivities: Sequence[CopSensitivity], spreads: Sequence[Spread] | None
) -> list[Line2D]:
    def arrow(colour: str, words: str) -> Line2D:
        return Line2D([], [], color=colour, linewidth=2.0, marker=9, markersize=7, label=words)

    moves = np.concatenate([s.com_gain for s in sensitivities]) * _STEP
    arrows = []
    if np.linalg.norm(moves, axis=1).max() > _SHORTEST:  # points have none
        arrows = [
            arrow(_FORWARD, f"CoP if the CoM goes {_STEP:.0f} mm forward"),
            arrow(_LEFT, f"{_STEP:.0f} mm to the left"),
        ]
    unsure = []
    if spreads:
        words = f"{spreads[0].sigmas:g} standard deviations of the CoP"
        unsure = [
            Line2D([], [], color=MUTED, linewidth=1.2, label=words),
            Line2D([], [], color=MUTED, label="its worst case", **_WORST),
        ]
    return [
        Line2D([], [], color=MUTED, marker="o", linestyle="none", label="CoP"),
        Line2D([], [], color=INK, marker="+", markersize=11, linestyle="none", label="CoM"),
        Line2D([], [], label="CoM on the ground", **RING),
        *arrows,
        *unsure,
    ]
