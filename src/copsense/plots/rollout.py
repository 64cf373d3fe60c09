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

from copsense.plots.reading import DEG, MM, contact_origins, labels, world_soles
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
from copsense.polygon import Polygon, unpadded

_CONTACTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_STATIC: dict[str, Any] = {"color": "#c3c9cf", "linewidth": 5.0, "zorder": 1.5}
_RED = "#b3261e"
_STILL = 0.1  # mm: less than this is drawn as standing still
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
        if _tipped(dataset):
            _mark_tip(ax, dataset)
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


def _tipped(dataset: xr.Dataset) -> bool:
    return bool(np.isfinite(float(dataset.attrs.get("tip_time", np.nan))))


def _mark_tip(ax: Axes, dataset: xr.Dataset) -> None:
    """A line where a contact first ceased to stand, with the word for it."""
    tip, end = (float(dataset.attrs[name]) for name in ("tip_time", "end_time"))
    ax.axvline(tip, color=_RED, linewidth=1.0, linestyle=(0, (4, 2)))
    left = tip > 0.5 * end
    ax.annotate(
        str(dataset.attrs.get("tip_kind", "tip")),
        (tip, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(-4 if left else 4, 0),
        textcoords="offset points",
        ha="right" if left else "left",
        color=_RED,
        fontsize=9,
    )


def _before(dataset: xr.Dataset) -> str:
    """What to add to the name of what is shown up to the tip only."""
    return f", before the {dataset.attrs.get('tip_kind', 'tip')}" if _tipped(dataset) else ""


def _colours(contacts: list[str]) -> dict[str, str]:
    return {name: _CONTACTS[k % len(_CONTACTS)] for k, name in enumerate(contacts)}


def _handles(colour: dict[str, str]) -> list[Line2D]:
    return [Line2D([], [], color=c, label=name) for name, c in colour.items()]


def _draw_forces(ax: Axes, dataset: xr.Dataset, colour: dict[str, str]) -> None:
    share = dataset["wrench"].sel(component="fz") / float(dataset.attrs["weight"]) * 100
    for name, c in colour.items():
        ax.plot(dataset["time"], share.sel(contact=name), color=c)
    most = float(np.nanmax(share.values[_telling(dataset)]))
    ax.set_ylim(-5.0, 1.15 * max(most, 10.0))
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
        found = (
            None
            if sole is None
            else Polygon.hull(sole).section("y", float(np.median([*known, 0.0])))
        )
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
    ax.set_title(f"from above{_before(dataset)}")


def _draw_com(ax: Axes, dataset: xr.Dataset) -> None:
    time = dataset["time"]
    target, com = (dataset[n].sel(com_axis="y") * MM for n in ("com_target", "com"))
    ax.plot(time, target, **_STATIC)
    ax.plot(time, com, color="#1d2733")
    ax.set_ylabel("CoM y [mm]")
    span = np.concatenate([target.values, com.values])
    if np.ptp(span) < _STILL:  # rounding is no motion
        ax.set_ylim(span.mean() - _STILL, span.mean() + _STILL)
    wide = Line2D([], [], label="asked for", **{**_STATIC, "linewidth": 4.0})
    put_legend(ax, [wide, Line2D([], [], color="#1d2733", label="measured")])


def _draw_torques(ax: Axes, dataset: xr.Dataset) -> None:
    torque = dataset["torque"].transpose("time", "joint").values
    names = labels(dataset, "joint")
    ax.plot(dataset["time"], torque, color=MUTED, linewidth=0.7, alpha=0.5)
    standing = torque[_telling(dataset)]
    largest = np.argsort(-np.abs(standing).max(axis=0))[:_MOST_NAMED]
    handles = []
    for c, j in zip(_CONTACTS, largest, strict=False):
        handles += ax.plot(dataset["time"], torque[:, j], color=c, linewidth=1.4, label=names[j])
    reach = 1.15 * float(np.abs(standing).max()) + 0.1
    ax.set_ylim(-reach, reach)
    ax.set_ylabel("torque [Nm]")
    put_legend(ax, handles)


def _standing(dataset: xr.Dataset) -> np.ndarray:
    """Rows (N,) before the first tip, without the first, which has no contact force yet."""
    tip, time = float(dataset.attrs.get("tip_time", np.nan)), dataset["time"].values
    rows = time <= tip if np.isfinite(tip) else np.ones(len(time), dtype=bool)
    rows[0] = len(rows) == 1
    return rows if np.any(rows) else np.ones(len(time), dtype=bool)


def _telling(dataset: xr.Dataset) -> np.ndarray:
    """Rows (N,) that a scale is for: the blows of a fall would press the rest flat."""
    through = dataset.attrs.get("end_kind") == "completed"
    return _standing(dataset.assign_attrs(tip_time=np.nan) if through else dataset)


def _hip_roll(dataset: xr.Dataset) -> str | None:
    rolls = [j for j in labels(dataset, "joint") if "hip" in j.lower() and "roll" in j.lower()]
    return rolls[0] if rolls else None


def _draw_against(ax: Axes, dataset: xr.Dataset, colour: dict[str, str], joint: str | None) -> None:
    """CoP y in each foot's frame against a joint or the CoM, the static prediction under it."""
    start = float(dataset["com"].sel(com_axis="y").values[0])
    rows = _standing(dataset)
    x, label = dataset["com"].sel(com_axis="y").values * MM, f"CoM y{_before(dataset)} [mm]"
    if joint is not None:
        x, label = (
            dataset["joint_position"].sel(joint=joint).values * DEG,
            f"{joint}{_before(dataset)} [deg]",
        )
    styles = line_styles(list(colour))
    if not np.any(np.isfinite(dataset["margin"])):
        _draw_loads(ax, dataset, colour, x[rows], rows)
        ax.set_xlabel(label)
        return
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
    by_contact = _local_edges(dataset, rows)
    for name, c in colour.items():
        for edge in by_contact.get(name, ()):
            ax.axhline(edge, **{**EDGE_LINE, "color": c})
    edges = list(by_contact.values())
    if edges:
        reach = 1.15 * float(np.abs(edges).max())
        ax.set_ylim(-reach, reach)
    ax.set_xlabel(label)
    ax.set_ylabel("CoP y in the foot's frame [mm]")
    handles = [Line2D([], [], color=c, linestyle=styles[n], label=n) for n, c in colour.items()]
    if "static_cop" in dataset:
        handles.append(Line2D([], [], label="static", **{**_STATIC, "linewidth": 4.0}))
    if edges:
        handles.append(Line2D([], [], label="sole's edges", **EDGE_LINE))
    put_legend(ax, handles)


def _draw_loads(
    ax: Axes, dataset: xr.Dataset, colour: dict[str, str], x: np.ndarray, rows: np.ndarray
) -> None:
    """The loads of points, whose centres of pressure do not move."""
    styles, share = line_styles(list(colour)), 100.0 / float(dataset.attrs["weight"])
    loads = dataset["wrench"].sel(component="fz").values[rows] * share
    handles = [
        ax.plot(x, load, color=c, linestyle=styles[name], label=name)[0]
        for load, (name, c) in zip(loads.T, colour.items(), strict=True)
    ]
    ax.set_ylim(-5.0, 1.15 * float(max(np.nanmax(loads), 10.0)))
    ax.set_ylabel("normal force [% of the weight]")
    put_legend(ax, handles)


def _local_edges(dataset: xr.Dataset, rows: np.ndarray) -> dict[str, tuple[float, float]]:
    """Where each sole ends to the right and to the left of its CoPs, in its own frame [mm]."""
    if "sole_polygon" not in dataset:
        return {}
    found = {}
    for k, name in enumerate(labels(dataset, "contact")):
        sole = unpadded(dataset["sole_polygon"].values[k] * MM)
        if sole is None:
            continue
        x = dataset["cop"].values[rows, k, 0]
        middle = float(np.median(x[np.isfinite(x)])) * MM if np.any(np.isfinite(x)) else 0.0
        whole = float(sole.vertices[:, 1].min()), float(sole.vertices[:, 1].max())
        found[name] = sole.section("y", middle) or whole
    return found
