"""What a robot is asked for, and the models that cannot be one."""

import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense.errors import InvalidInputError
from copsense.limits import torque_limits
from copsense.simulation.disturbance import Motors


def biped(order):
    """A biped of two hips and two knees, its joints added in an order such as "hip, knee"."""
    model = pin.Model()
    model.name = "biped"
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    model.appendBodyToJoint(base, pin.Inertia.FromSphere(10.0, 0.2), pin.SE3.Identity())
    for joint in order:
        side, kind = joint.split("_")
        lateral = 0.1 if side == "l" else -0.1
        parent = base if kind == "hip" else model.getJointId(f"{side}_hip")
        drop = np.array([0.0, lateral if kind == "hip" else 0.0, -0.2])
        limb = model.addJoint(parent, pin.JointModelRX(), pin.SE3(np.eye(3), drop), joint)
        model.appendBodyToJoint(limb, pin.Inertia.FromSphere(2.0, 0.05), pin.SE3.Identity())
        if kind == "knee":
            sole = pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.2]))
            model.addFrame(pin.Frame(f"{side}_sole", limb, sole, pin.FrameType.OP_FRAME))
    return model


def test_a_model_that_is_not_depth_first_is_rejected():
    with pytest.raises(
        InvalidInputError, match=r"depth-first order.* carried by l_hip, r_hip"
    ) as caught:
        copsense.Robot.from_model(biped(["l_hip", "r_hip", "l_knee", "r_knee"]))
    assert "root_joint" not in str(caught.value)
    assert "limb" in str(caught.value)
    # Its twin in depth-first order is the same robot, and its derivatives are right.
    robot = copsense.Robot.from_model(biped(["l_hip", "l_knee", "r_hip", "r_knee"]))
    q = robot.configuration({"l_hip": 0.1, "r_hip": -0.2, "l_knee": 0.2, "r_knee": 0.1})
    stance = copsense.Stance(robot, q, [copsense.Contact("l_sole"), copsense.Contact("r_sole")])
    copsense.check_sensitivity(stance, copsense.minimum_wrench(1.0))


def test_position_limits_are_the_models_and_infinite_where_it_has_none(icub, stance_of):
    lower, upper = icub.robot.position_limits
    knee = icub.robot.torque_names.index("l_knee")
    model = icub.robot.model
    assert (lower[knee], upper[knee]) == (model.lowerPositionLimit[7 + knee], upper[knee])
    assert np.all(lower < upper)
    without = model.copy()
    without.lowerPositionLimit = np.zeros(model.nq)
    without.upperPositionLimit = np.zeros(model.nq)
    lower, upper = copsense.Robot.from_model(without).position_limits
    assert np.all(lower == -np.inf)
    assert np.all(upper == np.inf)


def test_effort_limits_leave_placeholders_out(icub):
    efforts = dict(zip(icub.robot.torque_names, icub.robot.effort_limits, strict=True))
    assert efforts["l_knee"] == 37.0
    assert efforts["torso_yaw"] == np.inf  # 50 000 Nm in the model


def test_the_limb_of_a_contact_is_the_chain_from_the_base(icub):
    names = [icub.robot.model.names[i] for i in icub.limb("l_sole")]
    assert names == [f"l_{j}" for j in ("hip_pitch", "hip_roll", "hip_yaw", "knee")] + [
        "l_ankle_pitch",
        "l_ankle_roll",
    ]
    assert icub.limb(icub.contacts[1]) == icub.limb("r_sole")
    with pytest.raises(copsense.errors.UnknownNameError, match="Did you mean l_sole"):
        icub.limb("l_soul")


def test_the_models_effort_limit_means_one_thing(icub):
    """To the limits of statics, to the weights of a criterion and to the motors of a simulation."""
    efforts = icub.robot.effort_limits
    assert not np.all(np.isfinite(efforts))
    assert not np.array_equal(efforts, icub.robot.model.upperEffortLimit[6:])
    assert np.array_equal(torque_limits(icub, "model"), efforts)
    assert np.array_equal(Motors(limit="model").limits(icub.robot), efforts)
    with pytest.raises(InvalidInputError, match="placeholder"):
        copsense.solve_equilibrium(icub, copsense.weighted_torque("1/limit^2"))


def test_zeros_for_limits_reject_no_posture(icub):
    """Zeros, as some files write no limits, are none: a posture is not held against them."""
    model = icub.robot.model.copy()
    model.lowerPositionLimit = np.zeros(model.nq)
    model.upperPositionLimit = np.zeros(model.nq)
    robot = copsense.Robot.from_model(model)
    q = np.array(icub.q)
    q[7:] = 0.0
    q[9] = 7.0
    robot.check_positions(q)
    assert np.all(copsense.Stance(robot, q, [copsense.Contact("l_sole")]).joint_limit_excess == 0)
