"""com_regions: the regions that limits leave to the CoM, one inside the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.regions.feasible_region import com_region
from copsense.regions.region import ComRegion
from copsense.regions.unclipped_region import criterion_region
from copsense.stance import Stance


def com_regions(
    stance: Stance, criteria: Sequence[Criterion], limits: Limits
) -> dict[str, ComRegion]:
    """Where the CoM may be over the ground, contacts and joints held at a posture.

    Args:
        stance: the posture.
        criteria: whose own wrenches are asked about.
        limits: what the wrenches and torques must respect.

    Returns:
        ``"friction and soles"``: an equilibrium exists within all but the torque limits;
        ``"and torque limits"``: within those too, where there are any; then each criterion's
        name: its own wrenches stay within all of them.
    """
    regions = {"friction and soles": com_region(stance, replace(limits, torque=None))}
    if limits.torque is not None:
        regions["and torque limits"] = com_region(stance, limits)
    return regions | {c.name: criterion_region(stance, c, limits) for c in criteria}
