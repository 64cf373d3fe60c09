"""plot_benchmark: simulated against predicted, and how the controllers rank."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Panels,
    given_axes,
    looks,
    new_figure,
    put_legend,
    styled,
    whole_figure,
)

if TYPE_CHECKING:
    import pandas as pd

_ACROSS = 3  # panels in a row
_BAR = 0.24  # inches that a bar takes
_SETTING = ["robot", "posture", "conditions"]


@styled
def plot_benchmark(
    table: pd.DataFrame,
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a benchmark's table: simulated against predicted above, the controllers' scores below.

    Args:
        table: what `copsense.comparison.run_benchmark` or `load_benchmark` returns.
        axes: where to draw, one for each score that has a prediction, then one for each trial and
            score; the legend then is over the first of them. Default a new figure.
        label: what the legend says, before the controller's name where there are several.
        color: of the only controller, or controller -> color; default as in every figure.
    """
    from copsense.comparison import CAVEAT, agreement

    look = looks(list(dict.fromkeys(table["controller"])), color, label, what="controllers")
    colour = look.colour
    found = agreement(table)
    compared = list(dict.fromkeys(found["score"]))
    groups = [
        (key, rows)
        for key, rows in table.groupby(["trial", "score"], sort=False)
        if not (rows["status"] == "none").all()  # point feet have no margin
    ]
    names = [*(f"{score} predicted" for score in compared), *(f"{t}, {s}" for (t, s), _ in groups)]
    if axes is None:
        panels = _panels(len(compared), [_height(rows, colour) for _, rows in groups])
    else:
        panels = given_axes(axes, names)
    for ax, score in zip(panels, compared, strict=False):
        _draw_agreement(ax, table, found, score, colour)
    for i, ((trial, score), rows) in enumerate(groups):
        row = range(i - i % _ACROSS, min(i - i % _ACROSS + _ACROSS, len(groups)))
        beside = row if axes is None else (i,)
        settings = max(_settings(groups[j][1]) for j in beside)
        _draw_bars(panels[len(compared) + i], str(trial), str(score), rows, colour, settings)
    handles: list[Line2D | Patch] = [
        Patch(color=shade, label=name) for name, shade in look.legend.items()
    ]
    dot = {"color": MUTED, "linestyle": "", "marker": "o", "markersize": 5.5}
    if compared:
        handles += [
            Line2D([], [], label="statics on the exact path", **dot),  # type: ignore[arg-type]
            Line2D([], [], label="to first order", markerfacecolor="none", **dot),  # type: ignore[arg-type]
        ]
    handles.append(Line2D([], [], label="prediction", color=INK, linestyle="", marker="|"))
    figure = whole_figure(panels[0])
    if axes is not None:
        put_legend(panels[0], handles)
        return figure
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=5,
        fontsize=9,
        title=CAVEAT if compared else None,
        title_fontsize=8,
    )
    cases, robots = table["key"].nunique(), ", ".join(dict.fromkeys(table["robot"]))
    figure.suptitle(
        f"{robots}: {cases} case{'s' * (cases != 1)} in closed loop beside the statics",
        x=0.01,
        ha="left",
        fontsize=12.5,
        fontweight="bold",
    )
    figure.get_layout_engine().set(w_pad=0.07, h_pad=0.08)  # type: ignore[union-attr,call-arg]
    return figure


def _panels(compared: int, tall: list[float]) -> list[Axes]:
    """The panels of a figure of its own: scores above, below them bars of a height [inches]."""
    top = math.ceil(compared / _ACROSS)
    rows = [tall[i : i + _ACROSS] for i in range(0, len(tall), _ACROSS)]
    heights = [3.3] * top + [max(row) for row in rows]
    figure = new_figure(11.0, sum(heights) + 0.9)
    grid = figure.add_gridspec(len(heights), _ACROSS, height_ratios=heights)
    places = [*range(compared), *(top * _ACROSS + i for i in range(len(tall)))]
    return [figure.add_subplot(grid[i // _ACROSS, i % _ACROSS]) for i in places]


def _height(rows: pd.DataFrame, colour: dict[str, str]) -> float:
    return 1.05 + _BAR * _settings(rows) * (min(len(colour), 4) + 0.8)


def _settings(rows: pd.DataFrame) -> int:
    return len(rows.groupby(_SETTING))


def _draw_agreement(
    ax: Axes, table: pd.DataFrame, found: pd.DataFrame, score: str, colour: dict[str, str]
) -> None:
    """Simulated over predicted; on the diagonal they are equal."""
    from copsense.comparison import shown_unit

    rows = table[(table["score"] == score) & (table["status"] == "measured")]
    unit, factor = shown_unit(rows["unit"].iloc[0])
    for column, face in (("first_order", "none"), ("predicted", None)):
        for name, own in rows.groupby("controller", sort=False):
            x, y = own[column].to_numpy(float) * factor, own["value"].to_numpy(float) * factor
            whiskers = np.abs(np.array([own["value"] - own["low"], own["high"] - own["value"]]))
            ax.errorbar(
                x,
                y,
                whiskers * factor,
                fmt="o",
                color=colour[str(name)],
                markerfacecolor=face or colour[str(name)],
                markersize=5.5,
                elinewidth=1.0,
                capsize=2.0,
                zorder=3 if face is None else 2.5,
            )
    everything = rows[["value", "predicted", "first_order"]].to_numpy(float) * factor
    low, high = np.nanmin(everything), np.nanmax(everything)
    room = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
    ends = (low - room, high + room)
    ax.plot(ends, ends, color=MUTED, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    ax.set(xlim=ends, ylim=ends, aspect="equal")
    ax.set_xlabel(f"predicted [{unit}]")
    ax.set_ylabel(f"simulated [{unit}]")
    ax.set_title(_words(score), pad=28)
    said = found[(found["score"] == score) & (found["prediction"] == "path")]
    if len(said):
        one = said.iloc[0]
        text = f"path: {one['cases']} cases, mean error {one['mean_error'] * factor:.2g} {unit}"
        if math.isfinite(one["low"]):
            text += f"\nr = {one['correlation']:.4f} ({one['low']:.3f} to {one['high']:.3f})"
        ax.text(0.0, 1.02, text, transform=ax.transAxes, va="bottom", fontsize=8, color=MUTED)


def _draw_bars(
    ax: Axes, trial: str, score: str, rows: pd.DataFrame, colour: dict[str, str], room: int
) -> None:
    """A bar per controller in each setting, its interval as a whisker, the prediction as a tick."""
    from copsense.comparison import shown_unit

    unit, factor = shown_unit(rows["unit"].iloc[0])
    settings = [key for key, _ in rows.groupby(_SETTING, sort=False)]
    names = [name for name in colour if name in set(rows["controller"])]
    several = rows["conditions"].nunique() > 1
    step = 0.8 / len(names)
    known = rows[["value", "low", "high", "predicted"]].to_numpy(float)
    known = known[np.isfinite(known)] * factor
    longest = float(known.max(initial=0.0)) or 1.0
    for i, key in enumerate(settings):
        here = rows[(rows[_SETTING] == list(key)).all(axis=1)].set_index("controller")
        for j, name in enumerate(names):
            if name not in here.index:
                continue
            row, at = here.loc[name], i - 0.4 + (j + 0.5) * step
            value = float(row["value"]) * factor
            low, high = float(row["low"]) * factor, float(row["high"]) * factor
            if row["status"] == "measured":
                ax.barh(at, value, 0.9 * step, color=colour[name])
                ax.errorbar(
                    value, at, xerr=[[value - low], [high - value]], color=INK,
                    elinewidth=1.0, capsize=2.5,
                )  # fmt: skip
            elif row["status"] == "bound":
                word, end = ("≥", low) if math.isfinite(low) else ("≤", high)
                ax.barh(at, end, 0.9 * step, color=colour[name], alpha=0.45, hatch="//")
                _note(ax, max(end, 0.0), at, f" {word} {end:.3g}")
            else:
                _note(ax, 0.0, at, f" × {row['status']}")
            if math.isfinite(row["predicted"]):
                expected = float(row["predicted"]) * factor
                ax.plot([expected] * 2, [at - step / 2, at + step / 2], color=INK, linewidth=1.3)
    ax.set_yticks(
        range(len(settings)),
        [", ".join((r, p, c) if several else (r, p)) for r, p, c in settings],
    )
    ax.set_ylim(room - 0.5, -0.5)  # the same bar width in panels side by side
    least = float(known.min(initial=0.0))
    ax.set_xlim(min(0.0, 1.08 * least), 1.12 * longest)
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(f"{_words(score)} [{unit}]")
    if not len(known):
        ax.set_xticks([])
    ax.set_title(trial if len(trial) < 40 else trial[:38] + "...")


def _note(ax: Axes, x: float, y: float, text: str) -> None:
    ax.text(x, y, text, va="center", ha="left", fontsize=8, color=MUTED)


def _words(score: str) -> str:
    return score.replace("_", " ")
