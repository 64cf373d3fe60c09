"""A robot's description that is missing, broken or senseless says so; a sound one stands."""

import numpy as np
import pinocchio as pin
import pytest
from support.tiny import FEET, MESH, MJCF, broken, urdf

import copsense
from copsense import Robot
from copsense.errors import (
    InvalidInputError,
    MissingExtraError,
    ModelLoadError,
    UnknownNameError,
)
from copsense.robots.presets import shared_presets


@pytest.fixture(params=[Robot.from_urdf, copsense.load_robot], ids=["from_urdf", "load_robot"])
def load(request):
    return request.param


def test_a_missing_file_is_named(load, tmp_path):
    with pytest.raises(ModelLoadError, match=r"no file at .*absent\.urdf.*Give the path"):
        load(tmp_path / "absent.urdf")


def test_a_folder_is_no_description(load, tmp_path):
    with pytest.raises(ModelLoadError, match=r"is a folder\. Give the path"):
        load(tmp_path)


def test_a_name_too_long_for_any_file_is_one_error(load):
    with pytest.raises(ModelLoadError, match="no file at") as caught:
        load("x" * 5000 + ".urdf")
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("content", [b"", bytes(range(256)), b"<robot><link", b"no XML at all"])
def test_a_file_that_is_no_xml_says_so(load, content, tmp_path):
    path = tmp_path / "bad file.urdf"
    path.write_bytes(content)
    with pytest.raises(ModelLoadError, match=r"bad file\.urdf is not XML.*Give a"):
        load(path)


def test_xml_of_another_kind_is_rejected_with_the_kinds_there_are():
    with pytest.raises(ModelLoadError, match=r"starts with <html>, URDF with <robot>"):
        Robot.from_urdf("<html/>")
    with pytest.raises(
        ModelLoadError, match=r"URDF with <robot>, MJCF with <mujoco> and SDF with <sdf>"
    ):
        copsense.load_robot("<html/>")


def test_the_wrong_reader_names_the_right_one():
    with pytest.raises(ModelLoadError, match="from_mjcf"):
        Robot.from_urdf(MJCF)
    with pytest.raises(ModelLoadError, match="from_urdf"):
        Robot.from_mjcf(urdf())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<child link="left"/>', '<child link="gone"/>', "child link 'gone' of joint 'left_hip'"),
        ('<parent link="base"/>', "", "parent link None of joint 'left_hip'"),
        ('<robot name="tiny">', "<robot>", "<robot> has no name"),
        ('link name="right"', 'link name="left"', "2 links are named 'left'"),
        ('joint name="right_hip"', 'joint name="left_hip"', "2 joints are named 'left_hip'"),
        ('type="revolute"', 'type="rubber"', "type 'rubber', not revolute"),
        ('axis xyz="1 0 0"', 'axis xyz="0 0 0"', "axis of joint 'left_hip' has no direction"),
        ('axis xyz="1 0 0"', 'axis xyz="nan 0 0"', "xyz='nan 0 0'"),
        ('axis xyz="1 0 0"', 'axis xyz="1 0"', "3 finite numbers"),
        ('<mass value="2"/>', '<mass value="heavy"/>', "value='heavy' in the <mass> of link"),
        ('<mass value="2"/>', '<mass value="nan"/>', "value='nan' in the <mass> of link 'base'"),
        ('<mass value="2"/>', '<mass value="inf"/>', "value='inf' in the <mass> of link 'base'"),
        ('<mass value="1"/>', '<mass value="-1"/>', "mass of link 'left' is negative"),
        ('ixx="1"', 'ixx="one"', "ixx='one' in the <inertia> of link 'base'"),
        ('effort="10"', 'effort="strong"', "effort='strong' in the <limit> of joint"),
    ],
)
def test_a_fault_of_a_urdf_is_named_and_is_not_guessed_away(load, old, new, said):
    with pytest.raises(ModelLoadError, match="Correct the file") as caught:
        load(broken(old, new))
    assert said in str(caught.value)


def test_a_urdf_without_links_and_one_that_is_no_tree_say_so(load):
    with pytest.raises(ModelLoadError, match="it has no link"):
        load('<robot name="empty"/>')
    loop = '<joint name="back" type="fixed"><parent link="left"/><child link="base"/></joint>'
    with pytest.raises(ModelLoadError, match="must be a tree"):
        load(broken("</robot>", loop + "</robot>"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('axis="1 0 0"', 'axis="sideways"', "axis='sideways' in the joint of body 'left'"),
        ('mass="2"', 'mass="nan"', "mass='nan' in the inertial of body 'base'"),
        ('pos="0 0.1 -0.5"', 'pos="0 0.1"', "3 finite numbers"),
        ('type="hinge"', 'type="rubber"', "invalid keyword: 'rubber'"),
    ],
)
def test_a_fault_of_an_mjcf_is_named(old, new, said):
    assert old in MJCF
    with pytest.raises(ModelLoadError, match="Correct the file") as caught:
        copsense.load_robot(MJCF.replace(old, new, 1))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["<mujoco/>", "<mujoco><worldbody/></mujoco>"])
def test_an_mjcf_without_bodies_says_so(text):
    with pytest.raises(ModelLoadError, match="no <body>"):
        copsense.load_robot(text)


@pytest.mark.parametrize("as_text", [True, False], ids=["text", "path"])
@pytest.mark.parametrize("source", [urdf(), MJCF], ids=["urdf", "mjcf"])
def test_a_sound_description_stands_on_its_soles_from_path_and_text(source, as_text, tmp_path):
    path = tmp_path / "ünsere Röboter.xml"
    path.write_text(source, encoding="utf-8")
    stance = copsense.load_stance(
        source if as_text else path, contacts=FEET, contact_at="sole", base_rpy=np.zeros(3)
    )
    assert stance.robot.joint_names == ("left_hip", "right_hip")
    assert [c.offset[2] for c in stance.contacts] == pytest.approx([-0.01, -0.01])
    assert copsense.solve_equilibrium(stance, copsense.minimum_wrench(1.0)).residual() < 1e-10


def test_an_mjcf_body_without_joint_gets_a_floating_base():
    robot = copsense.load_robot(MJCF.replace("<freejoint/>", ""))
    assert (robot.base_nv, robot.joint_names) == (6, ("left_hip", "right_hip"))


def test_a_urdf_with_mujoco_s_extension_element_is_a_urdf():
    extension = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    assert copsense.load_robot(broken("</robot>", extension)).mass == pytest.approx(4.0)


def test_meshes_are_not_needed_until_a_sole_is_read():
    robot = Robot.from_urdf(urdf(MESH))
    assert robot.mass == pytest.approx(4.0)
    with pytest.raises(ModelLoadError, match=r"foot\.stl.*Give package_dirs= \(--package-dir\)"):
        copsense.load_stance(robot, contacts=FEET, contact_at="sole")


def test_a_sole_that_cannot_be_read_is_a_warning_where_it_was_not_asked_for():
    with pytest.warns(copsense.robots.ContactGeometryWarning, match="no sole polygon") as notes:
        stance = copsense.load_stance(urdf(MESH), contacts=FEET, contact_at="frame")
    assert len(notes) == 2
    assert [c.polygon for c in stance.contacts] == [None, None]


@pytest.mark.parametrize(
    ("foot", "said"),
    [
        ("", "no collision geometry is attached to frame 'left'"),
        (
            '<collision><geometry><sphere radius="0.1"/></geometry></collision>',
            "touches the ground in a single point",
        ),
    ],
)
def test_a_foot_without_a_sole_says_what_to_give_instead(foot, said):
    with pytest.raises(ModelLoadError, match="polygon") as caught:
        copsense.load_stance(urdf(foot), contacts=FEET, contact_at="sole")
    assert said in str(caught.value)


def test_a_robot_without_geometry_says_so():
    robot = Robot.from_model(pin.buildSampleModelHumanoidRandom())
    with pytest.raises(InvalidInputError, match="without geometry"):
        copsense.sole.read_sole(robot, copsense.Contact(robot.frame_names[-1]))


def test_an_unknown_robot_lists_the_known_ones_and_the_nearest():
    with pytest.raises(
        UnknownNameError, match=r"'iccub'.*Did you mean icub.*talos.*URDF, MJCF or SDF"
    ):
        copsense.load_robot("iccub")


def test_a_model_without_floating_base_is_rejected():
    with pytest.raises(InvalidInputError, match=r"no floating base .*JointModelFreeFlyer"):
        Robot.from_model(pin.buildSampleModelManipulator())
    with pytest.raises(InvalidInputError, match="first joint is none"):
        Robot.from_model(pin.Model())


def test_a_robot_without_mass_is_rejected():
    weightless = urdf().replace('mass value="1"', 'mass value="0"')
    with pytest.raises(InvalidInputError, match=r"total 0 kg.*positive masses"):
        Robot.from_urdf(weightless.replace('mass value="2"', 'mass value="0"'))


@pytest.mark.parametrize("mass", [-1.0, np.nan, np.inf])
def test_a_model_with_a_senseless_mass_names_the_joint_that_carries_it(mass):
    model = pin.buildSampleModelHumanoidRandom()
    model.inertias[3].mass = mass
    with pytest.raises(InvalidInputError, match=f"not finite at {model.names[3]}"):
        Robot.from_model(model)


def test_a_model_with_nan_geometry_or_without_gravity_is_rejected():
    model = pin.buildSampleModelHumanoidRandom()
    model.inertias[3].lever = np.array([np.nan, 0, 0])
    with pytest.raises(InvalidInputError, match=f"not finite at {model.names[3]}"):
        Robot.from_model(model)
    model = pin.buildSampleModelHumanoidRandom()
    model.gravity.linear = np.zeros(3)
    with pytest.raises(InvalidInputError, match="nothing to share"):
        Robot.from_model(model)


def test_the_wrong_joint_to_keep_is_named_with_the_nearest():
    with pytest.raises(UnknownNameError, match=r"'left_hop'.*Did you mean left_hip"):
        Robot.from_urdf(urdf()).keeping(["left_hop"])


@pytest.mark.parametrize(
    ("robot", "package", "extra"),
    [("icub", "icub-models", "icub"), ("talos", "example-robot-data", "robots")],
)
def test_a_robot_whose_package_is_absent_names_the_extra(robot, package, extra, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("sys.path", [])
    monkeypatch.setattr("sys.prefix", "/nowhere")
    said = rf"{package}.*pip install \"copsense\[{extra}\]\""
    with shared_presets(), pytest.raises(MissingExtraError, match=said):
        copsense.load_robot(robot)


def test_a_planar_base_takes_no_orientation():
    with pytest.raises(InvalidInputError, match="no heading"):
        copsense.robots.four_bar_robot().configuration(base_yaw=0.3)
    with pytest.raises(InvalidInputError, match=r"no orientation.*Leave"):
        copsense.load_stance("four_bar", base_rpy=(0.0, 0.0, 0.1))


@pytest.mark.parametrize("name", ["leg_length", "rod_length", "leg_mass", "body_mass"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_a_four_bar_rejects_senseless_sizes(name, value):
    with pytest.raises(InvalidInputError, match=name.split("_")[0]):
        copsense.robots.four_bar_robot(**{name: value})
