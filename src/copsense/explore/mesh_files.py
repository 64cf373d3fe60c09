"""Mesh files: triangles as a file has them.

The only module that opens meshes to draw them, with a reader of its own for binary STL.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from copsense.errors import ModelLoadError
from copsense.extras import require

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 84  # bytes of a binary STL before its facets


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
            return _whole(path, *joined(corners.astype(float)))
    return _whole(path, *_read_other(path))


def _whole(path: Path, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh that has triangles, and numbers.

    Raises:
        ModelLoadError: it has not: the file is cut short, say.
    """
    if not len(faces) or not np.isfinite(vertices).all():
        what = "numbers that are not finite" if len(faces) else "no triangle"
        raise ModelLoadError(
            f"mesh {path} holds {what}. Fetch the file again, or leave meshes out with --no-meshes."
        )
    return vertices, faces


def _read_other(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A mesh of any other kind (COLLADA, OBJ, text STL)."""
    require("trimesh", f"drawing {path.suffix.lower() or 'such'} meshes")
    if path.suffix.lower() == ".dae":
        require("collada", "drawing .dae meshes")
    import trimesh

    try:
        # Not as one mesh, nor by its path: pictures would be opened, and packed into a large one.
        with path.open("rb") as file:
            scene: Any = trimesh.load(file, file_type=path.suffix.lower()[1:], force="scene")
        # Corners that several triangles share, once: thinning out would tear them apart.
        parts = [np.asarray(mesh.triangles, float) for mesh in scene.dump()]
        return joined(np.vstack([np.zeros((0, 3, 3)), *parts]).reshape(-1, 3))
    except Exception as error:  # readers of many formats raise anything
        raise ModelLoadError(
            f"mesh {path} cannot be read: {type(error).__name__}: {error}. Leave meshes out with "
            "--no-meshes."
        ) from None


def joined(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles' corners (3f, 3) as vertices, each once, and faces."""
    # As bytes: a row is one value, and no tolerance is needed, for a file repeats its numbers.
    rows = np.ascontiguousarray(corners + 0.0).view(np.dtype((np.void, corners.itemsize * 3)))
    _, first, inverse = np.unique(rows.ravel(), return_index=True, return_inverse=True)
    return corners[first], inverse.reshape(-1, 3).astype(np.int64)
