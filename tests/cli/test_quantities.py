"""One reader of quantities: degrees for what turns, metres for what slides, or the unit given."""

import math

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense

from copsense.cli.quantities import read_positions, read_quantity, read_range
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.robot import Robot


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("20", "rad", math.radians(20)),
        ("20deg", "rad", math.radians(20)),
        ("-0.3rad", "rad", -0.3),
        ("0.2", "m", 0.2),
        ("0.2m", "m", 0.2),
        ("25mm", "m", 0.025),
        ("2.5cm", "m", 0.025),
        ("-1e-2", "m", -0.01),
    ],
)
def test_a_quantity_is_read_in_the_unit_it_names_or_the_usual_one(text, unit, value):
    assert read_quantity(text, unit) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("20deg", "m"), ("0.1m", "rad"), ("", "m"), ("m", "m"), ("2 degs", "rad")],
)
def test_a_quantity_of_another_kind_is_rejected_with_an_example(text, unit):
    with pytest.raises(InvalidInputError, match="Give an angle" if unit == "rad" else "a length"):
        read_quantity(text, unit)


def test_a_range_takes_units_at_both_ends():
    assert read_range("-70mm:0.07:5", "m") == (-0.07, 0.07, 5)
    assert read_range("-5:0.1rad:3", "rad") == (math.radians(-5), 0.1, 3)
    with pytest.raises(InvalidInputError, match="START:STOP:COUNT"):
        read_range("1:2", "m")


@pytest.fixture(scope="module")
def elevator(tmp_path_factory):
    """A lift on a wide foot: a prismatic joint, and a revolute one over it."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    link = '<link name="{}"><inertial><mass value="5"/>' + inertia + "</inertial></link>"
    text = '<robot name="elevator">' + "".join(map(link.format, ("base", "cabin", "arm")))
    for name, kind, axis, parent, child in (
        ("slide", "prismatic", "0 1 0", "base", "cabin"),
        ("turn", "revolute", "1 0 0", "cabin", "arm"),
    ):
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 0.5"/><axis xyz="{axis}"/>'
            '<limit lower="-0.25" upper="0.25" effort="100" velocity="1"/></joint>'
        )
    path = tmp_path_factory.mktemp("robots") / "elevator.urdf"
    path.write_text(text + "</robot>")
    return path


STAND = ("--contact", "base", "--sole", "-0.5:0.5:-0.5:0.5")


def test_the_unit_of_a_position_is_that_of_its_joint(elevator):
    robot = Robot.from_urdf(elevator)
    assert robot.torque_units == ("m", "rad")
    assert read_positions(("slide=0.1", "turn=20"), robot) == {
        "slide": 0.1,
        "turn": math.radians(20),
    }
    with pytest.raises(InvalidInputError, match="Give a length"):
        read_positions(("slide=20deg",), robot)
    with pytest.raises(UnknownNameError, match="Did you mean slide"):
        read_positions(("slid=1",), robot)


def test_joints_of_several_coordinates_have_a_unit_for_each():
    model = pin.Model()
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
    model.appendBodyToJoint(base, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.addJoint(base, pin.JointModelPlanar(), pin.SE3.Identity(), "table")
    model.addJoint(base, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.addJoint(base, pin.JointModelPrismaticUnaligned(1, 1, 0), pin.SE3.Identity(), "rail")
    robot = Robot.from_model(model)
    assert robot.torque_units == ("m", "m", "rad", "rad", "rad", "rad", "m")
    assert robot.joint_unit("rail") == "m"


def test_a_sweep_of_a_prismatic_joint_is_in_metres(elevator):
    answer = copsense("sweep", elevator, *STAND, "--joint", "slide=0:0.2:3", "--json")
    assert answer.code == 0, answer.err
    assert answer.json["unit"] == "m"
    assert answer.json["criteria"]["minimum-torque"]["planted"] == [0.0, 0.2]
    mm = copsense("sweep", elevator, *STAND, "--joint", "slide=0mm:200mm:3", "--json")
    assert mm.json["criteria"] == answer.json["criteria"]
    assert (
        "from +0 to +0.2 m" in copsense("sweep", elevator, *STAND, "--joint", "slide=0:0.2:3").out
    )


def test_posture_and_joint_hold_a_prismatic_joint_in_metres(elevator):
    far = copsense("analyse", elevator, *STAND, "--posture", "slide=0.1", "--com-y=0.05", "--json")
    near = copsense("analyse", elevator, *STAND, "--joint", "slide=100mm", "--com-y=0.05", "--json")
    for answer in (far, near):
        assert answer.code == 0, answer.err
    same = copsense("analyse", elevator, *STAND, "--joint", "slide=0.1", "--com-y=0.05", "--json")
    assert near.json == same.json


def test_excess_and_slopes_are_said_in_the_joint_s_unit(elevator):
    answer = copsense("analyse", elevator, *STAND, "--posture", "slide=0.3", "--along", "slide")
    assert "slide is 50.0 mm beyond its limit" in answer.err
    assert "dCoP_y/dslide [mm/mm]" in answer.out
    assert "[mm/deg]" in copsense("analyse", elevator, *STAND, "--along", "turn").out
    swept = copsense("sweep", elevator, *STAND, "--joint", "slide=0:0.3:4")
    assert "slide is beyond its limit at 1 postures, by up to 50.0 mm" in swept.err
