"""Where the contacts stand, as variables that sweeps and recordings share."""

from __future__ import annotations

from typing import Any

import numpy as np

from copsense.polygon import padded
from copsense.stance import Stance

CONVENTIONS = (
    "SI units, radians, world z up; wrenches are what the environment does to the robot, force "
    "first; base velocity in the base's frame"
)


def ground_variables(stance: Stance) -> dict[str, Any]:
    """Contact frames in the world, and soles in contact axes: name -> (dimensions, values, words).

    Soles with fewer vertices than others repeat their last one; a contact without a sole has NaN.
    """
    places = stance.placements
    found: dict[str, Any] = {
        "contact_position": (
            ("contact", "com_axis"),
            np.array([p.translation for p in places]),
            {"units": "m", "long_name": "origin of the contact frame, world axes"},
        ),
        "contact_rotation": (
            ("contact", "com_axis", "contact_axis"),
            np.array([p.rotation for p in places]),
            {"units": "1", "long_name": "columns: contact axes in world axes"},
        ),
    }
    soles = [c.sole for c in stance.contacts]
    if any(soles):
        found["sole_polygon"] = (
            ("contact", "vertex", "axis"),
            padded(soles),
            {
                "units": "m",
                "long_name": "vertices of the sole, contact axes, last one repeated; NaN if none",
            },
        )
    return found
