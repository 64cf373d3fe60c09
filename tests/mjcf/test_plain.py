"""Without MuJoCo an MJCF is read by Pinocchio as MuJoCo would, or rejected by name."""

import importlib.util

import pytest
from support.mjcf import FOOT, LEG, assert_mujocos, walker

import copsense
from copsense import Contact
from copsense.errors import ModelLoadError
from copsense.sole import read_sole


@pytest.fixture(autouse=True)
def no_mujoco(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "mujoco" else find(name, *a)
    )


SIMPLE = {
    "plain": {},
    "a ball": {
        "left": "<body name='arm'><joint name='ball' type='ball' pos='0 0 .1'/>"
        "<geom type='capsule' fromto='0 0 0 .1 0 -.3' size='.03'/><site name='l_tip'/></body>"
    },
    "shapes of every group": {
        "foot": "".join(f"<geom size='.0{3 + g}' group='{g}' pos='.{g} 0 0'/>" for g in range(6))
    },
    "radians": {
        "head": "<compiler angle='radian'/>",
        "foot": FOOT + "<site name='{side}_tip' pos='.1 0 0' euler='.3 .2 .1'/>",
    },
    "gravity": {"head": "<option gravity='0 0 -1.62'/>"},
    "a base that is fixed": {"base": ""},
    "shapes of every kind": {
        "foot": "<geom type='cylinder' size='.1 .02' density='300'/><geom type='ellipsoid' "
        "size='.1 .05 .02' pos='.1 0 0' zaxis='1 0 1' mass='.3'/>"
    },
    "a full inertia": {
        "foot": "<inertial pos='.01 .02 -.03' mass='1' fullinertia='.02 .03 .04 .001 .002 .003'/>"
    },
    "a class for the children": {
        "head": "<default><default class='limb'><joint axis='0 1 1' range='-10 30'/></default>"
        "</default>",
        "left": "<body name='limb' childclass='limb' pos='0 .1 0'><joint name='j'/>"
        "<geom size='.1'/><site name='l_tip' pos='0 0 -.3'/></body>",
    },
    "a keyframe": {
        "tail": "<keyframe><key name='k' qpos='0 0 1 1 0 0 0 .1 .2 .3 .4 .5 0 0 0 0 0'/></keyframe>"
    },
    "a keyframe of a base that is fixed": {
        "base": "",
        "tail": "<keyframe><key name='k' qpos='.1 .2 .3 .4 .5 0 0 0 0 0'/></keyframe>",
    },
    "a joint's place": {
        "left": LEG.format(side="l", y=0.1, foot="<geom size='.1'/>").replace(
            "name='l_knee'", "name='l_knee' pos='.01 .02 .03'"
        )
    },
}


@pytest.mark.parametrize("parts", SIMPLE.values(), ids=SIMPLE)
def test_a_simple_file_is_read_as_mujoco_reads_it(parts):
    text = walker(**parts)
    assert_mujocos(text)
    assert copsense.load_robot(text).mjcf.shapes is None  # the other reader


def test_soles_are_read_too(tmp_path):
    path = tmp_path / "walker.xml"
    path.write_text(walker())
    assert read_sole(copsense.load_robot(path), Contact("l_foot")).height == pytest.approx(-0.06)


MESH = "<asset><mesh name='cube' vertex='0 0 0 .1 0 0 0 .1 0 0 0 .1'/></asset>"


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"head": "<include file='parts.xml'/>"}, "<include file='parts.xml'>"),
        ({"left": "<include file='leg.xml'/>"}, "<include file='leg.xml'>"),
        ({"foot": f"<frame>{FOOT}</frame>"}, "<frame> in body 'l_foot'"),
        ({"foot": f"<replicate count='2'>{FOOT}</replicate>"}, "<replicate> in body 'l_foot'"),
        ({"before": "<frame/>"}, "<frame> in the world"),
        (
            {"before": "<body name='ball'><freejoint/><geom size='.1'/></body>"},
            "several bodies in the world (ball, trunk)",
        ),
        (
            {"foot": FOOT + "<geom size='.1' contype='0' conaffinity='0'/>"},
            "a geom that does not collide and gives body 'l_foot' its mass",
        ),
        (
            {"head": "<default><default class='seen'><geom contype='0'/></default></default>"},
            "geoms of a class that do not collide",
        ),
        ({"left": "<body><joint name='j'/><geom size='.1'/></body>"}, "a body without a name"),
        ({"tail": "<worldbody/>"}, "2 <worldbody>"),
        (
            {"head": MESH, "foot": "<geom type='mesh' mesh='cube'/>"},
            "a mesh that gives body 'l_foot' its mass",
        ),
        ({"head": "<compiler inertiagrouprange='0 2'/>"}, "inertiagrouprange= in <compiler>"),
        ({"head": "<compiler boundmass='1'/>"}, "boundmass= in <compiler>"),
        ({"head": "<compiler eulerseq='ZYX'/>"}, "eulerseq='ZYX'"),
        ({"head": "<compiler settotalmass='1'/>"}, "settotalmass= in <compiler>"),
        ({"head": "<compiler inertiafromgeom='true'/>"}, "inertiafromgeom='true'"),
        ({"head": "<default><joint pos='0 0 1'/></default>"}, "pos= of a joint in a <default>"),
        (
            {"left": "<body name='b'><joint name='j' ref='10'/><geom size='.1'/></body>"},
            "ref= of a joint in body 'b'",
        ),
        (
            {"foot": "<body name='{side}_float' gravcomp='1'>" + FOOT + "</body>"},
            "gravcomp= of body 'l_float'",
        ),
        (
            {
                "foot": FOOT + "<body name='{side}_a'><body name='{side}_b'><site name='{side}_s'/>"
                "</body></body>"
            },
            "a site in body 'l_b', which has no joint",
        ),
        (
            {"head": "<extension><plugin plugin='mujoco.elasticity.cable'/></extension>"},
            "<extension>",
        ),
    ],
)
def test_what_the_reader_does_not_know_is_named_with_the_remedy(parts, said):
    with pytest.raises(ModelLoadError, match=r"pip install \"copsense\[sim\]\"") as caught:
        copsense.load_robot(walker(**parts))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["<mujoco/>", "<mujoco><worldbody/></mujoco>"])
def test_a_file_without_bodies_says_so(text):
    with pytest.raises(ModelLoadError, match="no <body>"):
        copsense.load_robot(text)


def test_without_gravity_in_the_file_there_is_the_earths_and_a_note():
    robot = copsense.load_robot(walker(head="<option><flag gravity='disable'/></option>"))
    assert robot.model.gravity.linear.tolist() == [0, 0, -9.81]
    assert any("turns gravity off" in note for note in robot.notes)


def test_what_is_not_used_is_said():
    tail = "<actuator><motor name='m' joint='l_hip'/></actuator>"
    tail += "<equality><joint name='e' joint1='l_hip'/></equality>"
    found = copsense.load_robot(walker(head="<default><joint stiffness='2'/></default>", tail=tail))
    assert any("equalities (e) are not used" in note for note in found.notes)
    assert any("actuators (m) are not read without MuJoCo" in note for note in found.notes)
    assert any("springs" in note for note in found.notes)
