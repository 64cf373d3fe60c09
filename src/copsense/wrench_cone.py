"""Wrench cone: the wrenches that friction at a sole's vertices can make up."""

from __future__ import annotations

from functools import cache

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.polygon import Polygon

_ROUNDING = 1e-9  # m


@cache
def unit_cone(sole: Polygon, mu: float, sides: int) -> tuple[Float[np.ndarray, " 6"], ...]:
    """Face normals of the wrench cone; each vertex pushes with f_z = 1 along the pyramid's edges.

    Their section at f_z = 1 is a polytope over (fx, fy, mx, my, mz); a face of it,
    n . w + offset <= 0, is a face n . w + offset f_z <= 0 of the cone (Caron et al. 2015).
    """
    if mu == 0:
        raise InvalidInputError(
            "without friction there is no wrench cone: use friction and CoP rows."
        )
    from scipy.spatial import ConvexHull, QhullError  # slow to import, and seldom needed

    angles = 2 * np.pi * np.arange(sides) / sides
    points = [
        (fx := mu * np.cos(t), fy := mu * np.sin(t), y, -x, x * fy - y * fx)
        for x, y in sole.vertices.tolist()
        for t in angles
    ]
    array = np.array(points)
    # Where Qhull takes little friction for a flat direction, each axis in its own size helps; where
    # rounding has it merge facets of so regular a section wrongly, looking from elsewhere does.
    own_size = np.diag(1.0 / np.abs(array).max(axis=0))
    turns = np.random.default_rng(0).normal(size=(4, 5, 5))
    for view in (np.eye(5), own_size, *(np.linalg.qr(turn)[0] @ own_size for turn in turns)):
        try:
            faces = np.unique(np.round(ConvexHull(array @ view.T).equations, 12), axis=0)
        except QhullError:
            continue
        faces[:, :5] = faces[:, :5] @ view
        faces /= np.linalg.norm(faces[:, :5], axis=1, keepdims=True)
        if (array @ faces[:, :5].T + faces[:, 5]).max() < _ROUNDING:
            return tuple(np.insert(faces[:, :5], 2, faces[:, 5], axis=1))
    raise InvalidInputError(
        f"the wrench cone of so thin a sole (friction {mu:g}) could not be computed. Use friction, "
        "CoP and torsion rows."
    )
