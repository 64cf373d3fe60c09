"""StandingDynamics: what a momentum-based controller computes of a robot at every step."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.stance import Stance

_LOCAL = pin.ReferenceFrame.LOCAL


class StandingDynamics:
    """Dynamics of a robot on fixed contacts, M dv + h = B tau + J' f and J dv + bias = 0.

    One instance serves one controller: it keeps its working memory between steps.

    Attributes, after `update`:
        M: mass matrix (nv, nv).
        h: bias forces C v + G (nv,).
        J: contact Jacobian (m, nv), contact axes.
        bias: J̇ v (m,).
        com, com_velocity: centre of mass (3,), world.
        angular_momentum: about the centre of mass (3,), world axes.
        angular_map: the angular rows of the centroidal momentum matrix (3, nv).
    """

    def __init__(self, stance: Stance) -> None:
        """Look up the contacts' places on the robot."""
        robot = stance.robot
        if robot.base_nv != 6 or any(c.kind == "planar" for c in stance.contacts):
            raise InvalidInputError(
                f"robot {robot.name!r} lives in a plane: a momentum-based controller is spatial. "
                "Use a robot with a free-floating base."
            )
        self.model, self.data = robot.model, robot.model.createData()
        self.mass = robot.mass
        self._zero = np.zeros(self.model.nv)
        self._contacts = []
        for contact, world in zip(stance.contacts, stance.placements, strict=True):
            frame = robot.frame(contact.frame)
            place = frame.placement * pin.SE3(contact.rotation, np.array(contact.offset))
            # A point contact's axes are fixed in the world.
            axes = world.rotation.T if contact.kind == "point" else None
            self._contacts.append((int(frame.parentJoint), place, axes))
        self.update(stance.q, self._zero)

    def update(self, q: Float[np.ndarray, " nq"], v: Float[np.ndarray, " nv"]) -> None:
        """Compute everything at a configuration and velocity."""
        model, data = self.model, self.data
        self.M = pin.crba(model, data, q)
        self.h = pin.nonLinearEffects(model, data, q, v)
        pin.ccrba(model, data, q, v)
        self.com = data.com[0].copy()
        self.com_velocity = data.hg.linear / self.mass
        self.angular_momentum = data.hg.angular.copy()
        self.angular_map = data.Ag[3:].copy()
        pin.computeJointJacobians(model, data, q)
        pin.forwardKinematics(model, data, q, v, self._zero)
        rows, drifts = [], []
        for joint, place, axes in self._contacts:
            local = pin.getFrameJacobian(model, data, joint, place, _LOCAL)
            if axes is None:
                drift = pin.getFrameAcceleration(model, data, joint, place, _LOCAL).vector
                rows.append(local)
                drifts.append(drift)
            else:
                turn = axes @ data.oMi[joint].rotation @ place.rotation
                drift = pin.getFrameClassicalAcceleration(model, data, joint, place, _LOCAL)
                rows.append(turn @ local[:3])
                drifts.append(turn @ drift.linear)
        self.J, self.bias = np.vstack(rows), np.concatenate(drifts)

    def base_wrench(
        self, force: Float[np.ndarray, " 3"], moment: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, " 6"]:
        """A wrench about the centre of mass, world axes, as one on the base in its own axes."""
        base = self.data.oMi[1].rotation
        arm = pin.skew(self.com - self.data.oMi[1].translation)
        return np.concatenate([base.T @ force, base.T @ (moment + arm @ force)])
