"""A base that a URDF writes out is the base: the robot equals the one without it, and says so."""

import pytest
from support.tiny import FEET, urdf

import copsense
from copsense import Robot
from copsense.errors import ModelLoadError

PLAIN = Robot.from_urdf(urdf())
SIX = ("prismatic", "prismatic", "prismatic", "revolute", "revolute", "revolute")
AXES = ("1 0 0", "0 1 0", "0 0 1") * 2
CUBE = '<collision><geometry><box size="1 1 1"/></geometry></collision>'


def mass(kg):
    return (
        f'<inertial><mass value="{kg}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def joint(name, kind, parent, child, axis="0 0 1"):
    limit = '<limit lower="-9" upper="9" effort="5" velocity="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="0.1 0 1" rpy="0 0 0.2"/>'
        f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def on(*elements):
    """The tiny robot with more elements in its file."""
    return urdf().replace("</robot>", "".join(elements) + "</robot>")


def chain(kinds, axes=AXES, first="", each=""):
    """Links v0, v1, ... without mass, from v0 to the base of the tiny robot."""
    links = [f'<link name="v{i}">{each if i else first}</link>' for i in range(len(kinds))]
    ends = [f"v{i}" for i in range(len(kinds))] + ["base"]
    joints = [joint(f"j{i}", kind, ends[i], ends[i + 1], axes[i]) for i, kind in enumerate(kinds)]
    return on(*links, *joints)


@pytest.mark.parametrize(
    "text",
    [
        on('<link name="world"/>', joint("free", "floating", "world", "base")),
        on('<link name="world"/>', joint("flat", "planar", "world", "base")),
        chain(SIX),
        chain(SIX, AXES[::-1]),
        chain((*SIX[:2], "fixed", *SIX[2:]), ("1 0 0", "0 1 0", "0 0 1", *AXES[2:])),
        chain(("prismatic", "prismatic", "continuous")),  # forward, sideways, heading
        chain(("revolute",) * 3, AXES[3:]),  # yaw, pitch, roll
        chain(("prismatic",)),  # a rail
        chain(("planar", "prismatic")),
        chain(("floating", "revolute")),
        chain(SIX, each=mass(1e-5)),
        chain(SIX, first=mass(50.0) + CUBE),  # the ground, with its mass
        on(
            f'<link name="world">{mass(7.0)}</link>',
            f'<link name="table">{mass(3.0)}{CUBE}</link>',
            joint("stands", "fixed", "world", "table"),
            joint("free", "floating", "world", "base"),
        ),
        on(
            f'<link name="world"/><link name="door">{mass(3.0)}</link>',
            joint("hinge", "revolute", "world", "door"),
            joint("free", "floating", "world", "base"),
        ),
    ],
)
def test_a_written_base_is_the_base_and_is_said(text):
    robot = Robot.from_urdf(text)
    assert robot.model == PLAIN.model
    assert robot.torque_names == PLAIN.torque_names
    assert "base is written into the file" in robot.notes[0]
    assert "above link 'base'" in robot.notes[0]


def test_the_note_names_the_joints_and_what_is_left_out_with_its_mass():
    text = chain(("prismatic", "prismatic", "revolute", "revolute", "revolute", "revolute"))
    assert "joints j0, j1, j2, j3, j4, j5 above" in Robot.from_urdf(text).notes[0]
    held = on(
        f'<link name="world"/><link name="table">{mass(3.0)}</link>',
        joint("stands", "fixed", "world", "table"),
        joint("free", "floating", "world", "base"),
    )
    note = Robot.from_urdf(held).notes[0]
    assert "joint free above link 'base' is taken" in note
    assert "left out with it: table (3 kg)" in note


@pytest.mark.parametrize(
    ("text", "torques"),
    [
        (on('<link name="world"/>', joint("stands", "fixed", "world", "base")), 2),
        # A massless foot as the root: what hangs on it is a robot.
        (chain(("revolute", "revolute")), 4),
        (chain(("revolute",) * 4, AXES[2:], first=CUBE), 6),
        (chain(("prismatic",) * 2, first=mass(2.0)), 4),  # a heavy sled is part of the robot
        (chain(("revolute",) * 3, AXES[3:], each=mass(0.2)), 5),
    ],
)
def test_joints_of_the_robot_stay_its_joints(text, torques):
    robot = Robot.from_urdf(text)
    assert len(robot.torque_names) == torques
    assert robot.notes == ()


def test_what_stands_on_a_written_base_stands_as_without_it():
    def stand(text):
        return copsense.load_stance(text, contacts=FEET, contact_at="sole")

    plain, mine = stand(urdf()), stand(chain(SIX))
    law = copsense.minimum_wrench(1.0)
    assert mine.com == pytest.approx(plain.com, abs=1e-12)
    found, expected = (copsense.solve_equilibrium(s, law).wrenches for s in (mine, plain))
    assert found == pytest.approx(expected, abs=1e-9)
    assert mine.robot.notes[0] in copsense.analyse(mine, [law]).notes


def test_two_floating_robots_and_a_part_that_floats_elsewhere_are_rejected_by_name():
    two = on(
        f'<link name="world"/><link name="ball">{mass(1.0)}</link>',
        joint("one", "floating", "world", "base"),
        joint("two", "floating", "world", "ball"),
    )
    with pytest.raises(ModelLoadError, match=r"joints 'one', 'two' are each a free base.*file of"):
        Robot.from_urdf(two)
    bird = on(f'<link name="bird">{mass(1.0)}</link>', joint("flies", "floating", "left", "bird"))
    with pytest.raises(ModelLoadError, match=r"joint 'flies' floats.*Make it fixed"):
        Robot.from_urdf(bird)
