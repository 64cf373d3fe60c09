"""Rigid body: what Pinocchio computes of a robot at a configuration, as arrays of one's own.

Pinocchio computes in a working memory (``pin.Data``), which takes longer to make than any of these
functions to run. One is kept for each robot and thread; none of it leaves this module, and nothing
in it outlives a call.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import owned
from copsense.motion import Motion
from copsense.robot import Robot

_LOCAL = pin.ReferenceFrame.LOCAL


class Attachment(NamedTuple):
    """Where on a robot something is, such as a contact.

    Attributes:
        joint: index in the model of the joint whose link carries it.
        placement: of its frame in that joint's frame.
    """

    joint: int
    placement: pin.SE3


def add_force(forces: dict[int, pin.Force], joint: int, force: pin.Force) -> None:
    """Add a spatial force on a joint, in its axes, to those that act on it already."""
    forces[joint] = forces[joint] + force if joint in forces else force


class _Scratch:
    """Working memory for one robot in one thread."""

    def __init__(self, robot: Robot) -> None:
        self.model = robot.model
        self.data = robot.model.createData()
        self.still = np.zeros(robot.model.nv)
        self.forces = pin.StdVec_Force()
        self.forces.extend([pin.Force.Zero()] * robot.model.njoints)
        self._tilted: pin.Model | None = None

    def tilted(self, gravity: Float[np.ndarray, " 3"]) -> pin.Model:
        """The model with another gravity [m/s^2]."""
        if self._tilted is None:
            self._tilted = self.model.copy()
        self._tilted.gravity.linear = gravity
        return self._tilted


class _Scratches(threading.local):
    """The working memories of a thread; each goes with its robot."""

    def __init__(self) -> None:
        self.of: WeakKeyDictionary[Robot, _Scratch] = WeakKeyDictionary()


_kept = _Scratches()


def _scratch(robot: Robot) -> _Scratch:
    found = _kept.of.get(robot)
    if found is None:
        found = _kept.of[robot] = _Scratch(robot)
    return found


def place(
    robot: Robot, q: Float[np.ndarray, " nq"], attachments: Sequence[Attachment]
) -> tuple[tuple[pin.SE3, ...], Float[np.ndarray, "k 6 nv"]]:
    """World placement of frames, and their Jacobians in their own axes (linear, angular)."""
    memory = _scratch(robot)
    model, data = memory.model, memory.data
    pin.computeJointJacobians(model, data, q)
    placements, jacobians = [], np.empty((len(attachments), 6, model.nv))
    for k, (joint, placement) in enumerate(attachments):
        placements.append(data.oMi[joint] * placement)
        jacobians[k] = pin.getFrameJacobian(model, data, joint, placement, _LOCAL)
    return tuple(placements), jacobians


def base_axes(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, "3 nb"]:
    """Angular velocity of the base by its own velocities, in world axes."""
    memory, world = _scratch(robot), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    pin.computeJointJacobians(memory.model, memory.data, q)
    return owned(pin.getJointJacobian(memory.model, memory.data, 1, world)[3:, : robot.base_nv])


def gravity(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, " nv"]:
    """Generalised gravity G(q) [N, Nm]."""
    memory = _scratch(robot)
    return owned(pin.computeGeneralizedGravity(memory.model, memory.data, q))


def gravity_under(
    robot: Robot, q: Float[np.ndarray, " nq"], pull: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " nv"]:
    """Generalised gravity of another pull than the model's (3,) [m/s^2], in which it is linear."""
    memory = _scratch(robot)
    return owned(pin.computeGeneralizedGravity(memory.tilted(pull), memory.data, q))


def inertial_regressor(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    acceleration: Float[np.ndarray, " nv"] | None = None,
    *,
    gravity: Float[np.ndarray, " 3"] | None = None,
) -> Float[np.ndarray, "nv k"]:
    """Y with G + M a = Y pi, pi the links' inertial parameters (10 (njoints - 1),).

    Of each joint's link ``pin.Inertia.toDynamicParameters``: mass, first moment, and inertia about
    the joint's frame, in its axes.

    Args:
        robot: the robot.
        q: configuration (nq,).
        acceleration: a (nv,); None at rest.
        gravity: another gravity than the model's (3,) [m/s^2].
    """
    memory = _scratch(robot)
    a = memory.still if acceleration is None else acceleration
    model = memory.model if gravity is None else memory.tilted(gravity)
    return owned(pin.computeJointTorqueRegressor(model, memory.data, q, memory.still, a))


def com(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, " 3"]:
    """Centre of mass in the world [m]."""
    memory = _scratch(robot)
    return owned(pin.centerOfMass(memory.model, memory.data, q))


def com_jacobian(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, "3 nv"]:
    """Jacobian of the centre of mass, world axes."""
    memory = _scratch(robot)
    return owned(pin.jacobianCenterOfMass(memory.model, memory.data, q))


def mass_matrix(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, "nv nv"]:
    """Joint-space inertia M(q), symmetric."""
    memory = _scratch(robot)
    return owned(pin.crba(memory.model, memory.data, q, pin.Convention.WORLD))


def momentum_map(robot: Robot, q: Float[np.ndarray, " nq"]) -> Float[np.ndarray, "6 nv"]:
    """Momentum (linear, angular about the centre of mass) by velocities, world axes."""
    memory = _scratch(robot)
    return owned(pin.computeCentroidalMap(memory.model, memory.data, q))


def momentum_rate(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    velocity: Float[np.ndarray, " nv"],
    acceleration: Float[np.ndarray, " nv"],
) -> Float[np.ndarray, " 6"]:
    """Rate of the momentum (linear, angular about the centre of mass), world axes [N, Nm]."""
    memory = _scratch(robot)
    rate = pin.computeCentroidalMomentumTimeVariation(
        memory.model, memory.data, q, velocity, acceleration
    )
    return owned(rate.vector)


def link_momentum_rate(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    velocity: Float[np.ndarray, " nv"],
    acceleration: Float[np.ndarray, " nv"],
    joint: int,
) -> Float[np.ndarray, " 6"]:
    """Rate of one link's momentum (linear, angular about the world's origin) [N, Nm]."""
    memory = _scratch(robot)
    model, data = memory.model, memory.data
    pin.forwardKinematics(model, data, q, velocity, acceleration)
    inertia, v = model.inertias[joint], data.v[joint]
    return owned(data.oMi[joint].act(inertia * data.a[joint] + inertia.vxiv(v)).vector)


def inverse_dynamics(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    motion: Motion | None = None,
    forces: Mapping[int, pin.Force] | None = None,
) -> Float[np.ndarray, " nv"]:
    """M dv/dt + C v + G less the generalised forces of spatial forces, in their joints' axes.

    It shares no step with `gravity` and the contacts' Jacobian.

    Args:
        robot: the robot.
        q: configuration (nq,).
        motion: velocity and acceleration; None at rest.
        forces: joint of the model -> force in the joint's axes.
    """
    memory = _scratch(robot)
    v, a = _rates(memory, motion)
    with _Applied(memory, forces or {}):
        return owned(pin.rnea(memory.model, memory.data, q, v, a, memory.forces))


def static_torque_derivative(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    forces: Mapping[int, pin.Force],
    gravity: Float[np.ndarray, " 3"] | None = None,
) -> Float[np.ndarray, "nv nv"]:
    """d(G - J' f)/dq at spatial forces on joints that turn with them.

    Args:
        robot: the robot.
        q: configuration (nq,).
        forces: joint of the model -> force in the joint's axes.
        gravity: another gravity than the model's (3,) [m/s^2].
    """
    memory = _scratch(robot)
    model = memory.model if gravity is None else memory.tilted(gravity)
    with _Applied(memory, forces):
        found = pin.computeStaticTorqueDerivatives(model, memory.data, q, memory.forces)
        return np.array(found)


def inverse_dynamics_derivatives(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    motion: Motion | None,
    forces: Mapping[int, pin.Force],
) -> tuple[Float[np.ndarray, "nv nv"], Float[np.ndarray, "nv nv"]]:
    """Derivatives of `inverse_dynamics` by q and by v, at spatial forces that turn with joints.

    Each at the other's, and the acceleration's, fixed numbers.
    """
    memory = _scratch(robot)
    v, a = _rates(memory, motion)
    with _Applied(memory, forces):
        found = pin.computeRNEADerivatives(memory.model, memory.data, q, v, a, memory.forces)
        return np.array(found[0]), np.array(found[1])


def velocity_derivatives(
    robot: Robot,
    q: Float[np.ndarray, " nq"],
    velocity: Float[np.ndarray, " nv"],
    attachments: Sequence[Attachment],
) -> Float[np.ndarray, "k 6 nv"]:
    """d(J v)/dq at fixed v for the local Jacobian J of each attached frame."""
    memory = _scratch(robot)
    model, data = memory.model, memory.data
    pin.computeForwardKinematicsDerivatives(model, data, q, velocity, memory.still)
    found = np.empty((len(attachments), 6, model.nv))
    for k, (joint, placement) in enumerate(attachments):
        found[k] = pin.getFrameVelocityDerivatives(model, data, joint, placement, _LOCAL)[0]
    return found


def inertia_derivative(
    robot: Robot, q: Float[np.ndarray, " nq"], acceleration: Float[np.ndarray, " nv"]
) -> Float[np.ndarray, "nv nv"]:
    """d(M a)/dq at fixed a."""
    memory = _scratch(robot)
    model, data = memory.model, memory.data
    at_rest = np.array(pin.computeGeneralizedGravityDerivatives(model, data, q))
    moving = pin.computeRNEADerivatives(model, data, q, memory.still, acceleration)[0]
    return np.asarray(moving - at_rest)


def _rates(memory: _Scratch, motion: Motion | None) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration, zero at rest."""
    if motion is None:
        return memory.still, memory.still
    return motion.velocity, motion.acceleration


class _Applied:
    """The working memory's forces, set for the length of a block and then zero again."""

    def __init__(self, memory: _Scratch, forces: Mapping[int, pin.Force]) -> None:
        self.memory, self.given = memory, forces

    def __enter__(self) -> None:
        for joint, force in self.given.items():
            self.memory.forces[joint] = force

    def __exit__(self, *_: object) -> None:
        for joint in self.given:
            self.memory.forces[joint].setZero()
