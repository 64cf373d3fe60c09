"""plot_rollout: a robot in closed loop on one page, after [Romano2016] Figures 6 to 9."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.reading import DEG, MM, contact_origins, cross_section, labels, world_soles
from copsense.plots.soles import draw_ground, draw_track, frame_ground
from copsense.plots.style import (
    COM_LINE,
    EDGE_LINE,
    MUTED,
    SOLE,
    line_styles,
    new_figure,
    put_legend,
    styled,
)

_CONTACTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_STATIC: dict[str, Any] = {"color": "#c3c9cf", "linewidth": 5.0, "zorder": 1.5}
_MOST_NAMED = 6  # joints whose torque has a line of its own in the legend


@styled
def plot_rollout(dataset: xr.Dataset, *, against: str | None = None) -> Figure:
    """Draw a recording: forces, CoPs in the soles, CoM, torques, and CoP against a joint.

    Args:
        dataset: what `copsense.simulation.rollout` returns, with or without a static prediction.
        against: joint whose position the last panel has along its axis; default the first hip
            roll there is, or else the CoM.
    """
    figure = new_figure(12.6, 7.4)
    panels = figure.subplots(2, 3)
    colour = _colours(labels(dataset, "contact"))
    _draw_forces(panels[0, 0], dataset, colour)
    _draw_cop(panels[0, 1], dataset, colour)
    _draw_above(panels[0, 2], dataset, colour)
    _draw_com(panels[1, 0], dataset)
    _draw_torques(panels[1, 1], dataset)
    _draw_against(panels[1, 2], dataset, colour, against or _hip_roll(dataset))
    for ax in (*panels[0, :2], *panels[1, :2]):
        ax.set_xlabel("time [s]")
        tip = float(dataset.attrs.get("tip_time", np.nan))
        if np.isfinite(tip):
            ax.axvline(tip, color="#b3261e", linewidth=1.0, linestyle=(0, (4, 2)))
    attributes = dataset.attrs
    figure.suptitle(
        f"{attributes['robot']} under {attributes.get('controller', 'a controller')}, "
        f"{float(attributes['end_time']):.2f} s\n{textwrap.shorten(attributes['end_reason'], 120)}",
        x=0.01,
        ha="left",
        fontsize=12.5,
        fontweight="bold",
    )
    return figure


def _colours(contacts: list[str]) -> dict[str, str]:
    return {name: _CONTACTS[k % len(_CONTACTS)] for k, name in enumerate(contacts)}


def _handles(colour: dict[str, str]) -> list[Line2D]:
    return [Line2D([], [], color=c, label=name) for name, c in colour.items()]


def _draw_forces(ax: Axes, dataset: xr.Dataset, colour: dict[str, str]) -> None:
    share = dataset["wrench"].sel(component="fz") / float(dataset.attrs["weight"]) * 100
    for name, c in colour.items():
        ax.plot(dataset["time"], share.sel(contact=name), color=c)
    most = float(np.nanmax(share.values[_standing(dataset)]))
    ax.set_ylim(-5.0, 1.15 * max(most, 10.0))  # the blows of a fall would press the rest flat
    ax.set_ylabel("normal force [% of the weight]")
    put_legend(ax, _handles(colour))


def _world_cop(dataset: xr.Dataset, name: str) -> Float[np.ndarray, "N contact 2"]:
    """CoPs of a variable over (any, contact, axis) in the world [mm]."""
    axes = dataset["contact_rotation"].values[:, :2, :2]
    turned = np.einsum("kab,ikb->ika", axes, dataset[name].values)
    return np.asarray(contact_origins(dataset) + turned * MM)


def _draw_cop(ax: Axes, dataset: xr.Dataset, colour: dict[str, str]) -> None:
    cops, soles = _world_cop(dataset, "cop"), world_soles(dataset)
    for k, (name, c) in enumerate(colour.items()):
        sole, known = soles[k], cops[np.isfinite(cops[:, k, 0]), k, 0]
        found = None if sole is None else cross_section(sole, "y", float(np.median([*known, 0.0])))
        if found:
            ax.axhspan(*found, color=SOLE, zorder=0.5, linewidth=0)
            for edge in found:
                ax.axhline(edge, **EDGE_LINE)
        ax.plot(dataset["time"], cops[:, k, 1], color=c, label=name)
    ax.plot(dataset["time"], dataset["com"].sel(com_axis="y") * MM, **COM_LINE)
    _limit(ax, dataset)
    ax.set_ylabel("CoP y in the soles, world [mm]")
    put_legend(ax, [*_handles(colour), Line2D([], [], label="CoM", **COM_LINE)])


def _limit(ax: Axes, dataset: xr.Dataset) -> None:
    feet = [contact_origins(dataset), *(s for s in world_soles(dataset) if s is not None)]
    y = np.vstack(feet)[:, 1]
    room = 0.12 * max(float(np.ptp(y)), 10.0)
    ax.set_ylim(y.min() - room, y.max() + room)


def _draw_above(ax: Axes, dataset: xr.Dataset, colour: dict[str, str]) -> None:
    rows = _standing(dataset)
    cops, margin = _world_cop(dataset, "cop")[rows], dataset["margin"].values[rows]
    draw_ground(ax, world_soles(dataset), contact_origins(dataset))
    for k, c in enumerate(colour.values()):
        draw_track(ax, cops[:, k], ~(margin[:, k] < 0), c, 2.4)
    com = dataset["com"].values[rows, :2] * MM
    ax.plot(com[:, 1], com[:, 0], zorder=4, **COM_LINE)
    frame_ground(ax, world_soles(dataset), contact_origins(dataset), com)
    ax.set_title("from above, before a tip")


def _draw_com(ax: Axes, dataset: xr.Dataset) -> None:
    time = dataset["time"]
    target, com = (dataset[n].sel(com_axis="y") * MM for n in ("com_target", "com"))
    ax.plot(time, target, **_STATIC)
    ax.plot(time, com, color="#1d2733")
    ax.set_ylabel("CoM y [mm]")
    wide = Line2D([], [], label="asked for", **{**_STATIC, "linewidth": 4.0})
    put_legend(ax, [wide, Line2D([], [], color="#1d2733", label="measured")])


def _draw_torques(ax: Axes, dataset: xr.Dataset) -> None:
    torque = dataset["torque"].transpose("time", "joint").values
    names = labels(dataset, "joint")
    ax.plot(dataset["time"], torque, color=MUTED, linewidth=0.7, alpha=0.5)
    standing = torque[_standing(dataset)]
    largest = np.argsort(-np.abs(standing).max(axis=0))[:_MOST_NAMED]
    handles = []
    for c, j in zip(_CONTACTS, largest, strict=False):
        handles += ax.plot(dataset["time"], torque[:, j], color=c, linewidth=1.4, label=names[j])
    reach = 1.15 * float(np.abs(standing).max()) + 0.1
    ax.set_ylim(-reach, reach)
    ax.set_ylabel("torque, before a tip [Nm]")
    put_legend(ax, handles)


def _standing(dataset: xr.Dataset) -> np.ndarray:
    """Rows (N,) before the first tip, without the first, which has no contact force yet."""
    tip, time = float(dataset.attrs.get("tip_time", np.nan)), dataset["time"].values
    rows = time <= tip if np.isfinite(tip) else np.ones(len(time), dtype=bool)
    rows[0] = len(rows) == 1
    return rows if np.any(rows) else np.ones(len(time), dtype=bool)


def _hip_roll(dataset: xr.Dataset) -> str | None:
    rolls = [j for j in labels(dataset, "joint") if "hip" in j.lower() and "roll" in j.lower()]
    return rolls[0] if rolls else None


def _draw_against(ax: Axes, dataset: xr.Dataset, colour: dict[str, str], joint: str | None) -> None:
    """CoP y in each foot's frame against a joint or the CoM, the static prediction under it."""
    start = float(dataset["com"].sel(com_axis="y").values[0])
    rows = _standing(dataset)
    x, label = dataset["com"].sel(com_axis="y").values * MM, "CoM y before a tip [mm]"
    if joint is not None:
        x, label = (
            dataset["joint_position"].sel(joint=joint).values * DEG,
            f"{joint} before a tip [deg]",
        )
    styles = line_styles(list(colour))
    if "static_cop" in dataset:
        there = (dataset["static_travel"].values + start) * MM
        if joint is not None:
            there = dataset["static_joint"].sel(joint=joint).values * DEG
        within = (there >= x[rows].min() - 0.5) & (there <= x[rows].max() + 0.5)
        for k in range(len(colour)):
            cop = np.where(within, dataset["static_cop"].values[:, k, 1] * MM, np.nan)
            ax.plot(there, cop, **_STATIC)
    for k, (name, c) in enumerate(colour.items()):
        cop = dataset["cop"].values[:, k, 1] * MM
        ax.plot(x[rows], cop[rows], color=c, linewidth=1.3, linestyle=styles[name])
    reach = [np.abs(s).max() for s in _local_soles(dataset)]
    if reach:
        ax.set_ylim(-1.3 * max(reach), 1.3 * max(reach))
    ax.set_xlabel(label)
    ax.set_ylabel("CoP y in the foot's frame [mm]")
    handles = [Line2D([], [], color=c, linestyle=styles[n], label=n) for n, c in colour.items()]
    if "static_cop" in dataset:
        handles.append(Line2D([], [], label="static", **{**_STATIC, "linewidth": 4.0}))
    put_legend(ax, handles)


def _local_soles(dataset: xr.Dataset) -> list[np.ndarray]:
    """The lateral reach of each sole in its own frame [mm]."""
    if "sole_polygon" not in dataset:
        return []
    return [polygon[:, 1] * MM for polygon in dataset["sole_polygon"].values]
