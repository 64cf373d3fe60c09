"""Sensors: the state as a controller sees it, with noise and odometry, and measured wrenches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from copsense.simulation.odometry import FootOdometry
from copsense.simulation.scenario import Scenario
from copsense.simulation.simulator import Snapshot
from copsense.stance import Stance

_STANDS = 0.9  # share of the weight that the ground must carry,
_SETTLED = 0.02  # and for how long [s], five time constants of a contact, before odometry begins


class Sensors:
    """The sensors of one run: state for the controller, wrenches for controller and record."""

    def __init__(self, scenario: Scenario, stance: Stance) -> None:
        """Seed the noise; `stance` is the robot as the controller knows it."""
        self._noise, self._model = scenario.noise, stance.robot.model
        self._random = np.random.default_rng(scenario.seed)
        # A stream of their own: noise of the wrenches does not change that of the joints.
        self._wrench_random = np.random.default_rng([scenario.seed, 1])
        noise = self._noise
        self._quiet = not (noise.position or noise.velocity)
        self._since, self._weight = np.inf, stance.robot.weight
        self._spread = np.repeat([noise.force, noise.moment], 3)
        self._exact = not np.any(self._spread)
        self._odometry = (
            None if scenario.odometry is None else FootOdometry(stance, scenario.odometry)
        )

    def read(self, now: Snapshot) -> tuple[np.ndarray, np.ndarray]:
        """Measured configuration (nq,) and velocity (nv,)."""
        q, v = now.q, now.v
        if not self._quiet:
            n = self._model.nv - 6
            turn, v = np.zeros(self._model.nv), now.v.copy()
            turn[6:] = self._noise.position * self._random.standard_normal(n)
            v[6:] += self._noise.velocity * self._random.standard_normal(n)
            q = pin.integrate(self._model, now.q, turn)
        if self._odometry and self._stood(now):
            q, v = self._odometry.estimate(q, v, now.wrenches)
        return q, v

    def _stood(self, now: Snapshot) -> bool:
        """Whether the robot has stood for a while since the start.

        In the first milliseconds of a simulation the ground does not carry the robot yet. A foot
        that trembles without load would look like a moving base, so until then the true state of
        the base is used.
        """
        if now.time - self._since < _SETTLED:
            carries = float(now.wrenches[:, 2].sum()) > _STANDS * self._weight
            self._since = min(self._since, now.time) if carries else np.inf
        return now.time - self._since >= _SETTLED

    def measured(self, now: Snapshot) -> Snapshot:
        """The snapshot with noise on its wrenches."""
        if self._exact:
            return now
        noise = self._spread * self._wrench_random.standard_normal(now.wrenches.shape)
        return replace(now, wrenches=now.wrenches + noise)
