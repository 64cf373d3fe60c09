"""Simulator: what a rollout needs of a physics engine, small enough to be faked in a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from copsense.errors import CopsenseError
from copsense.stance import Stance


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A robot in motion, in the analysis's conventions.

    Attributes:
        time: since the last reset [s].
        q: configuration (nq,): base position, quaternion (x, y, z, w), joints.
        v: velocity (nv,): the base in its own frame, then the joints.
        wrenches: wrench of the environment on the robot at each contact (nc, 6), contact axes,
            about the contact frame's origin [N, Nm], during the step that led here; zero after a
            reset.
        positions: origin of each contact frame (nc, 3), world [m].
        rotations: axes of each contact frame as columns (nc, 3, 3), world; they turn with the
            foot, for point contacts too.
    """

    time: float
    q: Float[np.ndarray, " nq"]
    v: Float[np.ndarray, " nv"]
    wrenches: Float[np.ndarray, "nc 6"]
    positions: Float[np.ndarray, "nc 3"]
    rotations: Float[np.ndarray, "nc 3 3"]


class SimulatorStoppedError(CopsenseError):
    """The engine cannot go on: a number is not finite, or it would start over by itself.

    Attributes:
        time: of the last sound state [s].
    """

    def __init__(self, reason: str, time: float) -> None:
        """Store the time beside the reason."""
        self.reason, self.time = reason, time
        super().__init__(f"{reason}, at {time:.3f} s")

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are built from the data, not from the message."""
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
            velocity: what it moves with (nv,); None at rest.
        """

    def step(
        self,
        torques: Float[np.ndarray, " n"],
        external: Float[np.ndarray, " nv"] | None = None,
    ) -> Snapshot:
        """Go on by one time step.

        Args:
            torques: joint torques (n,) in the robot's order [Nm, N], held during the step.
            external: generalised force of everything but motors and contacts (nv,), in the axes
                of the velocity [N, Nm].

        Raises:
            SimulatorStoppedError: the motion is not finite any more.
        """


@runtime_checkable
class AlterableSimulator(Simulator, Protocol):
    """A simulator whose ground and robot may differ from what the controller believes."""

    def set_friction(self, friction: float, contact: str | None = None) -> None:
        """Change the ground's friction, under one contact or all, until the next reset."""

    def altered(self, stance: Stance) -> Simulator:
        """The same simulator of another robot on the same contacts."""
