"""Free motions: which of them can be followed, and those of given energy that move the CoM.

Of a stance's matrices alone, so that each formula stands by itself; `Stance` says what they mean.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from copsense.arrays import read_only
from copsense.row_space import RowSpace

_NOTHING = read_only(np.zeros(0))
# Curvature (1/m) from which contacts forbid a motion that their Jacobian allows.
_CURVED = 1e-4
_MASSLESS = 1e-14  # share of the largest kinetic energy under which a motion moves no mass
_HEAVY = 1e-4  # pivots of the energy, relative, from which every motion moves some mass
_LOST = 1e-9  # singular values of the CoM Jacobian, relative, that count as unreachable
_FOLDED = 1e-2  # the same where the contacts hold motions to second order only
_APART = 1e-3  # from here on the CoM's two directions are far from depending on each other


class Folds(NamedTuple):
    """Motions that can be followed to first order only.

    Attributes:
        motions: orthonormal (nv, k).
        equations: rows F (k, nv) and
        errors: e (k,), F dq = -e, by which the constraints come to be deficient along them.
        branching: whether other motions part here.
    """

    motions: Float[np.ndarray, "nv k"]
    equations: Float[np.ndarray, "k nv"]
    errors: Float[np.ndarray, " k"]
    branching: bool


def find_folds(
    space: RowSpace,
    constraints: Float[np.ndarray, "c nv"],
    curvature: Callable[[Float[np.ndarray, " c"]], Float[np.ndarray, "nv nv"]],
) -> Folds:
    """Where constraints J depend on each other, y' J = 0, what their second order forbids.

    A motion v moves the contacts by v' Q v / 2 along y. Where Q is definite on some motions and
    zero on the others, those cannot be followed at all; where it has both signs, motions part.

    Args:
        space: the row space of J.
        constraints: J.
        curvature: Q = d(J' y)/dq of a combination y (c,).
    """
    u, Z = space.redundant, space.null
    if not u.shape[1]:
        return Folds(Z[:, :0], Z.T[:0], _NOTHING, branching=False)
    motions, rows, errors = [Z[:, :0]], [Z.T[:0]], [np.zeros(0)]
    branching = False
    for y in u.T:
        turned = curvature(y)
        values, vectors = np.linalg.eigh(Z.T @ (turned + turned.T) @ Z / 2)
        curved = np.abs(values) > _CURVED
        if curved.any() and (np.all(values[curved] > 0) or np.all(values[curved] < 0)):
            false = Z @ vectors[:, curved]
            motions.append(false)
            rows.append(false.T @ turned)
            errors.append(false.T @ constraints.T @ y)
        elif curved.any():
            branching = True
    left, s, _ = np.linalg.svd(np.hstack(motions), full_matrices=False)
    return Folds(
        read_only(left[:, s > _CURVED]),
        read_only(np.vstack(rows)),
        read_only(np.concatenate(errors)),
        branching,
    )


def unit_energy(
    motions: Float[np.ndarray, "nv p"], mass_matrix: Float[np.ndarray, "nv nv"]
) -> Float[np.ndarray, "nv r"]:
    """Motions Z R of unit kinetic energy, with R R' = (Z' M Z)^-1.

    Motions of massless links alone are left out: they have no energy to be measured by.

    Args:
        motions: Z.
        mass_matrix: M.
    """
    Z = motions
    energy = Z.T.dot(mass_matrix).dot(Z)
    if len(energy):
        factor, info = lapack.dpotrf(energy, lower=1)
        pivots = factor.diagonal()
        if info == 0 and pivots.min() > _HEAVY * pivots.max():
            return np.asarray(lapack.dtrtrs(factor, Z.T, lower=1)[0].T)  # Z L^-T
    values, vectors = np.linalg.eigh(energy)
    kept = values > _MASSLESS * values.max(initial=0.0)
    return np.asarray(Z @ (vectors[:, kept] / np.sqrt(values[kept])))


def least_energy(
    motions: Float[np.ndarray, "nv r"], speeds: Float[np.ndarray, "2 r"], *, folded: bool
) -> Float[np.ndarray, "nv 2"]:
    """The motion of least kinetic energy per unit of CoM x and y velocity, Z R (J_c Z R)^+.

    Zero along a direction in which the CoM cannot move.

    Args:
        motions: Z R, of unit kinetic energy.
        speeds: J_c Z R, the CoM's horizontal velocities along them.
        folded: whether some directions are held to second order only, and so known less exactly.
    """
    (a, b), (_, c) = speeds.dot(speeds.T).tolist()
    area = a * c - b * b
    if area > _APART * (a + c) ** 2:
        inverse = np.array([[c, -b], [-b, a]]) / area
        return np.asarray(motions.dot(speeds.T).dot(inverse))
    return np.asarray(motions @ np.linalg.pinv(speeds, rcond=_FOLDED if folded else _LOST))
