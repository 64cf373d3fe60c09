"""Effort limits are what the actuators of an MJCF can exert; MuJoCo's own forces judge."""

import mujoco
import numpy as np
import pytest
from support.mjcf import walker

import copsense

ACTUATORS = {
    "<motor joint='{j}' gear='50' ctrlrange='-2 1' ctrllimited='true'/>": 50.0,
    "<motor joint='{j}' gear='-20' ctrlrange='-1 1'/>": 20.0,
    "<motor joint='{j}' forcerange='-30 40'/>": 30.0,
    "<motor joint='{j}' forcerange='0 40'/>": 40.0,
    "<position joint='{j}' kp='100' forcerange='-25 25' gear='2'/>": 50.0,
    "<general joint='{j}' gainprm='3' ctrlrange='-4 4' forcerange='-9 9'/>": 9.0,
    "<motor joint='{j}' ctrlrange='-1 1'/><motor joint='{j}' gear='7' ctrlrange='-1 1'/>": 8.0,
    "<position joint='{j}' kp='100' ctrlrange='-1 1'/>": np.inf,
    "<motor joint='{j}'/>": np.inf,
}
OTHER = "<motor joint='r_knee'/>"


@pytest.mark.parametrize(("actuators", "limit"), ACTUATORS.items(), ids=ACTUATORS)
def test_an_effort_limit_is_the_largest_force_of_the_joints_actuators(actuators, limit):
    text = walker(tail=f"<actuator>{actuators.format(j='l_knee')}{OTHER}</actuator>")
    robot = copsense.load_robot(text)
    limits = dict(zip(robot.torque_names, robot.effort_limits, strict=True))
    assert limits.pop("l_knee") == limit
    assert set(limits.values()) == {np.inf}
    if np.isfinite(limit):
        mj = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(mj)
        forces = []
        for push in (-1e6, 1e6):
            data.ctrl[:] = push
            mujoco.mj_forward(mj, data)
            forces.append(abs(float(data.qfrc_actuator[mj.joint("l_knee").dofadr[0]])))
        # Toward the weaker side, except where the actuator pulls one way only.
        assert limit in (pytest.approx(min(forces)), pytest.approx(max(forces)))


def test_the_joints_own_range_of_actuator_forces_counts_too():
    text = walker(tail="<actuator><motor joint='l_knee' forcerange='-90 90'/></actuator>")
    robot = copsense.load_robot(
        text.replace("name='l_knee'", "name='l_knee' actuatorfrcrange='-60 60'")
    )
    limits = dict(zip(robot.torque_names, robot.effort_limits, strict=True))
    assert limits["l_knee"] == 60.0


def test_a_tendons_motor_without_a_range_has_no_limit():
    tendon = (
        "<tendon><fixed name='both'><joint joint='l_knee' coef='1'/><joint joint='r_knee' "
        "coef='1'/></fixed></tendon><actuator><motor tendon='both'/></actuator>"
    )
    robot = copsense.load_robot(walker(tail=tendon))
    limits = dict(zip(robot.torque_names, robot.effort_limits, strict=True))
    assert np.inf in limits.values()
