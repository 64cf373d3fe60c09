"""PushForces: the pushes of a scenario as a generalised force."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.simulation.scenario import Scenario
from copsense.simulation.simulator import Snapshot
from copsense.stance import Stance


class PushForces:
    """The pushes of one run."""

    def __init__(self, scenario: Scenario, stance: Stance, step: float) -> None:
        """Prepare for a robot and a time step [s] of the physics."""
        self._step, self._pushes, self._model = step, scenario.pushes, stance.robot.model
        self._frames = [stance.robot.frame_id(push.frame) for push in self._pushes]
        self._data = self._model.createData()

    def rest(self, time: float, duration: float) -> bool:
        """Whether no push acts for a while from a time on [s]."""
        return not any(push.share(time, duration) for push in self._pushes)

    def at(self, now: Snapshot) -> Float[np.ndarray, " nv"] | None:
        """Generalised force (nv,) of all pushes during the next step, or None without any."""
        if not self._pushes:
            return None
        shares = [push.share(now.time, self._step) for push in self._pushes]
        if not any(shares):
            return None
        total = np.zeros(self._model.nv)
        pin.computeJointJacobians(self._model, self._data, now.q)
        pin.updateFramePlacements(self._model, self._data)
        for push, frame, share in zip(self._pushes, self._frames, shares, strict=True):
            J = pin.getFrameJacobian(
                self._model, self._data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            total += share * (J[:3].T @ np.array(push.force))
        return total
