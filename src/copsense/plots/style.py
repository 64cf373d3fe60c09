"""Style: colours, lines and legends that mean the same in every figure.

Colour is the criterion (Okabe and Ito's palette, safe for colour-blind readers), line style the
contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeAlias, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure as Figure  # for modules that do not import matplotlib
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from copsense.errors import InvalidInputError
from copsense.plots.saving import render_figure

Color: TypeAlias = str | Mapping[str, str] | None
Panels: TypeAlias = Sequence[Axes] | np.ndarray  # as subplots gives them
P = ParamSpec("P")
R = TypeVar("R")

INK, MUTED, SOLE, BAD = "#1d2733", "#5b6672", "#e8ecf0", "#fbeae6"
COM_LINE: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (6, 2, 1, 2))}
OFF_SOLE: dict[str, Any] = {"linewidth": 1.3, "linestyle": (0, (1.0, 1.6))}
LIMIT_LINE: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (1, 2))}
STATIC_LINE: dict[str, Any] = {"color": "#c3c9cf", "linewidth": 5.0, "zorder": 1.5}
EDGE_LINE: dict[str, Any] = {"color": MUTED, "linewidth": 1.1, "linestyle": (0, (1.2, 1.6))}
_KNOWN = {
    "minimum-wrench": "#D55E00",
    "minimum-torque": "#0072B2",
    "minimum-tangential": "#CC79A7",
}
_OTHERS = ("#009E73", "#E69F00", "#56B4E9", "#CC79A7", "#8C6D31", "#000000")
_STYLES: tuple[Any, ...] = ("-", (0, (4.5, 1.8)), (0, (1.2, 1.4)), (0, (5, 1.4, 1.2, 1.4)))

_NOTEBOOK_DPI = 90.0
_TITLE = 17.0  # points that a title over the axes takes
_LETTERS, _HANDLE = 15.0, 6  # letters per inch of a legend; letters that a handle takes

STYLE = {
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
        with mpl.rc_context(STYLE):  # type: ignore[arg-type]
            return plot(*args, **kwargs)

    return draw


class NotebookFigure(Figure):
    """A figure that notebooks show, though pyplot does not know it."""

    def _repr_png_(self) -> bytes:
        return render_figure(self, ".png", dpi=_NOTEBOOK_DPI)


def new_figure(width: float, height: float) -> NotebookFigure:
    """A figure [inches] without a window, unknown to pyplot."""
    return NotebookFigure(figsize=(width, height), layout="constrained")


def new_axes(width: float, height: float, projection: str | None = None) -> Axes:
    """Axes in a figure of their own [inches], which notebooks show."""
    figure = new_figure(width, height)
    ax = figure.add_subplot(projection=projection)
    ax._repr_png_ = figure._repr_png_  # type: ignore[attr-defined]
    return ax


def axes_or_new(ax: Any, width: float = 4.9, height: float = 3.6) -> Axes:
    """The axes given, or those of a new figure.

    Raises:
        InvalidInputError: what is given is not one Matplotlib Axes.
    """
    if ax is None:
        return new_axes(width, height)
    if not isinstance(ax, Axes):
        raise InvalidInputError(
            f"ax is one Matplotlib Axes, not a {type(ax).__name__}: of several, give one, such as "
            "axes[0]."
        )
    return ax


def given_axes(axes: Any, needed: Sequence[str]) -> list[Axes]:
    """The axes given, one for each of what is drawn; an array of them in its order.

    Args:
        axes: Matplotlib Axes, in any sequence or array.
        needed: what is drawn, panel by panel, in words.

    Raises:
        InvalidInputError: they are too few or too many, or something else.
    """
    found = list(np.ravel(np.array(axes, dtype=object)))
    if len(found) != len(needed) or not all(isinstance(ax, Axes) for ax in found):
        others = [ax for ax in found if not isinstance(ax, Axes)]
        given = f"a {type(others[0]).__name__}" if others else f"{len(found)}"
        raise InvalidInputError(
            f"axes are {len(needed)} Matplotlib Axes, one for each of {', '.join(needed)}; given: "
            f"{given}. Make them with figure.subplots(1, {len(needed)}), or leave axes out."
        )
    return found


def axes_or_pair(
    axes: Any,
    needed: tuple[str, str],
    width: float,
    height: float,
    widths: tuple[float, float] | None = None,
) -> list[Axes]:
    """The two axes given, or those of a new figure [inches], side by side."""
    if axes is not None:
        return given_axes(axes, needed)
    return list(new_figure(width, height).subplots(1, 2, width_ratios=widths))


def whole_figure(ax: Axes) -> Figure:
    """The figure that axes are in, around any subfigure."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure


@dataclass(frozen=True)
class Looks:
    """How criteria, or what else a figure tells apart by colour, look in it.

    Attributes:
        colour: of each.
        words: of each in a legend.
    """

    colour: dict[str, str]
    words: dict[str, str]

    @property
    def legend(self) -> dict[str, str]:
        """Words -> colour."""
        return {self.words[name]: shade for name, shade in self.colour.items()}


def looks(
    names: Sequence[str],
    color: Color = None,
    label: str | None = None,
    *,
    what: str = "criteria",
    usual: Mapping[str, str] | None = None,
) -> Looks:
    """The looks of criteria, or of what else a figure tells apart by colour, those asked for first.

    Args:
        names: of the criteria.
        color: one colour for a single criterion, or criterion -> colour; the others keep theirs.
        label: what a legend says, before the criterion's name where there are several.
        what: the criteria are, in an error's words.
        usual: their colours where none is asked for; default a criterion's own.

    Raises:
        InvalidInputError: no colour, one colour for several criteria, or one of no criterion here.
    """
    asked: Mapping[str, str] = {}
    if isinstance(color, Mapping):
        asked = color
    elif color is not None:
        if len(names) > 1:
            raise InvalidInputError(
                f"one color for {len(names)} {what} would make them look alike: give "
                f"color={{{names[0]!r}: {color!r}}}, or draw one of them alone."
            )
        asked = dict.fromkeys(names, color)
    for name, shade in asked.items():
        if name not in names:
            raise InvalidInputError(
                f"color names {name!r}, which is not drawn. Choose from {', '.join(names)}."
            )
        if not is_color_like(shade):
            raise InvalidInputError(
                f"{shade!r} is not a color of Matplotlib: give a name such as 'black'."
            )
    words = {name: name for name in names}
    if label is not None:
        words = {name: label if len(names) == 1 else f"{label}, {name}" for name in names}
    return Looks(dict(colours(names) if usual is None else usual) | dict(asked), words)


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


def with_legend(ax: Axes, handles: Sequence[Artist]) -> list[Artist]:
    """The handles of the legend that is there already, less those of the same words, and these."""
    before = ax.get_legend()
    kept = [] if before is None else [h for h in before.legend_handles if h is not None]
    mine = {str(handle.get_label()) for handle in handles}
    return [*(h for h in kept if str(h.get_label()) not in mine), *handles]


def put_legend(ax: Axes, handles: Sequence[Artist]) -> None:
    """A legend over the axes, where it hides no line, in as many rows as it needs.

    What a legend that is there already explains, it explains too.
    """
    handles = with_legend(ax, handles)
    width = ax.get_figure(root=True).get_figwidth() * ax.get_position().width  # type: ignore[union-attr]
    needed = sum(len(str(handle.get_label())) + _HANDLE for handle in handles)
    rows = math.ceil(needed / (_LETTERS * width))
    titled = any(ax.get_title(loc) for loc in ("left", "center", "right"))
    room = ScaledTranslation(0.0, _TITLE * titled / 72.0, whole_figure(ax).dpi_scale_trans)
    above = ax.transAxes + room
    ax.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        bbox_transform=above,
        ncols=math.ceil(len(handles) / rows),
        borderaxespad=0.3,
        borderpad=0.0,
        columnspacing=1.2,
        handlelength=2.0,
        fontsize=8.8,
    )
