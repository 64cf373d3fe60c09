"""The planar four-bar linkage of [Romano2016] Section IV as a rigid-body model."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from copsense.errors import InvalidInputError
from copsense.robot import Robot

JOINTS = ("l_hip", "l_ankle", "r_hip", "r_ankle")


def four_bar_robot(
    leg_length: float = 0.5,
    rod_length: float = 0.14,
    leg_mass: float = 8.25,
    body_mass: float = 16.5,
) -> Robot:
    """Two legs and the rod between their hips, in the vertical y-z plane, with massless feet.

    The left foot stands at +y, as on a humanoid that faces +x; the paper's x axis is therefore
    -y, and its moments about its z axis are moments about -x. Link masses are points: the legs'
    at mid-leg, the body's at the middle of the rod.

    Args:
        leg_length: l, hip to ankle [m].
        rod_length: d, between the hips [m]; the feet stand d apart.
        leg_mass: m_l [kg].
        body_mass: m_b [kg]. The default is twice the leg's ([Romano2016] Hypothesis 1-iii), 33 kg
            in all as on the iCub.

    Raises:
        InvalidInputError: a length or the total mass is not positive, or a mass is negative.
    """
    for name, value in {"leg_length": leg_length, "rod_length": rod_length}.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidInputError(f"{name} must be a positive length [m], got {value}.")
    if not (leg_mass >= 0 and body_mass >= 0 and 0 < 2 * leg_mass + body_mass < np.inf):
        raise InvalidInputError(
            f"masses must be non-negative and not all zero, got leg {leg_mass}, body {body_mass}."
        )
    model = pin.Model()
    model.name = "four_bar"
    # The planar joint's x, y, rotation become the world's y, z, rotation about x.
    plane = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    base = model.addJoint(0, pin.JointModelPlanar(), pin.SE3(plane, np.zeros(3)), "root_joint")
    _point_mass(model, base, body_mass, np.zeros(3))
    for side, sign in (("l", 1.0), ("r", -1.0)):
        at_hip = pin.SE3(np.eye(3), np.array([sign * rod_length / 2, 0.0, 0.0]))
        hip = model.addJoint(base, pin.JointModelRZ(), at_hip, f"{side}_hip")
        down = np.array([0.0, -leg_length, 0.0])
        _point_mass(model, hip, leg_mass, down / 2)
        ankle = model.addJoint(hip, pin.JointModelRZ(), pin.SE3(np.eye(3), down), f"{side}_ankle")
        sole = pin.SE3(plane.T, np.zeros(3))
        model.addFrame(pin.Frame(f"{side}_sole", ankle, 0, sole, pin.FrameType.OP_FRAME))
    return Robot.from_model(model, name="four_bar")


def four_bar_angles(xi: float) -> dict[str, float]:
    """Joint angles [rad] at the paper's coordinate xi, the angle between rod and leg.

    At xi = pi/2 the legs are vertical; below it the body has moved to the paper's +x, which is -y.
    """
    lean = np.pi / 2 - xi
    return {"l_hip": lean, "l_ankle": -lean, "r_hip": lean, "r_ankle": -lean}


def _point_mass(model: pin.Model, joint: int, mass: float, where: np.ndarray) -> None:
    model.appendBodyToJoint(joint, pin.Inertia(mass, where, np.zeros((3, 3))), pin.SE3.Identity())
