"""Criteria: which of them the kernel serves, and their weights as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from copsense.batch.layout import Feet
from copsense.content import FrozenMapping
from copsense.criterion import Criterion, Quadratic
from copsense.stance import Stance
from copsense.statics import WrenchPolicy, policy_name

LEAST_WRENCH, LEAST_TORQUE, WEIGHTED = 0, 1, 2
_SINGULAR = 1e-12  # eigenvalue of the wrenches' weights, relative, that is none
_ROUNDING = 1e-12  # of a reference's pull, relative


class KernelCriteria(NamedTuple):
    """The criteria that a kernel serves.

    The reach of a weight matrix is how far from its diagonal it has entries: 0 where it is
    diagonal, -1 where it is zero.

    Attributes:
        column: where each stands among the results (nk,).
        kind: least wrench, least torque (one weight for all joints), or weighted (nk,).
        unit: the weight of all joints that a least torque leaves out (nk,); 1 for another.
        arm: L^2 of a least wrench (nk,); 0 for another.
        torque: weights of the support joints' torques (nk, ns, ns).
        torque_root: U, with U' U these weights.
        torque_reach: of both (nk,).
        wrench: weights of the contacts' wrenches, contact axes (nk, 6 nc, 6 nc).
        wrench_root: U, with U' U these weights.
        wrench_reach: of both (nk,).
        reference: the wrenches that cost nothing (nk, 6 nc).
    """

    column: np.ndarray
    kind: np.ndarray
    unit: np.ndarray
    arm: np.ndarray
    torque: np.ndarray
    torque_root: np.ndarray
    torque_reach: np.ndarray
    wrench: np.ndarray
    wrench_root: np.ndarray
    wrench_reach: np.ndarray
    reference: np.ndarray


def kernel_criteria(
    stance: Stance, feet: Feet, criteria: Sequence[Criterion | WrenchPolicy]
) -> tuple[KernelCriteria, Mapping[str, str]]:
    """Those of some criteria that the kernel serves, and why it leaves each of the others."""
    left: dict[str, str] = {}
    served: list[tuple[int, Quadratic]] = []
    for index, criterion in enumerate(criteria):
        if not isinstance(criterion, Criterion):
            left[policy_name(criterion)] = "it is a policy"
            continue
        quadratic = criterion.at(stance)
        if why := _why_left(stance, feet, quadratic):
            left[str(criterion.name)] = why
        else:
            served.append((index, quadratic))
    nk, ns, m = len(served), len(feet.support), 6 * len(feet.body)
    found = KernelCriteria(
        column=np.array([index for index, _ in served], dtype=np.int64),
        kind=np.full(nk, WEIGHTED, dtype=np.int64),
        unit=np.ones(nk),
        arm=np.zeros(nk),
        torque=np.zeros((nk, ns, ns)),
        torque_root=np.zeros((nk, ns, ns)),
        torque_reach=np.full(nk, -1, dtype=np.int64),
        wrench=np.zeros((nk, m, m)),
        wrench_root=np.zeros((nk, m, m)),
        wrench_reach=np.full(nk, -1, dtype=np.int64),
        reference=np.zeros((nk, m)),
    )
    for i, (_, quadratic) in enumerate(served):
        _enter(found, i, stance, feet, quadratic)
    return found, FrozenMapping(left)


def _why_left(stance: Stance, feet: Feet, quadratic: Quadratic) -> str:
    """Why the kernel does not serve a criterion; empty where it does."""
    if quadratic.inertia:
        return "its torque weights follow the inertia"
    rest = np.setdiff1d(np.arange(len(quadratic.torque)), feet.support - 1)
    if np.any(quadratic.torque[np.ix_(feet.support - 1, rest)]):
        return "its torque weights couple joints between the contacts with others"
    W, pull = quadratic.wrench, quadratic.pull
    least, *_, most = np.linalg.eigvalsh(W)
    if not np.any(quadratic.torque) and not least > _SINGULAR * most:
        return "its weights leave wrenches to a tie-break"
    missing = np.abs(W @ _reference(quadratic) - pull)
    if np.any(missing > _ROUNDING * np.abs(pull).max(initial=0.0)):
        return "it has a preload that no wrench weights bear"
    return ""


def _enter(found: KernelCriteria, i: int, stance: Stance, feet: Feet, quadratic: Quadratic) -> None:
    """Write one criterion's numbers."""
    place = feet.support - 1
    torque, wrench = quadratic.torque[np.ix_(place, place)], quadratic.wrench
    weights = np.diag(quadratic.torque)
    if not np.any(wrench) and np.array_equal(quadratic.torque, weights[0] * np.eye(len(weights))):
        found.kind[i], found.unit[i] = LEAST_TORQUE, weights[0]
        torque = np.eye(len(place))
    if not np.any(quadratic.torque) and not np.any(quadratic.pull):
        arm = _arm(stance, wrench)
        if arm is not None:
            found.kind[i], found.arm[i] = LEAST_WRENCH, arm
    rows = np.concatenate([6 * k + np.array(c.components) for k, c in enumerate(stance.contacts)])
    found.torque[i], found.torque_root[i] = torque, _root(torque)
    found.wrench[i][np.ix_(rows, rows)] = wrench
    found.wrench_root[i][np.ix_(rows, rows)] = _root(wrench)
    found.reference[i, rows] = _reference(quadratic)
    found.torque_reach[i], found.wrench_reach[i] = _reach(found.torque[i]), _reach(found.wrench[i])


def _reference(quadratic: Quadratic) -> np.ndarray:
    """f_ref (m,) of the pull W_f f_ref; the nearest there is."""
    if not np.any(quadratic.pull):
        return np.zeros_like(quadratic.pull)
    return np.asarray(np.linalg.lstsq(quadratic.wrench, quadratic.pull)[0])


def _root(W: np.ndarray) -> np.ndarray:
    """U with U' U = W, diagonal where W is."""
    weights = np.diag(W)
    if np.array_equal(np.diag(weights), W):
        return np.diag(np.sqrt(weights))
    values, vectors = np.linalg.eigh(W)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


def _reach(W: np.ndarray) -> int:
    row, column = np.nonzero(W)
    if len(row) and np.any(row != column):
        return len(W) - 1  # its root may be full
    return 0 if len(row) else -1


def _arm(stance: Stance, W: np.ndarray) -> float | None:
    """L^2 where W is a norm of wrenches, 1 for forces and 1 / L^2 for moments; else None."""
    weights = np.diag(W)
    if np.any(np.diag(weights) != W):
        return None
    forces, moments = (
        weights[on] for on in (stance.component_index < 3, stance.component_index >= 3)
    )
    if np.any(forces != forces[0]) or np.any(moments != moments[:1]):
        return None
    # Points alone have no moments: any arm does.
    return float(forces[0] / moments[0]) if len(moments) else 1.0
