"""The rows of a sweep whose postures are instants of a sway along its path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion
from copsense.errors import CopsenseError, UndeterminedWrenchError
from copsense.limits import Limits
from copsense.path import PosturePath
from copsense.sensitivity import CopSensitivity, cop_rates, cop_sensitivity
from copsense.stance import Stance
from copsense.statics import WrenchPolicy, solve_equilibrium, with_tie_break
from copsense.sway_levers import SwayLever, lever_outputs, sway_levers
from copsense.sweep_layout import SweepRows
from copsense.timed_path import Instant, Sway

if TYPE_CHECKING:
    import xarray as xr


def passing_instant(
    sway: Sway | None, path: PosturePath, i: int, rows: SweepRows
) -> tuple[Sway, Instant] | None:
    """A posture as the sway passes it; the reason of its rows where that is not known."""
    if sway is None or i in path.failures:
        return None
    try:
        return sway, sway.at(float(path.values[i]))
    except CopsenseError as error:
        rows.reason[i] = str(error)
        return None


def evaluate_row(
    path: PosturePath,
    i: int,
    criterion: Criterion | WrenchPolicy,
    limits: Limits | None,
    passing: tuple[Sway, Instant] | None,
) -> tuple[CopSensitivity, Float[np.ndarray, "nc 2"]]:
    """The sensitivity at a posture, at rest or as a sway passes it, and d CoP / d coordinate."""
    if passing is None:
        found = _sensitivity(path.stances[i], criterion, limits)
        return found, found.gradient @ path.tangents[i]
    sway, instant = passing
    found = _sensitivity(instant.stance, criterion, limits)
    equilibrium = found.equilibrium
    forces, _ = sway.rates(instant, equilibrium)
    return found, cop_rates(equilibrium, found.cop, equilibrium.stance.unstack(forces))


def with_sway(
    dataset: xr.Dataset,
    sway: Sway,
    criteria: Sequence[Criterion | WrenchPolicy],
    limits: Limits | None,
) -> xr.Dataset:
    """A sweep's dataset with what the sway was, and how far its statics reach."""
    assert sway.centre is not None
    levers: list[tuple[SwayLever, ...] | None] = []
    for criterion in criteria:
        try:
            middle, tangent = sway.path.at(sway.centre)
            levers.append(sway_levers(solve_equilibrium(middle, criterion, limits), tangent))
        except CopsenseError:  # the rows around it say why
            levers.append(None)
    outputs = lever_outputs(dataset["contact"].values.tolist())
    for name, unit, meaning in (
        ("lever", "m", "1 + w^2 lever / g is what a sway of frequency w does to the slope"),
        ("frequency", "Hz", "up to which the statics are within 5 % in a sway"),
    ):
        values = [
            [getattr(x, name) for x in each] if each else [np.nan] * len(outputs) for each in levers
        ]
        key = "sway_lever" if name == "lever" else "static_frequency"
        attributes = {"units": unit, "long_name": f"{meaning}, at the path's middle"}
        dataset[key] = (("criterion", "output"), np.array(values), attributes)
    title = str(dataset.attrs["title"]).replace("Static centre", "Centre")
    return dataset.assign_coords(output=list(outputs)).assign_attrs(
        title=f"{title} in a sway",
        period=sway.period,
        sway_centre=sway.centre,
        sway_amplitude=sway.amplitude,
    )


def _sensitivity(
    stance: Stance, criterion: Criterion | WrenchPolicy, limits: Limits | None
) -> CopSensitivity:
    """The sensitivity, with a tie-break in the criterion where it needs one."""
    try:
        return cop_sensitivity(stance, criterion, limits)
    except UndeterminedWrenchError:
        if not isinstance(criterion, Criterion):
            raise
        return cop_sensitivity(stance, with_tie_break(stance, criterion), limits)
