"""Support points: where a contact touches the ground in a physics engine."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.polygon import Polygon


def support_points(contact: Contact, detail: float) -> Float[np.ndarray, "k 2"]:
    """Points (k, 2) in the plane of a contact that carry its wrench, contact frame [m].

    They are vertices of the sole's polygon; a point contact has its origin alone. The vertices that
    stand out least are left out first, as long as all of them stay within `detail` [m] of the
    outline.

    Raises:
        InvalidInputError: a surface contact without a polygon, or a planar contact.
    """
    if contact.kind == "point":
        return np.zeros((1, 2))
    if contact.kind == "planar":
        raise InvalidInputError(
            f"contact {contact.name!r} is planar, the simulation is spatial. Use surface or point "
            "contacts."
        )
    sole = contact.sole
    if sole is None or len(sole) < 3:
        raise InvalidInputError(
            f"contact {contact.name!r} has no sole to stand on. "
            "Give Contact(..., polygon=rectangle(...)) (--sole X0:X1:Y0:Y1)."
        )
    kept = list(sole.vertices)
    while len(kept) > 3:
        # How far each vertex stands out of the line through its neighbours.
        corners = np.array(kept)
        before, along = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        along = (along - before) / np.linalg.norm(along - before, axis=1)[:, None]
        rest = corners - before
        least = int(np.argmin(np.abs(along[:, 0] * rest[:, 1] - along[:, 1] * rest[:, 0])))
        fewer = np.delete(corners, least, axis=0)
        if -Polygon(fewer).margins(sole.vertices).min() > detail:
            break
        kept.pop(least)
    return np.array(kept)
