"""Heights: whether a map loses postures because of how high the robot is to stand."""

from __future__ import annotations

import numpy as np

from copsense.batch import PostureChart
from copsense.errors import UnreachablePostureError
from copsense.maps.sampling import Grid, Sampling
from copsense.stance import Stance

_TRIED = 64  # postures of the map
_LOST = 0.1  # share of them that may be out of reach without a note
_HEIGHTS = ("com_z", "base_z")
_LOWER = (0.98, 0.95, 0.92, 0.88, 0.84)  # of the CoM's height


def check_heights(stance: Stance, sampling: Sampling) -> None:
    """Reject heights that are meant from the stance's own: they begin under its feet.

    Raises:
        UnreachablePostureError: the CoM or the base is to go from the ground or below it to less
            than half as high as it stands.
    """
    ground = float(min(place.translation[2] for place in stance.placements))
    for axis in sampling.axes:
        if axis.name not in _HEIGHTS:
            continue
        own = float(PostureChart(stance, (axis.name,), compiled=False).values[0])
        low, high = sorted((axis.start, axis.stop))
        if low <= ground and high < ground + (own - ground) / 2:
            raise UnreachablePostureError(
                f"{axis.name} is the height over the world's origin, {low * 1e3:.0f} to "
                f"{high * 1e3:.0f} mm is at the feet of {stance.robot.name!r}, and the stance has "
                f"{own * 1e3:.0f} mm. Give heights, such as --over {axis.name}="
                f"{(own + low) * 1e3:.0f}mm:{(own + high) * 1e3:.0f}mm."
            )


def height_advice(stance: Stance, sampling: Sampling) -> str:
    """Advise to map over a lower height, where the stance's own puts postures out of reach.

    Coordinates that are not named keep the stance's value. If the height is one of them, a robot
    on nearly straight legs cannot reach postures that would stretch them. Tries a few postures of
    the map, and those out of reach again with the CoM lower.

    Returns:
        One sentence; empty where height is named, few postures are lost, or lower ones are too.
    """
    names = sampling.names
    if stance.robot.base_nv != 6 or set(_HEIGHTS) & set(names):
        return ""
    rows = np.unique(np.linspace(0, len(sampling) - 1, _TRIED).round().astype(np.int64))
    values = np.vstack([sampling.values(int(i), int(i) + 1) for i in rows])
    lost = values[~PostureChart(stance, names).solve(values).converged]
    if len(lost) < _LOST * len(values):
        return ""
    lower, height = PostureChart(stance, (*names, "com_z")), float(stance.com[2])
    reached = [
        int(
            lower.solve(np.column_stack([lost, np.full(len(lost), share * height)])).converged.sum()
        )
        for share in _LOWER
    ]
    best = int(np.argmax(reached))
    if 2 * reached[best] < len(lost):
        return ""
    z = _LOWER[best] * height
    example = f"{z:.3f}:{z:.3f}:1" if isinstance(sampling, Grid) else f"{0.99 * z:.3f}:{z:.3f}"
    return (
        f"of {len(values)} postures tried, {len(lost)} cannot be reached at the height kept (CoM "
        f"at {height:.3f} m), and {reached[best]} of these can with the CoM at {z:.3f} m. To "
        f"reach them, map over the height too: --over com_z={example}"
    )
