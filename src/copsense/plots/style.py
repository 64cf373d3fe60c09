"""Style: colours, lines and legends that mean the same in every figure.

Colour is the criterion (Okabe and Ito's palette, safe for colour-blind readers), line style the
contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Figure  # for modules that do not import matplotlib
from matplotlib.lines import Line2D

P = ParamSpec("P")
R = TypeVar("R")

INK, MUTED, SOLE, BAD = "#1d2733", "#5b6672", "#e8ecf0", "#fbeae6"
COM_LINE: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (6, 2, 1, 2))}
OFF_SOLE: dict[str, Any] = {"linewidth": 1.3, "linestyle": (0, (1.0, 1.6))}
LIMIT_LINE: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (1, 2))}
EDGE_LINE: dict[str, Any] = {"color": MUTED, "linewidth": 1.1, "linestyle": (0, (1.2, 1.6))}
_KNOWN = {
    "minimum-wrench": "#D55E00",
    "minimum-torque": "#0072B2",
    "minimum-tangential": "#CC79A7",
}
_OTHERS = ("#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#8C6D31", "#000000")
_STYLES: tuple[Any, ...] = ("-", (0, (4.5, 1.8)), (0, (1.2, 1.4)), (0, (5, 1.4, 1.2, 1.4)))

_LETTERS, _HANDLE = 15.0, 6  # letters per inch of a legend; letters that a handle takes

_RC = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": "#9aa4ae",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e6e9ec",
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.fontsize": 9.0,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.columnspacing": 1.5,
    "legend.handlelength": 2.3,
    "lines.linewidth": 1.9,
    "lines.solid_capstyle": "round",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "copsense",  # the same figure gives the same bytes
    "svg.fonttype": "path",
}


def styled(plot: Callable[P, R]) -> Callable[P, R]:
    """Give a function this style while it draws; the caller's settings stay as they were."""

    @wraps(plot)
    def draw(*args: P.args, **kwargs: P.kwargs) -> R:
        with mpl.rc_context(_RC):  # type: ignore[arg-type]
            return plot(*args, **kwargs)

    return draw


def new_figure(width: float, height: float) -> Figure:
    """A figure [inches] without a window, unknown to pyplot."""
    return Figure(figsize=(width, height), layout="constrained")


def axes_or_new(ax: Axes | None, width: float = 4.9, height: float = 3.6) -> Axes:
    """The axes given, or those of a new figure."""
    return new_figure(width, height).add_subplot() if ax is None else ax


def colours(criteria: Iterable[str]) -> dict[str, str]:
    """A colour per criterion; the paper's criteria keep theirs in every figure."""
    names = list(criteria)
    spare = [c for c in _OTHERS if c not in {_KNOWN.get(n) for n in names}]
    chosen, used = {}, 0
    for name in names:
        if name in _KNOWN:
            chosen[name] = _KNOWN[name]
        else:
            chosen[name] = spare[used % len(spare)]
            used += 1
    return chosen


def line_styles(contacts: Sequence[str]) -> dict[str, Any]:
    """A line style per contact."""
    return {name: _STYLES[k % len(_STYLES)] for k, name in enumerate(contacts)}


def add_legend(
    ax: Axes,
    criteria: dict[str, str],
    contacts: dict[str, Any] | None = None,
    extra: Iterable[Line2D] = (),
) -> None:
    """A legend over the axes with each colour and line style once."""
    handles = [Line2D([], [], color=c, label=n) for n, c in criteria.items()]
    handles += [
        Line2D([], [], color=MUTED, linestyle=style, label=name)
        for name, style in (contacts or {}).items()
    ]
    put_legend(ax, [*handles, *extra])


def put_legend(ax: Axes, handles: Sequence[Line2D]) -> None:
    """A legend over the axes, where it hides no line, in as many rows as it needs."""
    width = ax.get_figure(root=True).get_figwidth() * ax.get_position().width  # type: ignore[union-attr]
    needed = sum(len(str(handle.get_label())) + _HANDLE for handle in handles)
    rows = math.ceil(needed / (_LETTERS * width))
    ax.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=math.ceil(len(handles) / rows),
        borderaxespad=0.3,
        borderpad=0.0,
        columnspacing=1.2,
        handlelength=2.0,
        fontsize=8.8,
    )
