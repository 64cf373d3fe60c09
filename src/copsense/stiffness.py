"""Stiffness: how a position-controlled robot shares its load, and whether it stands at all.

Servos and gears give ``tau = K (q_cmd - q)``, soles and ground ``f = Kc`` times their compression.
With d the joints' deflection and e how far the command would have the contacts from where they
stand,

    J d = Kc^-1 f + e

so that the robot takes the wrenches of least elastic energy: those of the criterion with
``W_tau = K^-1`` and ``W_f = Kc^-1``, and ``e' f`` for the preload. Damping does not matter at rest.
To first order in the deflection; the error in the forces goes as 1/K.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, finite_number
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.stance import Stance, check_at_rest
from copsense.statics import solve_equilibrium
from copsense.terms import PreloadTerm, Term, TorqueTerm, WrenchTerm

_RIGID = 1e-12  # motions, relative, that no joint feels


def stiffness(
    joints: float | Mapping[str, float] | ArrayLike,
    contacts: ArrayLike | Mapping[str, ArrayLike] | None = None,
    preload: Mapping[str, ArrayLike] | ArrayLike | None = None,
    *,
    name: str = "stiffness",
) -> Criterion:
    """The criterion of a robot whose joints are held in position by springs.

    Joints alike on rigid ground without preload share the load as `minimum_torque` does.

    Args:
        joints: stiffness K of every joint [Nm/rad, or N/m of a prismatic joint]: a number; joint
            name -> number, where ``"*hip*"`` fits every joint with hip in its name and ``"*"`` the
            rest; a vector (n,); or a matrix (n, n). A joint not named is rigid.
        contacts: stiffness Kc of the soles: six numbers for every contact, or by contact name
            [N/m, then Nm/rad], infinite where rigid; None for all rigid.
        preload: e, of each contact's commanded place from where it stands, by contact name or
            (nc, 6), contact axes [m, rad]; see `command_preload`. What a motion of the base makes
            up for changes nothing.
        name: how it is called in results.

    Raises:
        InvalidInputError: a stiffness that is not positive.
    """
    terms: list[Term] = [TorqueTerm(_compliances(joints, "joints"))]
    if contacts is not None:
        terms.append(WrenchTerm(_compliances(contacts, "soles")))
    if preload is not None:
        terms.append(PreloadTerm(preload))
    return Criterion(name, tuple(terms))


def command_preload(stance: Stance, offsets: Mapping[str, float]) -> Float[np.ndarray, "nc 6"]:
    """e = J d of a command that is off by some joint angles from a posture that fits the ground.

    Args:
        stance: the posture.
        offsets: joint -> how far its command is from the posture [rad, m].

    Returns:
        Displacement of each contact's commanded place (nc, 6), contact axes [m, rad].

    Raises:
        UnknownNameError: a joint that the robot does not have.
    """
    moved = np.zeros(stance.robot.model.nv)
    for joint, offset in offsets.items():
        moved[stance.robot.velocity_index(joint)] = finite_number(offset, f"the offset of {joint}")
    return stance.unstack(stance.jacobian @ moved)


def critical_stiffness(stance: Stance, criterion: Criterion) -> float:
    """By which factor every joint's stiffness may be multiplied before the posture falls.

    A posture stands while A + K (and J' Kc J of soft soles) is positive on the motions that rigid
    contacts allow, A being how gravity and the contacts' forces turn. Of `stiffness(1.0)` it is
    the least common stiffness itself [Nm/rad]. Above one the robot falls; zero where it stands
    whatever the stiffness, infinite where no stiffness of joints helps, as on soles too soft.

    Args:
        stance: robot, posture and contacts, at rest.
        criterion: of `stiffness`.

    Raises:
        InvalidInputError: a stance in motion, or a criterion that is not one of stiffnesses.
        CopsenseError: it has no equilibrium here.
    """
    check_at_rest(stance, "the stability of a posture")
    quadratic = criterion.at(stance)
    if quadratic.inertia or not quadratic.active.all():
        raise InvalidInputError(
            f"criterion {criterion.name!r} does not give every joint a stiffness. Use "
            "copsense.stiffness.stiffness (--criterion stiffness:...) with a number for each."
        )
    equilibrium = solve_equilibrium(stance, criterion)
    robot, J = stance.robot, stance.constraints
    nb = robot.unactuated_nv
    K = np.zeros((robot.model.nv, robot.model.nv))
    K[nb:, nb:] = np.linalg.inv(quadratic.torque)
    order = robot.from_drives(np.eye(robot.model.nv))
    K = order @ K @ order.T
    soft = quadratic.wrench.any(axis=1)
    Q = stance.balance_derivative(equilibrium.forces)
    if soft.any():
        Q = Q + J[soft].T @ np.linalg.inv(quadratic.wrench[np.ix_(soft, soft)]) @ J[soft]
        Z = scipy.linalg.null_space(J[~soft], rcond=1e-9) if not soft.all() else np.eye(len(K))
    else:
        Z = stance.admissible_motions
    Q, K = (Z.T @ ((X + X.T) / 2) @ Z for X in (Q, K))
    values, vectors = np.linalg.eigh(K)
    felt = values > _RIGID * values.max(initial=0.0)
    N, R = vectors[:, ~felt], vectors[:, felt]
    if N.shape[1]:
        # Motions that no joint feels stand by the soles alone; the rest is what they leave.
        alone = N.T @ Q @ N
        if np.linalg.eigvalsh(alone)[0] <= 0:
            return math.inf
        across = N.T @ Q @ R
        Q = R.T @ Q @ R - across.T @ np.linalg.solve(alone, across)
    else:
        Q = R.T @ Q @ R
    least = scipy.linalg.eigh(Q, np.diag(values[felt]), eigvals_only=True)[0]
    return max(0.0, -float(least))


def _compliances(stiffnesses: Any, what: str) -> Any:
    """The inverse of stiffnesses: of numbers, of each by its name, or of a matrix."""
    if isinstance(stiffnesses, Mapping):
        return {name: _compliance(each, f"{what} {name}") for name, each in stiffnesses.items()}
    return _compliance(stiffnesses, what)


def _compliance(stiffnesses: Any, what: str) -> float | Float[np.ndarray, "..."]:
    try:
        given = np.asarray(stiffnesses, dtype=float)
    except (TypeError, ValueError):
        given = np.array(np.nan)
    rigid = np.isposinf(given)
    shape = (None,) * given.ndim
    array = finite_array(np.where(rigid, 1.0, given), f"the stiffness of {what}", shape)
    if array.ndim == 2:
        if rigid.any() or not np.allclose(array, array.T) or np.linalg.eigvalsh(array)[0] <= 0:
            raise InvalidInputError(
                f"the stiffness of {what} is not symmetric and positive definite. Give one."
            )
        return np.asarray(np.linalg.inv(array))
    if np.any(array <= 0):
        raise InvalidInputError(
            f"the stiffness of {what} is {array.min():g}. Give positive numbers, infinite where "
            "rigid."
        )
    found = np.where(rigid, 0.0, 1.0 / array)
    return found if found.ndim else float(found)
