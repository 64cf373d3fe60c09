"""Cassie: rods that stay closed, leaf springs held straight, lines under its feet."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.commands import copsense
from support.mujoco_balance import missing_forces
from support.statics_apart import frame_at, loop_gaps

from copsense import (
    Robot,
    check_sensitivity,
    lateral_sweep,
    minimum_torque,
    minimum_wrench,
    solve_equilibrium,
)
from copsense.closing import close
from copsense.errors import ModelLoadError, UndeterminedWrenchError
from copsense.robots.cassie import cassie_robot
from copsense.robots.presets import example_file

LEAST = minimum_wrench(1.0)
CRITERIA = (LEAST, minimum_torque(tie_break=LEAST))
FILE = example_file("cassie_description/robots/cassie_v2.sdf", "cassie")[0]


@pytest.fixture(scope="module")
def cassie(stance_of):
    return stance_of("cassie")


def test_ten_motors_close_its_loops_wherever_it_sways(cassie):
    robot = cassie.robot
    assert robot.mass == pytest.approx(32.94)
    assert len(robot.torque_names) == 10
    assert {name.split("-")[1] for name in robot.torque_names} == {
        "roll", "yaw", "pitch", "knee", "foot",
    }  # fmt: skip
    stances = lateral_sweep(cassie, -0.02, 0.02, 3).stances
    for stance in (cassie, *stances):
        assert np.abs(loop_gaps(robot, stance.q)).max() < 1e-12
        for joint in robot.drives.springs:
            assert abs(robot.joint_position(stance.q, joint)) < 1e-12
    knees = [robot.joint_position(s.q, "left-knee-op") for s in stances]
    assert np.ptp(knees) > 1e-4
    assert stances[2].com[1] - stances[0].com[1] == pytest.approx(0.04, abs=1e-11)


def test_toe_and_heel_are_the_ends_of_the_line_under_the_cylinder_of_the_file(cassie):
    root = ET.parse(FILE).getroot()
    places = dict(zip(cassie.contact_names, cassie.placements, strict=True))
    for side in ("left", "right"):
        shape = root.find(f"model/link[@name='{side}-foot']/collision")
        x, y, z, *rpy = (float(w) for w in shape.findtext("pose").split())
        half = float(shape.findtext("geometry/cylinder/length")) / 2
        radius = float(shape.findtext("geometry/cylinder/radius"))
        foot = frame_at(cassie.robot, cassie.q, f"{side}-foot")
        axis = foot.rotation @ Rotation.from_euler("xyz", rpy).apply([0, 0, 1])
        centre = foot.act(np.array([x, y, z]))
        ends = np.array([centre - half * axis, centre + half * axis])
        toe, heel = ends[np.argsort(-ends[:, 0])] - [0, 0, radius]
        # The file's 1.57 rad is a right angle to 0.07 mm at the end of the line.
        for name, end in (("toe", toe), ("heel", heel)):
            there = places[f"{side}-{name}"].translation
            np.testing.assert_allclose(there, end, rtol=0, atol=1e-4)


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_mujoco_needs_no_other_force(cassie, criterion):
    found = solve_equilibrium(cassie, criterion)
    assert np.abs(missing_forces(cassie, found)).max() < 1e-9 * cassie.robot.weight
    # What holds the leaves straight is what would bend them by 2.0 and 1.3 degrees.
    for leaf, degrees in (("left-knee-shin-joint", 1.99), ("left-tarsus-spring-joint", 1.33)):
        bend = (
            found.loop_forces[f"coupling of {leaf}"] / cassie.robot.drives.springs[leaf].stiffness
        )
        assert np.degrees(bend) == pytest.approx(degrees, abs=0.01)


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_sensitivity_is_what_finite_differences_find(cassie, criterion):
    check_sensitivity(cassie, criterion)


def test_heel_and_toe_may_push_against_each_other_and_the_rows_are_named(cassie):
    with pytest.raises(UndeterminedWrenchError, match="in left-toe fx") as caught:
        solve_equilibrium(cassie, minimum_torque())
    assert "rank 26 of 28 rows" in str(caught.value)


def test_commands_say_what_differs_from_the_file():
    answer = copsense("analyse", "cassie", "--criterion", "minimum-wrench")
    for words in ("hinges are universal joints", "leaf springs are held straight"):
        assert answer.err.count(words) == 1


def bent(robot, *held):
    """The heel's leaf [rad] where loops are closed at a knee of -0.3 rad and these are held."""
    start = robot.configuration({"left-knee-op": -0.3})
    q = close(robot, start, ["left-knee-op", "left-knee-shin-joint", *held])
    assert np.abs(loop_gaps(robot, q)).max() < 1e-10
    return robot.joint_position(q, "left-tarsus-spring-joint")


def test_the_files_hinges_would_wind_the_heels_leaf():
    assert abs(bent(Robot.from_sdf(FILE))) > 0.27
    assert abs(bent(cassie_robot(FILE), "left-tarsus-spring-joint")) < 1e-12


def test_another_file_is_rejected(tmp_path):
    other = tmp_path / "other.sdf"
    other.write_text(FILE.read_text(encoding="utf-8").replace("left-crank-rod-joint", "left-rod"))
    with pytest.raises(ModelLoadError, match="no hinge left-crank-rod-joint"):
        cassie_robot(other)
