"""identify: the best of each family beside the paper's two, by cross-validated error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.arrays import owned
from copsense.content import ShortRepr, freeze
from copsense.criterion import minimum_torque, minimum_wrench
from copsense.design import Family
from copsense.identification.families import identifiable, identifiable_named
from copsense.identification.fitting import Progress, cross_validated, fit_family
from copsense.identification.measurements import Measurements
from copsense.identification.parameter_fit import ParameterFit
from copsense.json_data import json_data
from copsense.logs.finding import Finding

_SAME = 0.02  # of an error: less is not a difference


@dataclass(frozen=True, eq=False, repr=False)
class Identification(ShortRepr):
    """What explains a robot's measurements.

    Attributes:
        robot: its name.
        rows: how many were fitted.
        inertia: whether the motion's inertia is in the loads.
        channels: what was measured.
        fits: family -> its best.
        errors: criterion or family -> cross-validated error, in shares of each channel's own
            spread, root mean square over the channels; smallest first.
        channel_errors: the same by channel (c,), each in its unit.
        findings: of the log that was identified, what it lacks or gets wrong.
        notes: how the log was read, and what the intervals have in them.
    """

    robot: str
    rows: int
    inertia: bool
    channels: tuple[str, ...]
    fits: Mapping[str, ParameterFit]
    errors: Mapping[str, float]
    channel_errors: Mapping[str, Float[np.ndarray, " c"]]
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the mappings and the arrays in them."""
        owned_errors = {name: owned(errors) for name, errors in self.channel_errors.items()}
        object.__setattr__(self, "channel_errors", owned_errors)
        freeze(self, "fits", "errors", "channel_errors")

    @property
    def best(self) -> tuple[str, ...]:
        """Criteria and families whose error is within 2 % of the smallest."""
        least = min(self.errors.values())
        return tuple(name for name, e in self.errors.items() if e <= least * (1 + _SAME))

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense identify --json`` prints: plain data, None for what is not a number."""
        data = {
            "robot": self.robot,
            "rows": self.rows,
            "inertia": self.inertia,
            "channels": list(self.channels),
            "fits": {name: fit.to_dict() for name, fit in self.fits.items()},
            "cross_validated": {
                name: {"error": e, "channels": self.channel_errors[name].tolist()}
                for name, e in self.errors.items()
            },
            "best": list(self.best),
            "findings": [finding.to_dict() for finding in self.findings],
            "notes": list(self.notes),
        }
        return dict(json_data(data))

    def __str__(self) -> str:
        """The table of ``copsense identify``."""
        how = "with the recorded motion's inertia" if self.inertia else "at rest"
        shown = ", ".join(self.channels[:4]) + (", ..." if len(self.channels) > 4 else "")
        many = len(self.channels)
        channels = f"{many} channel" + "s" * (many != 1)
        lines = [
            f"{self.robot}: {self.rows} rows {how}; {channels}: {shown}",
            "cross-validated error, of each channel's own spread:",
        ]
        for name, error in self.errors.items():
            lines.append(f"  {name}: {error:.4f}")
            if name not in self.fits:
                continue
            fit = self.fits[name]
            lines += [f"    {parameter}: {e}" for parameter, e in fit.estimates.items()]
            values = ", ".join(f"{s:.3g}" for s in fit.singular_values)
            lines.append(f"    singular values {values}; {fit.effective:.0f} independent rows")
            lines += [f"    not seen: {text}" for text in fit.unseen_text]
            if not fit.converged:
                lines.append(f"    did not settle in {fit.steps} steps")
        lines.append(f"best, within 2 %: {', '.join(self.best)}")
        return "\n".join(lines)


def identify(
    measurements: Measurements,
    families: Sequence[Family | str] | None = None,
    *,
    progress: Progress = lambda _: None,
) -> Identification:
    """Which criterion of some families explains measurements, beside the paper's two.

    A common scale of the weights is never visible: the last joint group counts 1.

    Args:
        measurements: what was measured, and where.
        families: by name (``"length"``, ``"mix"``, ``"joints"``, ``"stiffness"``) or families of
            one's own; default all of these that the robot has.
        progress: called with the rows evaluated.

    Raises:
        UnknownNameError: no such family.
        CopsenseError: a family has no answer at a posture.
    """
    stance = measurements.stances[0]
    chosen = list(identifiable(stance).values()) if families is None else list(families)
    wanted = [f if isinstance(f, Family) else identifiable_named(stance, f) for f in chosen]
    fits, found = {}, {}
    for family in wanted:
        fit = fit_family(family, measurements, progress=progress)
        fits[family.name] = fit
        start = [
            min(max(low if np.isnan(e.value) else e.value, low), high)
            for e, (low, high) in zip(fit.estimates.values(), family.bounds, strict=True)
        ]
        found[family.name] = cross_validated(
            lambda rows, family=family, start=start: (
                fit_family(  # type: ignore[misc]
                    family, rows, start, progress=progress
                ).criterion
            ),
            measurements,
        )
    for criterion in (minimum_torque(), minimum_wrench(1.0)):
        found[criterion.name] = cross_validated(lambda _, c=criterion: c, measurements)  # type: ignore[misc]
    order = sorted(found, key=lambda name: found[name][0])
    return Identification(
        stance.robot.name,
        len(measurements.stances),
        stance.motion is not None,
        measurements.names,
        fits,
        {name: found[name][0] for name in order},
        {name: found[name][1] for name in order},
    )
