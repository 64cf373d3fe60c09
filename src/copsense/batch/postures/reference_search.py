"""Reference search: the same as `newton`, one posture at a time, with Pinocchio's kinematics.

It serves what the kernel does not: planar robots, joints of several degrees of freedom, any number
of contacts; and everything where Numba is not installed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from copsense.batch.postures.coordinates import Coordinates, Limb
from copsense.batch.postures.search_settings import (
    BEYOND,
    DAMPING,
    FLOOR,
    LONGEST_STEP,
    MOST_STEPS,
    OPPOSITE,
    PATIENCE,
    PROGRESS,
    SOLVED,
    STUCK,
    TINY,
    UNSOLVED,
)
from copsense.content import ShortRepr
from copsense.posture import TOLERANCE
from copsense.stance import AT_LIMIT, RANK_TOLERANCE, Stance


@dataclass(frozen=True, eq=False, repr=False)
class Attempt(ShortRepr):
    """Where a search ended.

    Attributes:
        q: the configuration (nq,).
        residual: largest error of a constraint [m, rad].
        iterations: steps taken.
        status: solved, unsolved, stuck, or beyond a limit.
        which: the error that remains, or the joint velocity beyond its limit.
        excess: by how much it is.
    """

    q: np.ndarray
    residual: float
    iterations: int
    status: int
    which: int
    excess: float


def search_one(stance: Stance, plan: Coordinates, values: np.ndarray) -> Attempt:
    """Look for the posture of one row of values (k,)."""
    model, nb = stance.robot.model, stance.robot.base_nv
    given = plan.given.copy()
    given[plan.place] = values
    for axis in plan.com_axes if nb == 6 else ():  # the base goes where the CoM goes
        given[axis] += given[model.nv + axis] - plan.given[model.nv + axis]
    folds = stance.false_motions.shape[1] > 0
    q, placed = stance.q, plan.given[: model.nv]  # where q stands
    before, steps = np.inf, 0
    worst, which = np.inf, 0
    while True:
        if not np.isfinite(given[: model.nv]).all():  # values so large that their squares overflow
            return Attempt(q, worst, steps, STUCK, which, 0.0)
        q = moved_configuration(stance, plan, q, placed, given[: model.nv])
        placed = given[: model.nv].copy()
        here = stance.at(q, check=False)
        h, opposite = constraint_errors(here, plan, given)
        if folds and not np.isfinite(here.jacobian).all():
            return Attempt(q, worst, steps, STUCK, which, 0.0)
        fold = here.fold_equations if folds else None
        folded = 0.0 if fold is None else float(np.abs(fold[1]).max(initial=0.0))
        sizes = np.abs(h)
        worst = max(float(sizes.max()), float(opposite))
        which = int(sizes.argmax())
        hopeless = steps % PATIENCE == 0 and steps > 0 and worst > PROGRESS * before
        if worst < TOLERANCE and folded < TOLERANCE:
            status, joint, excess = within_limits(here, plan)
            return Attempt(here.q, worst, steps, status, joint, excess)
        if steps >= MOST_STEPS or hopeless:
            status = UNSOLVED if steps >= MOST_STEPS else STUCK
            return Attempt(here.q, worst, steps, status, which, 0.0)
        before = worst if steps % PATIENCE == 0 else before
        with np.errstate(over="ignore", invalid="ignore"):
            _advance(here, plan, given, h, fold)
        steps += 1


def _advance(
    here: Stance,
    plan: Coordinates,
    given: np.ndarray,
    h: np.ndarray,
    fold: tuple[np.ndarray, np.ndarray] | None,
) -> None:
    """Take one step of every limb's unknowns."""
    first = 0
    for limb in plan.limbs:
        J = _jacobian(here, plan, given, limb)
        e = h[first : first + len(J)]
        first += len(J)
        if fold is not None and len(fold[0]):
            # Motions that the contacts hold to second order are asked for as what they are: else
            # Newton only halves the error in them, and ends where J is all but deficient.
            rows, errors = np.array(fold[0]), fold[1]
            rows[:, : here.robot.base_nv] = rows[:, : here.robot.base_nv] @ base_rates(here, given)
            J = np.vstack([J, rows[:, list(limb.unknowns)]])
            step = -np.linalg.lstsq(J, np.concatenate([e, errors]), rcond=RANK_TOLERANCE)[0]
        else:
            # s J' (J J' + mu 1)^-1 h, mu = c |h|^2 + floor.
            M = J @ J.T
            mu = DAMPING * float(e @ e) + FLOOR * float(np.trace(M)) + TINY
            step = -J.T @ np.linalg.solve(M + mu * np.eye(len(M)), e)
        longest = float(np.abs(step).max(initial=0.0))
        given[list(limb.unknowns)] += LONGEST_STEP / max(longest, LONGEST_STEP) * step


def within_limits(here: Stance, plan: Coordinates) -> tuple[int, int, float]:
    """Solved or beyond a limit; the joint velocity that is worst beyond it, and by how much."""
    x = np.zeros(len(plan.low))
    for joint in list(here.robot.model.joints)[2:]:
        if joint.nq == 1:
            x[joint.idx_v - here.robot.base_nv] = here.q[joint.idx_q]
    beyond = np.maximum(plan.low - x, x - plan.high)
    which = int(beyond.argmax()) if len(beyond) else 0
    excess = float(beyond.max(initial=0.0))
    return (BEYOND if excess > AT_LIMIT else SOLVED), which, excess


def moved_configuration(
    stance: Stance, plan: Coordinates, q: np.ndarray, before: np.ndarray, given: np.ndarray
) -> np.ndarray:
    """The configuration of base coordinates and joint positions, the latter from where they are.

    Args:
        stance: that of the plan.
        plan: what the given numbers mean.
        q: a configuration (nq,).
        before: its given numbers (nv,).
        given: those to move it to (nv,).
    """
    model, nb = stance.robot.model, stance.robot.base_nv
    way = given - before
    way[:nb] = 0.0
    q = pin.integrate(model, q, way)
    if nb == 6:
        place = pin.SE3(np.eye(3), given[:3].copy())
        place.rotation = pin.rpy.rpyToMatrix(*given[3:6])
        local = model.jointPlacements[1].actInv(place)
        q[:3] = local.translation
        if plan.turned:
            turn = pin.SE3ToXYZQUAT(local)[3:]
            q[3:7] = -turn if turn @ stance.q[3:7] < 0 else turn
        else:
            q[3:7] = stance.q[3:7]
            root = model.jointPlacements[1]
            q[:3] = root.rotation.T @ (given[:3] - root.translation)
    else:
        q[:4] = *given[:2], np.cos(given[2]), np.sin(given[2])
    return np.asarray(q)


def contact_target(plan: Coordinates, k: int, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where contact k is to be: its origin (3,) and axes (3, 3), for its x, y and yaw (3,)."""
    first = len(plan.given) - 3 * len(plan.positions) + 3 * k
    way = wanted - plan.given[first : first + 3]
    s, c = np.sin(way[2]), np.cos(way[2])
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    position = plan.positions[k] + [way[0], way[1], plan.slopes[k] @ way[:2]]
    return position, plan.rotations[k] @ turn


def constraint_errors(
    here: Stance, plan: Coordinates, given: np.ndarray
) -> tuple[np.ndarray, bool]:
    """h, limb by limb, world axes [m, rad]; a planar contact's in its own axes.

    And whether a foot faces away from where it should, where the turn's error says little.
    """
    nv, errors, opposite = here.robot.model.nv, [], False
    for limb in plan.limbs:
        for k in limb.contacts:
            contact, place = here.contacts[k], here.placements[k]
            target, R = contact_target(plan, k, given[nv + 3 + 3 * k : nv + 6 + 3 * k])
            off = place.translation - target
            if contact.kind == "point":
                errors.append(off)
                continue
            turn = np.cross(R.T, place.rotation.T).sum(axis=0)
            open_ = 1.0 + float(np.sum(R * place.rotation))
            turn = 2.0 / max(open_, OPPOSITE) * turn
            opposite = opposite or open_ < OPPOSITE
            if contact.kind == "surface":
                errors.append(np.concatenate([off, turn]))
            else:
                rows = np.concatenate([R.T @ off, R.T @ turn])
                errors.append(rows[list(contact.components)])
    errors.append(np.array([here.com[a] - given[nv + a] for a in plan.com_axes]))
    return np.concatenate(errors), opposite


def _jacobian(here: Stance, plan: Coordinates, given: np.ndarray, limb: Limb) -> np.ndarray:
    """dh/dx of a limb."""
    nb, blocks = here.robot.base_nv, []
    B = base_rates(here, given)
    for k in limb.contacts:
        contact, place = here.contacts[k], here.placements[k]
        rows = here.jacobian[here.rows[k]]
        if contact.kind != "planar":  # contact axes to the world's
            blocks += [place.rotation @ rows[i : i + 3] for i in range(0, len(rows), 3)]
        else:
            blocks.append(rows)
    blocks.append(here.com_jacobian[list(plan.com_axes)])
    J = np.vstack(blocks)
    J[:, :nb] = J[:, :nb] @ B
    return J[:, list(limb.unknowns)]


def base_rates(here: Stance, given: np.ndarray) -> np.ndarray:
    """Velocity of the base in its own frame per rate of its coordinates."""
    B = np.eye(here.robot.base_nv)
    if here.robot.base_nv == 6:
        turn = pin.rpy.rpyToMatrix(*given[3:6])
        B[:3, :3] = turn.T
        B[3:, 3:] = turn.T @ pin.rpy.computeRpyJacobian(
            given[3:6].copy(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
    else:
        c, s = np.cos(given[2]), np.sin(given[2])
        B[:2, :2] = [[c, s], [-s, c]]
    return B
