"""Contacts that are unknown, misplaced or too few say so, with offsets and valid names."""

import numpy as np
import pytest
from support.tiny import FEET, urdf

import copsense
from copsense import Contact, Plane, Stance
from copsense.errors import (
    ContactGeometryError,
    InsufficientContactsError,
    InvalidInputError,
    UnknownNameError,
)


def test_an_unknown_frame_lists_the_likeliest_of_hundreds(icub):
    with pytest.raises(UnknownNameError, match=r"Did you mean l_sole") as caught:
        icub.with_contacts([Contact("l_soul")])
    assert "427 in all" in str(caught.value)
    assert len(str(caught.value)) < 1200
    assert caught.value.valid == icub.robot.frame_names


def test_an_unknown_kind_of_contact_lists_the_kinds():
    with pytest.raises(Exception, match="surface") as caught:
        Contact("l_sole", kind="foot")
    assert "point" in str(caught.value)


def test_a_contact_needs_a_frame():
    with pytest.raises(InvalidInputError, match="needs its frame"):
        Contact("")


def test_a_frame_fixed_in_the_world_is_no_contact_of_the_robot(icub):
    with pytest.raises(InvalidInputError, match=r"fixed in the world.*Name a frame of a foot"):
        icub.with_contacts([Contact("universe"), Contact("l_sole")])


def test_no_contact_lists_the_frames(icub):
    with pytest.raises(InvalidInputError, match=r"at least one contact.*l_sole"):
        Stance(icub.robot, icub.q, ())


def test_contacts_of_one_name_are_rejected_and_may_be_renamed(icub):
    with pytest.raises(InvalidInputError, match=r"share a name: l_sole, l_sole.*name=") as caught:
        icub.with_contacts([Contact("l_sole"), Contact("l_sole")])
    assert "r_sole" not in str(caught.value)
    two = icub.with_contacts([Contact("l_sole"), Contact("l_sole", name="again")])
    assert two.contact_names == ("l_sole", "again")


def points(*offsets):
    return [
        Contact("l_sole", kind="point", name=f"p{i}", offset=offset)
        for i, offset in enumerate(offsets)
    ]


@pytest.mark.parametrize(
    ("contacts", "rank"),
    [
        (points((0, 0, 0)), 3),
        (points((0, 0, 0), (0.1, 0, 0)), 5),
        (points((0, 0, 0), (0.1, 0, 0), (0.3, 0, 0)), 5),
        ([Contact("l_sole", kind="planar"), Contact("r_sole", kind="planar")], 3),
    ],
    ids=["one point", "two points", "points on a line", "planar feet"],
)
def test_contacts_that_cannot_carry_the_robot_say_how_much_they_span(icub, contacts, rank):
    with pytest.raises(InsufficientContactsError, match=rf"span {rank} of 6.*three point contacts"):
        icub.with_contacts(contacts)


def test_three_points_off_a_line_carry_the_robot(icub):
    stance = icub.with_contacts(points((0, 0, 0), (0.1, 0, 0), (0, 0.05, 0)))
    equilibrium = copsense.solve_equilibrium(stance, copsense.minimum_wrench(1.0))
    assert equilibrium.residual() < 1e-10


def test_a_contact_off_its_plane_says_by_how_many_millimetres(icub):
    with pytest.raises(ContactGeometryError, match=r"'l_sole'.*-10\.000 mm") as caught:
        icub.with_contacts([Contact("l_sole", plane=Plane((0, 0, 0.01)))])
    assert "drop its plane" in str(caught.value)


def test_a_contact_turned_out_of_its_plane_says_by_how_many_degrees(icub):
    tilted = Plane(tuple(icub.placements[0].translation), (0, np.sin(0.02), np.cos(0.02)))
    with pytest.raises(ContactGeometryError, match=r"1\.146 deg"):
        icub.with_contacts([Contact("l_sole", plane=tilted)])
    upside_down = Plane(normal=(0, 0, -1))
    with pytest.raises(ContactGeometryError, match=r"180\.000 deg"):
        icub.with_contacts([Contact("l_sole", plane=upside_down)])


def test_a_contact_at_a_frame_off_the_sole_warns_in_millimetres():
    with pytest.warns(copsense.robots.ContactGeometryWarning, match=r"10\.0 mm.*contact_at='sole'"):
        copsense.load_stance(urdf(), contacts=FEET)
    with pytest.warns(copsense.robots.ContactGeometryWarning):
        stance = copsense.load_stance(urdf(), contacts=FEET)
    assert "10.0 mm" in copsense.robots.sole_notes(stance)[0]


def test_a_robot_that_is_no_preset_asks_for_its_contacts():
    with pytest.raises(InvalidInputError, match=r"--contact FRAME.*all: .*left.*copsense inspect"):
        copsense.load_stance(urdf())


def test_contacts_given_as_one_name_are_not_read_letter_by_letter():
    with pytest.raises(InvalidInputError, match=r"Give a list, \['left'\]"):
        copsense.load_stance(urdf(), contacts="left")


@pytest.mark.parametrize("field", ["offset", "rotation", "polygon", "friction"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_of_a_contact_must_be_finite(field, value):
    bad = {
        "offset": (0.0, 0.0, value),
        "rotation": np.diag([1.0, 1.0, value]),
        "polygon": np.array([[0.0, 0.0], [value, 1.0], [1.0, 0.0]]),
        "friction": value,
    }
    with pytest.raises(InvalidInputError, match=field):
        Contact("foot", **{field: bad[field]})


def test_a_rotation_must_be_one():
    for matrix in (np.ones((3, 3)), -np.eye(3), 2 * np.eye(3)):
        with pytest.raises(InvalidInputError, match="not a rotation matrix"):
            Contact("foot", rotation=matrix)


def test_a_polygon_needs_two_points():
    with pytest.raises(InvalidInputError, match="single point"):
        Contact("foot", polygon=np.zeros((3, 2)))


def test_a_plane_needs_a_direction():
    with pytest.raises(InvalidInputError, match=r"not a direction. Give one"):
        Plane(normal=(0, 0, 0))
    with pytest.raises(InvalidInputError, match="not finite"):
        Plane(normal=(0, 0, np.nan))


@pytest.mark.parametrize("width", [0.0, -1.0, np.nan, np.inf])
def test_a_stance_width_is_a_positive_number(width):
    with pytest.raises(InvalidInputError, match=r"stance width \[m\] is .*Give a positive"):
        copsense.load_stance("icub", width=width)


def test_a_stance_width_needs_two_contacts():
    with pytest.raises(InvalidInputError, match="Leave width out"):
        copsense.load_stance("icub", contacts=["l_sole"], width=0.1)


def test_a_contact_put_at_a_height_keeps_what_it_has_along_its_plane():
    # About x by a right angle: the contact's normal is the model's -y.
    turned = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    contact = Contact("l_sole", rotation=turned, offset=(0.1, 0.5, 0.3), friction=0.4)
    assert contact.normal.tolist() == [0.0, -1.0, 0.0]
    raised = contact.at_height(-0.02)
    assert raised.offset == pytest.approx((0.1, 0.02, 0.3))
    assert raised.friction == 0.4
    assert raised.normal @ raised.offset == pytest.approx(-0.02)
