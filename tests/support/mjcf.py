"""A small MJCF robot with holes to fill, and MuJoCo's own compiler as the judge of what is read."""

import mujoco
import numpy as np
import pinocchio as pin

import copsense

FOOT = "<geom name='{side}_sole' type='box' size='.1 .05 .01' pos='.03 0 -.05' mass='.7'/>"
LEG = """
<body name='{side}_thigh' pos='0 {y} -.1'>
  <joint name='{side}_hip_roll' axis='1 0 0'/>
  <joint name='{side}_hip' axis='0 1 0' range='-90 60'/>
  <geom type='capsule' fromto='0 0 0 .02 0 -.3' size='.05' mass='3'/>
  <body name='{side}_shin' pos='.02 0 -.3' euler='0 4 3'>
    <joint name='{side}_knee' axis='0 1 0' range='0 140'/>
    <geom type='capsule' fromto='0 0 0 0 0 -.3' size='.04' mass='2'/>
    <body name='{side}_foot' pos='0 0 -.3'>
      <joint name='{side}_ankle' axis='0 1 0' range='-60 60'/>
      <joint name='{side}_ankle_roll' axis='1 0 0'/>
      {foot}
    </body></body></body>"""


def walker(
    *,
    head="",
    foot=FOOT,
    left=None,
    before="",
    after="",
    base="<freejoint/>",
    trunk="<geom type='box' size='.1 .15 .2' pos='.02 0 .2' mass='12'/>",
    tail="",
):
    """A biped: `left` replaces its left leg, `foot` what feet hold; the rest is inserted."""
    legs = [
        LEG.format(side=side, y=y, foot=foot.format(side=side))
        for side, y in (("l", 0.1), ("r", -0.1))
    ]
    if left is not None:
        legs[0] = left
    return (
        f"<mujoco model='walker'>{head}<worldbody><geom type='plane' size='1 1 1'/>{before}"
        f"<body name='trunk' pos='0 0 1'>{base}{trunk}{''.join(legs)}</body>{after}</worldbody>"
        f"{tail}</mujoco>"
    )


def assert_mujocos(source, robot=None, root="trunk"):
    """Mass, CoM, every body, site, joint axis and range of a robot are those MuJoCo compiles."""
    robot = copsense.load_robot(source) if robot is None else robot
    text = isinstance(source, str) and source.lstrip().startswith("<")
    compiled = mujoco.MjModel.from_xml_string if text else mujoco.MjModel.from_xml_path
    mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log file here
    try:
        mj = compiled(str(source))
    finally:
        mujoco.set_mju_user_warning(None)
    data, body = mujoco.MjData(mj), mj.body(root).id
    inside = [b for b in range(mj.nbody) if mj.body_rootid[b] == body]
    assert abs(robot.mass - mj.body_subtreemass[body]) < 1e-9
    random = np.random.default_rng(3)
    for _ in range(4):
        angles = {name: float(random.normal()) for name in robot.joint_names if _single(mj, name)}
        q = robot.configuration(angles)
        mujoco.mj_resetData(mj, data)
        for joint, angle in angles.items():
            data.joint(joint).qpos[0] = angle
        mujoco.mj_kinematics(mj, data)
        mujoco.mj_comPos(mj, data)
        work = robot.model.createData()
        pin.framesForwardKinematics(robot.model, work, q)
        base = _axes(data.xpos[body], data.xmat[body])
        here = work.oMf[robot.frame_id(root)]
        off = base.actInv(data.subtree_com[body]) - here.actInv(
            pin.centerOfMass(robot.model, work, q)
        )
        assert np.abs(off).max() < 1e-9, off
        for b in inside:
            if mj.body(b).name:
                _same(
                    base.actInv(_axes(data.xpos[b], data.xmat[b])),
                    robot,
                    work,
                    here,
                    mj.body(b).name,
                )
        for s in range(mj.nsite):
            if mj.site_bodyid[s] in inside:
                place = _axes(data.site_xpos[s], data.site_xmat[s])
                _same(base.actInv(place), robot, work, here, mj.site(s).name)
    low, high = robot.position_limits
    for name, lowest, highest in zip(robot.torque_names, low, high, strict=True):
        if _single(mj, name):
            limited = mj.joint(name).limited[0]
            wanted = mj.joint(name).range if limited else (-np.inf, np.inf)
            assert np.allclose([lowest, highest], wanted, atol=1e-12), name
    assert np.array_equal(robot.model.gravity.linear, mj.opt.gravity)
    return robot


def _single(mj, name):
    found = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_JOINT, name)
    return found >= 0 and int(mj.jnt_type[found]) in (2, 3)


def _axes(position, matrix):
    return pin.SE3(np.array(matrix).reshape(3, 3), np.array(position))


def _same(there, robot, work, base, name):
    here = base.actInv(work.oMf[robot.frame_id(name)])
    assert np.abs(here.homogeneous - there.homogeneous).max() < 1e-9, name
