"""What an MJCF says and copsense does not use is named; what is used makes no noise."""

import pytest
from support.mjcf import FOOT, walker

import copsense

EQUALITIES = {
    "weld": (
        "<weld body1='l_foot'/>",
        "equality (weld) of 'l_foot' and the world is not used: it joins the robot to what is not "
        "part of it.",
    ),
    "fixed": (
        "<joint joint1='l_hip' polycoef='0.2 0 0 0 0'/>",
        "joint 'l_hip' is held at 0.2 rad or m by an equality.",
    ),
    "bent": (
        "<joint joint1='l_hip' joint2='r_hip' polycoef='0 1 0 2 0'/>",
        "equality (joint) of joint 'l_hip' and joint 'r_hip' is not used: its polynomial is of "
        "degree 3, copsense knows straight lines.",
    ),
    "tendon": (
        "<tendon name='taut' tendon1='string'/>",
        "equality 'taut' (tendon) of tendon 'string' is not used: copsense knows connect, weld and "
        "joint.",
    ),
}
USED = {
    "connect": "<connect name='rod' body1='l_foot' body2='r_foot' anchor='0 0 0'/>",
    "weld": "<weld body1='l_foot' body2='r_foot'/>",
    "sites": "<connect site1='l_tip' site2='r_tip'/>",
    "joint": "<joint joint1='l_hip' joint2='r_hip'/>",
}
TENDON = "<tendon><fixed name='string'><joint joint='l_hip' coef='1'/></fixed></tendon>"
TIPPED = FOOT + "<site name='{side}_tip'/>"


def notes(**parts):
    return copsense.load_robot(walker(**parts)).notes


def test_a_file_of_which_all_is_used_has_no_notes():
    motors = "".join(
        f"<motor joint='{side}_{joint}'/>"
        for side in "lr"
        for joint in ("hip_roll", "hip", "knee", "ankle", "ankle_roll")
    )
    assert notes() == ()
    assert notes(tail=f"<actuator>{motors}</actuator><sensor><clock/></sensor>") == ()


@pytest.mark.parametrize(("element", "said"), EQUALITIES.values(), ids=EQUALITIES)
def test_an_equality_is_named_with_its_ends(element, said):
    assert notes(foot=TIPPED, tail=f"{TENDON}<equality>{element}</equality>") == (said,)


@pytest.mark.parametrize("element", USED.values(), ids=USED)
def test_an_equality_that_is_used_is_not_named(element):
    assert notes(foot=TIPPED, tail=f"{TENDON}<equality>{element}</equality>") == ()


def test_equalities_that_do_not_act_are_not_named():
    weld = "<equality><weld body1='l_foot' {}/></equality>"
    assert notes(tail=weld.format("active='false'")) == ()
    off = "<option><flag equality='disable'/></option>"
    assert notes(head=off, tail=weld.format("")) == ()
    ball = "<body name='ball'><freejoint/><geom size='.1'/></body>"
    beside = notes(after=ball, tail="<equality><weld body1='ball'/></equality>")
    assert not any("equality" in note for note in beside)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (
            {
                "foot": "<geom size='.02' mass='.2'/><body><joint name='{side}_ball' type='ball' "
                "stiffness='3'/>" + FOOT + "</body>"
            },
            "springs (stiffness) of joints l_ball, r_ball are not used",
        ),
        ({"tail": TENDON.replace("name=", "stiffness='9' name=")}, "tendons string are not used"),
        ({"tail": TENDON.replace("name=", "range='0 1' name=")}, "tendons string are not used"),
        (
            {
                "foot": TIPPED,
                "tail": "<tendon><spatial name='rope'><site site='l_tip'/><site site='r_tip'/>"
                "</spatial></tendon><actuator><motor name='winch' tendon='rope'/></actuator>",
            },
            "actuators winch do not act on a single joint or a fixed tendon; each joint that they",
        ),
        (
            {"foot": TIPPED, "tail": "<actuator><motor name='jet' site='l_tip'/></actuator>"},
            "actuators jet do not act on joints; they are not used",
        ),
        (
            {"tail": "<actuator><motor joint='l_hip'/></actuator>"},
            "r_knee, r_ankle, r_ankle_roll have no actuator, while others have; they have no motor",
        ),
        (
            {
                "base": "<freejoint/>",
                "foot": "<body name='{side}_float' gravcomp='1'>" + FOOT + "</body>",
            },
            "gravcomp of l_float, r_float is not used",
        ),
        (
            {"head": "<option gravity='1 0 -9'/>"},
            "gravity in the file is 1 0 -9 m/s^2, not straight down",
        ),
        (
            {"head": "<option gravity='0 0 9'/>"},
            "gravity in the file is 0 0 9 m/s^2, not straight down",
        ),
    ],
)
def test_each_thing_that_is_passed_over_is_said(parts, said):
    found = notes(**parts)
    assert any(said in note for note in found), found
    assert all(note.endswith(".") for note in found)
