"""What a robot looks like: triangles on its joints, from files of several kinds."""

import struct

import numpy as np
import pinocchio as pin
import pytest

import copsense
from copsense.cli.explore_command import stance_words
from copsense.errors import ModelLoadError
from copsense.explore.shape import load_shape, read_mesh

URDF = """<robot name="r"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
<geometry><box size="0.4 0.2 0.1"/></geometry></visual>
<visual><geometry>{}</geometry></visual></link></robot>"""
MJCF = """<mujoco><worldbody><body name="a" pos="0 0 1"><freejoint/>
<geom type="sphere" size="0.1" mass="1"/>
<geom type="capsule" size="0.05 0.2" pos="0 0 1" mass="1"/></body></worldbody></mujoco>"""


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


def test_an_mjcf_shows_what_collides():
    (mesh,) = load_shape(copsense.load_robot(MJCF)).meshes
    assert mesh.joint == 1
    np.testing.assert_allclose(mesh.vertices[:, 2].max(), 1.25, atol=1e-9)
    np.testing.assert_allclose(mesh.vertices[:, 2].min(), -0.1, atol=1e-9)


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
