"""Inertias that no body has: named where motion is asked for, replaced on demand, never felt by
statics."""

import re

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense as command
from support.walkers import BIPED, bent, walker

import copsense
from copsense.errors import ImpossibleInertiaError
from copsense.inertias import impossible_inertias, repair_inertias
from copsense.simulation import Scenario


def with_inertia(link, moments, *, text=None, mass=None):
    """A walker of which one link has these principal moments [kg m^2], and this mass."""
    text = text or walker()
    ixx, iyy, izz = moments
    before = rf'<link name="{link}"><inertial><origin[^>]*/><mass value="'
    pattern = rf'({before})([^"]*)("/>)<inertia[^>]*>'
    kg = r"\2" if mass is None else str(mass)
    inertia = f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>'
    found, count = re.subn(pattern, rf"\g<1>{kg}\g<3>{inertia}", text)
    assert count == 1
    return found


def stand(text):
    return copsense.load_stance(text, contacts=BIPED, contact_at="sole", posture=bent())


@pytest.mark.parametrize(
    ("moments", "wrong"),
    [((0.0, 0.02, 0.02), "0, 0.02 and 0.02"), ((0.01, 0.02, 0.05), "0.01, 0.02 and 0.05")],
    ids=["not positive", "one too great"],
)
def test_the_simulation_names_the_link_and_its_inertia_and_what_works(moments, wrong):
    stance = stand(with_inertia("l_knee_link", moments))
    with pytest.raises(ImpossibleInertiaError) as error:
        copsense.balance(stance, reference=Scenario(0.05))
    said = str(error.value)
    assert f"link 'l_knee_link' (1.2 kg) has the principal inertias {wrong} kg m^2" in said
    assert "--repair-inertia" in said
    assert "analyse, sweep, design, map and push work" in said


@pytest.mark.parametrize("moments", [(0.0, 0.02, 0.02), (0.01, 0.02, 0.05), (0.0, 0.0, 0.0)])
def test_repair_changes_no_statics_and_lets_the_robot_stand(moments):
    broken = stand(with_inertia("l_knee_link", moments))
    robot = repair_inertias(broken.robot)
    assert impossible_inertias(robot) == {}
    i = robot.model.getJointId("l_knee")
    body, was = robot.model.inertias[i], broken.robot.model.inertias[i]
    # A ball of the mean moment, as MuJoCo's balanceinertia; of water where there is none.
    mean = sum(moments) / 3 or 0.4 * 1.2 * (3 * 1.2 / (4e3 * np.pi)) ** (2 / 3)
    np.testing.assert_allclose(body.inertia, mean * np.eye(3), rtol=1e-12, atol=1e-18)
    assert body.mass == was.mass
    np.testing.assert_array_equal(body.lever, was.lever)
    (note,) = [note for note in robot.notes if note not in broken.robot.notes]
    assert "'l_knee_link'" in note
    assert "Statics do not change; motions do." in note
    fixed = copsense.Stance(robot, broken.q, broken.contacts)
    for criterion in (copsense.minimum_torque(), copsense.minimum_wrench(1.0)):
        before = copsense.solve_equilibrium(broken, criterion)
        after = copsense.solve_equilibrium(fixed, criterion)
        np.testing.assert_array_equal(before.wrenches, after.wrenches)
        np.testing.assert_array_equal(before.torques, after.torques)
    run = copsense.balance(fixed, reference=Scenario(0.1))
    assert run.completed


def test_an_inertia_without_mass_is_left_out():
    text = with_inertia("l_roll_link", (1e-3, 1e-3, 1e-3), mass=0.0)
    stance = stand(text)
    assert list(impossible_inertias(stance.robot)) == ["l_roll"]
    robot = repair_inertias(stance.robot)
    assert not robot.model.inertias[robot.model.getJointId("l_roll")].inertia.any()
    assert copsense.balance(
        copsense.Stance(robot, stance.q, stance.contacts), reference=Scenario(0.05)
    ).completed


def test_inertias_that_bodies_have_are_left_as_they_are():
    robot = stand(walker()).robot
    assert repair_inertias(robot) is robot
    rod = pin.Inertia(1.0, np.zeros(3), np.diag([1e-4, 1.0, 1.0]))  # thin, and still a body
    model = robot.model.copy()
    model.inertias[model.getJointId("l_knee")] = rod
    assert impossible_inertias(copsense.Robot("rod", model)) == {}


def test_the_command_repairs_on_demand_and_says_so(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(with_inertia("l_knee_link", (0.0, 0.02, 0.02)), encoding="utf-8")
    words = [path, "--contact", "l_foot", "--contact", "r_foot", "--contact-at", "sole"]
    for joint, at in bent().items():
        words += ["--posture", f"{joint}={at}rad"]
    failed = command("balance", *words, "--duration", 0.05)
    assert failed.code == 2
    assert "link 'l_knee_link' (1.2 kg)" in failed.err
    mended = command("balance", *words, "--duration", 0.05, "--repair-inertia")
    assert mended.code == 0, mended.err
    assert "0.0133 kg m^2 about every axis, their mean, takes their place" in mended.err
    assert command("analyse", *words).code == 0
