"""joint_models: Pinocchio's joint about or along an axis."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Float


def along(axis: Float[np.ndarray, " 3"], kind: Literal["R", "P"]) -> Any:
    """A hinge ("R") or slide ("P"), of Pinocchio's simpler kinds where the axis is one of them.

    Args:
        axis: direction in the joint's frame (3,), of any length but zero.
        kind: which of them.
    """
    for letter, unit in zip("XYZ", np.eye(3), strict=True):
        if np.array_equal(axis, unit):
            return getattr(pin, f"JointModel{kind}{letter}")()
    unaligned = {"R": pin.JointModelRevoluteUnaligned, "P": pin.JointModelPrismaticUnaligned}
    return unaligned[kind](axis / np.linalg.norm(axis))
