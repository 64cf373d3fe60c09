"""robust_com_travel: what a model's errors leave of the first-order CoM travel of a posture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from copsense.sensitivity import CopSensitivity
from copsense.uncertainty.source import Source
from copsense.uncertainty.source_changes import change_of


def robust_com_travel(
    sensitivity: CopSensitivity, sources: Sequence[Source], sigmas: float
) -> tuple[Float[np.ndarray, " nc"], Float[np.ndarray, " nc"]]:
    """How far errors let the CoM move before a contact tips or unloads, likely and at worst [m].

    What they leave of the lesser of `CopSensitivity.com_travel` and `unloading_travel`: the slack
    of an edge, or the load, less what the errors take of it, over how fast the CoM uses it up. For
    one posture `propagate_uncertainty` has the exact travel; this is for many.

    Args:
        sensitivity: of a criterion's own wrenches at a posture.
        sources: what may be off, such as those of `sources_of`.
        sigmas: how many standard deviations.

    Returns:
        Along the worst direction of the ellipsoid of errors (nc,), and where every source is off
        its worst way (nc,). Negative where the contact may tip or unload as it stands.
    """
    equilibrium = sensitivity.equilibrium
    stance, rows = equilibrium.stance, equilibrium.stance.edge_rows
    slack, loads = rows.dot(equilibrium.wrenches.reshape(-1)), equilibrium.wrenches[:, 2]
    forces, _ = equilibrium.response(change_of(stance, sources))
    deviations = sigmas * np.array([source.deviation for source in sources])
    changes = stance.unstack(forces) * deviations
    taken, load = rows.dot(changes.reshape(-1, len(sources))), changes[:, 2]

    def left(size: Callable[[np.ndarray], np.ndarray]) -> Float[np.ndarray, " nc"]:
        tips, _ = sensitivity.slack_travel(slack - size(taken))
        return np.minimum(tips, sensitivity.load_travel(loads - size(load)))

    return left(lambda a: np.linalg.norm(a, axis=1)), left(lambda a: np.abs(a).sum(axis=1))
