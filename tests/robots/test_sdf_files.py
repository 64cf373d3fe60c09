"""SDF files: every link where poses composed by hand put it; what is not known is rejected."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from support.sdf_apart import placed, whole_body

import copsense
from copsense import Robot
from copsense.drives import Spring
from copsense.errors import ModelLoadError
from copsense.robots.presets import example_file

LINK = (
    "<link name='{0}'><pose>{1}</pose><inertial><pose>.01 -.02 .03 .1 .2 .3</pose><mass>{2}</mass>"
    "<inertia><ixx>.02</ixx><iyy>.03</iyy><izz>.04</izz><ixy>.001</ixy><ixz>.002</ixz>"
    "<iyz>-.003</iyz></inertia></inertial></link>"
)
POSES = {
    "base": ".1 .2 1 .1 -.2 .3",
    "a": ".2 .3 .8 -.4 .2 .1",
    "b": ".3 .1 .7 .2 .5 -.6",
    "c": ".1 -.2 .6 1 .3 .2",
    "d": "0 .3 .5 .3 -.3 .3",
    "e": ".2 .2 .4 -.1 .7 .2",
    "f": ".3 .3 .3 .2 .1 -.9",
}
JOINT = (
    "<joint name='{0}' type='{1}'><pose>{2}</pose><parent>{3}</parent><child>{4}</child>{5}</joint>"
)
AXIS = "<axis><xyz{1}>{0}</xyz>{2}</axis>"
CROSS = AXIS.format("1 0 0", "", "") + "<axis2><xyz>0 1 0</xyz></axis2>"
SPRING = (
    "<limit><lower>-1</lower><upper>2</upper><effort>30</effort><velocity>4</velocity></limit>"
    "<dynamics><damping>.5</damping><friction>.1</friction><spring_reference>.2</spring_reference>"
    "<spring_stiffness>70</spring_stiffness></dynamics>"
)


def text(version="1.6", joints=None, more="", links=None):
    parts = joints or [
        # A child before its parent: the order of the file is not that of the tree.
        JOINT.format("slide", "prismatic", ".1 0 0 0 .4 0", "b", "c", AXIS.format("1 2 2", "", "")),
        JOINT.format("hinge", "revolute", "", "base", "a", AXIS.format("0 1 0", "", SPRING)),
        JOINT.format("turn", "continuous", "0 .1 0 .2 0 0", "a", "b", AXIS.format("1 0 1", "", "")),
        JOINT.format("weld", "fixed", "", "base", "d", ""),
        JOINT.format("ball", "ball", ".05 .1 0 .3 .1 0", "d", "e", ""),
        JOINT.format(
            "cross", "universal", "0 0 .2 0 0 .5", "base", "f",
            CROSS,
        ),
    ]  # fmt: skip
    body = "".join(LINK.format(n, p, k + 1) for k, (n, p) in enumerate(POSES.items()))
    return (
        f"<sdf version='{version}'><model name='toy'>{links or body}{''.join(parts)}{more}"
        "</model></sdf>"
    )


def random_positions(robot, seed):
    """A configuration with the base at the origin, and the numbers of each joint of the file."""
    rng = np.random.default_rng(seed)
    q, positions = pin.neutral(robot.model), {}
    for name in robot.joint_names:
        joint = robot.model.joints[robot.joint_id(name)]
        stem = name.partition("[")[0]
        if joint.nq == 4:
            turn = Rotation.from_rotvec(rng.normal(size=3))
            q[joint.idx_q : joint.idx_q + 4] = turn.as_quat()
            positions[stem] = turn.as_matrix()
        else:
            q[joint.idx_q] = rng.uniform(-1.5, 1.5)
            positions.setdefault(stem, []).append(q[joint.idx_q])
    return q, positions


def assert_same(robot, source, root, seed):
    q, positions = random_positions(robot, seed)
    places = placed(source, positions, root)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    for link, place in places.items():
        found = data.oMf[robot.model.getFrameId(link, pin.FrameType.BODY)].homogeneous
        np.testing.assert_allclose(found, place, rtol=0, atol=1e-13, err_msg=link)
    mass, com, inertia = whole_body(source, places)
    assert robot.mass == pytest.approx(mass, rel=1e-14)
    pin.ccrba(robot.model, data, q, np.zeros(robot.model.nv))
    np.testing.assert_allclose(data.com[0], com, rtol=0, atol=1e-13)
    np.testing.assert_allclose(data.Ig.inertia, inertia, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("version", ["1.4", "1.6"])
def test_links_stand_where_poses_composed_by_hand_put_them(version, seed):
    source = text(version)
    assert_same(Robot.from_sdf(source), source, "base", seed)


@pytest.mark.parametrize(
    ("version", "attribute", "flag"),
    [
        ("1.6", "", "<use_parent_model_frame>true</use_parent_model_frame>"),
        ("1.7", " expressed_in='__model__'", ""),
    ],
)
def test_an_axis_may_be_given_in_the_models_frame(version, attribute, flag):
    axis = AXIS.format("1 2 -1", attribute, flag)
    joints = [JOINT.format("hinge", "revolute", ".1 0 0 .3 0 .2", "base", "a", axis)]
    links = "".join(LINK.format(n, POSES[n], 1.0) for n in ("base", "a"))
    source = text(version, joints, links=links)
    assert_same(Robot.from_sdf(source), source, "base", 3)
    in_joint = source.replace(attribute, "").replace(flag, "")
    with pytest.raises(AssertionError, match="a"):
        assert_same(Robot.from_sdf(in_joint), source, "base", 3)


def test_springs_limits_and_defaults_are_those_of_the_format():
    bare = "<link name='bare'/>"
    hung = JOINT.format("hung", "fixed", "", "f", "bare", "")
    world = JOINT.format("held", "fixed", "", "world", "base", "")
    robot = Robot.from_sdf(text(more=bare + hung + world))
    assert robot.mass == pytest.approx(sum(range(1, 8)) + 1.0)
    assert robot.drives.springs == {"hinge": Spring(70.0, 0.2)}
    assert robot.dof_names[-2:] == ("cross[0]", "cross[1]")
    at = robot.dof_names.index("hinge")
    low, high = robot.position_limits
    assert (low[at], high[at], robot.effort_limits[at]) == (-1.0, 2.0, 30.0)
    assert np.isinf(np.delete(robot.effort_limits, at)).all()
    assert np.isinf(np.delete(low, at)).all()
    assert robot.model.damping[at + 6] == 0.5
    assert robot.model.upperDryFrictionLimit[at + 6] == 0.1
    said = " ".join(robot.notes)
    for words in ("'held' ties link 'base' to the world", "bare have no <mass>", "have motors"):
        assert words in said


@pytest.mark.parametrize(("kind", "rows"), [("ball", 3), ("revolute", 6), ("fixed", 6)])
def test_a_second_parent_closes_a_loop(kind, rows):
    """It is closed where every joint is at zero, and opens as the frames composed by hand do."""
    axis = AXIS.format("0 1 0", "", "") if kind == "revolute" else ""
    pose = ".1 .2 .3 .4 .5 .6"
    source = text(more=JOINT.format("rod", kind, pose, "c", "e", axis))
    robot = Robot.from_sdf(source)
    (loop,) = robot.drives.loops
    assert loop.name == "rod"
    closures = copsense.closures.Closures(robot, pin.neutral(robot.model))
    assert len(closures.error) == rows
    assert np.abs(closures.error).max() < 1e-15
    q, positions = random_positions(robot, 5)
    here, there = placed(source, positions, "base"), placed(source, {}, "base")
    P = np.eye(4)
    P[:3, 3], P[:3, :3] = (0.1, 0.2, 0.3), Rotation.from_euler("xyz", (0.4, 0.5, 0.6)).as_matrix()
    on_child = here["e"] @ P
    on_parent = here["c"] @ np.linalg.inv(there["c"]) @ there["e"] @ P
    gap = np.linalg.inv(on_child) @ on_parent
    error = copsense.closures.Closures(robot, q).error
    if kind == "ball":
        assert np.linalg.norm(error) == pytest.approx(np.linalg.norm(gap[:3, 3]), rel=1e-12)
    elif kind == "fixed":
        np.testing.assert_allclose(error, pin.log6(pin.SE3(gap)).vector, rtol=0, atol=1e-12)
    else:
        middle = (error[:3] + error[3:]) / 2  # of a pin's two points on its axis
        np.testing.assert_allclose(middle, gap[:3, 3], rtol=0, atol=1e-12)
        across = (error[3:] - error[:3]) / np.linalg.norm(closures.robot.drives.loops[0].axis)
        turned = gap[:3, :3] @ [0, 1, 0] - [0, 1, 0]
        assert np.linalg.norm(np.cross(across, turned)) < 1e-12
        assert np.linalg.norm(across) > 1e-3


FAULTS = {
    "is of type 'gearbox', not revolute": ("type='revolute'", "type='gearbox'"),
    "<gearbox_ratio> in joint 'weld' is not known here": (
        "<parent>base</parent><child>d</child>",
        "<gearbox_ratio>2</gearbox_ratio><parent>base</parent><child>d</child>",
    ),
    "<include> in the model": ("<link name='a'>", "<include/><link name='a'>"),
    "<mimic> in <axis> of joint 'hinge'": ("<limit>", "<mimic joint='turn'/><limit>"),
    "<fluid_added_mass> in <inertial> of link 'base'": (
        "<mass>1</mass>",
        "<mass>1</mass><fluid_added_mass/>",
    ),
    "<mass> in <inertial> of link 'base' is 'x', not one finite": ("<mass>1<", "<mass>x<"),
    "3 finite numbers": ("<xyz>0 1 0<", "<xyz>0 1<"),
    "the <axis> of joint 'hinge' has no direction": (
        "<xyz>0 1 0</xyz><limit>",
        "<xyz>0 0 0</xyz><limit>",
    ),
    "joint 'slide' has no <axis>": ("<axis><xyz>1 2 2</xyz></axis>", ""),
    'the <pose> of link \'a\' has relative_to="base"': (
        "<link name='a'><pose>",
        "<link name='a'><pose relative_to='base'>",
    ),
    'degrees="true"': ("<link name='a'><pose>", "<link name='a'><pose degrees='true'>"),
    "has <static>": ("<link name='a'>", "<static>true</static><link name='a'>"),
    "has <gravity>": ("<link name='a'>", "<link name='a'><gravity>0</gravity>"),
    "2 links are named 'a'": ("<link name='b'>", "<link name='a'/><link name='b'>"),
    "the parent 'zz' of joint 'hinge' is not a link of the model": (
        "<parent>base</parent><child>a<",
        "<parent>zz</parent><child>a<",
    ),
    "'base', 'stray' hang on no joint": ("<link name='a'>", "<link name='stray'/><link name='a'>"),
    "closes a loop and is of type 'universal'": (
        "</model>",
        JOINT.format("rod", "universal", "", "c", "e", CROSS) + "</model>",
    ),
    "its version is '2.0', not 1.x": ("version='1.6'", "version='2.0'"),
    "it holds <world>": ("</sdf>", "<world/></sdf>"),
    "of type universal, has a spring": (
        "<axis2><xyz>0 1 0</xyz>",
        "<axis2><xyz>0 1 0</xyz><dynamics><spring_stiffness>3</spring_stiffness></dynamics>",
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", FAULTS)
def test_what_is_not_read_is_rejected_by_name(said):
    old, new = FAULTS[said]
    source = text()
    assert old in source
    with pytest.raises(ModelLoadError) as caught:
        Robot.from_sdf(source.replace(old, new, 1))
    assert said in str(caught.value)
    assert "not a valid SDF" in str(caught.value)


def test_the_language_of_a_file_is_told_by_its_first_element(tmp_path):
    file = tmp_path / "toy.sdf"
    file.write_text(text())
    assert copsense.load_robot(file).name == "toy"
    with pytest.raises(ModelLoadError, match=r"Robot\.from_sdf"):
        Robot.from_urdf(file)
    with pytest.raises(ModelLoadError, match="the shapes of an SDF are not read"):
        copsense.sole.read_sole(copsense.load_robot(file), copsense.Contact("a"))


def test_shipped_cassies_stand_where_their_poses_put_them():
    """The variants without gearboxes, as their files have them, at random postures."""
    folder = example_file("cassie_description/robots/cassie_v2.sdf", "cassie")[0].parent
    for name in ("cassie_v2", "cassie_reduced", "cassie_simple", "cassie_wo_gearbox_spring"):
        file = folder / f"{name}.sdf"
        robot = Robot.from_sdf(file)
        assert_same(robot, file, "pelvis", 11)
        assert len(robot.drives.loops) == 4
    with pytest.raises(ModelLoadError, match="'left-roll-joint' is of type 'gearbox'"):
        Robot.from_sdf(folder / "cassie.sdf")
    preset = copsense.load_robot("cassie")  # its rods end in universal joints
    assert_same(preset, preset.description.text, "pelvis", 12)
