"""Every preset stands: feet on the ground, CoM over their middle, soles as their meshes show."""

from contextvars import Context

import numpy as np
import pytest

import copsense
from copsense import load_stance
from copsense.robots.presets import shared_presets

BIPEDS = {"icub", "talos", "romeo", "g1", "human"}


@pytest.mark.parametrize("name", [name for name in copsense.robots.PRESETS if name != "four_bar"])
def test_preset_stands_on_level_ground_with_its_com_over_the_middle_of_its_feet(stance_of, name):
    stance = stance_of(name)
    origins = np.array([place.translation for place in stance.placements])
    normals = np.array([place.rotation[:, 2] for place in stance.placements])
    np.testing.assert_allclose(origins[:, 2], 0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(normals, [[0, 0, 1]] * len(normals), rtol=0, atol=1e-11)
    np.testing.assert_allclose(origins.mean(axis=0), 0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(stance.com[:2], 0, rtol=0, atol=1e-11)
    assert stance.com[2] > 0.1
    least = copsense.minimum_wrench(1.0)  # heel and toe may push against each other
    assert not copsense.solve_equilibrium(stance, copsense.minimum_torque(tie_break=least)).pulling


@pytest.mark.parametrize("name", [*sorted(BIPEDS), "iCubGenova04", "iCubLisboa01"])
def test_bipeds_face_x_with_the_left_foot_at_y(stance_of, name):
    stance = stance_of(name)
    left, right = stance.placements
    assert stance.contact_names[0].startswith("l")
    assert left.translation[1] > 0.03 > -0.03 > right.translation[1]
    for place, contact in zip(stance.placements, stance.contacts, strict=True):
        assert place.rotation[0, 0] > 0.9
        assert copsense.polygon.Polygon(contact.polygon).margin((0.0, 0.0)).distance > 0.02


def test_four_bar_stands_as_the_papers_at_a_right_angle(stance_of):
    stance = stance_of("four_bar")
    left, right = (place.translation for place in stance.placements)
    np.testing.assert_allclose(left, [0, 0.07, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(right, [0, -0.07, 0], rtol=0, atol=1e-12)
    # kappa l = 3/4 of 0.5 m
    np.testing.assert_allclose(stance.com, [0, 0, 0.375], rtol=0, atol=1e-12)


def test_icubs_sole_is_what_its_mesh_shows():
    # Lowest millimetre of the collision mesh of iCubGenova04: 10.5 mm under the sole's frame.
    robot = copsense.load_robot("icub")
    sole = copsense.sole.read_sole(robot, copsense.Contact("l_sole"))
    assert sole.height == pytest.approx(-0.0105, abs=5e-5)
    # Of the hull's 74 vertices seven are within 0.1 um of the line of others.
    assert len(sole.polygon) == 67
    low, high = sole.polygon.min(axis=0), sole.polygon.max(axis=0)
    np.testing.assert_allclose(low, [-0.066, -0.0435], rtol=0, atol=5e-5)
    np.testing.assert_allclose(high, [0.129, 0.0515], rtol=0, atol=5e-5)
    # The right one is its mirror image.
    other = copsense.sole.read_sole(robot, copsense.Contact("r_sole")).polygon
    np.testing.assert_allclose(other.min(axis=0)[1], -high[1], rtol=0, atol=1e-4)


def test_icubs_frame_and_sole_contacts_differ_by_that_height(icub):
    at_sole = copsense.load_stance("icub", contact_at="sole")
    for contact in at_sole.contacts:
        assert contact.offset[2] == pytest.approx(-0.0105, abs=5e-5)
    assert at_sole.com[2] - icub.com[2] == pytest.approx(0.0105, abs=5e-5)


def test_locked_joints_keep_their_mass(icub):
    whole = copsense.load_robot("iCubGenova04")
    assert len(whole.joint_names) == 32
    assert len(icub.robot.joint_names) == 23
    assert icub.robot.mass == pytest.approx(whole.mass, rel=1e-12)
    assert icub.robot.model.nv == 29


def test_a_robot_is_read_once_where_it_is_shared_and_afresh_elsewhere():
    kept = {}
    with shared_presets(kept):
        here, lowered = load_stance("four_bar"), load_stance("four_bar")
        with shared_presets():
            assert load_stance("four_bar").robot is not here.robot
        assert load_stance("four_bar").robot is here.robot
    assert here.robot is lowered.robot is kept["four_bar"]
    bare = Context()  # within the suite's own block all is shared
    first, second = (bare.run(load_stance, "four_bar").robot for _ in range(2))
    assert first is not second
    assert first is not here.robot
    with shared_presets(kept):
        assert load_stance("four_bar").robot is here.robot


def test_a_contact_that_the_user_placed_stays_there():
    feet = [
        copsense.Contact(frame, offset=(0.0, 0.0, 0.03))
        for frame in ("left_sole_link", "right_sole_link")
    ]
    stance = copsense.load_stance("talos", contacts=feet)
    assert all(contact.offset == (0.0, 0.0, 0.03) for contact in stance.contacts)
    assert all(contact.polygon is not None for contact in stance.contacts)
    asked = copsense.load_stance("talos", contacts=feet, contact_at="sole")
    assert all(abs(contact.offset[2]) < 1e-3 for contact in asked.contacts)
    with_outline = [
        copsense.Contact(f, polygon=copsense.rectangle((-0.05, 0.1), (-0.03, 0.03)))
        for f in ("l_sole", "r_sole")
    ]
    lowered = copsense.load_stance("iCubGenova04", contacts=with_outline)
    assert lowered.contacts[0].offset[2] == pytest.approx(-0.0105, abs=1e-5)
    assert len(lowered.contacts[0].polygon) == 4


@pytest.mark.parametrize("name", ["icub", "human", "four_bar"])
def test_a_preset_and_load_stance_mean_the_same_by_posture_and_base_rpy(name):
    preset = copsense.robots.PRESETS[name]
    rpy = None if name == "four_bar" else preset.base_rpy
    given = copsense.load_stance(name, posture=preset.posture, base_rpy=rpy)
    np.testing.assert_array_equal(given.q, copsense.load_stance(name).q)
