"""Closing: the joints of a robot brought to where its couplings and loops are closed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.closures import RANK, Closures
from copsense.errors import OpenLoopError
from copsense.robot import Robot

_CLOSED = 1e-11  # m, rad
_SHUT = 1e-6  # m, rad: what is open by less, posture solving closes
_STEP = 0.3  # rad, m: longer steps are shortened
_ITERATIONS = 100


def close(
    robot: Robot, q: Float[np.ndarray, " nq"], held: Iterable[str] = ()
) -> Float[np.ndarray, " nq"]:
    """The configuration near another at which couplings and loops are closed.

    Followers go where their leaders put them, a leader where a follower that is held wants it;
    then joints that are not held close the loops, and only if they cannot, all joints.

    Args:
        robot: the robot.
        q: configuration (nq,) to start from.
        held: names of joints that are to stay if they can.

    Returns:
        The configuration (nq,); where no such one was found, the nearest to it that was.
    """
    if not (robot.drives.couplings or robot.drives.loops):
        return q
    wanted = set(held)
    q = _coupled(robot, q, wanted)
    free = np.ones(robot.model.nv)
    free[: robot.base_nv] = 0.0
    loose = free.copy()
    loose[[robot.velocity_index(j) for j in wanted & set(robot.dof_names)]] = 0.0
    found, gap = _newton(robot, q, loose)
    return found if gap < _CLOSED else min((found, gap), _newton(robot, q, free), key=_gap)[0]


def check_closable(robot: Robot, q: Float[np.ndarray, " nq"]) -> None:
    """Reject a configuration that `close` could not close.

    Raises:
        OpenLoopError: a loop or coupling is open there.
    """
    if not (robot.drives.couplings or robot.drives.loops):
        return
    closures = Closures(robot, q)
    error = np.abs(closures.error)
    worst = int(error.argmax())
    if error[worst] > _SHUT:
        raise OpenLoopError(
            f"{closures.names[worst]} of robot {robot.name!r} cannot be closed: the joints leave "
            f"{error[worst]:.3g} (m or rad) open, starting from this posture. Give a posture "
            "nearer to where it is closed (posture=, --posture JOINT=POSITION), other points of "
            "the two frames (FRAME@X:Y:Z), or a kind that holds less (ball, pin, weld)."
        )


def _gap(found: tuple[np.ndarray, float]) -> float:
    return found[1]


def _coupled(robot: Robot, q: Float[np.ndarray, " nq"], held: set[str]) -> Float[np.ndarray, " nq"]:
    """Move followers to where their leaders put them; of chains, one link after the other."""
    known, couplings = set(held), robot.drives.couplings
    for coupling in couplings:
        backwards = coupling.joint in known and coupling.of not in known and coupling.ratio
        if backwards:
            now = robot.joint_position(q, coupling.joint)
            q = _moved(robot, q, coupling.of, (now - coupling.offset) / coupling.ratio)
            known.add(coupling.of)
    for _ in couplings:
        for coupling in couplings:
            lead = robot.joint_position(q, coupling.of)
            q = _moved(robot, q, coupling.joint, coupling.ratio * lead + coupling.offset)
    return q


def _moved(
    robot: Robot, q: Float[np.ndarray, " nq"], joint: str, position: float
) -> Float[np.ndarray, " nq"]:
    velocity = np.zeros(robot.model.nv)
    velocity[robot.velocity_index(joint)] = position - robot.joint_position(q, joint)
    return np.asarray(pin.integrate(robot.model, q, velocity))


def _newton(
    robot: Robot, q: Float[np.ndarray, " nq"], free: Float[np.ndarray, " nv"]
) -> tuple[Float[np.ndarray, " nq"], float]:
    """The smallest steps of the free velocities that close what is open, and what stays open."""
    best = q, np.inf
    for _ in range(_ITERATIONS):
        closures = Closures(robot, q)
        gap = float(np.abs(closures.error).max(initial=0.0))
        if gap < best[1]:
            best = q, gap
        if gap < _CLOSED:
            break
        step = -np.linalg.lstsq(closures.jacobian * free, closures.error, rcond=RANK)[0] * free
        step *= min(1.0, _STEP / max(float(np.abs(step).max()), 1e-300))
        q = np.asarray(pin.integrate(robot.model, q, step))
    return best
