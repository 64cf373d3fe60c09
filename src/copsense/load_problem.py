"""LoadProblem: which contact forces carry a load, and which torques they take.

The one statement of "share this load": with f the stacked contact forces and tau the torques,

    base_map f = base_wrench        tau = torque_offset - joint_map f

At rest base_map = J_b', joint_map = J_j' and the right-hand sides are gravity's, G_b and G_j, less
the loads; in motion (`Stance.moving`) inertia is among them. Joints without a motor stand among the
base's rows; forces of loops and couplings stand behind the contacts'. A controller states its own
(see `controllers.balancing`). What a criterion prefers among such f is `Quadratic.over_forces`;
what limits allow, `LimitRows.over_forces`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float

from copsense.arrays import read_only
from copsense.content import ShortRepr
from copsense.row_space import RowSpace
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class LoadProblem(ShortRepr):
    """Which contact forces f are allowed, and which torques they take.

    A controller's arrays are good until its next step: copy what is to be kept.

    Attributes:
        base_map: stacked contact forces to the wrench on the base (nb, m).
        base_wrench: the wanted wrench of all contacts on the base (nb,), base axes.
        joint_map: contact forces to motor torques (n, m).
        torque_offset: (n,) [Nm].
        joint_inertia: M_j (n, n), for a criterion that weighs with its inverse.
        response: of a robot in motion whose other accelerations follow that of its base: how the
            rows of the base and of the motors change per wrench on the base (nb + n, 6); None where
            they do not.
    """

    base_map: Float[np.ndarray, "nb m"]
    base_wrench: Float[np.ndarray, " nb"]
    joint_map: Float[np.ndarray, "n m"]
    torque_offset: Float[np.ndarray, " n"]
    joint_inertia: Float[np.ndarray, "n n"]
    response: Float[np.ndarray, "r 6"] | None = None

    @classmethod
    def of(cls, stance: Stance) -> LoadProblem:
        """The load of a stance: its weight, its inertia, and what else is known to act on it."""
        return _of(stance)

    @cached_property
    def equations(self) -> RowSpace:
        """Which f balance the base: the smallest of them, and what they leave free."""
        return RowSpace(self.base_map, max(self.base_map.shape) * np.finfo(float).eps)

    def torques(self, forces: Float[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
        """The torques that contact forces take (n,) [Nm]."""
        return np.asarray(self.torque_offset - self.joint_map.dot(forces))

    def yielding(self) -> LoadProblem:
        """The same where the wrench on the base may be another than the wanted one.

        Accelerations follow it. The base's rows are the first six; those that cannot change, for
        want of motors, are stated again behind them.
        """
        if self.response is None:
            return self
        nb, B, w = len(self.base_map), self.base_map[:6], self.base_wrench[:6]
        free, motors = self.response[6:nb], self.response[nb:]
        stiff = np.eye(6) - self.response[:6]
        return replace(
            self,
            base_map=np.vstack([B, stiff.dot(B), self.base_map[6:] - free.dot(B)]),
            base_wrench=np.concatenate([w, stiff.dot(w), self.base_wrench[6:] - free.dot(w)]),
            joint_map=self.joint_map - motors.dot(B),
            torque_offset=self.torque_offset - motors.dot(w),
            response=None,
        )

    def imbalance(self, forces: Float[np.ndarray, " m"]) -> float:
        """Largest force or moment on the base by which contact forces miss the load [N, Nm]."""
        return float(np.abs(self.base_map.dot(forces) - self.base_wrench).max())


@lru_cache(maxsize=4)  # one criterion after another asks at a posture
def _of(stance: Stance) -> LoadProblem:
    robot = stance.robot
    nb, map_, N = robot.unactuated_nv, stance.constraints.T, stance.balance
    inertia = stance.mass_matrix[robot.base_nv :, robot.base_nv :]
    if robot.actuation is not None:
        map_, N = robot.by_drive(map_), robot.by_drive(N)
        inertia = robot.actuation.inverse @ inertia @ robot.actuation.inverse.T
        map_, N, inertia = read_only(map_), read_only(N), read_only(inertia)
    return LoadProblem(map_[:nb], N[:nb], map_[nb:], N[nb:], inertia)
