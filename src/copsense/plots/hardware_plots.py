"""plot_hardware and plot_hardware_sweep: what a robot's dimensions and masses buy of travel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.hardware import HardwareEffects, HardwareSweep, Parameter
from copsense.plots.reading import MM
from copsense.plots.style import (
    INK,
    MUTED,
    Color,
    Panels,
    axes_or_new,
    given_axes,
    looks,
    new_figure,
    put_legend,
    styled,
    whole_figure,
)

_MOST = 12  # bars of a group
_SIDES = {"to +y": "#0072B2", "to -y": "#E69F00", "smallest": INK}
_SHOWN = {"m": (1e3, "mm"), "kg": (1.0, "kg")}
_ROOM = 0.24  # of the widest bar, for its words


@styled
def plot_hardware(
    effects: HardwareEffects,
    sweeps: Sequence[HardwareSweep] = (),
    *,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw what each parameter buys of the smallest travel, a panel for each group, best on top.

    A bar to the right is travel gained by a unit in the better direction, which its words say; one
    to the left is what even that costs. Sweeps of single parameters stand below.

    Args:
        effects: what `copsense.hardware.hardware_effects` gives.
        sweeps: what `copsense.hardware.value_sweep` gives of single parameters.
        axes: where to draw, a panel for each group of `HardwareEffects.ranking`, then one for each
            sweep; default a new figure.
        label: what the titles and legends say first.
        color: of the bars, or the criterion -> color; default as in every figure.
    """
    groups = effects.ranking
    most = max(min(len(order), _MOST) for order in groups.values())
    high = 1.2 + 0.27 * most
    figure: Figure
    if axes is not None:
        panels = given_axes(axes, [*groups, *(each.parameter.name for each in sweeps)])
        figure = whole_figure(panels[0])
    else:
        figure = new_figure(1.2 + 4.2 * max(len(groups), len(sweeps)), high + 4.0 * bool(sweeps))
        heights = [high, 4.0][: 1 + bool(sweeps)]
        parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)
        above, *below = np.ravel(parts)
        panels = list(np.ravel(above.subplots(1, len(groups))))
        for part in below:
            panels += list(np.ravel(part.subplots(1, len(sweeps))))
        above.suptitle(
            f"{effects.stance.robot.name} under {effects.criterion.name}: the CoM goes "
            f"{effects.smallest * MM:.1f} mm to the shorter side"
        )
    name = effects.criterion.name
    colour = looks([name], color).colour[name]
    for ax, (group, order) in zip(panels, groups.items(), strict=False):
        _bars(ax, effects, order[:_MOST], colour)
        first = "" if label is None else f"{label}, "
        ax.set_title(f"{first}{group}")
        ax.set_xlabel(f"travel gained by {effects.amount_of(group)[1]} [mm]")
    for ax, each in zip(panels[len(groups) :], sweeps, strict=True):
        plot_hardware_sweep(each, ax=ax, label=label)
    return figure


def _bars(ax: Axes, effects: HardwareEffects, order: tuple[int, ...], colour: str) -> None:
    gained = np.array([effects.bought[i] for i in order]) * MM
    places = np.arange(len(order))
    ax.barh(places, gained, height=0.68, color=colour, zorder=2)
    ax.axvline(0.0, color=INK, lw=0.9)
    widest = float(np.abs(gained).max(initial=0.0)) or 1.0
    for place, i, length in zip(places, order, gained, strict=True):
        words = f"{length:+.3f} ({effects.better[i]})" if length > 0 else f"{length:+.3f}"
        ax.annotate(
            words,
            (max(length, 0.0), place),
            (3, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color=MUTED,
        )
    ax.set_yticks(places, [_called(effects.parameters[i]) for i in order])
    ax.invert_yaxis()
    ax.grid(visible=False, axis="y")
    low = min(float(gained.min(initial=0.0)), 0.0)
    ax.set_xlim(low * 1.05, max(float(gained.max(initial=0.0)), 0.0) + _ROOM * 2 * widest)


def _called(parameter: Parameter) -> str:
    """A parameter's name under the title of its group."""
    if parameter.group == "lengths":
        return parameter.name
    return parameter.name.partition("@")[2]


@styled
def plot_hardware_sweep(
    sweep: HardwareSweep,
    *,
    ax: Axes | None = None,
    label: str | None = None,
    color: Color = None,
) -> Axes:
    """Draw the travel to both sides over a parameter, and the tangent by its exact derivative.

    A cross on the axis is a value with which the robot cannot stand.

    Args:
        sweep: what `copsense.hardware.value_sweep` gives.
        ax: axes to draw in; default a new figure.
        label: what the legend says first.
        color: ``"to +y"``, ``"to -y"`` or ``"smallest"`` -> color.
    """
    ax = axes_or_new(ax, 5.6, 4.0)
    p, look = sweep.parameter, looks(list(_SIDES), color, label, what="sides", usual=_SIDES)
    factor, unit = _SHOWN.get(p.unit, (1.0, p.unit))
    x = sweep.values * factor
    order = np.argsort(x)
    travels = {
        "to +y": [point.travels["+y"] for point in sweep.points],
        "to -y": [point.travels["-y"] for point in sweep.points],
        "smallest": [point.smallest for point in sweep.points],
    }
    handles: list[Line2D] = []
    for side, found in travels.items():
        y = np.array([np.nan if t is None or not np.isfinite(t) else t for t in found]) * MM
        wide = 3.4 if side == "smallest" else 1.4
        (line,) = ax.plot(
            x[order],
            y[order],
            "o-",
            ms=4 if side != "smallest" else 0,
            lw=wide,
            alpha=0.35 if side == "smallest" else 1.0,
            zorder=1.8 if side == "smallest" else 2.0,
            color=look.colour[side],
            label=look.words[side],
        )
        handles.append(line)
    _tangent(ax, sweep, factor, handles, look.words["smallest"])
    lost = np.array([not point.ends for point in sweep.points])
    if lost.any():
        (marks,) = ax.plot(
            x[lost],
            np.zeros(int(lost.sum())),
            "x",
            color="#c0392b",
            ms=7,
            mew=1.8,
            clip_on=False,
            transform=ax.get_xaxis_transform(),
            label="cannot stand",
        )
        handles.append(marks)
    ax.axvline(p.nominal * factor, color=MUTED, lw=0.9, ls=(0, (4, 2)))
    ax.set_xlabel(f"{p.name} [{unit}]; dashed: as it is")
    ax.set_ylabel("travel of the CoM [mm]")
    put_legend(ax, handles)
    return ax


def _tangent(
    ax: Axes, sweep: HardwareSweep, factor: float, handles: list[Line2D], words: str
) -> None:
    """The smallest travel by the derivative at the robot as it is."""
    effects, p = sweep.nominal, sweep.parameter
    own = [i for i, each in enumerate(effects.parameters) if each.name == p.name]
    if not own:
        return
    low, high = float(sweep.values.min()), float(sweep.values.max())
    at = np.unique([low, min(max(p.nominal, low), high), high]) - p.nominal
    more, less = effects.slopes[own[0], 2]
    there = effects.smallest + np.where(at > 0, more * at, less * -at)
    (line,) = ax.plot(
        (p.nominal + at) * factor,
        there * MM,
        color=MUTED,
        lw=1.1,
        ls=(0, (1.2, 1.6)),
        label=f"{words}, by its derivative",
    )
    handles.append(line)
