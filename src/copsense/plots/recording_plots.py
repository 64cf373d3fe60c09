"""plot_rollout: a robot in closed loop on one page, after [Romano2016] Figures 6 to 9."""

from __future__ import annotations

import textwrap

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from copsense.plots.reading import DEG, MM, contact_origins, labels, world_soles
from copsense.plots.sole_plots import draw_ground, draw_track, frame_ground
from copsense.plots.style import (
    COM_LINE,
    EDGE_LINE,
    MUTED,
    SOLE,
    STATIC_LINE,
    Color,
    Looks,
    Panels,
    given_axes,
    line_styles,
    looks,
    new_figure,
    put_legend,
    styled,
    whole_figure,
)
from copsense.polygon import Polygon, unpadded
from copsense.simulation import Event, Recording

_SIX = ("forces", "CoPs", "the CoPs from above", "the CoM", "torques", "CoPs over a joint")
_CONTACTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_RED = "#b3261e"
_STILL = 0.1  # mm: smaller motions are drawn as standing still
_MOST_NAMED = 6  # joints whose torque has a line of its own in the legend


@styled
def plot_rollout(
    recording: Recording,
    *,
    against: str | None = None,
    axes: Panels | None = None,
    label: str | None = None,
    color: Color = None,
) -> Figure:
    """Draw a recording: forces, CoPs in the soles, CoM, torques, and CoP against a joint.

    Args:
        recording: with or without a static prediction attached.
        against: joint along the horizontal axis of the last panel; default the first hip roll,
            or the CoM without one.
        axes: where to draw the six, row by row; default a new figure.
        label: what the legends say, before the contact's name where there are several.
        color: of the only contact, or contact -> color; default as in every figure.
    """
    if axes is None:
        panels = new_figure(12.6, 7.4).subplots(2, 3)
    else:
        panels = np.array(given_axes(axes, _SIX)).reshape(2, 3)
    figure = whole_figure(panels[0, 0])
    contacts = labels(recording, "contact")
    look = looks(contacts, color, label, what="contacts", usual=_colours(contacts))
    _draw_forces(panels[0, 0], recording, look)
    _draw_cop(panels[0, 1], recording, look)
    _draw_above(panels[0, 2], recording, look)
    _draw_com(panels[1, 0], recording)
    _draw_torques(panels[1, 1], recording)
    _draw_against(panels[1, 2], recording, look, against or _hip_roll(recording))
    for ax in (*panels[0, :2], *panels[1, :2]):
        ax.set_xlabel("time [s]")
        if recording.tip is not None:
            _mark_tip(ax, recording.tip, recording.end.time)
    if axes is not None:
        return figure
    figure.suptitle(
        f"{recording.attrs['robot']} under {recording.attrs.get('controller', 'a controller')}, "
        f"{recording.end.time:.2f} s\n{textwrap.shorten(recording.end.message, 120)}",
        x=0.01,
        ha="left",
        fontsize=12.5,
        fontweight="bold",
    )
    return figure


def _mark_tip(ax: Axes, tip: Event, end: float) -> None:
    """A line where a contact first ceased to stand, with the word for it."""
    ax.axvline(tip.time, color=_RED, linewidth=1.0, linestyle=(0, (4, 2)))
    left = tip.time > 0.5 * end
    ax.annotate(
        tip.kind,
        (tip.time, 0.03),
        xycoords=("data", "axes fraction"),
        xytext=(-4 if left else 4, 0),
        textcoords="offset points",
        ha="right" if left else "left",
        color=_RED,
        fontsize=9,
    )


def _before(recording: Recording) -> str:
    """What to add to the name of a panel that shows the part before the tip alone."""
    return f", before the {recording.tip.kind}" if recording.tip else ""


def _colours(contacts: list[str]) -> dict[str, str]:
    return {name: _CONTACTS[k % len(_CONTACTS)] for k, name in enumerate(contacts)}


def _handles(look: Looks) -> list[Line2D]:
    return [Line2D([], [], color=c, label=words) for words, c in look.legend.items()]


def _draw_forces(ax: Axes, recording: Recording, look: Looks) -> None:
    share = recording["wrench"].sel(component="fz") / float(recording.attrs["weight"]) * 100
    for name, c in look.colour.items():
        ax.plot(recording["time"], share.sel(contact=name), color=c)
    shown = _for_scale(recording)["wrench"].sel(component="fz") / float(recording.attrs["weight"])
    most = float(np.nanmax(shown.values)) * 100
    ax.set_ylim(-5.0, 1.15 * max(most, 10.0))
    ax.set_ylabel("normal force [% of the weight]")
    put_legend(ax, _handles(look))


def _world_cop(recording: Recording, name: str) -> Float[np.ndarray, "N contact 2"]:
    """CoPs of a variable over (any, contact, axis) in the world [mm]."""
    axes = recording["contact_rotation"].values[:, :2, :2]
    turned = np.einsum("kab,ikb->ika", axes, recording[name].values)
    return np.asarray(contact_origins(recording) + turned * MM)


def _draw_cop(ax: Axes, recording: Recording, look: Looks) -> None:
    cops, soles = _world_cop(recording, "cop"), world_soles(recording)
    for k, (name, c) in enumerate(look.colour.items()):
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
        ax.plot(recording["time"], cops[:, k, 1], color=c, label=look.words[name])
    ax.plot(recording["time"], recording["com"].sel(com_axis="y") * MM, **COM_LINE)
    _limit(ax, recording)
    ax.set_ylabel("CoP y in the soles, world [mm]")
    put_legend(ax, [*_handles(look), Line2D([], [], label="CoM", **COM_LINE)])


def _limit(ax: Axes, recording: Recording) -> None:
    feet = [contact_origins(recording), *(s for s in world_soles(recording) if s is not None)]
    y = np.vstack(feet)[:, 1]
    room = 0.12 * max(float(np.ptp(y)), 10.0)
    ax.set_ylim(y.min() - room, y.max() + room)


def _draw_above(ax: Axes, recording: Recording, look: Looks) -> None:
    stood = _standing(recording)
    cops, margin = _world_cop(stood, "cop"), stood["margin"].values
    draw_ground(ax, world_soles(recording), contact_origins(recording))
    for k, c in enumerate(look.colour.values()):
        draw_track(ax, cops[:, k], ~(margin[:, k] < 0), c, 2.4)
    com = stood["com"].values[:, :2] * MM
    ax.plot(com[:, 1], com[:, 0], zorder=4, **COM_LINE)
    frame_ground(ax, world_soles(recording), contact_origins(recording), com)
    ax.set_title(f"from above{_before(recording)}")


def _draw_com(ax: Axes, recording: Recording) -> None:
    time = recording["time"]
    target, com = (recording[n].sel(com_axis="y") * MM for n in ("com_target", "com"))
    ax.plot(time, target, **STATIC_LINE)
    ax.plot(time, com, color="#1d2733")
    ax.set_ylabel("CoM y [mm]")
    span = np.concatenate([target.values, com.values])
    if np.ptp(span) < _STILL:  # rounding is not a motion
        ax.set_ylim(span.mean() - _STILL, span.mean() + _STILL)
    wide = Line2D([], [], label="asked for", **{**STATIC_LINE, "linewidth": 4.0})
    put_legend(ax, [wide, Line2D([], [], color="#1d2733", label="measured")])


def _draw_torques(ax: Axes, recording: Recording) -> None:
    motors = "motor" if "motor" in recording["torque"].dims else "joint"
    torque = recording["torque"].transpose("time", motors).values
    names = labels(recording, motors)
    ax.plot(recording["time"], torque, color=MUTED, linewidth=0.7, alpha=0.5)
    standing = _for_scale(recording)["torque"].transpose("time", motors).values
    largest = np.argsort(-np.abs(standing).max(axis=0))[:_MOST_NAMED]
    handles = []
    for c, j in zip(_CONTACTS, largest, strict=False):
        handles += ax.plot(recording["time"], torque[:, j], color=c, linewidth=1.4, label=names[j])
    reach = 1.15 * float(np.abs(standing).max()) + 0.1
    ax.set_ylim(-reach, reach)
    ax.set_ylabel("torque [Nm]")
    put_legend(ax, handles)


def _standing(recording: Recording) -> Recording:
    """The rows before the first tip that have contact forces."""
    return _loaded(recording.before_first_tip)


def _loaded(recording: Recording) -> Recording:
    """All rows but the first, which has no contact force yet."""
    time = recording["time"].values
    return recording if len(time) == 1 else recording.between(float(time[1]), np.inf)


def _for_scale(recording: Recording) -> Recording:
    """The rows that set a scale: the impacts of a fall would press the rest flat."""
    return _loaded(recording) if recording.completed else _standing(recording)


def _hip_roll(recording: Recording) -> str | None:
    rolls = [j for j in labels(recording, "joint") if "hip" in j.lower() and "roll" in j.lower()]
    return rolls[0] if rolls else None


def _draw_against(ax: Axes, recording: Recording, look: Looks, joint: str | None) -> None:
    """CoP y in each foot's frame against a joint or the CoM, the static prediction under it."""
    start = float(recording["com"].sel(com_axis="y").values[0])
    stood = _standing(recording)
    x, label = stood["com"].sel(com_axis="y").values * MM, f"CoM y{_before(recording)} [mm]"
    if joint is not None:
        x = stood["joint_position"].sel(joint=joint).values * DEG
        label = f"{joint}{_before(recording)} [deg]"
    styles = line_styles(list(look.colour))
    if not np.any(np.isfinite(recording["margin"])):
        _draw_loads(ax, stood, look, x)
        ax.set_xlabel(label)
        return
    if "static_cop" in recording:
        there = (recording["static_travel"].values + start) * MM
        if joint is not None:
            there = recording["static_joint"].sel(joint=joint).values * DEG
        within = (there >= x.min() - 0.5) & (there <= x.max() + 0.5)
        for k in range(len(look.colour)):
            cop = np.where(within, recording["static_cop"].values[:, k, 1] * MM, np.nan)
            ax.plot(there, cop, **STATIC_LINE)
    for k, (name, c) in enumerate(look.colour.items()):
        cop = stood["cop"].values[:, k, 1] * MM
        ax.plot(x, cop, color=c, linewidth=1.3, linestyle=styles[name])
    edges = _local_edges(stood)
    for k, found in edges.items():
        for edge in found:
            ax.axhline(edge, **{**EDGE_LINE, "color": list(look.colour.values())[k]})
    if edges:
        reach = 1.15 * float(np.abs(list(edges.values())).max())
        ax.set_ylim(-reach, reach)
    ax.set_xlabel(label)
    ax.set_ylabel("CoP y in the foot's frame [mm]")
    handles = [
        Line2D([], [], color=c, linestyle=styles[n], label=look.words[n])
        for n, c in look.colour.items()
    ]
    if "static_cop" in recording:
        handles.append(Line2D([], [], label="static", **{**STATIC_LINE, "linewidth": 4.0}))
    if edges:
        handles.append(Line2D([], [], label="sole's edges", **EDGE_LINE))
    put_legend(ax, handles)


def _draw_loads(ax: Axes, stood: Recording, look: Looks, x: Float[np.ndarray, " N"]) -> None:
    """The loads of points, whose centres of pressure do not move."""
    styles, share = line_styles(list(look.colour)), 100.0 / float(stood.attrs["weight"])
    loads = stood["wrench"].sel(component="fz").values * share
    handles = [
        ax.plot(x, load, color=c, linestyle=styles[name], label=look.words[name])[0]
        for load, (name, c) in zip(loads.T, look.colour.items(), strict=True)
    ]
    ax.set_ylim(-5.0, 1.15 * float(max(np.nanmax(loads), 10.0)))
    ax.set_ylabel("normal force [% of the weight]")
    put_legend(ax, handles)


def _local_edges(stood: Recording) -> dict[int, tuple[float, float]]:
    """Contact -> where its sole ends to the right and left of its CoPs, in its own frame [mm]."""
    found: dict[int, tuple[float, float]] = {}
    if "sole_polygon" not in stood:
        return found
    for k, polygon in enumerate(stood["sole_polygon"].values):
        sole = unpadded(polygon * MM)
        if sole is None:
            continue
        x = stood["cop"].values[:, k, 0]
        middle = float(np.median(x[np.isfinite(x)])) * MM if np.any(np.isfinite(x)) else 0.0
        whole = float(sole.vertices[:, 1].min()), float(sole.vertices[:, 1].max())
        found[k] = sole.section("y", middle) or whole
    return found
