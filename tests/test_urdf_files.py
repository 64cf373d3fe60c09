"""URDF as people have it: encodings, namespaces, xacro, inertials; and what its parser says."""

import os
import re

import pytest
from support.tiny import FEET, broken, urdf

import copsense
from copsense import Robot
from copsense.errors import ModelLoadError

PLAIN = Robot.from_urdf(urdf())
HEAD = '<?xml version="1.0" encoding="{}"?>\n'


def written(tmp_path, raw):
    path = tmp_path / "robot.urdf"
    path.write_bytes(raw)
    return path


@pytest.mark.parametrize(
    "raw",
    [
        urdf().encode("utf-8-sig"),
        urdf().replace("\n", "\r\n").encode("utf-8-sig"),
        ("\n\n" + urdf()).encode(),
        (HEAD.format("utf-16") + urdf()).encode("utf-16"),
        (HEAD.format("iso-8859-1") + "<!-- Fuß -->" + urdf()).encode("latin-1"),
        urdf().replace("<robot ", '<robot xmlns="http://example.org/robot" ').encode(),
        re.sub(r'"(-?[0-9][0-9. e-]*)"', r'" \1 \n"', urdf())
        .replace('version=" 1.0 \n"', 'version="1.0"')
        .encode(),
        urdf().replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" ').encode(),
    ],
    ids=["bom", "crlf", "blank", "utf-16", "latin-1", "namespace", "spaces", "xacro's name alone"],
)
def test_the_same_robot_in_another_dress_is_the_same_robot(raw, tmp_path):
    path = written(tmp_path, raw)
    robot = Robot.from_urdf(path)
    assert robot.model == PLAIN.model
    assert robot.notes == ()
    stance = copsense.load_stance(path, contacts=FEET, contact_at="sole")
    assert len(stance.contacts[0].polygon) == 4


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</inertial>", '</inertial><xacro:wheel side="l"/>', "<xacro:wheel>"),
        ('mass value="2"', 'mass value="${m / 2}"', "value='${m / 2}'"),
        ('<child link="left"/>', '<child link="$(arg foot)"/>', "link='$(arg foot)'"),
    ],
)
@pytest.mark.parametrize("space", ['xmlns:xacro="http://www.ros.org/wiki/xacro" ', ""])
def test_xacro_that_was_not_expanded_is_named_with_the_remedy(old, new, said, space):
    text = broken(old, new).replace("<robot ", f"<robot {space}")
    with pytest.raises(ModelLoadError, match=r"Expand it with xacro first") as caught:
        copsense.load_robot(text)
    assert said in str(caught.value)


@pytest.mark.parametrize("space", ['xmlns:xacro="http://www.ros.org/wiki/xacro" ', ""])
def test_xacro_beside_the_links_of_a_whole_file_is_left_out_with_a_note(space):
    stray = '<xacro:include filename="$(find arm)/arm.xacro"/><xacro:wheel side="l"/></robot>'
    text = broken("</robot>", stray).replace("<robot ", f"<robot {space}")
    robot = copsense.load_robot(text)
    assert robot.model == PLAIN.model
    (note,) = robot.notes
    assert note.startswith("<xacro:include> and <xacro:wheel> are xacro that was not expanded")


def test_a_file_of_macros_says_xacro_and_not_that_it_has_no_link():
    macros = '<xacro:macro name="leg"><link name="l"/></xacro:macro>'
    head = '<robot name="m" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    with pytest.raises(ModelLoadError, match=r"<xacro:macro>.*Expand it"):
        Robot.from_urdf(f"{head}{macros}</robot>")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<mass value="1"/>', "", "<inertial> of link 'left' has no <mass>"),
        ('<mass value="1"/>', "<mass/>", "<mass> of link 'left' has no value"),
        (' effort="10"', "", "<limit> of joint 'left_hip' has no effort"),
        (' velocity="1"', "", "<limit> of joint 'left_hip' has no velocity"),
        (
            '<limit effort="10" velocity="1" lower="-1" upper="1"/>',
            "",
            "joint 'left_hip' is revolute and has no <limit>: give it one",
        ),
        ("</robot>", '<link name="lost"/></robot>', "links 'base', 'lost' are the child of no"),
        (
            "</robot>",
            '<link name="a"/><link name="b"/>'
            '<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>'
            '<joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint></robot>',
            "links 'a', 'b' hang on one another",
        ),
    ],
)
def test_what_the_parser_would_drop_or_reject_is_named(old, new, said, capfd):
    with pytest.raises(ModelLoadError, match="Correct the file") as caught:
        copsense.load_robot(broken(old, new))
    assert said in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_the_parser_s_own_reason_reaches_the_message_and_not_the_terminal(capfd):
    text = urdf().replace("<robot ", '<robot version="first" ')
    with pytest.raises(ModelLoadError, match=r"version attribute.*Correct the file") as caught:
        Robot.from_urdf(text)
    assert "at line" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>',
            "",
            "<inertial> of link 'base' has no <inertia>: its mass is taken as a point",
        ),
        (
            '<box size="0.2 0.1 0.02"/>',
            '<cone radius="0.1"/>',
            "collision shape of link 'left' is left out: its <geometry> holds <cone>",
        ),
        ('<box size="0.2 0.1 0.02"/>', "", "its <geometry> holds nothing"),
    ],
)
def test_what_is_harmless_or_left_out_is_a_note_and_no_noise(old, new, said, capfd):
    robot = copsense.load_robot(broken(old, new))
    assert robot.mass == PLAIN.mass
    assert len(robot.notes) == 1
    assert said in robot.notes[0]
    assert capfd.readouterr() == ("", "")


def test_standard_error_works_again_after_a_file_was_read(capfd):
    with pytest.raises(ModelLoadError):
        Robot.from_urdf(urdf().replace("<robot ", '<robot version="first" '))
    os.write(2, b"still here")
    assert capfd.readouterr().err == "still here"
