"""StandingDynamics: what a momentum-based controller computes of a robot at every step."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.errors import InvalidInputError
from copsense.stance import Stance, check_at_rest

_LOCAL = pin.ReferenceFrame.LOCAL


class StandingDynamics:
    """Dynamics of a robot on fixed contacts, M dv + h = B tau + J' f and J dv + bias = 0.

    One instance serves one controller: its arrays are working memory that the next `update`
    overwrites, and partly views of Pinocchio's own.

    Attributes, after `update`:
        M: mass matrix (nv, nv).
        h: bias forces C v + G (nv,).
        J: contact Jacobian (m, nv), contact axes.
        bias: J̇ v (m,).
        com, com_velocity: centre of mass (3,), world.
        angular_map: the angular rows of the centroidal momentum matrix (3, nv): its product with
            a velocity is the angular momentum about the centre of mass, world axes.
    """

    def __init__(self, stance: Stance) -> None:
        """Look up the contacts' places on the robot."""
        robot = stance.robot
        check_at_rest(stance, "a controller's stance")
        if robot.base_nv != 6 or any(c.kind == "planar" for c in stance.contacts):
            raise InvalidInputError(
                f"robot {robot.name!r} lives in a plane: a momentum-based controller is spatial. "
                "Use a robot with a free-floating base."
            )
        self.model: pin.Model = robot.model
        self.data: pin.Data = robot.model.createData()
        self.mass: float = robot.mass
        # Views of Pinocchio's arrays: to ask it for them takes longer than to read them.
        self.M: Float[np.ndarray, "nv nv"] = self.data.M
        self.h: Float[np.ndarray, " nv"] = self.data.nle
        self.angular_map: Float[np.ndarray, "3 nv"] = self.data.Ag[3:]
        self.com: Float[np.ndarray, " 3"] = self.data.com[0]
        self.com_velocity: Float[np.ndarray, " 3"] = self.data.vcom[0]
        self._at_com = pin.SE3.Identity()
        self._base: pin.SE3 = self.data.oMi[1]
        # Row-major, so that J' is as LAPACK wants it.
        self.J: Float[np.ndarray, "m nv"] = np.zeros((stance.rows[-1].stop, robot.model.nv))
        self.bias: Float[np.ndarray, " m"] = np.zeros(len(self.J))
        self._contacts = []
        for contact, world, rows in zip(
            stance.contacts, stance.placements, stance.rows, strict=True
        ):
            at = contact.on(robot)
            # A point contact's axes are fixed in the world.
            axes = world.rotation.T if contact.kind == "point" else None
            self._contacts.append((at.joint, at.placement, axes, rows))
        self._begin(stance)
        self.update(stance.q, np.zeros(robot.model.nv))

    def _begin(self, stance: Stance) -> None:
        """Prepare what a robot with drives and loads has beside this."""

    def update(self, q: Float[np.ndarray, " nq"], v: Float[np.ndarray, " nv"]) -> None:
        """Compute everything at a configuration and velocity."""
        model, data = self.model, self.data
        # One pass for M, h, J, A_G and the accelerations of the links under dv = 0.
        pin.computeAllTerms(model, data, q, v)
        for joint, place, axes, rows in self._contacts:
            local = pin.getFrameJacobian(model, data, joint, place, _LOCAL)
            if axes is None:
                self.J[rows] = local
                self.bias[rows] = pin.getFrameAcceleration(model, data, joint, place, _LOCAL).vector
            else:
                turn = axes @ data.oMi[joint].rotation @ place.rotation
                drift = pin.getFrameClassicalAcceleration(model, data, joint, place, _LOCAL)
                self.J[rows] = turn @ local[:3]
                self.bias[rows] = turn @ drift.linear

    def base_wrench(
        self, force: Float[np.ndarray, " 3"], moment: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, " 6"]:
        """A wrench about the centre of mass, world axes, as one on the base in its own axes."""
        self._at_com.translation = self.com
        return self._base.actInv(self._at_com.act(pin.Force(force, moment))).vector

    def moment(self, base_wrench: Float[np.ndarray, " 6"]) -> Float[np.ndarray, " 3"]:
        """The moment about the centre of mass, world axes, of a wrench on the base."""
        self._at_com.translation = self.com
        return self._at_com.actInv(self._base.act(pin.Force(base_wrench))).angular
