"""Meshes are found beside the URDF, above it, in package folders; or every place is named."""

import struct

import numpy as np
import pytest
from support.tiny import FEET, MESH, urdf

import copsense
from copsense.errors import ModelLoadError
from copsense.meshes import find_mesh

LOW, HIGH = np.array([-0.09, -0.04, -0.03]), np.array([0.11, 0.05, 0.0])


def box_stl():
    """A box from LOW to HIGH as a binary STL: twelve triangles of its corners."""
    triangles = []
    for axis in range(3):
        for end in (LOW, HIGH):
            others = [i for i in range(3) if i != axis]
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = np.empty(3)
                corner[axis] = end[axis]
                corner[others] = [(LOW, HIGH)[a][others[0]], (LOW, HIGH)[b][others[1]]]
                corners.append(corner)
            triangles += [corners[:3], [corners[2], corners[3], corners[0]]]
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *np.concatenate(t), 0) for t in map(np.array, triangles)
    )
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


@pytest.fixture
def package(tmp_path):
    """A package with its URDF two folders under it, and its mesh beside that folder."""
    root = tmp_path / "share" / "tiny_robot"
    (root / "urdf" / "v2").mkdir(parents=True)
    (root / "meshes").mkdir()
    (root / "meshes" / "foot.stl").write_bytes(box_stl())
    return root


def sole(source, **more):
    stance = copsense.load_stance(source, contacts=FEET, contact_at="sole", **more)
    return stance.contacts[0]


def put(package, filename):
    path = package / "urdf" / "v2" / "tiny.urdf"
    path.write_text(urdf(MESH.replace("package://nowhere/foot.stl", filename)), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "filename",
    [
        "../../meshes/foot.stl",
        r"..\..\meshes\foot.stl",
        "package://tiny_robot/meshes/foot.stl",
        "model://tiny_robot/meshes/foot.stl",
        "package://renamed/meshes/foot.stl",  # a checkout under another name
    ],
)
def test_a_mesh_near_its_file_is_found_without_options(package, filename, monkeypatch):
    monkeypatch.chdir("/")
    found = sole(put(package, filename))
    assert found.offset[2] == pytest.approx(-0.03)
    assert found.polygon.min(axis=0) == pytest.approx(LOW[:2])
    assert found.polygon.max(axis=0) == pytest.approx(HIGH[:2])


def test_a_mesh_is_relative_to_the_package_that_holds_the_file(package, monkeypatch):
    monkeypatch.chdir("/")
    path = put(package, "meshes/foot.stl")
    with pytest.raises(ModelLoadError, match="relative"):
        sole(path)
    (package / "package.xml").write_text("<package/>", encoding="utf-8")
    assert sole(path).offset[2] == pytest.approx(-0.03)


@pytest.mark.parametrize("folder", [".", ".."])
def test_the_package_and_the_folder_that_holds_it_are_both_package_folders(package, folder):
    text = urdf(MESH.replace("nowhere", "tiny_robot/meshes"))
    assert sole(text, package_dirs=[package / folder]).offset[2] == pytest.approx(-0.03)


@pytest.mark.parametrize(
    ("variable", "folder"),
    [
        ("ROS_PACKAGE_PATH", "share"),
        ("ROS_PACKAGE_PATH", "share/tiny_robot"),
        ("AMENT_PREFIX_PATH", "."),
    ],
)
def test_the_workspaces_of_ros_are_searched(package, variable, folder, monkeypatch, tmp_path):
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path / folder}")
    found = find_mesh("package://tiny_robot/meshes/foot.stl")
    assert found == package / "meshes" / "foot.stl"


def test_what_the_caller_gives_goes_before_what_lies_near(package, tmp_path):
    other = tmp_path / "other" / "tiny_robot" / "meshes" / "foot.stl"
    other.parent.mkdir(parents=True)
    other.write_bytes(b"")
    path = put(package, "package://tiny_robot/meshes/foot.stl")
    name = "package://tiny_robot/meshes/foot.stl"
    assert find_mesh(name, [str(tmp_path / "other")], path) == other
    assert find_mesh(name, [], path) == package / "meshes" / "foot.stl"


@pytest.mark.parametrize("scheme", ["", "file://"])
def test_an_absolute_path_is_taken_as_it_is(package, scheme):
    mesh = package / "meshes" / "foot.stl"
    assert find_mesh(f"{scheme}{mesh}") == mesh


def test_a_missing_mesh_names_every_place_and_what_to_give(package, tmp_path):
    path = put(package, "package://tiny_robot/meshes/fot.stl")
    (tmp_path / "mine").mkdir()
    with pytest.raises(ModelLoadError) as caught:
        sole(path, package_dirs=[tmp_path / "mine"])
    said = str(caught.value)
    for place in (
        tmp_path / "mine" / "tiny_robot" / "meshes" / "fot.stl",
        tmp_path / "mine" / "meshes" / "fot.stl",
        package.parent / "tiny_robot" / "meshes" / "fot.stl",
        package / "meshes" / "fot.stl",
    ):
        assert str(place) in said
    assert "--package-dir" in said
    assert "holds the package 'tiny_robot', or the package itself" in said


def test_a_relative_mesh_of_a_text_says_that_a_text_has_no_folder():
    with pytest.raises(ModelLoadError, match=r"a text has no folder.*--package-dir"):
        sole(urdf(MESH.replace("package://nowhere/foot.stl", "foot.stl")))
