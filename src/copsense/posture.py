"""Posture: the configuration nearest to a reference that keeps the contacts in place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from copsense.arrays import check_type, checked_positions, finite_array, finite_number, owned
from copsense.closures import RANK as CLOSURE_RANK
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.freedom import missing_joints
from copsense.listing import counted
from copsense.posture_system import (
    PostureCost as PostureCost,
)
from copsense.posture_system import (
    bordered,
    cost_derivatives,
    followed_tangents,
    independent_rows,
    posture_weights,
    solve_bordered,
)
from copsense.reach import beyond_reach
from copsense.stance import Stance, check_at_rest, check_stance
from copsense.unheld import moved_joints

TOLERANCE = 1e-12  # on every constraint [m, rad]
_STATIONARITY = 1e-11  # on the cost's gradient along the manifold
_NEWTON_REGION = 1e-2  # constraint error under which the exact curvature is used
_LONGEST_STEP = 0.3  # rad or m: longer Newton steps are shortened
_MAX_ITERATIONS = 100


@dataclass(frozen=True, eq=False, repr=False)
class Posture:
    """A solved posture and how it moves when its request does.

    Attributes:
        stance: the stance at the posture.
        tangents: dq/d(request) (nv, r): one exact column per requested CoM coordinate, in the
            order x, y, z, then one per requested joint; each satisfies J t = 0, and is zero
            where the contacts hold that coordinate fast.
        iterations: Newton iterations taken.
    """

    stance: Stance
    tangents: Float[np.ndarray, "nv r"]
    iterations: int

    def __post_init__(self) -> None:
        """Own the tangents."""
        object.__setattr__(self, "tangents", owned(self.tangents))

    def __repr__(self) -> str:
        """The stance, and how many coordinates were requested."""
        requests = self.tangents.shape[1]
        return f"Posture({self.stance!r}, {requests} requested, {self.iterations} iterations)"


def solve_posture(
    stance: Stance,
    *,
    com: Sequence[float | None] = (None, None, None),
    joints: Mapping[str, float] | None = None,
    targets: Sequence[pin.SE3] | None = None,
    reference: ArrayLike | None = None,
    cost: PostureCost | None = None,
) -> Posture:
    """Find the posture nearest to a reference with the contacts in place (inverse kinematics).

    Args:
        stance: where to start; its contacts stay where they are unless `targets` moves them.
        com: centre of mass (x, y, z) in the world [m]; None leaves a coordinate free.
        joints: joint name -> position [rad, or m for a prismatic joint] to hold.
        targets: world placement of each contact frame, to move the feet.
        reference: configuration that deviations are measured from; default the stance's own.
        cost: weights of the deviations.

    Returns:
        A posture that meets every constraint within 1e-12 (m, rad).

    Raises:
        UnreachablePostureError: no such posture was found; the message says what remains.
        UnknownNameError: a joint is not in the model.
    """
    check_stance(stance)
    check_at_rest(stance, "a posture to search for")
    robot = stance.robot
    cost = cost or PostureCost()
    joints = checked_positions(joints, "joint positions")
    entries = len(com) if isinstance(com, Sized) else 1
    if entries != 3:
        raise InvalidInputError(
            f"com has {entries} entries. Give x, y and z [m], None where one is free."
        )
    wanted = [
        (i, finite_number(value, f"the CoM's {'xyz'[i]} [m]"))
        for i, value in enumerate(com)
        if value is not None
    ]
    for joint, position in joints.items():
        joints[joint] = robot.checked_position(joint, position)
    places = tuple(stance.placements if targets is None else targets)
    if len(places) != len(stance.contacts):
        raise InvalidInputError(
            f"got {counted(len(places), 'target')} for {counted(len(stance.contacts), 'contact')}. "
            "Give one each."
        )
    for contact, place in zip(stance.contacts, places, strict=True):
        check_type(place, pin.SE3, f"a target of contact {contact.name!r}", "Give a pin.SE3.")
        finite_array(place.homogeneous, f"the target of contact {contact.name!r}", (4, 4))
    home = stance.q if reference is None else robot.check_configuration(reference)
    columns = [robot.velocity_index(joint) for joint in joints]
    weights = posture_weights(stance, cost)
    selector = np.eye(robot.model.nv)[columns]
    axes = [i for i, _ in wanted]

    # `folded` once rows were left out as said twice, `whole` once none may be any more. Where they
    # are held to second order they stay out: the fold equations stand for them.
    here, multipliers, folded, whole = stance, None, False, False
    for iteration in range(_MAX_ITERATIONS):
        # h(q) = 0: contacts, centre of mass, joints; C = dh/dq.
        h = np.concatenate(
            [
                constraint_error(here, places),
                here.hanging_balance / robot.weight,
                [here.com[i] - value for i, value in wanted],
                [robot.joint_position(here.q, joint) - angle for joint, angle in joints.items()],
            ]
        )
        swing = here.hanging_derivative / robot.weight
        C = np.vstack([here.constraints, swing, here.com_jacobian[axes], selector])
        A, errors, spread = (C, h, None) if whole else independent_rows(here, C, h)
        if spread is not None and not folded:
            folded = not stance.false_motions.shape[1]
        whole = folded and spread is None
        gradient, hessian = cost_derivatives(here, home, weights)
        if multipliers is None or spread is not None or len(multipliers) != len(A):
            multipliers = np.linalg.lstsq(A.T, -gradient, rcond=1e-10)[0]
        stationarity = gradient + A.T @ multipliers
        small = float(np.abs(h).max())
        if small < _NEWTON_REGION:
            # Curvature of the Lagrangian, sum lambda d2h: a static torque derivative in which
            # gravity stands for the CoM's multiplier and the contact forces for the feet's.
            of_h = multipliers if spread is None else (spread @ multipliers)[: len(h)]
            rows = len(here.constraints)
            pull = np.zeros(3)
            start = rows + len(swing)
            pull[axes] = of_h[start : start + len(axes)]
            hessian = hessian + here.curvature(-of_h[:rows], -pull / robot.mass)
        K = bordered(hessian, A)
        if small < TOLERANCE / 5 and np.abs(stationarity).max() < _STATIONARITY:
            # Rates of h: one for each request, and none of what is held to second order only.
            requests = len(axes) + len(columns)
            rate = np.zeros((len(h) if spread is None else len(spread), requests))
            rate[len(h) - requests : len(h)] = np.eye(requests)
            tangents, followed = followed_tangents(here, K, C, rate, spread)
            tangents[:, ~followed] = 0.0
            return Posture(stance.at(here.q), tangents, iteration)
        stuck = folded and not whole and np.abs(errors).max() < TOLERANCE / 5
        if stuck and np.abs(stationarity).max() < _STATIONARITY:
            # What was left out as said twice is not in place: it says something of its own.
            whole, multipliers = True, None
            continue
        step = solve_bordered(K, -np.concatenate([stationarity, errors]))
        length = min(1.0, _LONGEST_STEP / max(float(np.abs(step[: robot.model.nv]).max()), 1e-300))
        before = here
        here = here.at(
            pin.integrate(robot.model, here.q, length * step[: robot.model.nv]), check=False
        )
        multipliers = multipliers + length * step[robot.model.nv :]
        multipliers = _carried(multipliers, before, here) if spread is None else None
    raise UnreachablePostureError(_what_remains(here, h, axes, list(joints), wanted))


def contact_motions(
    stance: Stance,
) -> tuple[Float[np.ndarray, "nv m"], Bool[np.ndarray, " m"]]:
    """How the posture follows contacts whose places move, its CoM over the same point.

    The tangents of ``solve_posture(stance, com=(x, y, None), targets=...)``: joints and trunk yield
    as little as its cost allows.

    Args:
        stance: robot, posture and contacts, at rest.

    Returns:
        dq per displacement of a contact along each row of stacked forces (nv, m), contact axes
        [m, rad], and which of them the robot can follow (m,); the column of another is zero.
    """
    check_stance(stance)
    check_at_rest(stance, "a posture to search for")
    axes = [0, 1] if stance.robot.base_nv == 6 else [1]
    swing = stance.hanging_derivative / stance.robot.weight
    C = np.vstack([stance.constraints, swing, stance.com_jacobian[axes]])
    A, _, spread = independent_rows(stance, C, np.zeros(len(C)))
    m = len(stance.row_names)
    rate = np.zeros((len(C) if spread is None else len(spread), m))
    rate[:m] = np.eye(m)
    # At its own reference no constraint has a multiplier, so that none curves the cost.
    K = bordered(np.diag(posture_weights(stance, PostureCost())), A)
    tangents, followed = followed_tangents(stance, K, C, rate, spread)
    tangents[:, ~followed] = 0.0
    return tangents, followed


def move_stance(
    stance: Stance,
    *,
    com_x: float | None = None,
    com_y: float | None = None,
    com_z: float | None = None,
    joints: Mapping[str, float] | None = None,
) -> Stance:
    """A stance moved with its contacts in place, staying nearest to where it was.

    Args:
        stance: the stance.
        com_x: world x of the CoM to move to [m]; None holds it.
        com_y: world y likewise [m].
        com_z: its height [m]; None leaves it free.
        joints: joint -> position to put it at [rad, or m for a prismatic joint].

    Returns:
        The stance there; the same one where nothing is asked for.

    Raises:
        InvalidInputError: a number that is none, or the x of a robot that lives in a plane.
        UnreachablePostureError: no posture has the CoM and the joints there.
        UnknownNameError: a joint is not in the model.
    """
    check_stance(stance)
    if com_x is None and com_y is None and com_z is None and not joints:
        return stance
    planar = stance.robot.base_nv != 6
    if planar and com_x is not None:
        raise InvalidInputError(
            f"robot {stance.robot.name!r} lives in a plane: its CoM has no x to choose. Leave "
            "com_x (--com-x) out."
        )
    x, y = (
        float(here) if at is None else at
        for here, at in zip(stance.com, (com_x, com_y), strict=False)
    )
    com = (None if planar else x, y, com_z)
    return solve_posture(stance, com=com, joints=joints).stance


def carry_payload(
    stance: Stance,
    frame: str,
    mass: float,
    *,
    com: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Stance:
    """A stance whose robot carries a mass, its CoM over the same point as before.

    Args:
        stance: the stance; its contacts stay.
        frame: name of the frame that carries it.
        mass: [kg].
        com: centre of the mass in the frame [m].

    Raises:
        UnknownNameError: no such frame.
        UnreachablePostureError: the robot cannot bring the CoM of both there.
    """
    check_at_rest(stance, "a payload")
    robot, (x, y, _) = stance.robot.with_payload(frame, mass, com=com), stance.com
    loaded = Stance(robot, stance.q, stance.contacts, loads=stance.loads)
    ahead = float(x) if robot.base_nv == 6 else None  # a planar robot has no x to keep
    return solve_posture(loaded, com=(ahead, float(y), None)).stance


def retract(stance: Stance, displacement: Float[np.ndarray, " nv"]) -> Stance:
    """Move a stance along a velocity, then back to where its contacts are.

    The correction is the smallest one (minimum-norm Newton), so an admissible v is the tangent of
    t -> retract(stance, t v) at 0, and central differences along it converge as t^2.

    Raises:
        UnreachablePostureError: the displacement leads to no posture with the contacts in place.
    """
    model = stance.robot.model
    displacement = finite_array(displacement, "the displacement", (model.nv,), "a velocity")
    moved = stance.at(pin.integrate(model, stance.q, displacement), check=False)
    return pull_back(moved, stance.placements)


def pull_back(stance: Stance, targets: Sequence[pin.SE3]) -> Stance:
    """Bring the contacts of a stance to their targets by the smallest corrections.

    Raises:
        UnreachablePostureError: they cannot be brought there.
    """
    here, model = stance, stance.robot.model
    for _ in range(_MAX_ITERATIONS):
        error, rows = constraint_error(here, targets), here.constraints
        if here.hanging_motions.shape[1]:
            swing = here.hanging_balance / here.robot.weight
            error = np.concatenate([error, swing])
            rows = np.vstack([rows, here.hanging_derivative / here.robot.weight])
        if np.abs(error).max() < TOLERANCE / 10:
            return here.at(here.q)
        rcond = 1e-9 if here.closures is None else CLOSURE_RANK
        step = -np.linalg.lstsq(rows, error, rcond=rcond)[0]
        step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        here = here.at(pin.integrate(model, here.q, step), check=False)
    raise UnreachablePostureError(_what_remains(here, error, [], [], []))


def contact_error(stance: Stance, targets: Sequence[pin.SE3]) -> Float[np.ndarray, " m"]:
    """How far each contact frame is from its target (m,): metres and radians, contact axes."""
    errors = []
    for contact, here, target in zip(stance.contacts, stance.placements, targets, strict=True):
        if contact.kind == "point":
            errors.append(here.rotation.T @ (here.translation - target.translation))
        else:
            errors.append(pin.log6(target.actInv(here)).vector[list(contact.components)])
    return np.concatenate(errors)


def constraint_error(stance: Stance, targets: Sequence[pin.SE3]) -> Float[np.ndarray, " c"]:
    """The same, then how far the robot's loops and couplings are open (c,)."""
    error = contact_error(stance, targets)
    if stance.closures is None:
        return error
    return np.concatenate([error, stance.closures.basis.T @ stance.closures.error])


def _carried(multipliers: np.ndarray, before: Stance, after: Stance) -> np.ndarray:
    """Multipliers of one iterate in the rows of the next: loops and what hangs have a new basis."""
    m, own = len(before.row_names), np.zeros(0)
    r = m
    if before.closures is not None and after.closures is not None:
        r += before.closures.basis.shape[1]
        own = after.closures.basis.T @ (before.closures.basis @ multipliers[m:r])
    k = r + before.hanging_motions.shape[1]
    swing = after.hanging_motions.T @ (before.hanging_motions @ multipliers[r:k])
    return np.concatenate([multipliers[:m], own, swing, multipliers[k:]])


def _what_remains(
    stance: Stance,
    h: np.ndarray,
    axes: list[int],
    joints: list[str],
    wanted: list[tuple[int, float]],
) -> str:
    ways = ("along x", "along y", "along z", "about x", "about y", "about z")
    labels = [
        f"contact {c.name} {ways[i]} remains {{:.2e}} {'m' if i < 3 else 'rad'} off"
        for c in stance.contacts
        for i in c.components
    ]
    if stance.closures is not None:
        open_ = "a loop or coupling of the robot remains {:.2e} m or rad open"
        labels += [open_] * stance.closures.basis.shape[1]
    labels += [
        f"what hangs of {', '.join(moved_joints(stance.robot, motion[:, None]))} lacks {{:.2e}} m "
        "of the weight"
        for motion in stance.hanging_motions.T
    ]
    labels += [f"the CoM's {'xyz'[i]} remains {{:.2e}} m off" for i in axes]
    labels += [f"joint {joint} remains {{:.2e}} (rad or m) off" for joint in joints]
    worst = int(np.argmax(np.abs(h)))
    asked = ", ".join(f"CoM {'xyz'[i]} = {round(value, 6) + 0.0:g} m" for i, value in wanted)
    left = labels[worst].format(abs(h[worst]))
    if abs(h[worst]) < TOLERANCE:
        left = "they are in place, but the search for the nearest posture does not settle"
    lacking = "; ".join(missing_joints(stance))
    middle = np.mean([place.translation for place in stance.placements], axis=0)
    far = [
        beyond_reach(
            stance.robot,
            value - middle[i],
            f"the CoM's {'xyz'[i]}, from the contacts,",
            given=value,
        )
        for i, value in wanted
    ]
    remedy = next((each for each in far if each), "")
    return (
        f"no posture of {stance.robot.name!r} with the contacts in place was found"
        + (f" for {asked}" if asked else "")
        + f": {left}. "
        + (f"{lacking[0].upper()}{lacking[1:]}. " if lacking else "")
        + (
            f"{remedy[0].upper()}{remedy[1:]}"
            if remedy
            else "Ask for less, start from a nearer posture, or leave out a contact that says what "
            "another says already."
        )
    )
