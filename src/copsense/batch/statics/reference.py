"""Reference: `cop_sensitivity`'s answers in a batch's arrays, one posture and criterion at a time.

It answers what the compiled kernel does not cover, and the kernel is tested against it.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from jaxtyping import Float

from copsense.batch.statics.batch_result import BatchResult, array_names, nothing
from copsense.batch.statics.limit_reference import solve_limited
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits
from copsense.sensitivity import cop_sensitivity, sensitivity_of
from copsense.stance import Stance
from copsense.statics import WrenchPolicy


def fill_row(
    stance: Stance,
    q: np.ndarray,
    criterion: Criterion | WrenchPolicy,
    result: BatchResult,
    row: int,
    column: int,
) -> str:
    """Fill one row of a result; the reason where that cannot be done, else nothing."""
    per_criterion = [name for name in array_names() if name != "com"]
    gains = len(result.com_gain) > 0
    try:
        here = stance.at(q, check=False)
        result.com[row] = here.com
        if result.limits is None:
            found = cop_sensitivity(stance.at(q), criterion)
        else:
            assert isinstance(criterion, Criterion)
            found = sensitivity_of(
                solve_limited(stance.at(q), criterion, result.limits, row, column)
            )
        values = {
            "wrenches": found.equilibrium.wrenches,
            "torques": found.equilibrium.torques,
            "cops": found.cop,
            "gradient": found.gradient,
            "margin": sole_margins(here, found.cop),
            "load_share": found.equilibrium.wrenches[:, 2] / stance.robot.weight,
        }
        if gains:
            values |= {
                "com_gain": found.com_gain,
                "com_travel": found.com_travel,
                "tipping_edge": found.tipping_edge,
                "unloading_travel": found.unloading_travel,
            }
    except CopsenseError as error:
        for name in per_criterion:
            if len(getattr(result, name)):
                getattr(result, name)[row, column] = nothing(name)
        return str(error)
    for name, value in values.items():
        getattr(result, name)[row, column] = value
    return ""


def sides(
    stance: Stance, criterion: Criterion | WrenchPolicy, limits: Limits
) -> Float[np.ndarray, "2 nc 2 2"]:
    """d cop / d CoM before and after a posture, NaN where no way was found on a side."""
    found = cop_sensitivity(stance, criterion, limits)
    gains = np.full((2, *found.com_gain.shape), np.nan)
    for n, side in enumerate((-1, 1)):
        for axis, motion in enumerate(found.com_motions.T):
            with suppress(InvalidInputError):
                gains[n, :, :, axis] = found.one_sided(motion, side=side)
    return gains


def sole_edges(stance: Stance) -> list[np.ndarray]:
    """Half-planes (a_x, a_y, b) of each contact's sole (e, 3); none where there is no sole."""
    return [
        np.column_stack([c.sole.normals, c.sole.offsets]) if c.sole else np.zeros((0, 3))
        for c in stance.contacts
    ]


def sole_margins(stance: Stance, cops: np.ndarray) -> np.ndarray:
    """Signed distance of each CoP to its sole's nearest edge (nc,); infinite without a sole."""
    pairs = zip(stance.contacts, cops, strict=True)
    return np.array([c.sole.margins(cop) if c.sole else np.inf for c, cop in pairs])
