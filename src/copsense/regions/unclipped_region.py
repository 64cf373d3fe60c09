"""The region where a criterion's own wrenches stay within limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits, check_limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.polygon import Polygon
from copsense.regions.refinement import Point
from copsense.regions.region import BOX, ComRegion, region_between
from copsense.regions.weight_line import balance_at, com_axes
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance
from copsense.statics import WrenchPolicy, share_load

_NOTHING = 1e-9  # of the weight: what rounding leaves of a slope that is zero

Affine = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # f0, F, tau0, T


@one_blas_thread()
def criterion_region(
    stance: Stance, criterion: Criterion | WrenchPolicy, limits: Limits, *, moving: bool = False
) -> ComRegion:
    """Where the CoM may be so that the criterion's own wrenches respect the limits.

    The wrenches are those that the criterion chooses without limits: inside, a controller that
    uses it needs no QP to clip them; outside, it does, though an equilibrium may exist. At a held
    posture they are affine in c, f = f0 + F (c - c0), so the region is the intersection of the
    half-planes ``A f <= b`` and ``|G_j - J_j' f| <= t``, exact, and lies in `com_region` of these
    limits.

    Args:
        stance: robot, posture and contacts.
        criterion: what shares the load; a policy q -> wrenches only if `moving`.
        limits: what the wrenches and torques must respect.
        moving: let the robot move its CoM itself, by the admissible motion of least kinetic energy
            (that of `CopSensitivity.com_gain`), with wrenches and torques to first order. J and
            G_j then change too, and the region may leave `com_region`, which holds them.

    Returns:
        The region. It is empty, with no vertex, where the criterion breaks a limit wherever the
        CoM is: nothing is infeasible by that, so nothing is raised.

    Raises:
        UndeterminedWrenchError: several wrenches are equally good.
        UnloadedContactError: `moving`, and a contact carries no normal force.
        InvalidInputError: a policy although the posture is held, or weights or limits that do not
            fit the stance.
        UnknownNameError: a torque limit names no joint.
    """
    check_limits(limits)
    axes = com_axes(stance)
    affine = _moving_equilibrium if moving else _held_equilibrium
    f0, F, tau0, T = affine(stance, criterion, axes)
    rows = limit_rows(stance, limits)
    joint, s = rows.joint, rows.sign
    # A f <= b and s tau <= t with f = f0 + F z and tau = tau0 + T z, c = c0 + axes z.
    m = rows.matrix.shape[1]  # the contacts' forces, without those of loops behind them
    f0, F = f0[:m], F[:m]
    normals = np.vstack([rows.matrix @ F, s[:, None] * T[joint]])
    offsets = np.concatenate([rows.bound - rows.matrix @ f0, rows.torque[joint] - s * tau0[joint]])
    unit = np.concatenate([np.linalg.norm(rows.matrix, axis=1), np.ones(len(joint))])
    none = _NOTHING * stance.robot.weight * unit
    size = np.linalg.norm(normals, axis=1)
    still = size <= none
    corners = BOX * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    if axes.shape[1] == 1:
        corners = np.array([[-BOX], [BOX]])
    if np.any(offsets[still] < -none[still]):
        corners = corners[:0]
    left = Polygon(corners @ axes.T).within(normals[~still] @ axes.T, offsets[~still])
    corners = stance.com[:2] + left.vertices
    return region_between(stance, corners, corners, interval=axes.shape[1] == 1)


def _held_equilibrium(
    stance: Stance, criterion: Criterion | WrenchPolicy, axes: Float[np.ndarray, "2 r"]
) -> Affine:
    """Forces and torques by the CoM's position along the axes, posture held: exactly affine."""
    if not isinstance(criterion, Criterion):
        raise InvalidInputError(
            "a policy q -> wrenches gives the wrenches of a posture, not those with the CoM "
            "elsewhere at this posture. Give a Criterion, or moving=True."
        )

    own, nb = LoadProblem.of(stance), stance.robot.unactuated_nv

    def share(step: Point) -> tuple[np.ndarray, np.ndarray]:
        # The weight at another point, shared at this posture.
        wrench = stance.robot.by_drive(balance_at(stance, stance.com[:2] + step))[:nb]
        return share_load(stance, criterion, replace(own, base_wrench=wrench))

    # A metre along each axis gives the slopes without rounding to speak of.
    (f0, tau0), ends = share(np.zeros(2)), [share(axis) for axis in axes.T]
    F = np.column_stack([forces - f0 for forces, _ in ends])
    T = np.column_stack([torques - tau0 for _, torques in ends])
    return f0, F, tau0, T


def _moving_equilibrium(
    stance: Stance, criterion: Criterion | WrenchPolicy, axes: Float[np.ndarray, "2 r"]
) -> Affine:
    """The same to first order along the admissible motions that move the CoM."""
    found = cop_sensitivity(stance, criterion)
    along = found.basis.T @ found.com_motions @ axes
    change = found.wrench_derivative @ along
    F = np.column_stack([stance.stack(change[..., i]) for i in range(axes.shape[1])])
    at = found.equilibrium
    return at.forces, F, at.torques, found.torque_derivative @ along
