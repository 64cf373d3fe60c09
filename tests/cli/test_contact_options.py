"""``--contact FRAME[:KIND]`` and ``--sole``: names with colons, and soles that are a line."""

import numpy as np
import pytest
from support.commands import copsense
from support.tiny import urdf

import copsense as library
from copsense import Contact
from copsense.contact import Plane

SOLE = ("--sole", "-0.1:0.1:-0.05:0.05", "--sole-height", "-0.01")
LAW = ("--criterion", "minimum-wrench")


@pytest.fixture
def scoped(tmp_path):
    """The tiny robot with links called after their robot, and one that looks like a kind."""
    path = tmp_path / "scoped.urdf"
    text = urdf().replace('"left"', '"tiny::left"').replace('"right"', '"tiny:right:point"')
    path.write_text(text, encoding="utf-8")
    return path


def contacts_of(path, *names):
    options = [word for name in names for word in ("--contact", name)]
    answer = copsense("analyse", path, *options, *SOLE, *LAW, "--json").json
    return {c["frame"]: c["kind"] for c in answer["contacts"]}


def test_the_longest_known_frame_is_meant(scoped):
    assert contacts_of(scoped, "tiny::left", "tiny:right:point") == {
        "tiny::left": "surface",
        "tiny:right:point": "surface",
    }


def test_a_kind_stands_after_the_last_colon(scoped):
    assert contacts_of(scoped, "tiny::left:surface", "tiny:right:point:planar") == {
        "tiny::left": "surface",
        "tiny:right:point": "planar",
    }


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tiny::left:points", "no kind of contact named 'points'. Did you mean point"),
        ("tiny::lift", "no frame in robot 'tiny' named 'tiny::lift'. Did you mean tiny::left"),
    ],
)
def test_a_wrong_name_is_told_apart_from_a_wrong_kind(scoped, name, said):
    assert said in copsense("analyse", scoped, "--contact", name).error


def test_a_sole_may_be_a_line_but_not_a_point(scoped):
    where = ("analyse", scoped, "--contact", "tiny::left", "--sole-height", "-0.01")
    answer = copsense(*where, "--sole", "-0.1:0.1:0:0", "--json").json
    row = answer["criteria"]["minimum-wrench"]["contacts"]["tiny::left"]
    assert row["margin"] <= 0.1 + 1e-9
    assert "empty" in copsense(*where, "--sole", "0:0:0:0").error


FEET = ("--contact", "l_sole", "--contact", "r_sole")


def saved(folder, *options):
    """The stance that a command stood, read back from the file that it wrote."""
    path = folder / "saved.toml"
    answer = copsense("analyse", "icub", *options, *LAW, "--json", "--save-stance", path)
    assert answer.code in (0, 1), answer.err
    return library.load_stance(path)


def same(stance, other):
    np.testing.assert_allclose(stance.q, other.q, rtol=0, atol=1e-9)
    for one, two in zip(stance.contacts, other.contacts, strict=True):
        np.testing.assert_allclose(one.offset, two.offset, rtol=0, atol=1e-12)
        np.testing.assert_allclose(one.rotation, two.rotation, rtol=0, atol=1e-12)
        assert (one.plane is None) == (two.plane is None)
        if one.plane is not None:
            np.testing.assert_allclose(one.plane.normal, two.plane.normal, rtol=0, atol=1e-12)
            np.testing.assert_allclose(one.plane.point, two.plane.point, rtol=0, atol=1e-12)


def known(frame, **changes):
    from dataclasses import replace

    preset = {c.frame: c for c in library.robots.PRESETS["icub"].contacts}
    return replace(preset[frame], **changes)


def test_a_slope_and_a_step_are_what_python_says(tmp_path):
    stance = saved(tmp_path, "--ground", "l_sole=0:5", "--ground", "r_sole=-3:0:50mm")
    slope, step = np.radians(5), np.radians(-3)
    same(
        stance,
        library.load_stance(
            "icub",
            contacts=[
                known("l_sole", plane=Plane.sloping(0.0, slope)),
                known("r_sole", plane=Plane.sloping(step, 0.0, 0.05)),
            ],
        ),
    )
    left, right = stance.placements
    # Ahead it falls away: z = -x tan(5 deg).
    assert left.translation[2] == pytest.approx(-left.translation[0] * np.tan(slope), abs=1e-9)
    # A negative roll falls away to the left, from 50 mm over the origin.
    fall = 0.05 + right.translation[1] * np.tan(step)
    assert right.translation[2] == pytest.approx(fall, abs=1e-9)
    np.testing.assert_allclose(left.rotation[:, 2], [np.sin(slope), 0, np.cos(slope)], atol=1e-9)


def test_a_hand_on_a_wall_is_what_python_says(tmp_path):
    hand = ("--contact", "l_hand:point", "--contact-offset", "l_hand=0:0:-20mm")
    stance = saved(tmp_path, *FEET, *hand, "--plane", "l_hand=-1:0:0:0.25:0:0")
    wall = Plane((0.25, 0.0, 0.0), (-1.0, 0.0, 0.0))
    palm = Contact("l_hand", kind="point", offset=(0.0, 0.0, -0.02), plane=wall)
    python = library.load_stance("icub", contacts=["l_sole", "r_sole", palm])
    same(stance, python)
    assert stance.placements[2].translation[0] == pytest.approx(0.25, abs=1e-9)


def test_a_turned_contact_is_what_python_says(tmp_path):
    stance = saved(tmp_path, "--contact-rpy", "l_sole=0:0:10", "--contact-at", "frame")
    turned = known("l_sole").turned(0.0, 0.0, np.radians(10.0))
    contacts = [turned, known("r_sole")]
    same(stance, library.load_stance("icub", contacts=contacts, contact_at="frame"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--ground", "l_sole"), "FRAME=ROLL:PITCH[:HEIGHT]"),
        (("--ground", "l_sole=5"), "FRAME=ROLL:PITCH[:HEIGHT]"),
        (("--ground", "l_sole=1:2:3:4"), "FRAME=ROLL:PITCH[:HEIGHT]"),
        (("--ground", "l_sole=0:5kg"), "5kg"),
        (("--ground", "l_sole=0:95"), "a wall by its normal"),
        (("--ground", "l_sole=0:nan"), "slope"),
        (("--ground", "l_soles=0:5"), "Did you mean l_sole"),
        (("--ground", "l_sole=0:5", "--ground", "l_sole=0:6"), "given twice for l_sole"),
        (("--ground", "l_sole=0:5", "--plane", "l_sole=0:0:1"), "Give one of them"),
        (("--plane", "l_sole=0:0:0"), "not a direction"),
        (("--plane", "l_sole=0:0:up"), "FRAME=NX:NY:NZ"),
        (("--plane", "l_sole=0:0:1:2"), "FRAME=NX:NY:NZ"),
        (("--contact-offset", "l_sole=0:0"), "FRAME=X:Y:Z"),
        (("--contact-rpy", "l_sole=0:0:x"), "such as 20 (degrees)"),
        (("--contact-offset", "head=0:0:0"), "Name it by --contact as well"),
    ],
)
def test_a_bad_place_is_one_clear_line(options, said):
    assert said in copsense("analyse", "icub", *options).error
