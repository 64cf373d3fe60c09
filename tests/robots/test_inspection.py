"""Inspection finds feet, soles and heading by geometry, and prints a line by which a robot stands.

The walkers are written with known feet, axes and soles: what is found is compared with those.
"""

import json
import re
import shlex
import warnings

import numpy as np
import pytest
from support.commands import copsense
from support.tiny import urdf as tiny
from support.walkers import BIPED, FOUR, FULL, PITCH_ONLY, walker, with_toes

import copsense as cs
from copsense.drives import Coupling, Spring
from copsense.robots import inspect_robot, soles_read
from copsense.robots.heading import upright_base

BACK = np.diag([-1.0, -1.0, 1.0])  # axes in which x is backward and y right
SIDE = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # y forward, x right


def written(folder, text, name="robot.urdf"):
    path = folder / name
    path.write_text(text)
    return path


def renamed(text, **names):
    for old, new in names.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    return text


def run(line):
    """Paste the line that was printed."""
    words = shlex.split(line)
    assert words[:2] == ["copsense", "analyse"]
    return copsense(*words[1:], "--json")


def test_feet_are_found_by_geometry_under_any_name_with_their_soles(tmp_path):
    text = renamed(walker(), l_foot="head", r_foot="left_hand", trunk="sole")
    found = inspect_robot(written(tmp_path, text))
    assert [foot.frame for foot in found.feet] == ["head", "left_hand"]
    for foot in found.feet:
        np.testing.assert_allclose(foot.sole.size, (0.2, 0.08), rtol=0, atol=1e-9)
        assert foot.sole.height == pytest.approx(-0.05, abs=1e-9)
        assert foot.sole.tilt == 0.0
        assert str(foot) == f"{foot.frame}: sole 200 x 80 mm, 50 mm under the frame"
    answer = run(str(found.line))
    assert answer.code == 0, answer.err
    said = "head and left_hand: sole 200 x 80 mm, 50 mm under the frame; read from their collision"
    assert said in answer.err


def test_parallel_legs_without_a_yaw_get_a_line_by_which_wrenches_have_a_derivative(tmp_path):
    """The usual small biped: hip roll, three pitches, ankle roll; upright it stands at a branch."""
    path = written(tmp_path, walker(FULL[1:]))
    found = inspect_robot(path)
    assert found.line.width == pytest.approx(1.2 * 0.2, abs=1e-3)
    (note,) = [note for note in found.notes if "exactly parallel" in note]
    assert "limbs of l_foot and r_foot have 5 joints each" in note
    assert "about z (yaw)" in note
    answer = run(str(found.line))
    assert answer.code == 0
    assert "held twice" not in answer.err
    words = shlex.split(str(found.line))
    at = words.index("--width")
    answer = copsense(*words[1:at], *words[at + 2 :], "--load", "trunk=0:5:0")
    assert answer.code == 2
    assert "no derivative here. The limbs of l_foot and r_foot have 5 joints each" in answer.err
    assert "(width=, --width)" in answer.err


@pytest.mark.parametrize(
    ("axes", "heading", "option"),
    [(None, 0.0, None), (BACK, 180.0, "--base-yaw=180"), (SIDE, 90.0, "--base-yaw=270")],
)
def test_a_robot_that_faces_elsewhere_is_turned_to_face_along_x(tmp_path, axes, heading, option):
    found = inspect_robot(written(tmp_path, walker(base=axes)))
    assert found.heading == heading
    if option is None:
        assert "--base" not in str(found.line)
    else:
        assert option in shlex.split(str(found.line))
    stance = _stance(found)
    for place, sign in zip(stance.placements, (1, -1), strict=True):
        assert sign * place.translation[1] > 0.05  # the left foot is left
    q = stance.q
    ahead = np.array([0.03, 0.0, 0.0])  # where a sole's middle is from its ankle
    turned = [place.rotation.T @ ahead for place in stance.placements]
    assert q.shape == (19,)
    assert all(t[0] > 0.02 or axes is not None for t in turned)


@pytest.mark.parametrize(
    ("axes", "rpy"),
    [
        (np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), "--base-rpy=-90:0:0"),
        (np.diag([1.0, -1.0, -1.0]), "--base-rpy=180:0:0"),
    ],
)
def test_a_base_whose_z_is_not_up_is_turned_by_the_line(tmp_path, axes, rpy):
    found = inspect_robot(written(tmp_path, walker(base=axes)))
    assert rpy in shlex.split(str(found.line))
    answer = run(str(found.line))
    assert answer.code == 0, answer.err
    assert _stance(found).com[2] > 0.4


def test_straight_knees_are_bent_ahead_unless_their_range_forbids_it(tmp_path):
    ahead = inspect_robot(written(tmp_path, walker())).line.posture
    assert ahead["l_knee"] > 0.2
    assert ahead["l_hip"] == pytest.approx(-ahead["l_knee"] / 2)
    limits = {"knee": (-2.0, 0.0)}
    back = inspect_robot(written(tmp_path, walker(limits=limits))).line.posture
    assert back["l_knee"] < -0.2
    assert back["l_hip"] == pytest.approx(-back["l_knee"] / 2)


def test_four_balls_are_points(tmp_path):
    text = walker(legs=FOUR).replace('<box size="0.2 0.08 0.02"/>', '<sphere radius="0.02"/>')
    assert "sphere" in text
    found = inspect_robot(written(tmp_path, text))
    assert [foot.kind for foot in found.feet] == ["point"] * 4
    assert "fl_foot:point" in str(found.line)
    assert run(str(found.line)).code == 0


def test_knees_tell_which_way_a_robot_on_points_faces(tmp_path):
    balls = walker(legs=FOUR).replace('<box size="0.2 0.08 0.02"/>', '<sphere radius="0.02"/>')
    found = inspect_robot(written(tmp_path, balls))
    assert found.heading == 0.0
    assert found.heading_reason.startswith("its knees turn across")
    rolled = [(name, {"1 0 0": "0 1 0", "0 1 0": "1 0 0"}.get(axis, axis)) for name, axis in FULL]
    sideways = walker(rolled, legs=FOUR).replace(
        '<box size="0.2 0.08 0.02"/>', '<sphere radius="0.02"/>'
    )
    found = inspect_robot(written(tmp_path, sideways))
    assert found.heading == 90.0
    assert "--base-yaw=270" in str(found.line)


def test_names_of_feet_tell_ahead_from_behind_where_geometry_does_not(tmp_path):
    other = {"fl": "hr", "fr": "hl", "hl": "fr", "hr": "fl"}
    text = walker(legs=FOUR).replace('<box size="0.2 0.08 0.02"/>', '<sphere radius="0.02"/>')
    turned = re.sub("(?<![a-z])(fl|fr|hl|hr)_", lambda m: other[m[1]] + "_", text)
    found = inspect_robot(written(tmp_path, turned))
    assert {foot.frame for foot in found.feet} == {f"{name}_foot" for name in other}
    assert found.heading == 180.0
    assert found.heading_reason.endswith("names tell ahead from behind")
    # Of words that contradict each other, none counts.
    mirrored = {"fl": "hl", "fr": "hr", "hl": "fl", "hr": "fr"}
    text = re.sub("(?<![a-z])(fl|fr|hl|hr)_", lambda m: mirrored[m[1]] + "_", text)
    found = inspect_robot(written(tmp_path, text))
    assert found.heading == 0.0
    assert found.heading_reason.endswith("nothing distinguishes ahead from behind")


def test_many_short_legs_of_which_no_shape_is_known_get_no_line(tmp_path):
    """Not a sole under each knee."""
    found = inspect_robot(written(tmp_path, walker(FULL[1:4], legs=FOUR, box=False)))
    assert len(found.feet) == 4
    assert found.line is None
    assert "--contact-offset" in found.reason
    assert str(found).count(found.feet[0].reason) == 1


def test_a_toe_tip_under_a_foot_is_doubted_aloud(tmp_path):
    # A foot of 200 x 80 mm, and a block of 13 x 45 mm that reaches 5 mm lower.
    tip = (
        '<collision><origin xyz="0.12 0 -0.05"/><geometry><box size="0.013 0.045 0.01"/>'
        "</geometry></collision></link>"
    )
    parts = walker().split("</collision></link>")
    text = f"</collision>{tip}".join(parts)
    path = written(tmp_path, text)
    found = inspect_robot(path)
    doubts = [n for n in found.notes if "13 x 45 mm" in n and "tip" in n]
    assert len(doubts) == 2
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        cs.load_stance(path, contacts=BIPED, contact_at="sole")
    doubts = [str(each.message) for each in said if "13 x 45 mm was read" in str(each.message)]
    assert len(doubts) == 2


def test_visual_geometry_is_offered_where_nothing_collides(tmp_path):
    text = walker().replace("<collision>", "<visual>").replace("</collision>", "</visual>")
    found = inspect_robot(written(tmp_path, text))
    assert "--soles visual" in str(found.line)
    assert any("what is drawn is read instead" in note for note in found.notes)
    assert [foot.sole.size for foot in found.feet] == [pytest.approx((0.2, 0.08))] * 2
    answer = run(str(found.line))
    assert answer.code == 0, answer.err
    assert "read from their visual geometry" in answer.err


def test_without_any_geometry_the_sole_is_said_to_be_a_guess(tmp_path):
    found = inspect_robot(written(tmp_path, walker(box=False)))
    assert [foot.frame for foot in found.feet] == BIPED
    assert "--sole=" in str(found.line)
    assert any("is a guess" in note for note in found.notes)
    assert run(str(found.line)).code == 0


def test_a_robot_that_cannot_stand_has_no_line_and_a_reason():
    ball = '<collision><geometry><sphere radius="0.02"/></geometry></collision>'
    found = inspect_robot(cs.Robot.from_urdf(tiny(ball)))
    assert found.line is None
    assert "two points" in found.reason
    assert "no line by which it stands" in str(found)


def test_the_command_prints_it_and_answers_in_json(tmp_path):
    path = written(tmp_path, walker())
    answer = copsense("inspect", path)
    assert answer.code == 0
    assert "walker: 18.6 kg" in answer.out
    assert "12 joints, 12 motors" in answer.out
    assert copsense("inspect", path, "--joints").out.count(" 80 Nm") == 12
    data = copsense("inspect", path, "--json").json
    assert data == json.loads(json.dumps(inspect_robot(path).to_dict()))
    assert data["feet"][0]["size"] == pytest.approx([0.2, 0.08])
    assert copsense("inspect", tmp_path / "none.urdf").error


def test_an_inspection_is_as_short_as_its_feet_and_ends_with_the_line(tmp_path):
    """The line that works is seen at once, however many joints there are."""
    found = inspect_robot(written(tmp_path, walker()))
    said, listed = str(found).splitlines(), found.text(joints=True).splitlines()
    for text in (said, listed):
        assert text[-2:] == ["to analyse it:", f"  {found.line}"]
        assert [line.split(":")[0] for line in text if line.startswith(("faces", "lowest"))] == [
            "faces",
            "lowest at rest",
        ]
    assert said[1] == (
        "every joint has a range; every motor has an effort limit (--joints lists them)"
    )
    assert not any("l_knee" in line for line in said[:-1])
    assert [line.split()[0] for line in listed[1:13]] == [joint.name for joint in found.joints]
    assert listed[13:] == said[2:]


def test_an_inspection_counts_what_joints_and_motors_lack():
    text = walker().replace('effort="80"', 'effort="50000"', 2)  # placeholders
    text = re.sub('(name="l_knee" type=)"revolute"', r'\1"continuous"', text)
    drives = cs.Drives(springs={"r_knee": Spring(40)}, couplings=(Coupling("r_yaw", "l_yaw", -1),))
    found = inspect_robot(cs.Robot.from_urdf(text).with_drives(drives))
    first, second = (joint.name for joint in found.joints[:2])
    assert str(found).splitlines()[1] == (
        f"1 of 12 joints lacks a range: l_knee; 2 of 11 motors lack an effort limit: {first}, "
        f"{second}; 1 spring; 1 coupling (--joints lists them)"
    )


def test_a_sole_that_was_given_is_not_said_to_be_read():
    polygon = cs.rectangle((-0.05, 0.1), (-0.04, 0.04))
    contacts = [cs.Contact(name, polygon=polygon) for name in BIPED]
    stance = cs.load_stance(walker(), contacts=contacts, contact_at="sole")
    assert soles_read(stance) == ()
    read = cs.load_stance(walker(), contacts=BIPED, contact_at="sole")
    assert len(soles_read(read)) == 1


def _stance(found):
    line = found.line
    return cs.load_stance(
        found.robot,
        contacts=list(line.contacts),
        contact_at=line.contact_at,
        posture=line.posture,
        base_rpy=np.radians(line.base_rpy),
    )


LEG = """<body name="{name}" pos="{x} {y} 0"><joint name="{name}_hip" axis="0 0 1"/>
<joint name="{name}_knee" axis="{a} 1 0"/>
<geom type="capsule" fromto="0 0 0 {x} {y} -0.3" size="0.03" mass="0.2"/></body>"""
BUG = (
    '<mujoco model="bug"><worldbody><body name="trunk" pos="0 0 0.5"><freejoint/>'
    '<geom type="sphere" size="0.15" mass="3"/>'
    + "".join(
        LEG.format(name=name, x=x, y=y, a=-1 if x * y > 0 else 1)
        for name, x, y in (("a", 0.2, 0.2), ("b", -0.2, 0.2), ("c", 0.2, -0.2), ("d", -0.2, -0.2))
    )
    + "</body></worldbody></mujoco>"
)


def test_a_leg_whose_tip_has_no_frame_stands_on_its_tip(tmp_path):
    path = tmp_path / "bug.xml"
    path.write_text(BUG, encoding="utf-8")
    found = inspect_robot(path)
    assert found.line.offsets == {
        "a": (0.2, 0.2, -0.33),
        "b": (-0.2, 0.2, -0.33),
        "c": (0.2, -0.2, -0.33),
        "d": (-0.2, -0.2, -0.33),
    }
    assert sum("its frame is 330 mm over the lowest point" in note for note in found.notes) == 4
    words = shlex.split(str(found.line))
    assert words[words.index("--contact-offset") + 1] == "a=0.2:0.2:-0.33"
    answer = copsense(*words[1:], "--json")
    assert answer.code == 0, answer.err
    heights = [contact["position"][2] for contact in answer.json["contacts"]]
    assert heights == pytest.approx([0.0] * 4, abs=1e-12)
    # The tips are 0.4 m to either side, not the hips at 0.2 m.
    assert abs(answer.json["contacts"][0]["position"][0]) == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("tilt", [6.0, 40.0])
def test_tilted_soles_are_named_with_their_angle_and_levelled_by_the_line(tmp_path, tilt):
    turned = rf'\g<1>rpy="0 {np.radians(tilt)} 0"'
    text = re.sub(r'(<collision><origin xyz="[^"]*" )rpy="[^"]*"', turned, walker())
    found = inspect_robot(written(tmp_path, text))
    for foot in found.feet:
        said = f"tilted by {tilt:.1f} deg against frame {foot.frame!r}"
        assert said in str(foot)
        assert any(said in note and "--level-soles" in note for note in found.notes)
    assert "--level-soles" in shlex.split(str(found.line))
    assert f"turned by {tilt:.1f} deg to lie flat" in run(str(found.line)).err


def test_a_foot_that_rests_on_its_edge_is_preferred_to_toes_that_reach_lower(tmp_path):
    text = walker(limits={"pitch": (0.03, 0.2)})  # toes down by 4 degrees at rest
    text = with_toes(text)
    found = inspect_robot(written(tmp_path, text))
    assert [foot.frame for foot in found.feet] == BIPED


def test_shins_tell_which_way_up_a_base_is_where_bent_knees_do_not():
    """Knees 0.2 m under the trunk and 0.14 m behind its middle, shins straight down from them."""
    legs = "".join(
        f'<link name="{name}"><inertial><origin xyz="0 -0.17 0"/><mass value="0.5"/><inertia '
        'ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>'
        f'<joint name="{name}_knee" type="revolute"><origin xyz="{x} -0.2 {z - 0.14}"/><parent '
        f'link="trunk"/><child link="{name}"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" '
        'effort="9" velocity="9"/></joint>'
        for name, (z, x) in FOUR.items()
    )
    trunk = (
        '<link name="trunk"><inertial><mass value="12"/><inertia ixx="0.1" ixy="0" ixz="0" '
        'iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
    )
    robot = cs.Robot.from_urdf(f'<robot name="y up">{trunk}{legs}</robot>')
    assert upright_base(robot, robot.configuration()) == (90.0, 0.0, 0.0)


def test_a_robot_whose_contacts_hold_the_com_sideways_says_so(tmp_path):
    found = inspect_robot(written(tmp_path, walker(PITCH_ONLY)))
    assert found.line is not None
    assert any("hold the CoM's y fast" in note and "Move CoM x" in note for note in found.notes)


@pytest.mark.parametrize(("axes", "base"), [(None, None), (BACK, "180"), (SIDE, "270")])
def test_axes_of_a_turned_foot_are_those_of_the_robot_that_faces_ahead(tmp_path, axes, base):
    """The foot's frame has x up and z backward, however the trunk is drawn."""
    foot = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    found = inspect_robot(written(tmp_path, walker(base=axes, foot=foot)))
    words = shlex.split(str(found.line))
    assert (f"--base-yaw={base}" in words) == (base is not None)
    for each in found.feet:
        np.testing.assert_allclose(each.contact.rotation, foot.T, rtol=0, atol=1e-12)
        np.testing.assert_allclose(each.sole.size, (0.2, 0.08), rtol=0, atol=1e-9)
    axes_said = "its x, y, z are the frame's -z, +y, +x"
    assert str(found).count(f"; {axes_said}") == 2
    assert run(str(found.line)).err.count(axes_said) == 2


def test_a_knee_beside_its_hip_is_as_straight_as_one_under_it(tmp_path):
    """Joints stand anywhere along their axes: a thigh that goes out by 0.2 m bends no knee."""
    text = walker()
    for side, out in (("l", 0.2), ("r", -0.2)):
        knee = f'<joint name="{side}_knee" type="revolute"><origin xyz="0.0 0.0 -0.3"'
        assert knee in text
        text = text.replace(knee, knee.replace("0.0 0.0 -0.3", f"0.0 {out} -0.3"))
    posture = inspect_robot(written(tmp_path, text)).line.posture
    assert posture["l_knee"] == posture["r_knee"] == pytest.approx(np.radians(30))


def test_knees_are_bent_under_hips_of_which_no_joint_alone_pitches_the_thigh(tmp_path):
    """Three axes askew, at right angles to each other, turn it together."""
    third = np.sqrt(1 / 3)
    across = np.array([[1, 0, -1], [1, -2, 1]]) / np.sqrt([[2], [6]])
    turn = np.vstack([across[0], [third] * 3, across[1]])  # its columns are the axes
    hips = [(name, " ".join(map(str, turn[:, i]))) for i, name in enumerate("abc")]
    joints = [*hips, *FULL[3:]]
    text = walker(joints)
    # The thigh hangs under the last of the hip's joints.
    for side in "lr":
        knee = f'<joint name="{side}_knee" type="revolute"><origin xyz="0.0 0.0 0.0"'
        assert knee in text
        text = text.replace(knee, knee.replace("0.0 0.0 0.0", "0.0 0.0 -0.3"))
    found = inspect_robot(written(tmp_path, text))
    posture = found.line.posture
    assert posture["l_knee"] == pytest.approx(np.radians(30))
    robot = found.robot
    q = robot.configuration({name: at for name, at in posture.items() if name.startswith("l_")})
    place = cs.Stance(robot, q, [cs.Contact("l_foot")], check=False).placements[0]
    # The sole stays level, and the foot is under the hip but for rounding to a tenth of a degree.
    np.testing.assert_allclose(place.rotation, np.eye(3), rtol=0, atol=5e-3)
    np.testing.assert_allclose(place.translation[:2], (0.0, 0.1), rtol=0, atol=3e-3)
    assert run(str(found.line)).code == 0
