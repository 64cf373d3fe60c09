"""LogComparison: what was measured beside what every criterion says, row by row and as slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from copsense.content import FrozenMapping, freeze
from copsense.cop import load_shares
from copsense.errors import UnknownNameError
from copsense.json_data import json_data
from copsense.logs.finding import Finding
from copsense.logs.log import Log
from copsense.logs.log_statics import LogStatics, loaded_cops
from copsense.logs.sway_fit import SlopeEstimate, Sway
from copsense.posture_run import PostureRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from copsense.explore.showing import ShownPage

MEASURED = "measured"


@dataclass(frozen=True, eq=False, repr=False)
class LogComparison:
    """A log beside the criteria.

    Attributes:
        log: the log.
        robot: the robot's name.
        weight: of the model [N].
        contact_names: the contacts, in order.
        torque_names: the motors, in order.
        base: ``"feet"`` or ``"recorded"``: what put the base in place.
        window: length of the smoothing filter [s].
        times: rows that are compared (M,) [s].
        com: centre of mass (M, 3), world of the first contact [m].
        travel: of the centre of mass along the line from the last to the first foot (M,) [m]; with
            other than two feet along its widest motion.
        distance: of the two feet along the ground [m]; None with more or fewer.
        wrenches: measured, of the ground on each contact (M, nc, 6) [N, Nm]; NaN where not.
        torques: measured (M, n) [Nm]; None where the log has none.
        statics: what each criterion says, at rest and in motion.
        sway: how the centre of mass moved; None where it stood still.
        slopes: output -> source -> slope. Outputs: ``"load"`` (share of the first foot per travel,
            times `distance`) and ``"CoP x of NAME"``, ``"CoP y of NAME"`` (per travel); sources:
            ``"measured"`` and the names of `statics`.
        skipped: how long the log's beginning was left out of the slopes [s].
        encoders: standard deviation of each encoder's constant error that is in the intervals
            [rad]; 0 where it was left out.
        findings: what is missing or does not fit.
        notes: how it was done, a sentence each.
        run: the postures that are compared, with their motion.
    """

    log: Log
    robot: str
    weight: float
    contact_names: tuple[str, ...]
    torque_names: tuple[str, ...]
    base: str
    window: float
    times: Float[np.ndarray, " M"]
    com: Float[np.ndarray, "M 3"]
    travel: Float[np.ndarray, " M"]
    distance: float | None
    wrenches: Float[np.ndarray, "M nc 6"]
    torques: Float[np.ndarray, "M n"] | None
    statics: tuple[LogStatics, ...]
    sway: Sway | None
    slopes: Mapping[str, Mapping[str, SlopeEstimate]]
    skipped: float
    encoders: float
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    run: PostureRun

    def __post_init__(self) -> None:
        """Own the arrays."""
        inner = {output: FrozenMapping(of) for output, of in self.slopes.items()}
        object.__setattr__(self, "slopes", inner)
        freeze(self, "times", "com", "travel", "wrenches", "torques", "slopes")

    @property
    def shares(self) -> Float[np.ndarray, "M nc"]:
        """Measured share of each contact of the normal forces (M, nc)."""
        return load_shares(self.wrenches)

    @property
    def cops(self) -> Float[np.ndarray, "M nc 2"]:
        """Measured centre of pressure of each contact, its axes (M, nc, 2) [m]; NaN where not."""
        return loaded_cops(self.wrenches)

    def of(self, criterion: str, *, inertia: bool) -> LogStatics:
        """What a criterion says, at rest or in motion.

        Raises:
            UnknownNameError: it was not compared.
        """
        for found in self.statics:
            if found.criterion == criterion and found.inertia == inertia:
                return found
        names = dict.fromkeys(s.criterion for s in self.statics)
        raise UnknownNameError("criterion in the comparison", criterion, names)

    def errors(self, statics: LogStatics) -> dict[str, float]:
        """Root mean square of measured less predicted: load shares, CoPs [m], torques [Nm].

        The mean of the differences is taken off: a sensor's offset is not an error of a criterion.
        What was not measured is left out.
        """
        found = {"load_share": _spread(self.shares - statics.shares)}
        if np.isfinite(self.cops).any():
            found["cop"] = _spread(self.cops - statics.cops)
        if self.torques is not None:
            found["torque"] = _spread(self.torques - statics.torques)
        return found

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense log --json`` prints: plain data, None for what is not a number."""
        normal = self.wrenches[:, :, 2].sum(axis=1)
        sway = self.sway
        data: dict[str, Any] = {
            "log": self.log.source,
            "robot": self.robot,
            "duration": float(self.log.times[-1]),
            "rate": self.log.rate,
            "rows": len(self.log.times),
            "compared": len(self.times),
            "base": self.base,
            "smoothing": self.window,
            "skipped": self.skipped,
            "encoders": self.encoders,
            "weight": self.weight,
            "normal_force": {"mean": float(normal.mean()), "deviation": float(normal.std())},
            "feet_distance": self.distance,
            "com_height": float(self.com[:, 2].mean()),
            "sway": None
            if sway is None
            else {
                "method": sway.method,
                "frequency": sway.frequency,
                "amplitude": sway.amplitude,
                "explained": sway.explained,
            },
            "slopes": {
                output: {source: slope.to_dict() for source, slope in of.items()}
                for output, of in self.slopes.items()
            },
            "errors": {s.name: self.errors(s) for s in self.statics},
            "findings": [f.to_dict() for f in self.findings],
            "notes": list(self.notes),
        }
        return dict(json_data(data))

    def plot(self) -> Figure:
        """The comparison on one page, `copsense.plots.plot_log`."""
        from copsense.plots import plot_log

        return plot_log(self)

    def show(self) -> ShownPage:
        """The log as a film in 3-D, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self)

    def __repr__(self) -> str:
        """Robot, sway and the slopes of the load."""
        lines = self._table({k: v for k, v in self.slopes.items() if k == "load"})
        return "\n".join([f"<copsense.logs.LogComparison of {self.heading}", *lines]) + ">"

    def __str__(self) -> str:
        """The command's tables."""
        return "\n".join([self.heading, *self.lines()])

    @property
    def heading(self) -> str:
        """Log, robot and how it moved, in a line."""
        text = f"{self.log.source} on {self.robot}: {self.log.times[-1]:.4g} s"
        if self.sway is not None and self.sway.method == "fundamental":
            text += f", sway of {self.sway.amplitude * 1e3:.1f} mm at {self.sway.frequency:.3f} Hz"
        if self.distance is not None:
            text += f", feet {self.distance * 1e3:.0f} mm apart"
        return text

    def lines(self) -> list[str]:
        """Tables of the slopes of the load, and of the CoPs that move with the sway."""
        return self._table(self.shown_slopes)

    def _table(self, slopes: Mapping[str, Mapping[str, SlopeEstimate]]) -> list[str]:
        if not slopes:
            return []
        width = max(len(source) for of in slopes.values() for source in of)
        lines = []
        for output, of in slopes.items():
            unit = f"{output} per CoM"
            if output == "load":
                unit = "load share per CoM travel x distance"
            lines.append(f"  {unit:<{width + 2}}   slope   95 % interval    phase   error rms")
            for source, slope in of.items():
                phase = "" if math.isnan(slope.phase) else f"{math.degrees(slope.phase):+6.1f} deg"
                error = self.error_text(output, source)
                lines.append(
                    f"    {source:<{width}} {slope.value:8.3f}   "
                    f"[{slope.low:.3f}, {slope.high:.3f}] {phase:>11}   {error}"
                )
        return lines

    @property
    def shown_slopes(self) -> dict[str, Mapping[str, SlopeEstimate]]:
        """The slopes, those of CoPs along one axis of the contacts: where they are largest."""
        of_cops = {k: v for k, v in self.slopes.items() if k != "load"}
        size = {
            axis: max(
                (abs(s.value) for k, v in of_cops.items() if k[4] == axis for s in v.values()),
                default=0.0,
            )
            for axis in "xy"
        }
        axis = max(size, key=size.__getitem__)
        return {k: v for k, v in self.slopes.items() if k == "load" or k[4] == axis}

    def error_text(self, output: str, source: str) -> str:
        """The error of a source's prediction of an output, as the table has it; may be empty."""
        if source == MEASURED:
            return ""
        found = self.errors(next(s for s in self.statics if s.name == source))
        if output == "load":
            return f"{found['load_share']:.4f}"
        return f"{found['cop'] * 1e3:.2f} mm" if "cop" in found else ""


def _spread(difference: np.ndarray) -> float:
    """Root mean square about the mean of each column, of the numbers that are there."""
    known = np.isfinite(difference).any(axis=0)
    if not known.any():
        return math.nan
    columns = difference[:, known]
    return float(np.sqrt(np.nanmean((columns - np.nanmean(columns, axis=0)) ** 2)))
