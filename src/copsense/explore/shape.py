"""Shape: what a robot looks like, as triangles on its joints; read from what its file draws."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.content import ShortRepr, freeze
from copsense.description import Description
from copsense.errors import CopsenseError, ModelLoadError
from copsense.explore.mesh_files import joined, read_mesh
from copsense.explore.solids import solid
from copsense.extras import require
from copsense.meshes import find_mesh
from copsense.mjcf import visible_shapes
from copsense.robot import Robot
from copsense.sdf import sdf_model_element
from copsense.xml_numbers import read_numbers

TRIANGLES = 27_000  # of a whole robot: more are slow to send and, without a GPU, to draw
_CAREFUL, _ROUGH = 3.0, 7.0  # of fast_simplification's 0 (slow, good) to 10
_NEAR = 1.2  # times what a mesh may keep, from which it is thinned out once more


@dataclass(frozen=True, eq=False, repr=False)
class JointMesh(ShortRepr):
    """What one joint carries.

    Attributes:
        joint: its index in the model.
        vertices: in the joint's frame [m].
        faces: corners of the triangles.
    """

    joint: int
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "vertices", "faces")


@dataclass(frozen=True, eq=False, repr=False)
class Shape(ShortRepr):
    """What a robot looks like.

    Attributes:
        meshes: one for each joint that carries something to see.
        notes: what could not be shown, and why.
        licences: who made the meshes, and under which terms they may be given on.
    """

    meshes: tuple[JointMesh, ...] = ()
    notes: tuple[str, ...] = ()
    licences: tuple[str, ...] = ()

    @property
    def triangles(self) -> int:
        """How many there are."""
        return sum(len(mesh.faces) for mesh in self.meshes)


Part = tuple[int, np.ndarray, np.ndarray]  # joint, vertices in its frame, faces


class _Visual(NamedTuple):
    """What a link of a URDF or an SDF shows: a mesh's file and scales, or a solid's sizes."""

    link: str
    place: pin.SE3
    kind: str
    numbers: tuple[float, float, float]
    file: str = ""


def load_shape(robot: Robot, triangles: int = TRIANGLES) -> Shape:
    """What a robot's file draws; of an MJCF, what MuJoCo's viewer shows at first.

    What cannot be read is left out and named; a robot without anything to draw is a stick figure.

    Args:
        robot: the robot.
        triangles: about how many to keep.
    """
    description, notes = robot.description, []
    if description is None:
        return Shape()
    parts: list[Part] = []
    files: list[Path] = []
    if description.language == "mjcf":
        found = _mjcf_parts(robot, description, files)
    else:
        found = _link_parts(robot.model, description, files)
    for each in found:
        if isinstance(each, str):
            notes.append(each)
        else:
            parts.append(each)
    meshes = _reduced(_by_joint(parts), triangles)
    told = tuple(dict.fromkeys(_licence(file) for file in files))
    return Shape(tuple(meshes), tuple(dict.fromkeys(notes)), told)


def _link_parts(
    model: pin.Model, description: Description, files: list[Path]
) -> Iterator[Part | str]:
    """The parts of a URDF or an SDF, and a sentence for each that cannot be read."""
    read: dict[Path, tuple[np.ndarray, np.ndarray]] = {}
    root = ET.fromstring(description.text)
    for visual in _urdf_visuals(root) if description.language == "urdf" else _sdf_visuals(root):
        if not model.existFrame(visual.link, pin.FrameType.BODY):
            continue
        # With its type: links and joints may share names.
        frame = model.frames[model.getFrameId(visual.link, pin.FrameType.BODY)]
        place = frame.placement * visual.place
        try:
            if visual.kind == "mesh":
                path = find_mesh(visual.file, description.package_dirs, description.path)
                if path not in read:
                    read[path] = read_mesh(path)
                    files.append(path)
                vertices, faces = read[path]
                vertices = vertices * visual.numbers
            else:
                vertices, faces = solid(visual.kind, *visual.numbers)
        except CopsenseError as error:
            yield f"not drawn: {error}"
            continue
        yield frame.parentJoint, vertices @ place.rotation.T + place.translation, faces


def _urdf_visuals(root: ET.Element) -> Iterator[_Visual]:
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            geometry = visual.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is None:
                continue
            origin = visual.find("origin")
            place = pin.SE3.Identity()
            if origin is not None:
                turn = pin.rpy.rpyToMatrix(*_three(origin.get("rpy"), 0.0))
                place = pin.SE3(turn, np.array(_three(origin.get("xyz"), 0.0)))
            name, file = link.get("name", ""), shape.get("filename", "")
            if shape.tag == "mesh":
                yield _Visual(name, place, "mesh", _three(shape.get("scale"), 1.0), file)
            else:
                size, radius, length = (shape.get(key) for key in ("size", "radius", "length"))
                yield _Visual(name, place, str(shape.tag), _sizes(size, radius, length))


def _sdf_visuals(root: ET.Element) -> Iterator[_Visual]:
    for link in sdf_model_element(root).findall("link"):
        for visual in link.findall("visual"):
            geometry = visual.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is None:
                continue
            pose = read_numbers(visual.findtext("pose", "").strip()) or [0.0] * 6
            place = pin.SE3(pin.rpy.rpyToMatrix(*pose[3:]), np.array(pose[:3]))
            name, file = link.get("name", ""), shape.findtext("uri", "").strip()
            if shape.tag == "mesh":
                yield _Visual(name, place, "mesh", _three(shape.findtext("scale"), 1.0), file)
            else:
                size, radius, length = (shape.findtext(key) for key in ("size", "radius", "length"))
                yield _Visual(name, place, str(shape.tag), _sizes(size, radius, length))


def _sizes(size: str | None, radius: str | None, length: str | None) -> tuple[float, float, float]:
    """Half sizes, as `solid` has them, of what URDF and SDF say in whole ones."""
    if radius is None:
        x, y, z = _three(size, 0.0)
        return x / 2, y / 2, z / 2
    return float(radius), float(length or 0.0) / 2, 0.0


def _three(text: str | None, default: float) -> tuple[float, float, float]:
    if text is None or not text.strip():
        return default, default, default
    found = read_numbers(text) or []
    if len(found) != 3:
        raise ModelLoadError(
            f"a visual has {text.strip()!r} where three numbers belong. Correct the file, or leave "
            "meshes out with --no-meshes."
        )
    return found[0], found[1], found[2]


def _mjcf_parts(robot: Robot, description: Description, files: list[Path]) -> Iterator[Part | str]:
    """The parts of an MJCF that are seen."""
    assert robot.mjcf is not None
    model, whole = robot.model, robot.mjcf.model
    shapes = visible_shapes(description)
    if shapes is None:
        yield "not drawn: shapes of an MJCF are read by MuJoCo; pip install 'copsense[sim]'."
        return
    for shape in shapes:
        name, place = whole.names[shape.joint], shape.placement
        if model.existJointName(name):
            joint = model.getJointId(name)
        elif model.existFrame(name):  # a joint that is locked
            frame = model.frames[model.getFrameId(name)]
            joint, place = frame.parentJoint, frame.placement * place
        else:
            continue
        try:
            if shape.kind == "mesh":
                vertices, faces = joined(shape.vertices[shape.faces].reshape(-1, 3))
                if description.path is not None and description.path not in files:
                    files.append(description.path)
            else:
                x, y, z = (float(size) for size in shape.size)
                vertices, faces = solid(shape.kind, x, y, z)
        except CopsenseError as error:
            yield f"not drawn: {error}"
            continue
        yield joint, vertices @ place.rotation.T + place.translation, faces


def _by_joint(parts: list[Part]) -> list[JointMesh]:
    """The parts of each joint as one mesh."""
    found = []
    for joint in sorted({part[0] for part in parts}):
        own = [part for part in parts if part[0] == joint]
        starts = np.cumsum([0, *(len(v) for _, v, _ in own)])
        faces = [f + start for (_, _, f), start in zip(own, starts, strict=False)]
        found.append(JointMesh(joint, np.vstack([v for _, v, _ in own]), np.vstack(faces)))
    return found


def _reduced(meshes: list[JointMesh], triangles: int) -> list[JointMesh]:
    """The meshes with about so many triangles in all, where there are more."""
    total = sum(len(mesh.faces) for mesh in meshes)
    if total <= triangles:
        return meshes
    require("fast_simplification", "drawing meshes of many triangles")
    import fast_simplification

    kept = _shared([len(mesh.faces) for mesh in meshes], triangles)
    found = []
    for mesh, count in zip(meshes, kept, strict=True):
        if count >= len(mesh.faces):
            found.append(mesh)
            continue
        points, faces = np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32)
        for care in (_CAREFUL, _ROUGH):  # what is careful may end before it is thin enough
            if len(faces) > _NEAR * count:
                points, faces = fast_simplification.simplify(
                    points, faces, target_reduction=1.0 - count / len(faces), agg=care
                )
        found.append(JointMesh(mesh.joint, np.asarray(points, float), np.asarray(faces, np.int64)))
    return found


def _shared(counts: list[int], triangles: int) -> list[int]:
    """How many triangles each mesh keeps: as the square roots of what they have, none too few.

    In proportion, a hand would be a wedge beside a head of many.
    """
    roots, kept = np.sqrt(np.array(counts, float)), np.array(counts, float)
    low, high = 0.0, float(roots.max())
    for _ in range(40):  # of the factor
        factor = 0.5 * (low + high)
        kept = np.minimum(counts, factor * roots)
        low, high = (factor, high) if kept.sum() < triangles else (low, factor)
    return [int(count) for count in kept]


def _licence(file: Path) -> str:
    """Who made a mesh and under which terms, as far as the files beside it say."""
    parts = file.parts
    if "icub_models" in parts or "iCub" in parts:
        return (
            "iCub meshes: Istituto Italiano di Tecnologia, icub-models, CC-BY-SA-4.0 "
            "(https://creativecommons.org/licenses/by-sa/4.0/)"
        )
    for folder in file.parents[:2]:
        terms_file = next(iter(sorted(folder.glob("LICENSE*"))), None)
        if terms_file is not None:
            return f"meshes of {folder.name}: the terms are in its {terms_file.name}"
    for folder in file.parents:
        manifest = folder / "package.xml"
        try:
            root = ET.parse(manifest).getroot() if manifest.is_file() else None
        except (OSError, ET.ParseError):
            root = None
        if root is not None:
            terms = list(dict.fromkeys(each.text for each in root.iter("license") if each.text))
            said = f"{'one of ' * (len(terms) > 1)}{', '.join(terms) or 'licence not said'}"
            return f"meshes of {root.findtext('name', folder.name)}: {said}"
    where = f"{file.parents[1].name}/{file.parent.name}" if len(parts) > 2 else file.name
    return f"meshes of {where}: no licence was found beside them; ask before you pass them on"
