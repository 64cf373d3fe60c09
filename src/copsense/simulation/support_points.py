"""Supports: the points of a contact that meet the ground in a physics engine."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from copsense.contact import Contact, half_planes
from copsense.errors import InvalidInputError


def support_points(contact: Contact, detail: float) -> Float[np.ndarray, "k 2"]:
    """Points of a contact's plane, in the contact frame [m], that carry its wrench.

    The vertices of the sole's polygon, whose hull is the sole; a point contact is its origin.
    Vertices are left out, the least first, while none is more than `detail` [m] off the outline.

    Raises:
        InvalidInputError: a surface contact without polygon, or a planar one.
    """
    if contact.kind == "point":
        return np.zeros((1, 2))
    if contact.kind == "planar":
        raise InvalidInputError(
            f"contact {contact.name!r} is planar: a simulation is spatial. Use surface or point "
            "contacts."
        )
    if contact.polygon is None or len(contact.polygon) < 3:
        raise InvalidInputError(
            f"contact {contact.name!r} has no sole, so nothing that could stand on the ground. "
            "Give Contact(..., polygon=rectangle(...)) (--sole X0:X1:Y0:Y1)."
        )
    polygon, kept = contact.polygon, list(contact.polygon)
    while len(kept) > 3:
        # How far each vertex stands out of the line through its neighbours.
        corners = np.array(kept)
        before, along = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        along = (along - before) / np.linalg.norm(along - before, axis=1)[:, None]
        rest = corners - before
        least = int(np.argmin(np.abs(along[:, 0] * rest[:, 1] - along[:, 1] * rest[:, 0])))
        fewer = np.delete(corners, least, axis=0)
        normals, offsets = half_planes(fewer)
        if (polygon @ normals.T - offsets).max() > detail:
            break
        kept.pop(least)
    return np.array(kept)
