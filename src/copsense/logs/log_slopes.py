"""log_slopes: how load shares and centres of pressure follow the centre of mass, per source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact
from copsense.cop import load_shares
from copsense.logs.log_statics import loaded_cops
from copsense.logs.sway_fit import LEAST, SlopeEstimate, Sway, fit_sway
from copsense.stance import Stance

Slopes = dict[str, dict[str, SlopeEstimate]]


def log_slopes(
    sway: Sway,
    times: Float[np.ndarray, " M"],
    travel: Float[np.ndarray, " M"],
    distance: float | None,
    sources: Mapping[str, Float[np.ndarray, "M nc 6"]],
    contacts: Sequence[Contact],
) -> Slopes:
    """Output -> source -> slope over the travel; load shares times the feet's distance.

    Args:
        sway: of this travel.
        times: [s].
        travel: of the centre of mass [m].
        distance: of the two feet [m]; None with more or fewer, whose loads have no slope.
        sources: name -> wrenches; rows that were not measured are left out.
        contacts: the contacts.
    """
    slopes: Slopes = {}

    def fit(output: str, source: str, values: np.ndarray, scale: float) -> None:
        known = np.isfinite(values)
        if known.sum() >= LEAST:
            found = fit_sway(sway, times[known], travel[known], values[known], scale)
            slopes.setdefault(output, {})[source] = found

    for source, wrenches in sources.items():
        if distance is not None:
            fit("load", source, load_shares(wrenches)[:, 0], distance)
    for k, contact in enumerate(contacts):
        for axis, letter in enumerate("xy"):
            for source, wrenches in sources.items():
                if contact.kind != "point":
                    values = loaded_cops(wrenches)[:, k, axis]
                    fit(f"CoP {letter} of {contact.name}", source, values, 1.0)
    return slopes


def com_travel(stance: Stance, com: Float[np.ndarray, "M 3"]) -> tuple[np.ndarray, float | None]:
    """CoM along the line from the last to the first of two feet, and the line's length."""
    ground = com[:, :2]
    if len(stance.contacts) == 2:
        first, last = (p.translation[:2] for p in stance.placements)
        line = first - last
        length = float(np.linalg.norm(line))
        if length > 1e-3:
            return (ground - (first + last) / 2) @ (line / length), length
    centred = ground - ground.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    if direction[int(np.argmax(np.abs(direction)))] < 0:
        direction = -direction
    return np.asarray(centred @ direction), None
