"""The system whose solution is the nearest posture: its cost, its constraints, their linearisation.

With h(q) = 0 the constraints, C = dh/dq, and g the gradient of the cost of what deviates from a
reference, the nearest posture has g + C' lambda = 0; Newton and all tangents solve

    [ H  C' ] [ dq      ]
    [ C  0  ] [ dlambda ]      H = d(g + C' lambda)/dq
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from copsense.arrays import finite_number
from copsense.errors import UnreachablePostureError
from copsense.stance import RANK_TOLERANCE, Stance

_PIVOT = 3e-6  # of the constraints' Cholesky factor, relative, from which they are independent
_RUNAWAY = 1e3  # rad or m, per unit requested, of a motion that is held but for rounding


@dataclass(frozen=True)
class PostureCost:
    """What a posture minimises, 1/2 sum w (deviation from the reference)^2, the base free to move.

    Attributes:
        base_rotation: weight of the base's rotation vector [1/rad^2].
        supporting: weight of each joint between a contact and the base.
        free: weight of every other joint, such as torso and arms.
    """

    base_rotation: float = 10.0
    supporting: float = 1.0
    free: float = 20.0

    def __post_init__(self) -> None:
        """Reject a weight that would leave a joint undetermined."""
        for name in ("base_rotation", "supporting", "free"):
            finite_number(getattr(self, name), f"the posture weight {name}", positive=True)


def supporting_joints(stance: Stance) -> Float[np.ndarray, " nv"]:
    """1 for every velocity between a contact and the base, 0 elsewhere (base: 0)."""
    mask = np.zeros(stance.robot.model.nv)
    for contact in stance.contacts:
        for joint in stance.limb(contact):
            model_joint = stance.robot.model.joints[joint]
            mask[model_joint.idx_v : model_joint.idx_v + model_joint.nv] = 1.0
    return mask


def posture_weights(stance: Stance, cost: PostureCost) -> Float[np.ndarray, " nv"]:
    """Weight of each velocity; none on the base's position, so that the feet decide it."""
    mask = supporting_joints(stance)
    weights = np.where(mask > 0, cost.supporting, cost.free)
    if stance.robot.base_nv == 6:
        weights[:3], weights[3:6] = 0.0, cost.base_rotation
    else:
        weights[:2], weights[2] = 0.0, cost.base_rotation
    return weights


def cost_derivatives(
    stance: Stance, home: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient of ``1/2 w |deviation|^2`` in the base's frame, and that gradient's derivative."""
    model = stance.robot.model
    deviation = pin.difference(model, home, stance.q)
    hessian = np.diag(weights)
    if stance.robot.base_nv == 6:
        # r = log(R_home' R): its gradient is r itself (r is an eigenvector of the log's
        # Jacobian), whose derivative is that Jacobian.
        relative = pin.Quaternion(home[3:7]).matrix().T @ pin.Quaternion(stance.q[3:7]).matrix()
        deviation[3:6] = pin.log3(relative)
        hessian[3:6, 3:6] = weights[3] * pin.Jlog3(relative)
    return weights * deviation, hessian


def bordered(hessian: np.ndarray, A: np.ndarray) -> np.ndarray:
    """[H A'; A 0]; written out, for `np.block` takes longer than the equations."""
    n = len(hessian)
    K = np.zeros((n + len(A), n + len(A)))
    K[:n, :n] = hessian
    K[n:, :n] = A
    K[:n, n:] = A.T
    return K


def independent_rows(
    here: Stance, C: np.ndarray, h: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Equations A dq = -e that say what C dq = -h says, without what it says twice.

    Returns:
        A, e, and U with A = U' [C; F], where F are the stance's fold equations; where the rows of
        C are independent, C, h and None.
    """
    try:
        pivots = np.linalg.cholesky(C @ C.T).diagonal()
        if len(pivots) and pivots.min() > _PIVOT * pivots.max():
            return C, h, None
    except np.linalg.LinAlgError:
        pass
    rows, errors = here.fold_equations
    u, s, _ = np.linalg.svd(np.vstack([C, rows]), full_matrices=False)
    spread = u[:, s > RANK_TOLERANCE * max(1.0, s[0])]
    return spread.T @ np.vstack([C, rows]), spread.T @ np.concatenate([h, errors]), spread


def followed_tangents(
    here: Stance,
    K: np.ndarray,
    C: np.ndarray,
    rate: np.ndarray,
    spread: np.ndarray | None,
    stationarity: np.ndarray | None = None,
) -> tuple[Float[np.ndarray, "nv p"], Bool[np.ndarray, " p"]]:
    """How a posture follows as its request does, or as something else changes its equations.

    Args:
        here: the posture.
        K: the system's matrix, of the rows of `independent_rows`.
        C: dh/dq.
        rate: how far C q, or [C; F] q where there is a spread, must go (c, p).
        spread: of `independent_rows`.
        stationarity: how the cost's gradient and C' lambda change otherwise (nv, p).

    Returns:
        dq (nv, p), and which of them can be followed (p,).
    """
    nv = here.robot.model.nv
    right = np.zeros((len(K), rate.shape[1]))
    right[nv:] = rate if spread is None else spread.T @ rate
    if stationarity is not None:
        right[:nv] = -stationarity
    tangents = solve_bordered(K, right)[:nv]
    # What the contacts hold fast has no tangent: least squares would move a contact.
    whole = C if spread is None else np.vstack([C, here.fold_equations[0]])
    missed = np.abs(whole @ tangents - rate).max(axis=0, initial=0.0)
    fastest = np.abs(tangents).max(axis=0, initial=1.0)
    runs_away = (fastest > _RUNAWAY) & (spread is not None)
    return tangents, ~((missed > 1e-6 * fastest) | runs_away)


def solve_bordered(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve, or take the minimum-norm least squares where constraints are redundant."""
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        raise UnreachablePostureError(
            "the search for a posture left all bounds: numbers of the model are too large or too "
            "small for it. Check its lengths [m], masses [kg] and angles [rad]."
        )
    try:
        solution = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        solution = np.full(right.shape, np.inf)
    if np.all(np.abs(solution) < 1e9):
        return np.asarray(solution)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0])
