"""gravity: that of an MJCF, or the Earth's where the file has none."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

STANDARD_GRAVITY = (0.0, 0.0, -9.81)  # m/s^2: MuJoCo's own default
_TILTED = 1e-6  # of gravity's size: what is less is rounding


def usable_gravity(
    gravity: Float[np.ndarray, " 3"],
) -> tuple[Float[np.ndarray, " 3"], tuple[str, ...]]:
    """The gravity to use (3,) [m/s^2], and what to know about it."""
    numbers = " ".join(f"{g:g}" for g in gravity)
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return np.array(STANDARD_GRAVITY), (
            "the file turns gravity off: 9.81 m/s^2 straight down is used; without weight there "
            "is no load to share.",
        )
    if gravity[2] > 0 or np.abs(gravity[:2]).max() > _TILTED * size:
        return gravity, (
            f"gravity in the file is {numbers} m/s^2, not straight down: the weight acts along it, "
            "while the ground is level and z is up.",
        )
    return gravity, ()
