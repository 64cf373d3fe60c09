"""Simulator: what a closed loop needs of a physics engine; small, so that tests can fake it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from copsense.content import ShortRepr
from copsense.errors import CopsenseError
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot(ShortRepr):
    """The state of a robot in motion, in the analysis's conventions.

    Attributes:
        time: since the last reset [s].
        q: configuration (nq,): base position, quaternion (x, y, z, w), joints.
        v: velocity (nv,): the base in its own frame, then the joints.
        wrenches: wrench of the environment on the robot at each contact (nc, 6), contact axes,
            about the contact frame's origin [N, Nm], during the last step; zero after a reset.
        positions: origin of each contact frame (nc, 3), world [m].
        rotations: axes of each contact frame as columns (nc, 3, 3), world; they turn with the
            foot, also for point contacts.
    """

    time: float
    q: Float[np.ndarray, " nq"]
    v: Float[np.ndarray, " nv"]
    wrenches: Float[np.ndarray, "nc 6"]
    positions: Float[np.ndarray, "nc 3"]
    rotations: Float[np.ndarray, "nc 3 3"]


class SimulatorStoppedError(CopsenseError):
    """The engine cannot continue: a number is not finite, or the engine would reset itself.

    Attributes:
        time: of the last valid state [s].
    """

    def __init__(self, reason: str, time: float) -> None:
        """Store reason and time."""
        self.reason = reason
        self.time = time
        super().__init__(f"{reason}, at {time:.3f} s")

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild copies and pickles from the data, not from the message."""
        return type(self), (self.reason, self.time)


@runtime_checkable
class Simulator(Protocol):
    """A robot on its contacts under torques.

    Attributes:
        stance: robot and contacts; its configuration is where a simulation starts.
        time_step: duration of one step [s].
    """

    @property
    def stance(self) -> Stance:
        """Robot and contacts; its configuration is where a simulation starts."""

    @property
    def time_step(self) -> float:
        """Duration of one step [s]."""

    def reset(self, velocity: Float[np.ndarray, " nv"] | None = None) -> Snapshot:
        """Put the robot at the stance's configuration, time zero.

        Args:
            velocity: initial velocity (nv,); None for rest.
        """

    def step(
        self,
        torques: Float[np.ndarray, " n"],
        external: Float[np.ndarray, " nv"] | None = None,
    ) -> Snapshot:
        """Advance by one time step.

        Args:
            torques: joint torques (n,) in the robot's order [Nm, N], held during the step.
            external: generalised force other than of motors and contacts (nv,), in the axes of
                the velocity [N, Nm].

        Raises:
            SimulatorStoppedError: the motion is no longer finite.
        """


@runtime_checkable
class RepeatingSimulator(Simulator, Protocol):
    """A simulator that advances by several time steps at once, without the states in between."""

    def repeat(self, torques: Float[np.ndarray, " n"], steps: int) -> Snapshot:
        """What as many calls of `step` with the same torques give, the last one's snapshot.

        Args:
            torques: joint torques (n,) in the robot's order [Nm, N], held during all steps.
            steps: how many.

        Raises:
            SimulatorStoppedError: the motion is no longer finite; its time is that of the call.
        """


@runtime_checkable
class AlterableSimulator(Simulator, Protocol):
    """A simulator whose ground and robot may differ from the controller's model."""

    def set_friction(self, friction: float, contact: str | None = None) -> None:
        """Change the ground's friction, under one contact or all, until the next reset."""

    def altered(self, stance: Stance) -> Simulator:
        """The same simulator with another robot on the same contacts."""
