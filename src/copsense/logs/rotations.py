"""Rotations as logs write them, as unit quaternions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.errors import InvalidInputError

_LENGTH = 0.1  # by which a quaternion's length may miss 1
_STRAIGHT = 0.05  # by which a matrix may miss being a rotation


def rotation_quaternions(
    rows: Float[np.ndarray, "N k"], representation: str
) -> Float[np.ndarray, "N 4"]:
    """Rotations as unit quaternions (x, y, z, w) that do not jump to their negative; NaN stays."""
    found = np.full((len(rows), 4), np.nan)
    for i in np.flatnonzero(np.isfinite(rows).all(axis=1)):
        row = rows[i]
        if representation in ("xyzw", "wxyz"):
            four = row if representation == "xyzw" else np.roll(row, -1)
            length = float(np.linalg.norm(four))
            if abs(length - 1.0) > _LENGTH:
                raise InvalidInputError(
                    f"the base's quaternion has length {length:.3g}, and a rotation's is 1. Check "
                    "the columns and the representation under [base]."
                )
            found[i] = four / length
            continue
        if representation == "matrix":
            R = row.reshape(3, 3)
            if np.abs(R @ R.T - np.eye(3)).max() > _STRAIGHT:
                raise InvalidInputError(
                    "the base's rotation matrix is not one. Check the columns under [base]."
                )
        else:
            angles = np.radians(row) if representation == "rpy_deg" else row
            R = pin.rpy.rpyToMatrix(angles[::-1] if representation == "ypr" else angles)
        found[i] = pin.Quaternion(R).normalized().coeffs()
    known = np.flatnonzero(np.isfinite(found[:, 0]))
    for before, i in pairwise(known):
        if found[before] @ found[i] < 0:
            found[i] *= -1
    return found
