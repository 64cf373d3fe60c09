"""Recording: what a rollout saw, and what is meant by before a tip, completed, tracked."""

from __future__ import annotations

import json
import math
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from copsense.errors import InvalidInputError
from copsense.json_data import json_data
from copsense.labelled import LabelledResult, tidy_table
from copsense.simulation.events import Event
from copsense.simulation.sway_comparison import compare_sway, sway_slopes

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from copsense.explore.showing import ShownPage
    from copsense.stance import Stance

SETTLING = 0.1  # s until the ground has taken up the weight evenly
_COLUMNS = (
    "com",
    "com_target",
    "com_velocity",
    "wrench",
    "wrench_command",
    "cop",
    "cop_command",
    "margin",
    "tilt",
    "torque",
    "torque_command",
    "joint_position",
    "joint_velocity",
)


class Recording(LabelledResult):
    """What `copsense.simulation.rollout` recorded, from the start to the end of the run.

    ``recording["cop"]`` is a labelled array over ``time`` and ``contact, axis, component, joint,
    com_axis``. A row is the state at its time and the wrenches of the step after it. A robot is
    judged by the part before the first contact tips, lifts or slips, `before_first_tip`: what is
    measured later, in a fall, says nothing about the controller.
    """

    _needs: ClassVar = ("time", "com", "com_target", "wrench", "cop", "torque", "tip_com")
    _needs_attributes: ClassVar = ("end_kind", "end_reason", "end_time", "tip_kind", "tip_time")
    _what: ClassVar = "a recording"
    _made_by: ClassVar = "copsense.simulation.rollout"
    _command: ClassVar = "copsense balance ... --output FILE.nc"

    __slots__ = ()

    @property
    def end(self) -> Event:
        """How the run ended; its kind is ``"completed"`` where nothing ended it early."""
        attributes = self.attrs
        kind, reason = str(attributes["end_kind"]), str(attributes["end_reason"])
        return Event(kind, float(attributes["end_time"]), reason)

    @property
    def tip(self) -> Event | None:
        """The first contact that tipped, lifted or slipped; None where every contact stood."""
        attributes = self.attrs
        if not attributes["tip_kind"]:
            return None
        return Event(
            str(attributes["tip_kind"]),
            float(attributes["tip_time"]),
            str(attributes.get("tip_reason", "")),
            str(attributes.get("tip_contact", "")),
        )

    @property
    def completed(self) -> bool:
        """Whether the run went to the scenario's end, on whichever contacts."""
        return self.end.kind == "completed"

    @property
    def before_first_tip(self) -> Recording:
        """The rows whose step ended before the first contact tipped, or with it; else all.

        The first row is kept where the contact tipped in its very step.
        """
        tip = self.tip
        if tip is None:
            return self
        time = self["time"].values
        return self._rows((time < tip.time) | (time == time[0]))

    @property
    def settled(self) -> Recording:
        """The rows from `SETTLING` on, when the ground has taken up the weight.

        A shorter recording has all its rows but the first, which has no contact force yet.
        """
        time = self["time"].values
        late = time >= time[0] + SETTLING
        if np.count_nonzero(late) < 2 and len(time) > 1:
            late = np.arange(len(time)) > 0
        return self._rows(late) if np.any(late) else self

    @property
    def tracking_error(self) -> float:
        """Root mean square of CoM y minus its target before the first tip [m]."""
        return float(np.sqrt(np.mean(self._error_y() ** 2)))

    @property
    def tracking_peak(self) -> float:
        """Largest distance of CoM y from its target before the first tip [m]."""
        return float(np.abs(self._error_y()).max())

    @property
    def tip_travel(self) -> float:
        """CoM y from its start when the first contact tipped [m]; NaN where none did."""
        return float(self["tip_com"].sel(com_axis="y") - self["com"].sel(com_axis="y")[0])

    @property
    def smallest_margin(self) -> dict[str, float]:
        """Contact -> smallest distance of its CoP to the sole's edge before the first tip [m].

        NaN for a contact without a sole, or that never carried load.
        """
        margin = self.before_first_tip["margin"].min("time")
        return dict(zip(self.labels("contact"), map(float, margin.values), strict=True))

    @property
    def torque_norm(self) -> float:
        """Mean over time of the norm of the torques before the first tip [Nm]."""
        torque = self.before_first_tip["torque"]
        return float(((torque**2).sum(str(torque.dims[1])) ** 0.5).mean())

    @property
    def torque_peak(self) -> float:
        """Largest torque of any motor before the first tip [Nm]."""
        return float(abs(self.before_first_tip["torque"]).max())

    def between(self, start: float, stop: float) -> Recording:
        """The rows from one time to another, both included [s].

        Raises:
            InvalidInputError: there is no row in between.
        """
        time = self["time"].values
        rows = (time >= start) & (time <= stop)
        if not rows.any():
            raise InvalidInputError(
                f"the recording has no row from {start:g} to {stop:g} s: it goes from {time[0]:g} "
                f"to {time[-1]:g} s, a row every {np.diff(time).max(initial=0.0):g} s. Give two "
                "times of these, the earlier first."
            )
        return self._rows(rows)

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense balance --json`` prints: plain data, None for what is not a number.

        How it ended, and tracking [m], margins [m] and torques [Nm] before the first tip, beside
        the static prediction; without one its texts are empty.
        """
        attributes, end, tip = self.attrs, self.end, self.tip
        data: dict[str, Any] = {
            "robot": attributes.get("robot", ""),
            "controller": attributes.get("controller", ""),
            "end": {"kind": end.kind, "reason": end.message, "time": end.time},
            "likely_cause": attributes.get("likely_cause", ""),
            "com_error_rms": self.tracking_error,
            "com_error_peak": self.tracking_peak,
            "smallest_margin": self.smallest_margin,
            "torque_norm_mean": self.torque_norm,
            "torque_peak": self.torque_peak,
            "first_tip": None
            if tip is None
            else {
                "contact": tip.contact,
                "reason": tip.message,
                "time": tip.time,
                "com_y_from_start": self.tip_travel,
            },
            "static_prediction": {
                "excursion": attributes.get("static_excursion"),
                "contact": attributes.get("static_contact", ""),
                "how": attributes.get("static_how", ""),
                "reach": attributes.get("static_reach"),
                "statement": attributes.get("static_statement", ""),
            },
            "quasi_static": {
                name: attributes.get(f"quasi_static_{name}")
                for name in ("lever", "excess", "share", "frequency")
            },
            "static_frequencies": json.loads(attributes.get("static_frequencies", "{}")),
            "sway": {"range": compare_sway(self), "slope": sway_slopes(self)},
            "notes": list(self.notes),
        }
        return dict(json_data(data))

    def to_pandas(self) -> pd.DataFrame:
        """A tidy table: a row per time and contact."""
        return tidy_table(self._dataset, ("time", "contact"), ("time", "contact"), _COLUMNS)

    def plot(self) -> Figure:
        """The recording on one page, `copsense.plots.plot_rollout`."""
        from copsense.plots import plot_rollout

        return plot_rollout(self)

    def show(self, stance: Stance) -> ShownPage:
        """A film in 3-D on the stance it was made of, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self, stance)

    def __repr__(self) -> str:
        """Robot, controller, how it ended, tracking and margins."""
        return "\n".join([f"<copsense.Recording of {self._heading()}", *self._lines()]) + ">"

    def _repr_html_(self) -> str:
        """The same with xarray's own view folded away, for notebooks."""
        lines = "".join(f"<div>{escape(line)}</div>" for line in self._lines())
        return (
            f"<div><strong>Recording of {escape(self._heading())}</strong>{lines}"
            f"<details><summary>dataset</summary>{self._dataset._repr_html_()}</details></div>"
        )

    def _heading(self) -> str:
        attributes = self.attrs
        return (
            f"{attributes.get('robot', 'a robot')} under "
            f"{attributes.get('controller', 'a controller')}, {self.end.time:.2f} s"
        )

    def _lines(self) -> list[str]:
        """What the representation says under its heading."""
        tip, end = self.tip, self.end
        lines = [f"  end: {end.message}"]
        if self.attrs.get("likely_cause"):
            lines.append(f"  likely cause: {self.attrs['likely_cause']}")
        if tip is not None:
            lines.append(
                f"  first {tip.kind} at {tip.time:.2f} s, CoM y {self.tip_travel * 1e3:+.1f} mm "
                f"from the start: {tip.message}"
            )
        lines.append(
            f"  CoM y error {self.tracking_error * 1e3:.3f} mm rms, "
            f"{self.tracking_peak * 1e3:.3f} mm at most"
        )
        known = {n: m for n, m in self.smallest_margin.items() if math.isfinite(m)}
        if known:
            least = min(known, key=known.__getitem__)
            lines.append(f"  smallest margin {known[least] * 1e3:+.1f} mm, of {least}")
        return lines

    def _error_y(self) -> np.ndarray:
        stood = self.before_first_tip
        error = stood["com"] - stood["com_target"]
        return np.asarray(error.sel(com_axis="y").values)

    def _rows(self, flags: np.ndarray) -> Recording:
        return Recording(self._dataset.isel(time=np.flatnonzero(flags)))
