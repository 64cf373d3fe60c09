"""robust_com_travel: what a model's errors leave of the first-order CoM travel of a posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from copsense.sensitivity import CopSensitivity
from copsense.uncertainty.source import Source
from copsense.uncertainty.source_changes import change_of


def robust_com_travel(
    sensitivity: CopSensitivity, sources: Sequence[Source], sigmas: float
) -> tuple[Float[np.ndarray, " nc"], Float[np.ndarray, " nc"]]:
    """What is left of `CopSensitivity.com_travel` of each contact, likely and at worst [m].

    The slack of an edge less what the errors take of it, over how fast the CoM uses it up. For one
    posture `propagate_uncertainty` has the exact travel; this is for many.

    Args:
        sensitivity: of a criterion's own wrenches at a posture.
        sources: what may be off, such as those of `sources_of`.
        sigmas: how many standard deviations.

    Returns:
        Along the worst direction of the ellipsoid of errors (nc,), and where every source is off
        its worst way (nc,). Negative where the contact may tip as it stands.
    """
    equilibrium = sensitivity.equilibrium
    stance, rows = equilibrium.stance, equilibrium.stance.edge_rows
    slack = rows.dot(equilibrium.wrenches.reshape(-1))
    forces, _ = equilibrium.response(change_of(stance, sources))
    deviations = sigmas * np.array([source.deviation for source in sources])
    taken = rows.dot(stance.unstack(forces).reshape(-1, len(sources))) * deviations
    likely = sensitivity.slack_travel(slack - np.linalg.norm(taken, axis=1))[0]
    return likely, sensitivity.slack_travel(slack - np.abs(taken).sum(axis=1))[0]
