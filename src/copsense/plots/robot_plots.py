"""plot_robot: the stick figure of a robot on its soles, from behind or from its right side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from copsense.errors import InvalidInputError
from copsense.plots.reading import MM, criterion_name
from copsense.plots.style import (
    COM_LINE,
    INK,
    MUTED,
    Color,
    axes_or_new,
    looks,
    styled,
    with_legend,
)
from copsense.sensitivity import CopSensitivity
from copsense.skeleton import skeleton
from copsense.stance import Stance

Side = Literal["behind", "right"]
SIDES: tuple[Side, ...] = ("behind", "right")
RING: dict[str, Any] = {
    "color": INK,
    "marker": "o",
    "markersize": 6,
    "markerfacecolor": "white",
    "linestyle": "none",
}
_ROOM = 0.06  # of the picture's larger side, around it
_BESIDE = 2.2  # inches that the legend beside the robot takes
_FLAT = 0.9  # of its width: lower robots have wider figures
_NARROWEST = 0.45  # of its height


@styled
def plot_robot(
    stance: Stance,
    sensitivities: Sequence[CopSensitivity] = (),
    *,
    side: Side = "behind",
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
    legend: bool = True,
) -> Axes:
    """Draw a robot's stick figure with its soles, its CoM over the ground, and the CoPs.

    Lines join each joint to the one that carries it, and to the contacts. A ring on the ground is
    the CoM's projection; a dot in a criterion's colour the CoP of a contact under it.

    Args:
        stance: the posture.
        sensitivities: of that stance, one per criterion; default no CoPs.
        side: seen from ``"behind"``, so that left is left, or from the robot's ``"right"``.
        ax: where to draw; default a new figure. Robots in the same axes share a picture around all.
        label: what the legend calls the robot; default nothing.
        color: of the stick figure, or criterion -> color of its dots; default as in every figure.
        legend: whether to explain the marks.

    Raises:
        InvalidInputError: another side, `ax` is not one Matplotlib Axes, or `color` is none.
    """
    if side not in SIDES:
        raise InvalidInputError(f"a robot is seen from {', '.join(SIDES)}, not from {side!r}.")
    names = [criterion_name(s.equilibrium.criterion) for s in sensitivities]
    ink = looks(["robot"], color).colour["robot"] if isinstance(color, str) else INK
    colour = looks(names, color if isinstance(color, Mapping) else None).colour
    across = 1 if side == "behind" else 0
    bones, com, places = skeleton(stance) * MM, stance.com * MM, stance.placements
    ax = axes_or_new(ax, *_size(bones, across, legend))
    shared = ax.has_data()
    draw_bones(ax, bones, across, color=ink)
    ground = min(float(place.translation[2]) for place in places) * MM
    outlines = []
    for contact, place in zip(stance.contacts, places, strict=True):
        if contact.sole is not None:
            flat = np.column_stack([contact.sole.vertices, np.zeros(len(contact.sole.vertices))])
            outline = (place.translation + flat @ place.rotation.T) * MM
            outlines.append(outline)
            closed = np.vstack([outline, outline[:1]])
            ax.plot(closed[:, across], closed[:, 2], color=MUTED, linewidth=4.0, zorder=2)
    ax.plot([com[across]] * 2, [ground, com[2]], zorder=4, **COM_LINE)
    ax.plot(com[across], com[2], "+", color=INK, markersize=13, markeredgewidth=2, zorder=6)
    ax.plot(com[across], ground, zorder=5, **RING)
    for number, (found, shade) in enumerate(zip(sensitivities, colour.values(), strict=True)):
        flat = np.column_stack([found.cop, np.zeros(len(found.cop))])
        cops = np.array(
            [(p.translation + p.rotation @ c) * MM for p, c in zip(places, flat, strict=True)]
        )
        # The later ones smaller, so that none hides another.
        size = max(8.5 - 2.0 * number, 3.5)
        ax.plot(cops[:, across], cops[:, 2], "o", color=shade, markersize=size, zorder=7)
    _frame(ax, np.vstack([bones.reshape(-1, 3), com[None], *outlines]), across, shared)
    if legend:
        # Beside the robot, which is narrower than the words.
        mine = [Line2D([], [], color=ink, linewidth=1.6, label=label)] if label else []
        handles = with_legend(ax, [*mine, *_handles(colour)])
        ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def _size(bones: Float[np.ndarray, "s 2 3"], across: int, legend: bool) -> tuple[float, float]:
    """Width and height of a figure of its own [inches], after the robot's shape from there."""
    sides = np.ptp(bones.reshape(-1, 3), axis=0)
    high = float(sides[2]) / max(float(sides[across]), 1.0)
    wide, tall = (3.0, 4.2) if high > _FLAT else (4.8, 1.5 + 3.0 * high)
    return wide + _BESIDE * legend, tall


def draw_bones(
    ax: Axes,
    bones: Float[np.ndarray, "s 2 3"],
    across: int,
    shade: float = 1.0,
    color: str = INK,
) -> None:
    """Draw segments over the world axis `across` (0 for x, 1 for y) and its height."""
    for segment in bones:
        ax.plot(
            segment[:, across],
            segment[:, 2],
            color=color,
            alpha=shade,
            linewidth=1.6,
            solid_capstyle="round",
            zorder=3,
        )


def _handles(colour: dict[str, str]) -> list[Line2D]:
    """What a legend says of the marks."""
    dots = [
        Line2D([], [], color=shade, marker="o", linestyle="none", label=f"CoP, {name}")
        for name, shade in colour.items()
    ]
    return [
        *dots,
        Line2D([], [], color=INK, marker="+", markersize=11, linestyle="none", label="CoM"),
        Line2D([], [], label="CoM on the ground", **RING),
    ]


def _frame(ax: Axes, points: Float[np.ndarray, "k 3"], across: int, shared: bool) -> None:
    """Equal scales and room around the points, and around what the axes had before."""
    low, high, sign = points.min(axis=0), points.max(axis=0), 1 if across == 1 else -1
    room = _ROOM * float((high - low).max())
    middle, height = (low + high)[across] / 2, float((high - low)[2]) + 2 * room
    # A robot that is thin from here has room for its marks and words all the same.
    half = max(float((high - low)[across]) / 2 + room, _NARROWEST * height / 2)
    wide, tall = [middle - half, middle + half], [low[2] - room, high[2] + room]
    if shared:
        wide, tall = [*wide, *ax.get_xlim()], [*tall, *ax.get_ylim()]
    ax.set_xlim(*sorted((min(wide), max(wide)), reverse=sign == 1))
    ax.set_ylim(min(tall), max(tall))
    ax.set_aspect("equal")
    ax.xaxis.set_major_locator(MaxNLocator(3))
    ax.set_xlabel("← left  y [mm]  right →" if across == 1 else "x, forward [mm] →")
    ax.set_ylabel("z [mm]")
    ax.set_title("from behind" if across == 1 else "from its right")
