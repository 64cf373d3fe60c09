"""What the ground did to a foot, from sensors anywhere between it and the base."""

import re
from pathlib import Path

import icub_models
import numpy as np
import pinocchio as pin
import pytest

from copsense import Contact
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.logs import Log, WrenchSeries
from copsense.logs.ground_wrenches import ground_wrenches
from copsense.logs.log_motion import LogMotion
from copsense.robot import Robot

ROWS = 3
FOOT = Contact("l_sole")


@pytest.fixture(scope="module")
def urdf():
    return Path(icub_models.get_model_file("iCubGenova04")).read_text("utf-8")


@pytest.fixture(scope="module")
def robot(urdf):
    return Robot.from_urdf(urdf)


@pytest.fixture(scope="module")
def motion(robot):
    rng = np.random.default_rng(5)
    q = np.array([pin.neutral(robot.model) for _ in range(ROWS)])
    q[:, 7:] += rng.uniform(-0.5, 0.5, (ROWS, robot.model.nq - 7))
    q[:, 3:7] = rng.normal(size=(ROWS, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v, a = rng.normal(size=(2, ROWS, robot.model.nv))
    return LogMotion(q, v, a, np.ones(ROWS, bool), 0.1)


@pytest.fixture(scope="module")
def truth():
    return np.random.default_rng(6).normal(size=(ROWS, 6)) * 50


def read(robot, motion, *sensors, world=False, contacts=(FOOT,)):
    log = Log("a log", np.arange(ROWS) * 0.1, ("j",), np.zeros((ROWS, 1)), sensors)
    return ground_wrenches(log, robot, contacts, motion, world)


def measured_in_leg(urdf, robot, motion, truth, sensor):
    """What a joint in the sensor's place transmits: inverse dynamics of a robot that has one."""
    joint = rf'(<joint name="{sensor}" type=)"fixed">'
    moving = (
        r'\1"revolute"><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    )
    text, count = re.subn(joint, moving, urdf)
    assert count == 1
    other = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    data, found = other.createData(), []
    foot = other.frames[other.getFrameId("l_sole")]
    for i in range(ROWS):
        q, v, a = pin.neutral(other), np.zeros(other.nv), np.zeros(other.nv)
        q[:7], v[:6], a[:6] = (
            motion.configurations[i, :7],
            motion.velocities[i, :6],
            motion.accelerations[i, :6],
        )
        for name in robot.joint_names:
            own, its = (
                robot.model.joints[robot.joint_id(name)],
                other.joints[other.getJointId(name)],
            )
            q[its.idx_q] = motion.configurations[i, own.idx_q]
            v[its.idx_v] = motion.velocities[i, own.idx_v]
            a[its.idx_v] = motion.accelerations[i, own.idx_v]
        external = pin.StdVec_Force()
        external.extend([pin.Force.Zero()] * other.njoints)
        external[foot.parentJoint] = foot.placement.act(pin.Force(truth[i]))
        pin.rnea(other, data, q, v, a, external)
        # Above on below, by Pinocchio; the sensor has below on above.
        found.append(-data.f[other.getJointId(sensor)].vector)
    return np.array(found)


@pytest.mark.parametrize("sensor", ["l_foot_ft_sensor", "l_leg_ft_sensor"])
def test_weight_and_inertia_below_a_sensor_in_the_leg_are_taken_off(
    urdf, robot, motion, truth, sensor
):
    values = measured_in_leg(urdf, robot, motion, truth, sensor)
    assert np.abs(values - truth).max() > 10
    found = read(robot, motion, WrenchSeries("ft", "l_sole", sensor, "leg", values))
    np.testing.assert_allclose(found[:, 0], truth, rtol=0, atol=1e-9)


def test_a_link_below_the_sensor_names_the_same_place(urdf, robot, motion, truth):
    values = measured_in_leg(urdf, robot, motion, truth, "l_foot_ft_sensor")
    found = read(robot, motion, WrenchSeries("ft", "l_sole", "l_foot", "leg", values))
    np.testing.assert_allclose(found[:, 0], truth, rtol=0, atol=1e-9)


def test_frames_of_the_foot_the_world_and_a_plate(robot, motion, truth):
    data, plates, world, foot = robot.model.createData(), [], [], []
    for q, wrench in zip(motion.configurations, truth, strict=True):
        pin.framesForwardKinematics(robot.model, data, q)
        sole = data.oMf[robot.frame_id("l_sole")]
        plates.append(sole.act(pin.Force(wrench)).vector)
        world.append(np.concatenate([sole.rotation @ wrench[:3], sole.rotation @ wrench[3:]]))
        ankle = data.oMf[robot.frame_id("l_foot")]
        foot.append(ankle.actInv(sole).act(pin.Force(wrench)).vector)
    for frame, kind, values in (
        ("", "sole", truth),
        ("l_sole", "sole", truth),
        ("l_foot", "sole", foot),
        ("world", "sole", world),
        ("", "plate", plates),
    ):
        sensor = WrenchSeries("s", "l_sole", frame, kind, np.array(values))
        found = read(robot, motion, sensor, world=True)
        np.testing.assert_allclose(found[:, 0], truth, rtol=0, atol=1e-9)


def test_sensors_of_one_foot_are_added_up(robot, motion, truth):
    halves = [WrenchSeries(n, "l_sole", "", "sole", truth / 2) for n in ("heel", "toe")]
    np.testing.assert_allclose(read(robot, motion, *halves)[:, 0], truth, atol=1e-12)


def test_a_plate_without_a_recorded_base_gives_its_normal_force(robot, motion, truth):
    found = read(robot, motion, WrenchSeries("p", "l_sole", "", "plate", truth))
    np.testing.assert_array_equal(found[:, 0, 2], truth[:, 2])
    assert np.isnan(np.delete(found[:, 0], 2, axis=1)).all()


def test_sensors_that_cannot_serve_a_foot(robot, motion, truth):
    def error(kind, contact, frame, sensor_kind, values=truth):
        with pytest.raises(kind) as caught:
            read(robot, motion, WrenchSeries("ft", contact, frame, sensor_kind, values))
        return str(caught.value)

    assert "no contact for the sensor 'ft' named 'l_toe'" in error(
        UnknownNameError, "l_toe", "", "sole"
    )
    assert "l_soel" in error(UnknownNameError, "l_sole", "l_soel", "sole")
    assert 'kind = "leg"' in error(InvalidInputError, "l_sole", "l_leg_ft_sensor", "sole")
    assert "not between" in error(InvalidInputError, "l_sole", "r_leg_ft_sensor", "leg")
    normal = np.full((ROWS, 6), np.nan)
    normal[:, 2] = 100
    assert "six numbers" in error(InvalidInputError, "l_sole", "l_leg_ft_sensor", "leg", normal)
