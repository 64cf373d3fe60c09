"""Shape: what a robot looks like, as triangles on its joints; read from what its file draws.

The only module that opens meshes to draw them, with a reader of its own for binary STL.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.content import ShortRepr, freeze
from copsense.errors import CopsenseError, ModelLoadError
from copsense.extras import require
from copsense.meshes import find_mesh
from copsense.mjcf.mjcf_reading import MjcfShape
from copsense.robot import Robot

TRIANGLES = 27_000  # of a whole robot: more are slow to send and, without a GPU, to draw
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84  # bytes of a binary STL before its facets
_ROUND = 24  # corners of a round outline


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


def load_shape(robot: Robot, triangles: int = TRIANGLES) -> Shape:
    """What a robot's file draws: the visual shapes of a URDF, the colliding ones of an MJCF.

    What cannot be read is left out and named; a robot without anything to draw is a stick figure.

    Args:
        robot: the robot.
        triangles: about how many to keep.
    """
    description, notes = robot.description, []
    if description is None or description.language == "sdf":
        return Shape()
    parts: list[Part] = []
    files: list[Path] = []
    found = _mjcf_parts(robot) if robot.mjcf is not None else _urdf_parts(robot, files)
    for each in found:
        if isinstance(each, str):
            notes.append(each)
        else:
            parts.append(each)
    meshes = _reduced(_by_joint(parts), triangles)
    told = tuple(dict.fromkeys(_licence(file) for file in files))
    return Shape(tuple(meshes), tuple(dict.fromkeys(notes)), told)


def _urdf_parts(robot: Robot, files: list[Path]) -> Iterator[Part | str]:
    """The parts that a URDF draws, and a sentence for each that cannot be read."""
    assert robot.description is not None
    model, description = robot.model, robot.description
    read: dict[Path, tuple[np.ndarray, np.ndarray]] = {}
    for link in ET.fromstring(description.text).iter("link"):
        name = link.get("name", "")
        if not model.existFrame(name, pin.FrameType.BODY):
            continue
        frame = model.frames[model.getFrameId(name, pin.FrameType.BODY)]
        for visual in link.findall("visual"):
            geometry = visual.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is None:
                continue
            place = frame.placement * _origin(visual.find("origin"))
            try:
                if shape.tag == "mesh":
                    filename = shape.get("filename", "")
                    path = find_mesh(filename, description.package_dirs, description.path)
                    if path not in read:
                        read[path] = read_mesh(path)
                        files.append(path)
                    vertices, faces = read[path]
                    vertices = vertices * _numbers(shape.get("scale"), 3, 1.0)
                else:
                    vertices, faces = _hull(_primitive(shape))
            except CopsenseError as error:
                yield f"not drawn: {error}"
                continue
            yield frame.parentJoint, vertices @ place.rotation.T + place.translation, faces


def _mjcf_parts(robot: Robot) -> Iterator[Part | str]:
    """The parts of an MJCF that collide."""
    assert robot.mjcf is not None
    model, whole = robot.model, robot.mjcf.model
    if robot.mjcf.shapes is None:
        yield "not drawn: shapes of an MJCF are read by MuJoCo; pip install 'copsense[sim]'."
        return
    for shape in robot.mjcf.shapes:
        name, place = whole.names[shape.joint], shape.placement
        if model.existJointName(name):
            joint = model.getJointId(name)
        elif model.existFrame(name):  # a joint that is locked
            frame = model.frames[model.getFrameId(name)]
            joint, place = frame.parentJoint, frame.placement * place
        else:
            continue
        points = _points_of(shape)
        if len(points) < 4:
            continue
        vertices, faces = _hull(points)
        yield joint, vertices @ place.rotation.T + place.translation, faces


def _points_of(shape: MjcfShape) -> np.ndarray:
    """Points whose hull a shape is."""
    x, y, z = (float(size) for size in shape.size)
    if shape.kind == "mesh":
        return np.asarray(shape.vertices)
    if shape.kind == "box":
        return _box(x, y, z)
    if shape.kind == "cylinder":
        return _tube(x, y)
    if shape.kind == "capsule":
        return _pill(x, y)
    return _ball(x, x, x) if shape.kind == "sphere" else _ball(x, y, z)


def read_mesh(path: Path) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Vertices, as the file has them, and faces of a mesh.

    Raises:
        ModelLoadError: it cannot be read.
        MissingExtraError: it takes a package that is not installed.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise ModelLoadError(
            f"mesh {path} cannot be read: {error}. Choose a readable file."
        ) from None
    if path.suffix.lower() == ".stl" and len(raw) >= _HEADER:
        count = int(np.frombuffer(raw, "<u4", 1, _HEADER - 4)[0])
        if len(raw) == _HEADER + count * _FACET.itemsize:
            corners = np.frombuffer(raw, _FACET, count, _HEADER)["corners"].reshape(-1, 3)
            return _whole(path, *_joined(corners.astype(float)))
    return _whole(path, *_read_other(path))


def _whole(path: Path, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh that has triangles, and numbers.

    Raises:
        ModelLoadError: it has not: the file is cut short, say.
    """
    if not len(faces) or not np.isfinite(vertices).all():
        what = "numbers that are not finite" if len(faces) else "no triangle"
        raise ModelLoadError(
            f"mesh {path} holds {what}. Fetch the file anew, or leave meshes out with --no-meshes."
        )
    return vertices, faces


def _read_other(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of any other kind (COLLADA, OBJ, text STL)."""
    require("trimesh", f"drawing {path.suffix.lower() or 'such'} meshes")
    if path.suffix.lower() == ".dae":
        require("collada", "drawing .dae meshes")
    import trimesh

    try:
        mesh: Any = trimesh.load(str(path), force="mesh")
        # Corners that several triangles share, once: thinning out would tear them apart.
        return _joined(np.array(mesh.vertices, float)[np.array(mesh.faces)].reshape(-1, 3))
    except Exception as error:  # readers of many formats raise anything
        raise ModelLoadError(
            f"mesh {path} cannot be read: {type(error).__name__}: {error}. Leave meshes out with "
            "--no-meshes."
        ) from None


def _joined(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles' corners (3f, 3) as vertices, each once, and faces."""
    # As bytes: a row is one value, and no tolerance is needed, for a file repeats its numbers.
    rows = np.ascontiguousarray(corners + 0.0).view(np.dtype((np.void, corners.itemsize * 3)))
    _, first, inverse = np.unique(rows.ravel(), return_index=True, return_inverse=True)
    return corners[first], inverse.reshape(-1, 3).astype(np.int64)


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

    found = []
    for mesh in meshes:
        points, faces = fast_simplification.simplify(
            np.asarray(mesh.vertices, np.float32),
            np.asarray(mesh.faces, np.int32),
            target_reduction=min(1.0 - triangles / total, 0.99),
        )
        found.append(JointMesh(mesh.joint, np.asarray(points, float), np.asarray(faces, np.int64)))
    return found


def _licence(file: Path) -> str:
    """Who made a mesh and under which terms, as far as the files beside it say."""
    parts = file.parts
    if "icub_models" in parts or "iCub" in parts:
        return (
            "iCub meshes: Istituto Italiano di Tecnologia, icub-models, CC-BY-SA-4.0 "
            "(https://creativecommons.org/licenses/by-sa/4.0/)"
        )
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
    return f"meshes of {where}: no licence was found beside them; ask before you give them on"


def _origin(element: ET.Element | None) -> pin.SE3:
    if element is None:
        return pin.SE3.Identity()
    roll, pitch, yaw = _numbers(element.get("rpy"), 3, 0.0)
    return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), _numbers(element.get("xyz"), 3, 0.0))


def _numbers(text: str | None, count: int, default: float) -> Float[np.ndarray, " n"]:
    return np.full(count, default) if text is None else np.array([float(t) for t in text.split()])


def _primitive(shape: ET.Element) -> np.ndarray:
    """Points whose hull is a box, a cylinder, a capsule or a sphere of a URDF."""
    size = {name: float(shape.get(name, "0")) for name in ("radius", "length")}
    if shape.tag == "box":
        return _box(*(_numbers(shape.get("size"), 3, 0.0) / 2))
    if shape.tag == "sphere":
        return _ball(*[size["radius"]] * 3)
    if shape.tag == "cylinder":
        return _tube(size["radius"], size["length"] / 2)
    if shape.tag == "capsule":
        return _pill(size["radius"], size["length"] / 2)
    raise ModelLoadError(
        f"a <{shape.tag}> is no shape of a URDF that is drawn. Leave meshes out with --no-meshes."
    )


def _box(x: float, y: float, z: float) -> np.ndarray:
    return np.array(np.meshgrid([-x, x], [-y, y], [-z, z])).reshape(3, -1).T


def _tube(radius: float, half: float) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
    rim = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    ends = [np.column_stack([rim, np.full(_ROUND, z)]) for z in (-half, half)]
    return np.vstack(ends)


def _ball(x: float, y: float, z: float) -> np.ndarray:
    turn = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
    rise = np.linspace(-np.pi / 2, np.pi / 2, _ROUND // 2 + 1)[1:-1]
    u, v = (a.ravel() for a in np.meshgrid(turn, rise))
    around = np.column_stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)])
    return np.vstack([around, [[0, 0, 1], [0, 0, -1]]]) * [x, y, z]


def _pill(radius: float, half: float) -> np.ndarray:
    ball = _ball(radius, radius, radius)
    return ball + np.where(ball[:, 2:] >= 0, half, -half) * [0, 0, 1]


def _hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The convex hull of points, its triangles seen from outside."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        raise ModelLoadError("a shape without volume. Leave meshes out with --no-meshes.") from None
    faces = hull.simplices.astype(np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces
