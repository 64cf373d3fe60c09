"""Couplings, loops and joints without motors of a URDF; what is assumed or left out is said."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from support.driven_files import urdf
from support.statics_apart import loop_gaps, solve_apart

import copsense
from copsense import minimum_torque, solve_equilibrium
from copsense.drives import Coupling
from copsense.errors import ModelLoadError

FEET = ["l_foot", "r_foot"]
BENT = {f"{s}_{j}": a for s in "lr" for j, a in {"hip": -0.35, "knee": 0.7, "ankle": -0.35}.items()}
MIMIC = '<mimic joint="{}" multiplier="{}" offset="{}"/>'
LOOP = (
    '<{tag} name="{s} rod" type="{kind}"><link1 link="{s}_rod" xyz=".01 0 -.24" rpy="{rpy}"/>'
    '<{end} link="{s}_ankle_link" xyz="-.07 0 0" rpy="{rpy}"/><axis xyz="{axis}"/></{tag}>'
)
TRANSMISSION = (
    "<transmission name='t_{0}'><type>transmission_interface/SimpleTransmission</type>"
    "<joint name='{0}'/><actuator name='m_{0}'/></transmission>"
)


def loops(kind, tag="loop_joint", end="link2", rpy="0 0 0", axis="0 1 0"):
    return "".join(LOOP.format(tag=tag, s=s, kind=kind, end=end, rpy=rpy, axis=axis) for s in "lr")


def stand(text, **posture):
    return copsense.load_stance(text, contacts=FEET, contact_at="sole", posture={**BENT, **posture})


def moving(robot, *but):
    return tuple(joint for joint in robot.joint_names if joint not in but)


def test_a_mimic_is_a_coupling_also_of_one_that_mimics():
    more = {"r_yaw": MIMIC.format("l_yaw", -1, 0.02), "r_roll": MIMIC.format("r_yaw", 0.5, 0)}
    stance = stand(urdf(more=more), l_yaw=0.05)
    robot = stance.robot
    assert robot.drives.couplings == (
        Coupling("r_yaw", "l_yaw", -1.0, 0.02),
        Coupling("r_roll", "r_yaw", 0.5, 0.0),
    )
    lead, middle, last = (robot.joint_position(stance.q, j) for j in ("l_yaw", "r_yaw", "r_roll"))
    assert middle == pytest.approx(0.02 - lead, abs=1e-12)
    assert last == pytest.approx(0.5 * middle, abs=1e-12)
    assert robot.torque_names == moving(robot, "r_yaw", "r_roll")
    assert robot.notes == ()


def test_what_mimics_a_fixed_joint_stays_where_it_is_put():
    text = urdf(
        more={"l_yaw": MIMIC.format("r_yaw", 2, 0.1), "l_roll": MIMIC.format("l_yaw", 3, 0)}
    )
    fixed = text.replace('name="r_yaw" type="revolute"', 'name="r_yaw" type="fixed"')
    robot, whole = copsense.load_robot(fixed), copsense.load_robot(urdf())
    assert not {"l_yaw", "l_roll", "r_yaw"} & set(robot.joint_names)
    assert any("l_yaw at 0.1, l_roll at 0.3" in note for note in robot.notes)
    q, there = robot.configuration(), whole.configuration({"l_yaw": 0.1, "l_roll": 0.3})
    feet = [at(each, p, "l_foot") for each, p in ((robot, q), (whole, there))]
    assert np.abs(feet[0] - feet[1]).max() < 1e-12


def at(robot, q, frame):
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.frame_id(frame)].homogeneous


def test_a_fixed_joint_that_mimics_stays_fixed():
    text = urdf(more={"r_yaw": MIMIC.format("l_yaw", -1, 0)})
    robot = copsense.load_robot(
        text.replace('name="r_yaw" type="revolute"', 'name="r_yaw" type="fixed"')
    )
    assert not robot.drives
    assert robot.notes == ()


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"more": {"r_yaw": MIMIC.format("yaw", 1, 0)}}, "joint 'r_yaw' mimics 'yaw', which is"),
        ({"more": {"r_yaw": MIMIC.format("r_yaw", 1, 0)}}, "joint 'r_yaw' mimics itself"),
        (
            {"more": {"r_yaw": MIMIC.format("l_yaw", 1, 0), "l_yaw": MIMIC.format("r_yaw", 1, 0)}},
            "joint 'l_yaw' mimics itself through 'r_yaw'",
        ),
        ({"more": {"r_yaw": MIMIC.format("l_yaw", "one", 0)}}, "multiplier='one'"),
        (
            {"tail": loops("ball").replace("l_ankle_link", "heel")},
            "link 'l_rod' of loop joint 'l rod'",
        ),
        (
            {"tail": loops("ball"), "rods": True, "cut": '<link2 link="r_ankle_link"'},
            "1 of <link1>",
        ),
        ({"tail": loops("ball", axis="0 0 0"), "rods": True}, "has no direction"),
    ],
)
def test_a_fault_is_told_by_name(parts, said):
    cut = parts.pop("cut", None)
    text = urdf(**parts)
    text = text.replace(cut, '<other link="r_ankle_link"') if cut else text
    with pytest.raises(ModelLoadError, match=said.replace("(", r"\(")):
        copsense.load_robot(text)


@pytest.mark.parametrize(
    ("tail", "rows"),
    [
        (loops("revolute"), 12),
        (loops("continuous", rpy="0 0 .3", axis=f"{np.sin(0.3)} {np.cos(0.3)} 0"), 12),
        (loops("spherical", end="link1"), 6),
        (loops("ball", tag="drake:loop_joint"), 6),
    ],
)
def test_a_loop_joint_is_a_loop(tail, rows):
    drives = copsense.load_robot(urdf(rods=True, tail=tail)).drives
    motors = [j for j in moving(copsense.load_robot(urdf(rods=True))) if "rod_top" not in j]
    motors = [j for j in motors if j not in ("l_ankle", "r_ankle")]
    idle = ("l_rod_top", "r_rod_top", "l_ankle", "r_ankle")
    stance = copsense.load_stance(
        urdf(rods=True, tail=tail), contacts=FEET, contact_at="sole", posture=BENT, passive=idle
    )
    assert [loop.name for loop in drives.loops] == ["l rod", "r rod"]
    assert stance.robot.torque_names == tuple(motors)
    assert np.abs(loop_gaps(stance.robot, stance.q)).max() < 1e-10
    assert len(stance.closures.names) == rows
    assert stance.admissible_motions.shape[1] == 6
    found = solve_equilibrium(stance, minimum_torque())
    forces, torques = solve_apart(stance, 1.0, np.zeros(6))
    apart = forces.reshape(-1, 6)[:, :3] - found.wrenches[:, :3]  # of the same axes, other points
    assert np.abs(apart).max() < 1e-8 * stance.robot.weight
    ours = dict(zip(stance.robot.torque_names, found.torques, strict=True))
    assert max(abs(ours[j] - t) for j, t in torques.items()) < 1e-8 * stance.robot.weight


def test_loops_that_are_not_known_are_noted():
    robot = copsense.load_robot(
        urdf(rods=True, tail=loops("screw") + "<drake:ball_constraint/><!-- none -->")
    )
    assert not robot.drives
    assert any("'l rod' is not used: it is of type 'screw'" in note for note in robot.notes)
    assert any("<ball_constraint> in the file is not used" in note for note in robot.notes)


def test_joints_left_out_of_the_transmissions_of_their_limb_have_no_motor():
    names = moving(copsense.load_robot(urdf()))
    every = urdf(tail="".join(TRANSMISSION.format(j) for j in names))
    assert not copsense.load_robot(every).drives
    assert copsense.load_robot(every).notes == ()
    robot = copsense.load_robot(
        urdf(tail="".join(TRANSMISSION.format(j) for j in names if j != "l_ankle_roll"))
    )
    assert robot.torque_names == moving(robot, "l_ankle_roll")
    assert "Joints l_ankle_roll have no <transmission>" in robot.notes[0]


def test_limbs_without_any_transmission_keep_their_motors():
    robot = copsense.load_robot(
        urdf(
            tail="".join(
                TRANSMISSION.format(j) for j in moving(copsense.load_robot(urdf())) if j[0] == "l"
            )
        )
    )
    assert not robot.drives
    assert "Joints r_yaw, r_roll, r_hip" in robot.notes[0]
    hand = copsense.load_robot(urdf(tail=TRANSMISSION.format("l_ankle_roll")))
    assert not hand.drives
    assert "have no <transmission>, nor has the first of their limb" in hand.notes[0]


def test_no_effort_is_said_and_can_be_no_motor():
    text = urdf(effort={"l_ankle_roll": 0})
    robot = copsense.load_robot(text)
    assert not robot.drives
    assert 'Joints l_ankle_roll have effort="0"' in robot.notes[0]
    idle = copsense.load_robot(text, passive=["l_ankle_roll"])
    assert idle.torque_names == moving(robot, "l_ankle_roll")


def test_a_mimic_holds_and_carries_what_it_does_in_mujocos_own_reader():
    """MuJoCo reads the same URDF, its base held: its equalities leave no other motion, and carry
    exactly what the motors and contacts leave of the joints' weight."""
    more = {"r_yaw": MIMIC.format("l_yaw", -0.7, 0.02), "r_roll": MIMIC.format("r_yaw", 0.5, 0)}
    text = urdf(more=more)
    found = solve_equilibrium(stand(text, l_yaw=0.05), minimum_torque())
    stance, robot = found.stance, found.stance.robot
    twin = mujoco.MjModel.from_xml_string(text)
    turn = pin.Quaternion(*np.roll(stance.q[3:7], 1)).matrix()
    twin.opt.gravity[:] = turn.T @ [0.0, 0.0, -9.81]  # its base is level
    twin.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(twin)
    names = [twin.joint(j).name for j in range(twin.njnt)]
    assert sorted(names) == sorted(robot.joint_names)
    data.qpos[:] = [robot.joint_position(stance.q, name) for name in names]
    mujoco.mj_forward(twin, data)
    equal = np.array(data.efc_type[: data.nefc]) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    assert equal.sum() == 2
    np.testing.assert_allclose(data.efc_pos[: data.nefc][equal], 0.0, atol=1e-12)
    J = np.array(data.efc_J).reshape(-1, twin.nv)[: data.nefc][equal]
    columns = [robot.velocity_index(name) for name in names]
    np.testing.assert_allclose(J @ stance.admissible_motions[columns], 0.0, atol=1e-12)
    # Their rows and ours span the same.
    ours = stance.closures.jacobian[:, columns]
    assert np.linalg.matrix_rank(np.vstack([J, ours]), tol=1e-9) == len(ours) == 2
    torques = dict(zip(robot.torque_names, found.torques, strict=True))
    left = data.qfrc_bias - [torques.get(name, 0.0) for name in names]
    for contact, place, wrench in zip(
        stance.contacts, stance.placements, found.wrenches, strict=True
    ):
        linear, angular = np.zeros((3, twin.nv)), np.zeros((3, twin.nv))
        point = turn.T @ (place.translation - stance.q[:3])
        body = twin.body(contact.frame).id
        mujoco.mj_jac(twin, data, linear, angular, point, body)
        axes = turn.T @ place.rotation
        left -= linear.T @ axes @ wrench[:3] + angular.T @ axes @ wrench[3:]
    carried = np.linalg.lstsq(J.T, left)[0]
    np.testing.assert_allclose(J.T @ carried, left, atol=1e-9 * robot.weight)
    assert np.abs(left).max() > 1e-3  # something to carry
