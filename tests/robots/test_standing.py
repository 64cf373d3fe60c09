"""How any robot comes to stand: walls, ranges without zero, frames with another axis up, sizes."""

import itertools
import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.commands import copsense as command
from support.walkers import BIPED, FOUR, FULL, bent, walker

import copsense
from copsense import Contact, Plane
from copsense.errors import InvalidInputError
from copsense.robots import (
    ImplausibleStanceWarning,
    UprightWarning,
    heading_notes,
    plausibility_notes,
)

WRENCH = copsense.minimum_wrench(1.0)
LEG = FULL[1:4]  # roll, hip, knee: a quadruped's, on point feet
QUARTERS = [
    np.column_stack([x, np.cross(z, x), z])
    for z, x in itertools.permutations([s * e for s in (1, -1) for e in np.eye(3)], 2)
    if abs(x @ z) == 0
]


def quietly(text, contacts=BIPED, **more):
    """A stance of which nothing has to be said."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return copsense.load_stance(text, contacts=contacts, **more)


def told(category, text, contacts=BIPED, **more):
    """A stance, and what was said of it in this category of warnings alone."""
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        stance = copsense.load_stance(text, contacts=contacts, **more)
    assert {note.category for note in notes} <= {category}
    return stance, [str(note.message) for note in notes]


@pytest.fixture(scope="module")
def upright():
    return quietly(walker(), contact_at="sole", posture=bent())


# Walls


@pytest.mark.parametrize("distance", [0.15, 0.2, 0.3])
@pytest.mark.parametrize("angle", [0.0, 25.0])
def test_a_hand_on_a_wall_goes_straight_to_it_and_the_feet_stay(distance, angle, stance_of):
    alone = stance_of("icub")
    free = alone.with_contacts([*alone.contacts, Contact("l_hand", "point")]).placements[2]
    normal = np.array([-np.cos(np.radians(angle)), -np.sin(np.radians(angle)), 0.0])
    wall = Plane(tuple(-distance * normal), tuple(normal))
    hand = Contact("l_hand", "point", plane=wall)
    stance = copsense.robots.stand(alone.robot, [*alone.contacts, hand], alone.q)
    found = stance.placements[2].translation
    assert normal @ found == pytest.approx(-distance, abs=1e-9)
    assert found[2] == pytest.approx(free.translation[2], abs=0.02)
    for now, before in zip(stance.placements, alone.placements, strict=False):
        assert now.translation == pytest.approx(before.translation, abs=1e-9)
    assert stance.com[:2] == pytest.approx(alone.com[:2], abs=1e-9)


# Ranges


@pytest.mark.parametrize("span", [(0.6, 2.4), (-2.4, -0.6)])
def test_joints_start_inside_a_range_that_leaves_zero_out(span):
    contacts = [Contact(f"{leg}_foot", "point") for leg in FOUR]
    stance = quietly(walker(LEG, legs=FOUR, limits={"knee": span}, box=False), contacts)
    assert not stance.joint_limit_excess.any()
    own = copsense.load_stance(
        stance.robot, contacts=contacts, posture={f"{leg}_knee": span[0] for leg in FOUR}
    )
    assert abs(own.robot.joint_position(own.q, "fl_knee") - span[0]) < 0.5


def test_joints_far_beyond_their_limits_are_named_and_how_far():
    text = walker(limits={"knee": (-0.1, 0.1)})
    stance, said = told(
        ImplausibleStanceWarning, text, contact_at="sole", posture={"l_knee": 0.9, "r_knee": 0.9}
    )
    worst = max(stance.joint_limit_excess)
    assert len(said) == 1
    assert f"_knee by {np.degrees(worst):.0f} deg" in said[0]
    assert "--posture" in said[0]
    assert plausibility_notes(stance) == (said[0],)


# Which way is up


@pytest.mark.parametrize("frame", QUARTERS)
def test_feet_are_turned_so_that_z_is_up_and_x_ahead_and_the_robot_stands_alike(frame, upright):
    stance, said = told(UprightWarning, walker(foot=frame), contact_at="sole", posture=bent())
    assert len(said) == (0 if frame[2, 2] == 1 else 2)
    assert stance.com == pytest.approx(upright.com, abs=1e-9)
    assert stance.contacts[0].offset == pytest.approx(-0.05 * frame[2], abs=1e-12)
    if said:
        up = "+-"[int(frame[2].sum() < 0)] + "xyz"[int(np.argmax(np.abs(frame[2])))]
        assert f"its {up} axis does" in said[0]
        assert stance.contacts[0].polygon == pytest.approx(upright.contacts[0].polygon, abs=1e-9)
        turn = stance.contacts[0].rotation
        assert frame @ turn == pytest.approx(np.eye(3), abs=1e-12)


def test_a_foot_that_was_placed_is_not_turned_but_told_which_axis_is_up():
    frame = pin.rpy.rpyToMatrix(np.pi / 2, 0, 0).round()
    placed = [Contact(foot, offset=(0.0, 0.0, 0.05)) for foot in BIPED]
    with pytest.raises(InvalidInputError, match=r"does not point up.*rotation=\[\[") as caught:
        quietly(walker(foot=frame), placed)
    assert "its -y axis does" in str(caught.value) or "its +y axis does" in str(caught.value)


@pytest.mark.parametrize("frame", QUARTERS)
def test_a_base_whose_z_is_not_up_is_turned_and_the_way_to_say_it_is_given(frame):
    contacts = [Contact(f"{leg}_foot", "point") for leg in FOUR]
    plain = quietly(walker(LEG, legs=FOUR), contacts)
    text = walker(LEG, legs=FOUR, base=frame)
    stance, said = told(UprightWarning, text, contacts)
    assert stance.com[2] == pytest.approx(plain.com[2], abs=1e-9)
    assert len(said) == (0 if frame[2, 2] == 1 else 1)
    if said:
        given = said[0].split("--base-rpy ")[1].split(")")[0]
        rpy = np.radians([float(angle) for angle in given.split(":")])
        again = quietly(text, contacts, base_rpy=rpy)
        assert again.q == pytest.approx(stance.q, abs=1e-12)


def test_the_command_takes_the_base_s_orientation(tmp_path):
    path = tmp_path / "y_up.urdf"
    frame = pin.rpy.rpyToMatrix(-np.pi / 2, 0, 0).round()
    path.write_text(walker(LEG, legs=FOUR, base=frame), encoding="utf-8")
    words = ["analyse", path, "--criterion", "minimum-wrench", "--json"]
    words += [w for leg in FOUR for w in ("--contact", f"{leg}_foot:point")]
    turned = command(*words)
    assert "--base-rpy" in turned.err
    rpy = turned.err.split("--base-rpy ")[1].split(")")[0]
    given = command(*words, "--base-rpy", rpy)
    assert "--base-rpy" not in given.err
    assert given.json["com"] == turned.json["com"]
    assert "ROLL:PITCH:YAW" in command(*words, "--base-rpy", "90:0").error
    assert "Give one" in command(*words, "--base-rpy", "90:0:0", "--base-yaw", "3").error


# What cannot be meant


def test_a_robot_that_hangs_under_its_contacts_is_rejected():
    contacts = [Contact(f"{leg}_foot", "point") for leg in FOUR]
    with pytest.raises(InvalidInputError, match=r"under all of its contacts.*base_rpy"):
        copsense.load_stance(walker(LEG, legs=FOUR), contacts=contacts, base_rpy=(np.pi, 0.0, 0.0))


def test_a_stance_built_upside_down_says_so_in_its_analysis():
    contacts = [Contact(f"{leg}_foot", "point") for leg in FOUR]
    plain = quietly(walker(LEG, legs=FOUR), contacts)
    q = np.array(plain.q)
    q[3:7] = [1.0, 0.0, 0.0, 0.0]  # w, x, y, z where x, y, z, w is meant
    hanging = copsense.Stance(plain.robot, q, contacts)
    notes = copsense.analyse(hanging, [WRENCH]).notes
    assert any("upside down? Quaternions are x, y, z, w" in note for note in notes)


@pytest.mark.parametrize(
    ("scale", "unit", "factor"), [(1e-3, "millimetres", "0.001"), (1e-2, "centimetres", "0.01")]
)
def test_lengths_that_are_not_metres_are_rejected_with_the_unit_they_may_be(scale, unit, factor):
    with pytest.raises(
        InvalidInputError, match=rf"are its lengths {unit}\?.*scale them by {factor}"
    ):
        copsense.load_stance(walker(scale=scale), contacts=BIPED, contact_at="sole")


@pytest.mark.parametrize(("mass", "said"), [(1e-3, "grams"), (1e3, "in tonnes")])
def test_masses_that_are_not_kilograms_are_doubted(mass, said):
    text = walker(mass=mass)
    stance, notes = told(ImplausibleStanceWarning, text, contact_at="sole", posture=bent())
    assert len(notes) == 1
    assert f"{stance.robot.mass:.3g} kg: are its masses" in notes[0]
    assert said in notes[0]


@pytest.mark.parametrize("name", ["icub", "talos", "human", "go2", "four_bar", "iCubLisboa01"])
def test_nothing_is_doubted_about_a_preset(name, stance_of):
    assert plausibility_notes(stance_of(name)) == ()
    assert heading_notes(stance_of(name)) == ()


@pytest.mark.parametrize(
    ("yaw", "said"), [(90.0, "90 deg to the left"), (-60.0, "60 deg to the right")]
)
def test_soles_whose_axes_do_not_point_ahead_are_named(icub, yaw, said):
    turn = pin.rpy.rpyToMatrix(0.0, 0.0, np.radians(yaw))
    contacts = [replace(c, rotation=c.rotation @ turn, plane=None) for c in icub.contacts]
    stance = icub.with_contacts(contacts)
    (note,) = heading_notes(stance)
    assert f"l_sole and r_sole points {said}" in note
    assert note in copsense.analyse(stance).notes
    assert heading_notes(icub) == ()
