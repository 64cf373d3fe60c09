"""MJCF bodies with several joints, which Pinocchio makes one composite joint of."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense.errors import InvalidInputError


def leg(side, y):
    return f"""
    <body name='{side}_thigh' pos='0 {y} -.05'>
      <joint name='{side}_hip_yaw' axis='0 0 1'/> <joint name='{side}_hip_roll' axis='1 0 0'/>
      <joint name='{side}_hip_pitch' axis='0 1 0'/>
      <geom type='capsule' fromto='0 0 0 0 0 -.3' size='.04' mass='2'/>
      <body name='{side}_shin' pos='0 0 -.3'>
        <joint name='{side}_knee' axis='0 1 0'/>
        <geom type='capsule' fromto='0 0 0 0 0 -.3' size='.03' mass='1.5'/>
        <body name='{side}_foot' pos='0 0 -.3'>
          <joint name='{side}_ankle_pitch' axis='0 1 0'/>
          <joint name='{side}_ankle_roll' axis='1 0 0'/>
          <geom type='box' size='.08 .04 .01' pos='.02 0 -.03' mass='.5'/>
        </body></body></body>"""


BIPED = f"""<mujoco model='biped'><worldbody><body name='trunk' pos='0 0 1'><freejoint/>
<geom type='box' size='.1 .12 .2' pos='0 0 .2' mass='10'/>{leg("l", 0.1)}{leg("r", -0.1)}</body>
</worldbody></mujoco>"""
BENT = {"hip_pitch": -0.3, "knee": 0.6, "ankle_pitch": -0.3, "hip_yaw": 0.1}


@pytest.fixture(scope="module")
def stance():
    posture = {f"{side}_{joint}": angle for side in "lr" for joint, angle in BENT.items()}
    return copsense.load_stance(
        BIPED, contacts=["l_foot", "r_foot"], posture=posture, contact_at="sole"
    )


def test_every_joint_keeps_its_name(stance):
    assert stance.robot.joint_names[:3] == ("l_hip_yaw", "l_hip_roll", "l_hip_pitch")
    assert len(stance.robot.joint_names) == 12
    assert stance.robot.joint_position(stance.q, "l_knee") == pytest.approx(0.6, abs=0.2)
    assert len(stance.contacts[0].polygon) == 4


@pytest.mark.parametrize(
    "criterion", [copsense.minimum_torque(), copsense.minimum_wrench(1.0)], ids=lambda c: c.name
)
def test_derivatives_are_exact_there(stance, criterion):
    moved = copsense.solve_posture(stance, com=(0.0, 0.03, None)).stance
    copsense.check_sensitivity(moved, criterion)


def test_the_mechanism_is_mujocos(stance):
    model = mujoco.MjModel.from_xml_string(BIPED)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(3)
    robot = stance.robot
    for _ in range(5):
        q = pin.integrate(
            robot.model, pin.neutral(robot.model), rng.normal(size=robot.model.nv) * 0.5
        )
        data.qpos[:3], data.qpos[3:7] = q[:3], q[[6, 3, 4, 5]]
        for joint in robot.joint_names:
            data.joint(joint).qpos[0] = robot.joint_position(q, joint)
        mujoco.mj_forward(model, data)
        com = pin.centerOfMass(robot.model, robot.model.createData(), q)
        assert np.abs(data.subtree_com[0] - com).max() < 1e-12


def test_a_file_reads_the_same(stance, tmp_path):
    path = tmp_path / "biped.xml"
    path.write_text(BIPED)
    assert copsense.load_robot(path).joint_names == stance.robot.joint_names


@pytest.mark.parametrize("joint", [pin.JointModelSphericalZYX, pin.JointModelUniversal])
def test_a_joint_whose_axes_turn_with_it_is_rejected(joint):
    model = pin.Model()
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.appendBodyToJoint(base, pin.Inertia.Random(), pin.SE3.Identity())
    arguments = (np.eye(3)[0], np.eye(3)[1]) if joint is pin.JointModelUniversal else ()
    model.addJoint(base, joint(*arguments), pin.SE3.Identity(), "hip")
    with pytest.raises(InvalidInputError, match=r"hip.*chain of joints"):
        copsense.load_robot(model)
