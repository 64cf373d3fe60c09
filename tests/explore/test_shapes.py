"""What a robot looks like: triangles on its joints, from files of several kinds."""

import struct

import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense.cli.explore_command import stance_words
from copsense.errors import ModelLoadError
from copsense.explore.mesh_files import read_mesh
from copsense.explore.shape import load_shape

URDF = """<robot name="r"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
<geometry><box size="0.4 0.2 0.1"/></geometry></visual>
<visual><geometry>{}</geometry></visual></link></robot>"""
MJCF = """<mujoco><worldbody><body name="a" pos="0 0 1"><freejoint/>
<geom type="sphere" size="0.1" mass="1"/>
<geom type="capsule" size="0.05 0.2" pos="0 0 1" mass="1"/></body></worldbody></mujoco>"""

DRAWN = """<mujoco><asset><mesh name="wedge" vertex="0 0 0 0.1 0 0 0 0.1 0 0 0 0.1"/></asset>
<worldbody><body pos="0 0 1"><freejoint/>
<geom name="ball" type="sphere" size="0.1" pos="0 0 0.2" mass="1" group="1"/>
<geom type="sphere" size="0.5" mass="1" group="3"/>
<geom type="sphere" size="0.5" mass="1" group="1" rgba="1 1 1 0"/>
<body pos="0 0 -0.3"><joint axis="0 1 0"/>
<geom name="wedge" type="mesh" mesh="wedge" pos="0.1 0 0" euler="0 30 0" mass="1" group="2"
contype="0" conaffinity="0"/></body></body></worldbody></mujoco>"""
SDF = """<sdf version="1.6"><model name="m"><link name="a"><inertial><mass>1</mass></inertial>
<visual name="v"><pose>2 0 0 0 0 1.5707963267948966</pose>
<geometry><box><size>0.4 0.2 0.3</size></box></geometry></visual></link></model></sdf>"""


def volume(vertices, faces):
    """Of a closed surface whose triangles are seen from outside."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_primitives_have_their_volume_and_place():
    robot = copsense.load_robot(URDF.format('<cylinder radius="0.1" length="0.5"/>'))
    (mesh,) = load_shape(robot).meshes
    box, tube = mesh.vertices[:8], mesh.vertices[8:]
    np.testing.assert_allclose(box.min(axis=0), [0.9, -0.2, -0.05], atol=1e-12)
    np.testing.assert_allclose(box.max(axis=0), [1.1, 0.2, 0.05], atol=1e-12)
    assert volume(box, mesh.faces[mesh.faces.max(axis=1) < 8]) == pytest.approx(0.4 * 0.2 * 0.1)
    faces = mesh.faces[mesh.faces.min(axis=1) >= 8] - 8
    assert volume(tube, faces) == pytest.approx(np.pi * 0.1**2 * 0.5, rel=0.02)


def test_a_binary_stl_is_read_with_each_vertex_once(tmp_path):
    corners = np.array(
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]], "<f4"
    )
    facets = b"".join(np.zeros(3, "<f4").tobytes() + each.tobytes() + b"\0\0" for each in corners)
    path = tmp_path / "square.stl"
    path.write_bytes(b"\0" * 80 + struct.pack("<I", 2) + facets)
    vertices, faces = read_mesh(path)
    assert len(vertices) == 4
    np.testing.assert_array_equal(vertices[faces], corners)
    path.write_bytes(b"\0" * 100)
    with pytest.raises(ModelLoadError, match=r"square\.stl"):
        read_mesh(path)


def test_a_mesh_that_is_missing_is_named_and_the_rest_drawn():
    shape = load_shape(copsense.load_robot(URDF.format('<mesh filename="missing.stl"/>')))
    assert len(shape.meshes[0].vertices) == 8
    assert any("missing.stl" in note for note in shape.notes)


def test_an_mjcf_without_groups_shows_what_collides():
    (mesh,) = load_shape(copsense.load_robot(MJCF)).meshes
    assert mesh.joint == 1
    np.testing.assert_allclose(mesh.vertices[:, 2].max(), 1.25, atol=1e-9)
    np.testing.assert_allclose(mesh.vertices[:, 2].min(), -0.1, atol=1e-9)


def test_an_mjcf_shows_what_mujoco_draws():
    mujoco = pytest.importorskip("mujoco", reason="the extra sim is not installed")
    robot = copsense.load_robot(DRAWN)
    shape = load_shape(robot)
    # MuJoCo's own places of the shapes that it draws, at a posture.
    mj = mujoco.MjModel.from_xml_string(DRAWN)
    data = mujoco.MjData(mj)
    data.qpos[2], data.qpos[7] = 0.7, 0.6
    mujoco.mj_forward(mj, data)
    corners = {}
    for name in ("wedge", "ball"):
        g = mj.geom(name).id
        first, count = (mj.mesh_vertadr[0], mj.mesh_vertnum[0]) if name == "wedge" else (0, 0)
        points = mj.mesh_vert[first : first + count] if count else np.zeros((1, 3))
        corners[name] = points @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
    q = np.array([*data.qpos[:3], 0, 0, 0, 1, data.qpos[7]])
    pin_data = robot.model.createData()
    pin.forwardKinematics(robot.model, pin_data, q)
    base, shin = (
        mesh.vertices @ pin_data.oMi[mesh.joint].rotation.T + pin_data.oMi[mesh.joint].translation
        for mesh in shape.meshes
    )
    np.testing.assert_allclose(base.mean(axis=0), corners["ball"][0], atol=1e-9)
    np.testing.assert_allclose(
        np.array(sorted(shin.tolist())), np.array(sorted(corners["wedge"].tolist())), atol=1e-6
    )
    assert volume(shape.meshes[1].vertices, shape.meshes[1].faces) == pytest.approx(1e-3 / 6)
    assert len(shape.licences) == 0  # a text has no file


def test_an_sdf_shows_its_links():
    robot = copsense.load_robot(SDF)
    (mesh,) = load_shape(robot).meshes
    np.testing.assert_allclose(mesh.vertices.min(axis=0), [1.9, -0.2, -0.15], atol=1e-12)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [2.1, 0.2, 0.15], atol=1e-12)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(0.2 * 0.4 * 0.3)


def test_cassie_stands_on_its_meshes(stance_of):
    stance = stance_of("cassie")
    shape = load_shape(stance.robot)
    assert not shape.notes
    data = stance.robot.model.createData()
    pin.forwardKinematics(stance.robot.model, data, np.array(stance.q))
    lowest = min(float(data.oMi[m.joint].act(p)[2]) for m in shape.meshes for p in m.vertices[::5])
    assert lowest == pytest.approx(0.0, abs=5e-3)


def test_the_icub_stands_on_its_meshes_with_few_triangles(icub):
    shape = load_shape(icub.robot)
    assert 20_000 < shape.triangles < 30_000
    assert any("CC-BY-SA-4.0" in each for each in shape.licences)
    data = icub.robot.model.createData()
    pin.forwardKinematics(icub.robot.model, data, np.array(icub.q))
    lowest = min(float(data.oMi[m.joint].act(p)[2]) for m in shape.meshes for p in m.vertices[::20])
    # The preset's contact frames lie 10.5 mm over the bottom of the soles.
    assert lowest == pytest.approx(-0.0105, abs=2e-3)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("explore icub --com-y 30mm --no-browser --at=com_z=0.5", "icub"),
        ("explore --port 80 --contact l_sole icub --limits friction=0.3", "--contact l_sole icub"),
        ("explore --stance a.toml --light --criterion minimum-torque", "--stance a.toml"),
    ],
)
def test_of_a_command_line_the_words_of_the_stance_are_kept(line, words):
    assert stance_words(line.split()) == words.split()
