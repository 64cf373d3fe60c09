"""The robot is the tree that holds the contacts, whatever else is in the scene, which is named."""

import pytest
from support import commands
from support.mjcf import FOOT, assert_mujocos, walker

import copsense
from copsense import Contact
from copsense.errors import InvalidInputError, ModelLoadError, UnknownNameError

BALL = "<body name='ball' pos='1 0 1'><freejoint/><geom size='.1' mass='1'/></body>"
TARGET = "<body name='target' mocap='true'><geom size='.1' contype='0' conaffinity='0'/></body>"
TABLE = "<body name='table'><geom type='box' size='.3 .3 .3' mass='20'/></body>"
DOOR = "<body name='door'><joint name='hinge' axis='0 0 1'/><geom size='.2' mass='3'/></body>"
SECOND = (
    "<body name='other'><freejoint/><geom size='.1' mass='2'/><body name='arm' pos='0 0 .1'>"
    "<joint name='swing'/><geom size='.1' mass='1'/><site name='grip'/></body></body>"
)
TERRAIN = (
    "<asset><hfield name='hills' nrow='2' ncol='2' size='1 1 .1 .1' elevation='0 1 0 1'/></asset>"
)
FEET = ["l_foot", "r_foot"]


@pytest.mark.parametrize("place", ["before", "after"])
@pytest.mark.parametrize(
    ("thing", "said"),
    [
        (BALL, "'ball' (1 kg, moving)"),
        (TARGET, "'target' (mocap)"),
        (TABLE, "'table' (20 kg, fixed)"),
        (DOOR, "'door' (3 kg, moving)"),
    ],
    ids=["ball", "mocap", "table", "door"],
)
def test_what_stands_beside_the_robot_is_left_out_and_named(thing, said, place):
    text = walker(**{place: thing})
    robot = assert_mujocos(text)
    assert robot.frame("l_foot") is not None
    (note,) = [n for n in robot.notes if "beside the robot ('trunk')" in n]
    assert said in note


def test_a_terrain_and_keyframes_of_the_whole_scene_are_no_obstacle():
    hills = "<geom type='hfield' hfield='hills'/>"
    key = "<keyframe><key name='k' qpos='{}'/></keyframe>".format(" ".join(["0"] * 7 + ["0"] * 17))
    assert_mujocos(
        walker(head=TERRAIN, before=BALL + hills, tail=key.replace("'0 0 0 0", "'1 0 1 1"))
    )


@pytest.mark.parametrize("frames", [["grip"], ["arm"], ["swing"], [Contact("grip", "point")]])
def test_the_robot_is_the_tree_of_the_frames_that_are_named(frames):
    text = walker(after=SECOND)
    names = [f if isinstance(f, str) else f.frame for f in frames]
    robot = copsense.load_robot(text, frames=names)
    assert robot.joint_names == ("swing",)
    assert robot.mass == pytest.approx(3.0)
    assert any("'trunk' (" in note for note in robot.notes)
    assert len(copsense.load_robot(text, frames=FEET).joint_names) == 10


@pytest.mark.parametrize("root", ["other", "arm"])
def test_any_of_its_bodies_chooses_a_robot(root):
    assert copsense.load_robot(walker(after=SECOND), root=root).joint_names == ("swing",)
    assert copsense.Robot.from_mjcf(walker(after=SECOND), root=root).joint_names == ("swing",)


def test_several_robots_are_told_apart_and_not_guessed():
    with pytest.raises(InvalidInputError) as caught:
        copsense.load_robot(walker(after=SECOND))
    for said in ("'trunk' (", "'other' (3 kg, moving)", "--contact", "root="):
        assert said in str(caught.value)
    with pytest.raises(InvalidInputError, match=r"separate.*l_foot on 'trunk', grip on 'other'"):
        copsense.load_robot(walker(after=SECOND), frames=["l_foot", "grip"])
    with pytest.raises(UnknownNameError, match=r"'othr'.*Did you mean other"):
        copsense.load_robot(walker(after=SECOND), root="othr")


def test_a_robot_with_a_free_base_comes_before_one_that_is_hinged_and_both_before_balls():
    assert len(copsense.load_robot(walker(before=DOOR + BALL)).joint_names) == 10
    balls = f"<mujoco><worldbody>{TABLE}{BALL}</worldbody></mujoco>"
    assert copsense.load_robot(balls).mass == pytest.approx(1.0)
    two = f"<mujoco><worldbody>{BALL}{BALL.replace('ball', 'bowl')}</worldbody></mujoco>"
    with pytest.raises(InvalidInputError, match=r"'ball' \(1 kg, moving\), 'bowl'"):
        copsense.load_robot(two)
    with pytest.raises(ModelLoadError, match="no <body>"):
        copsense.load_robot(f"<mujoco><worldbody>{TARGET}</worldbody></mujoco>")


def test_a_frame_of_the_world_is_no_foot():
    with pytest.raises(InvalidInputError, match="'spot' is fixed in the world"):
        copsense.load_robot(walker(before="<site name='spot'/>"), frames=["spot"])


def test_load_stance_and_the_command_take_the_robot_of_their_contacts(tmp_path):
    """Both robots alone would do: the contacts decide, and what is left out is said once."""
    path = tmp_path / "scene.xml"
    path.write_text(walker(after=SECOND, foot=FOOT + "<site name='{side}_under' pos='0 0 -.06'/>"))
    bent = {
        f"{s}_{j}": a for s in "lr" for j, a in {"hip": -0.4, "knee": 0.8, "ankle": -0.4}.items()
    }
    stance = copsense.load_stance(path, contacts=FEET, contact_at="sole", posture=bent)
    assert len(stance.robot.joint_names) == 10
    words = ["analyse", path, "--contact-at", "sole", "--criterion", "minimum-wrench", "--json"]
    for foot in FEET:
        words += ["--contact", foot]
    for joint, angle in bent.items():
        words += ["--posture", f"{joint}={angle}rad"]
    answer = commands.copsense(*words)
    assert answer.code == 0, answer.err
    assert sum("'other' (3 kg, moving)" in note for note in answer.json["notes"]) == 1
    assert answer.err.count("'other' (3 kg, moving)") == 1
