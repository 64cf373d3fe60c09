"""Actuation: from the commanded torques to those applied (delay, bandwidth, limits)."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.robot import Robot
from copsense.simulation.disturbance import Motors


class Actuation:
    """The motors of one run; before the start, the first command counts as already given.

    Attributes:
        plain: whether every command is applied as it is, at once.
    """

    def __init__(self, motors: Motors, robot: Robot, time_step: float) -> None:
        """Prepare the delay line.

        Raises:
            InvalidInputError: the delay is not a multiple of the time step.
        """
        ratio = motors.delay / time_step
        self._delay = round(ratio)
        if abs(ratio - self._delay) > 1e-6 * max(ratio, 1.0):
            raise InvalidInputError(
                f"the motors' delay of {motors.delay:g} s is not a multiple of the physics' time "
                f"step of {time_step:g} s. Give {self._delay * time_step:g} s."
            )
        self._limits = motors.limits(robot)
        self._limited = bool(np.any(np.isfinite(self._limits)))
        # A first-order low-pass, exact for a command held during the step.
        self._keep = (
            0.0
            if motors.bandwidth is None
            else math.exp(-2.0 * math.pi * motors.bandwidth * time_step)
        )
        self.plain: bool = not (self._delay or self._limited or self._keep)
        self._line: deque[np.ndarray] = deque()
        self._applied: np.ndarray | None = None

    def apply(self, command: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The torques of the next physics step; to be called once for each."""
        if self.plain:
            return command
        if self._applied is None:
            self._line.extend([command] * self._delay)
            self._applied = self._clip(command)
        self._line.append(command)
        arrived = self._clip(self._line.popleft())
        self._applied = self._keep * self._applied + (1.0 - self._keep) * arrived
        return self._applied

    def _clip(self, torques: np.ndarray) -> np.ndarray:
        return np.clip(torques, -self._limits, self._limits) if self._limited else torques
