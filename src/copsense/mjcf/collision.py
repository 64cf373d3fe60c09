"""collision: the shapes of a robot's links that MuJoCo lets collide."""

from __future__ import annotations

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


def collision_shapes(mj: Any, tree: Tree) -> tuple[MjcfShape, ...]:
    """Shapes of the robot with a ``contype`` or ``conaffinity``, or named in a ``<pair>``."""
    paired = {int(g) for g in np.concatenate([mj.pair_geom1, mj.pair_geom2])}
    shapes = []
    for g in range(mj.ngeom):
        body, kind = int(mj.geom_bodyid[g]), _KINDS.get(int(mj.geom_type[g]))
        collides = mj.geom_contype[g] or mj.geom_conaffinity[g] or g in paired
        if body not in tree.bodies or kind is None or not collides:
            continue
        joint, outer = tree.bodies[body]
        place = outer * pose(mj.geom_pos[g], mj.geom_quat[g])
        name = mj.geom(g).name or f"shape {g} of {body_label(mj, body)}"
        size = np.array(mj.geom_size[g], dtype=float)
        shapes.append(MjcfShape(name, kind, joint, place, size, _vertices(mj, g, kind)))
    return tuple(shapes)


def _vertices(mj: Any, g: int, kind: str) -> np.ndarray:
    """Vertices of a mesh (k, 3), in the axes that the compiler gave its shape."""
    if kind != "mesh":
        return np.zeros((0, 3))
    mesh = int(mj.geom_dataid[g])
    first, count = int(mj.mesh_vertadr[mesh]), int(mj.mesh_vertnum[mesh])
    return np.array(mj.mesh_vert[first : first + count], dtype=float)
