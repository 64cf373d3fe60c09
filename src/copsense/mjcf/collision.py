"""collision: the shapes of a robot's links that MuJoCo lets collide, and those that it draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from copsense.mjcf.mjcf_reading import MjcfShape
from copsense.mjcf.scene import body_label
from copsense.mjcf.tree_model import Tree, pose

_KINDS = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
    int(mujoco.mjtGeom.mjGEOM_SDF): "mesh",
}


# Groups that MuJoCo's viewer shows at first, and how much of a shape is to be seen.
_SHOWN_GROUPS, _FAINT = (0, 1, 2), 0.05


def collision_shapes(mj: Any, tree: Tree) -> tuple[MjcfShape, ...]:
    """Shapes of the robot with a ``contype`` or ``conaffinity``, or named in a ``<pair>``."""
    paired = {int(g) for g in np.concatenate([mj.pair_geom1, mj.pair_geom2])}
    collides = (mj.geom_contype != 0) | (mj.geom_conaffinity != 0)
    return tuple(_shape(mj, tree, g) for g in _own(mj, tree) if collides[g] or g in paired)


def drawn_shapes(mj: Any, tree: Tree) -> tuple[MjcfShape, ...]:
    """Shapes of the robot in the groups that MuJoCo's viewer shows at first, with their faces.

    All of them where none is in these groups. What is transparent is left out.
    """
    own = [g for g in _own(mj, tree) if mj.geom_rgba[g, 3] > _FAINT]
    shown = [g for g in own if mj.geom_group[g] in _SHOWN_GROUPS]
    return tuple(replace(_shape(mj, tree, g), faces=_faces(mj, g)) for g in (shown or own))


def _own(mj: Any, tree: Tree) -> list[int]:
    """The robot's shapes of the kinds that are read."""
    return [
        g
        for g in range(mj.ngeom)
        if int(mj.geom_bodyid[g]) in tree.bodies and int(mj.geom_type[g]) in _KINDS
    ]


def _shape(mj: Any, tree: Tree, g: int) -> MjcfShape:
    body, kind = int(mj.geom_bodyid[g]), _KINDS[int(mj.geom_type[g])]
    joint, outer = tree.bodies[body]
    place = outer * pose(mj.geom_pos[g], mj.geom_quat[g])
    name = mj.geom(g).name or f"shape {g} of {body_label(mj, body)}"
    size = np.array(mj.geom_size[g], dtype=float)
    return MjcfShape(name, kind, joint, place, size, _vertices(mj, g, kind))


def _faces(mj: Any, g: int) -> np.ndarray:
    """Corners of a mesh's triangles (f, 3); none of what is not a mesh."""
    if _KINDS[int(mj.geom_type[g])] != "mesh":
        return np.zeros((0, 3), dtype=np.int64)
    mesh = int(mj.geom_dataid[g])
    first, count = int(mj.mesh_faceadr[mesh]), int(mj.mesh_facenum[mesh])
    return np.array(mj.mesh_face[first : first + count], dtype=np.int64)


def _vertices(mj: Any, g: int, kind: str) -> np.ndarray:
    """Vertices of a mesh (k, 3), in the axes that the compiler gave its shape."""
    if kind != "mesh":
        return np.zeros((0, 3))
    mesh = int(mj.geom_dataid[g])
    first, count = int(mj.mesh_vertadr[mesh]), int(mj.mesh_vertnum[mesh])
    return np.array(mj.mesh_vert[first : first + count], dtype=float)
