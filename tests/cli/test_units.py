"""One reader of quantities: degrees for what turns, metres for what slides, or the unit given."""

import math

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense

from copsense.cli.units import read_positions, read_quantity, read_range
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
    """A cabin that slides over a wide foot, and an arm on it that turns."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    text = '<robot name="elevator">'
    for name, height in (("base", 0), ("cabin", 0), ("arm", 0.4)):
        text += (
            f'<link name="{name}"><inertial><origin xyz="0 0 {height}"/><mass value="5"/>{inertia}'
            "</inertial></link>"
        )
    for name, kind, axis, parent, child in (
        ("slide", "prismatic", "0 1 0", "base", "cabin"),
        ("turn", "revolute", "1 0 0", "cabin", "arm"),
    ):
        text += (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 0.5"/><axis xyz="{axis}"/>'
            '<limit lower="-0.05" upper="0.05" effort="100" velocity="1"/></joint>'
        )
    path = tmp_path_factory.mktemp("robots") / "elevator.urdf"
    path.write_text(text + "</robot>")
    return path


STAND = ("--contact", "base", "--sole", "-0.5:0.5:-0.5:0.5")


def test_the_unit_of_a_position_is_that_of_its_joint(elevator):
    robot = Robot.from_urdf(elevator)
    assert robot.dof_units == ("m", "rad")
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
    assert robot.dof_units == ("m", "m", "rad", "rad", "rad", "rad", "m")
    assert robot.joint_unit("rail") == "m"


def test_a_sweep_of_a_prismatic_joint_is_in_metres(elevator):
    metres = copsense("sweep", elevator, *STAND, "--joint", "slide=0:0.15:4", "--json")
    assert metres.code == 0, metres.err
    assert metres.json["unit"] == "m"
    assert metres.json["criteria"]["minimum-torque"]["planted"] == [0.0, 0.15]
    assert "slide is beyond its limit at 2 postures, by up to 100.0 mm" in metres.err
    text = copsense("sweep", elevator, *STAND, "--joint", "slide=0mm:150mm:4").out
    assert "from +0 to +0.15 m" in text


def test_a_posture_holds_a_prismatic_joint_in_metres(elevator):
    held = [
        copsense("analyse", elevator, *STAND, "--joint", f"slide={value}", "--json")
        for value in ("0.1", "100mm")
    ]
    assert held[0].json == held[1].json
    assert "slide is 50.0 mm beyond its limit." in held[0].json["notes"]
    near, middle = (
        copsense("analyse", elevator, *STAND, "--posture", f"slide={value}", "--json").json
        for value in ("0.1", "0")
    )
    assert near["com"][2] < middle["com"][2] - 1e-6  # bent, to stay near what was asked for


def test_slopes_are_per_degree_or_per_metre_of_the_joint(elevator):
    slide, turn = (
        copsense("analyse", elevator, *STAND, "--along", joint).out for joint in ("slide", "turn")
    )
    assert "dCoP_y/dslide [mm/mm]" in slide
    assert "dCoP_y/dturn [mm/deg]" in turn
