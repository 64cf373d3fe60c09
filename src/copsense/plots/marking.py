"""Marks that several figures share: failed rows, what lies below zero, single postures."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from copsense.plots.reading import abscissa
from copsense.plots.style import BAD, MUTED
from copsense.sweeps import Sweep

_FEW = 12  # postures: lines with this many or fewer have markers
_NOTHING = 1e-9  # share of the largest value: less below zero is rounding
_ROOM = 0.1  # share of the axes' height that a line of text needs


def mark_failed(ax: Axes, sweep: Sweep, colour: dict[str, str], against: str | None = None) -> None:
    """Put a cross on the lower edge where a row failed: a gap alone is easily missed."""
    x, rows = abscissa(sweep, against).values, sweep.failed.values
    if not rows.any():
        return
    for j, shade in enumerate(colour.values()):
        here = x[rows[:, j]]
        ax.plot(
            here,
            np.full(here.shape, 0.02 + 0.03 * j),
            "x",
            color=shade,
            markersize=4.5,
            markeredgewidth=1.2,
            transform=ax.get_xaxis_transform(),
            clip_on=False,
            label="failed",
        )
    ax.annotate(
        f"× {int(rows.sum())} failed rows",
        (0.99, 0.02 + 0.03 * len(colour)),
        xycoords="axes fraction",
        ha="right",
        va="bottom",
        fontsize=8,
        color=MUTED,
    )


def marks(sweep: Sweep) -> dict[str, Any]:
    """The style of a line: with markers where there are few postures."""
    return {"marker": "o", "markersize": 3.5} if sweep.sizes["posture"] <= _FEW else {}


def shade_below_zero(ax: Axes, values: Float[np.ndarray, "N ..."], words: str) -> None:
    """Shade what is below zero, if anything is, and label it where there is room."""
    ax.axhline(0.0, color=MUTED, linewidth=1.0)
    known = values[np.isfinite(values)]
    if not np.any(known < -_NOTHING * np.abs(known).max(initial=0.0)):
        return
    low, high = ax.get_ylim()
    ax.axhspan(low, 0.0, color=BAD, zorder=0.4, linewidth=0)
    ax.set_ylim(low, high)
    if -low > _ROOM * (high - low):
        ax.text(
            0.5,
            low * 0.94,
            words,
            transform=ax.get_yaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=8.5,
            color=MUTED,
        )


def say(ax: Axes, words: str) -> None:
    """Write in the middle of axes that have nothing to show."""
    ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", va="center", color=MUTED)
