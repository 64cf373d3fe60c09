"""A rod between two balls spins about its own axis: that moves nothing, and changes no number."""

import numpy as np
import pytest

import copsense
from copsense.controllers import BalancingController
from copsense.posture import retract

LEG = """
<body name="{s}_thigh" pos="0 {y} 0"><joint name="{s}_roll" axis="1 0 0"/>
 <joint name="{s}_hip" axis="0 1 0"/><joint name="{s}_yaw" axis="0 0 1"/>
 <geom type="capsule" size=".04" fromto="0 0 0 0 0 -.3" mass="2" contype="0" conaffinity="0"/>
 <body name="{s}_shin" pos="0 0 -.4"><joint name="{s}_knee" axis="0 1 0"/>
  <geom type="capsule" size=".03" fromto="0 0 0 0 0 -.3" mass="1" contype="0" conaffinity="0"/>
  {crank}
  <body name="{s}_foot" pos="0 0 -.4"><joint name="{s}_ankle" axis="0 1 0"/>
   <joint name="{s}_tilt" axis="1 0 0"/>
   <geom type="box" size=".1 .05 .02" pos=".03 0 -.04" mass=".5"/>
   <site name="{s}_sole" pos=".03 0 -.06"/></body></body></body>"""
CRANK = """<body name="crank" pos="-.04 0 -.1"><joint name="crank" axis="0 1 0"/>
 <geom type="sphere" size=".02" mass=".1" contype="0" conaffinity="0"/>
 <body name="rod" pos="-.05 0 0"><joint name="rod" type="ball"/>
  <geom type="capsule" size=".01" fromto="0 0 0 0 0 -.3" mass=".2" contype="0" conaffinity="0"/>
 </body></body>"""
ROBOT = (
    '<mujoco><compiler angle="degree"/><worldbody><body name="trunk" pos="0 0 1"><freejoint/>'
    '<geom type="box" size=".1 .1 .2" pos="0 0 .2" mass="10"/>'
    + LEG.format(s="l", y=0.1, crank=CRANK)
    + LEG.format(s="r", y=-0.1, crank="")
    + "</body></worldbody><equality>"
    '<connect body1="rod" body2="l_foot" anchor="0 0 -.3"/></equality><actuator>'
    + "".join(
        f'<motor joint="{s}_{j}"/>'
        for s in "lr"
        for j in ("roll", "hip", "yaw", "knee", "ankle", "tilt")
        if (s, j) != ("l", "ankle")
    )
    + '<motor joint="crank"/></actuator></mujoco>'
)
CRITERIA = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]


@pytest.fixture(scope="module")
def stance(tmp_path_factory):
    path = tmp_path_factory.mktemp("rod") / "robot.xml"
    path.write_text(ROBOT)
    bend = {f"{s}_{j}": a for s in "lr" for j, a in (("hip", -0.2), ("knee", 0.4))}
    return copsense.load_stance(
        str(path), contacts=["l_sole", "r_sole"], contact_at="sole", posture=bend
    )


def spin(stance):
    """The motion of the rod about its own axis."""
    start = stance.robot.model.joints[stance.robot.joint_id("rod")].idx_v
    return np.eye(stance.robot.model.nv)[start + 2]


def test_what_spins_may_be_balanced(stance):
    BalancingController(stance, CRITERIA[1])


def test_it_stands_and_the_rod_hangs_from_nothing(stance):
    assert stance.hanging_motions.shape[1] == 0
    assert abs(stance.unheld_motions.T @ spin(stance)).max() > 0.9
    assert not stance.constraints[:, int(np.argmax(spin(stance)))].any()


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_turning_the_rod_about_itself_changes_no_force(stance, criterion):
    forces = copsense.solve_equilibrium(stance, criterion).contact_forces
    for angle in (1e-5, 0.1, 1.0):
        turned = retract(stance, angle * spin(stance))
        found = copsense.solve_equilibrium(turned, criterion).contact_forces
        assert found == pytest.approx(forces, abs=1e-6 * stance.robot.weight)


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_sensitivities_are_finite_differences(stance, criterion):
    copsense.check_sensitivity(stance, criterion)


def test_postures_move_with_it(stance):
    path = copsense.lateral_sweep(stance, -0.01, 0.01, 3)
    assert not path.failures
