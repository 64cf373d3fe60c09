"""SwayController: a sway with the very torques that the analysis says hold it in motion.

The balancing controller knows the CoM's acceleration but not that of the posture, so that a fast
sway under it shares the load a little differently from its criterion. Here the torques are those of
the timed path's equilibria; the balancing controller adds only what brings the robot back to it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from copsense.controllers import BalancingController, Command, Observation, PathReference, Sine
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits
from copsense.stance import Stance
from copsense.statics import solve_equilibrium
from copsense.timed_path import Sway

_PLACES = 33  # from one turning point to the other, where the torques are solved


class SwayController:
    """The torques of a sway's equilibria in motion, and feedback around it.

    Args:
        reference: a `Sine` along a path.
        criterion: how the load is shared.
        limits: what wrenches and torques must respect on the reference; None for nothing.

    Raises:
        InvalidInputError: the reference is not a sine.
        CopsenseError: no equilibrium in motion somewhere on the way.
    """

    def __init__(
        self, reference: PathReference, criterion: Criterion, limits: Limits | None = None
    ) -> None:
        """Solve the equilibria in motion from one turning point to the other."""
        signal = reference.signal
        if not isinstance(signal, Sine) or not signal.amplitude:
            raise InvalidInputError(
                f"{signal!r} is not a sway. Give a reference whose signal is a Sine."
            )
        self.stance: Stance = reference.path.at(0.0)[0]
        self.name: str = f"{criterion.name} in motion"
        self._signal = signal
        self._feedback = BalancingController(self.stance, criterion)
        reach = abs(signal.amplitude)
        sway = Sway(reference.path, 1.0 / signal.frequency, centre=0.0, amplitude=reach)
        phase = np.linspace(-math.pi / 2, math.pi / 2, _PLACES)
        found = [
            solve_equilibrium(sway.at(float(s)).stance, criterion, limits)
            for s in reach * np.sin(phase)
        ]
        # Even about the turning points, where the sway stands still.
        ends = "clamped"
        self._torques = CubicSpline(phase, [each.torques for each in found], bc_type=ends)
        self._wrenches = CubicSpline(phase, [each.wrenches for each in found], bc_type=ends)

    def __call__(self, observation: Observation) -> Command:
        """The torques at a state, and the wrenches of the sway at that time."""
        value = self._signal.at(observation.time)[0] / abs(self._signal.amplitude)
        phase = math.asin(min(max(value, -1.0), 1.0))
        target = observation.target
        there = replace(observation, q=target.posture, v=target.velocity)
        wanted = np.array(self._feedback(there).torques)
        torques = self._torques(phase) + self._feedback(observation).torques - wanted
        return Command(torques, self._wrenches(phase))
