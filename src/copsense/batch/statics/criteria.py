"""Criteria: which of them the kernel serves, and their weights as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from copsense.criterion import Criterion, Quadratic
from copsense.stance import Stance
from copsense.statics import WrenchPolicy

LEAST_WRENCH, LEAST_TORQUE, WEIGHTED = 0, 1, 2


class KernelCriteria(NamedTuple):
    """The criteria that a kernel serves.

    Attributes:
        column: where each stands among the results (nk,).
        kind: least wrench, least torque (one weight for all joints), or weighted (nk,).
        joint: weight of each joint's torque; the first is the base's and unused (nk, n + 1).
        force: weight of every contact's force (nk,).
        moment: weight of every surface contact's moment (nk,).
    """

    column: np.ndarray
    kind: np.ndarray
    joint: np.ndarray
    force: np.ndarray
    moment: np.ndarray


def kernel_criteria(stance: Stance, criteria: Sequence[Criterion | WrenchPolicy]) -> KernelCriteria:
    """Those of some criteria that the kernel serves: diagonal torque weights, wrench norms."""
    column, kind, joint, force, moment = [], [], [], [], []
    for index, criterion in enumerate(criteria):
        if not isinstance(criterion, Criterion):
            continue
        quadratic = criterion.at(stance)
        norm = _norm(stance, quadratic)
        W = quadratic.torque
        weights = np.diag(W)
        if norm is None or quadratic.inertia or np.any(np.diag(weights) != W):
            continue
        torque, wrench = bool(np.any(weights > 0)), bool(norm[0] > 0 or norm[1] > 0)
        if not torque and not (norm[0] > 0 and norm[1] > 0):
            continue
        column.append(index)
        kind.append(
            LEAST_WRENCH
            if not torque
            else WEIGHTED
            if wrench or np.any(weights != weights[0])
            else LEAST_TORQUE
        )
        joint.append(np.append(0.0, weights))
        force.append(norm[0])
        moment.append(norm[1])
    n = len(stance.robot.torque_names)
    return KernelCriteria(
        np.array(column, dtype=np.int64),
        np.array(kind, dtype=np.int64),
        np.array(joint, dtype=float).reshape(-1, n + 1),
        np.array(force, dtype=float),
        np.array(moment, dtype=float),
    )


def _norm(stance: Stance, quadratic: Quadratic) -> tuple[float, float] | None:
    """Weights of forces and of moments where W_f is a norm of wrenches about zero, else None."""
    W, components = quadratic.wrench, stance.component_index
    weights = np.diag(W)
    if np.any(quadratic.pull != 0) or np.any(np.diag(weights) != W):
        return None
    forces, moments = weights[components < 3], weights[components >= 3]
    if np.any(forces != forces[0]) or (len(moments) and np.any(moments != moments[0])):
        return None
    # Points alone have no moments: any weight does.
    return float(forces[0]), float(moments[0]) if len(moments) else float(forces[0])
