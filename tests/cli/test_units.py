"""One reader of quantities: degrees for what turns, metres for what slides, or the unit given."""

import math
from dataclasses import fields

import click
import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense

import copsense.cli as cli
from copsense.cli.balance_command import balance
from copsense.cli.benchmark_command import _trials
from copsense.cli.disturbance_options import read_disturbances, read_signal
from copsense.cli.limit_options import read_limits
from copsense.cli.units import read_positions, read_quantity, read_range
from copsense.comparison.trials import KINDS, Breaking, Sway, option_unit
from copsense.controllers import Ramp, Sine
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.joint_notes import joint_limit_notes
from copsense.limits import Limits
from copsense.paper import FourBar, solve_four_bar
from copsense.robot import Robot
from copsense.simulation import FrictionChange, Push


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
        ("13mm", "m", 0.013),
        ("2ms", "s", 0.002),
        ("0.5", "s", 0.5),
        ("1deg/s", "rad/s", math.radians(1)),
        ("1", "rad/s", math.radians(1)),
        ("0.3rad/s", "rad/s", 0.3),
        ("10mm/s", "m/s", 0.01),
        ("0.5Hz", "Hz", 0.5),
        ("40N", "N", 40.0),
        ("30Nm", "Nm", 30.0),
        ("2Ns", "Ns", 2.0),
        ("2.5kg", "kg", 2.5),
    ],
)
def test_a_quantity_is_read_in_the_unit_it_names_or_the_usual_one(text, unit, value):
    assert read_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("20deg", "m"),
        ("0.1m", "rad"),
        ("", "m"),
        ("m", "m"),
        ("2 degs", "rad"),
        ("2s", "Hz"),
        ("2rad", "rad/s"),
        ("1m", "s"),
        ("3Nm", "N"),
        ("3N", "Ns"),
    ],
)
def test_a_quantity_of_another_kind_is_rejected_with_an_example(text, unit):
    kinds = {"rad": "an angle", "m": "a length", "Hz": "a frequency", "rad/s": "a rate"}
    kinds |= {"s": "a time", "N": "a force", "Ns": "an impulse"}
    with pytest.raises(InvalidInputError, match=f"Give {kinds[unit]}, such as"):
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
    assert "slide is beyond its limit at 2 postures, by up to 100.0 mm" in metres.json["notes"]
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


@pytest.mark.parametrize("xi", ["1.5rad", f"{math.degrees(1.5)!r}", f"{math.degrees(1.5)!r}deg"])
def test_the_four_bar_stands_at_degrees_or_at_the_unit_given(xi):
    given = ("four-bar", "--xi", xi, "--leg-length", "500mm", "--rod-length", "14cm", "--json")
    answer = copsense(*given).json
    assert answer["parameters"]["xi"] == pytest.approx(1.5, abs=1e-15)
    exact = solve_four_bar(FourBar(0.5, 0.14, 8.25, 16.5), 1.5, "minimum-torque")
    assert answer["cop"]["left"] == pytest.approx(exact.cop[0], rel=1e-12)
    assert answer["com"] == pytest.approx(exact.to_dict()["com"])
    assert exact.to_dict().keys() < answer.keys()
    assert "at xi = 85.9437 deg" in copsense("four-bar", "--xi", xi).out


def test_limits_are_read_in_the_unit_they_name():
    assert read_limits(
        "cop-margin=5mm,torsion=13mm,torque=30Nm,normal-force=10N,sides=6"
    ) == Limits(cop_margin=0.005, torsion=0.013, torque=30.0, normal_force=10.0, friction_sides=6)


def test_disturbances_are_read_in_the_unit_they_name():
    """What `balance` makes of its options, without a simulation."""
    typed = {
        "push": ("0:40N:0:500ms:0.1s:chest",),
        "friction": ("0.5:250ms",),
        "unknown_payload": ("chest=1.5kg",),
        "mass_error": 0.0,
        "torque_limit": ("l_knee=20Nm",),
        "force_noise": 0.0,
        "moment_noise": 0.0,
        "bandwidth": None,
        "odometry": None,
        "seed": 0,
    }
    command = balance.make_context(
        "balance",
        ["icub", "--delay", "2ms", "--position-noise", "0.1", "--velocity-noise", "1deg/s"],
    )
    typed |= {k: command.params[k] for k in ("delay", "position_noise", "velocity_noise")}
    read = read_disturbances(typed)
    assert read["pushes"][0] == Push((0.0, 40.0, 0.0), 0.5, 0.1, "chest")
    assert read["friction"][0] == FrictionChange(0.5, 0.25)
    assert read["model_error"].payload == {"chest": 1.5}
    assert read["motors"].limit == {"l_knee": 20.0}
    assert read["motors"].delay == 0.002
    assert read["noise"].position == pytest.approx(math.radians(0.1))
    assert read["noise"].velocity == pytest.approx(math.radians(1.0))
    assert read_signal("sine:20mm:0.5Hz") == read_signal("sine:0.02:0.5") == Sine(0.02, 0.5)
    assert read_signal("ramp:-20mm:10mm/s") == Ramp(-0.02, 0.01)


def test_every_number_of_a_trial_has_a_unit_but_a_count():
    counts = {"periods", "repeats", "seed"}
    for kind, trial in KINDS.items():
        for field in fields(trial):
            known = option_unit(kind, field.name) is not None
            assert known == (field.name not in counts | {"side", "parameter"}), (kind, field.name)


def test_a_trial_is_read_in_the_unit_it_names():
    texts = ["sway:amplitude=39mm,frequency=0.05Hz", "falls:position_noise=0.1,repeats=3"]
    sway, falls = _trials(texts, None, None, quick=False).values()
    assert sway == Sway(0.039, 0.05)
    assert falls.position_noise == pytest.approx(math.radians(0.1))
    assert falls.repeats == 3
    (worse,) = _trials(["velocity_noise:severe=2rad/s"], None, None, quick=False).values()
    assert worse == Breaking("velocity_noise", severe=2.0)


@pytest.mark.parametrize("name", cli.copsense.list_commands(click.Context(cli.copsense)))
def test_no_command_has_two_options_of_one_name(name):
    command = cli.copsense.get_command(click.Context(cli.copsense), name)
    names = [name for parameter in command.params for name in parameter.opts]
    assert len(names) == len(set(names))


def test_what_a_printed_position_is_rounded_by_is_not_beyond_a_limit(icub):
    def notes(excess):
        q = np.array(icub.q)
        robot = icub.robot
        upper = dict(zip(robot.dof_names, robot.position_limits[1], strict=True))["l_elbow"]
        q[robot.model.joints[robot.joint_id("l_elbow")].idx_q] = upper + np.radians(excess)
        return joint_limit_notes(icub.at(q, check=False))

    assert notes(0.009) == ()
    assert notes(0.02) == ("l_elbow is 0.02 deg beyond its limit.",)
