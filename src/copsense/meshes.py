"""Meshes: where on this machine the file that a URDF names is."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote, urlparse

from copsense.errors import ModelLoadError


def find_mesh(filename: str, package_dirs: Iterable[str] = (), path: Path | None = None) -> Path:
    """The file of a mesh.

    A relative name is looked up beside the URDF, in the ROS package that the URDF is part of (the
    folder above it with a ``package.xml``), then in the package folders. ``package://`` is
    looked up in the package folders, in the folders above the URDF, and where ROS_PACKAGE_PATH and
    AMENT_PREFIX_PATH say; a folder may hold the package or be the package.

    Args:
        filename: as the URDF writes it.
        package_dirs: folders that hold packages, or are packages.
        path: the URDF's own path, if it came from a file.

    Raises:
        ModelLoadError: no such file; the message lists every place.
    """
    places = list(dict.fromkeys(_places(filename.replace("\\", "/"), tuple(package_dirs), path)))
    for place in places:
        if _is_file(place):
            return place.absolute()
    package = urlparse(filename.replace("\\", "/")).netloc
    what = (
        f"the folder that holds the package {package!r}, or the package itself"
        if package
        else ("the folder to which its name is relative")
    )
    searched = ", ".join(map(str, places)) or "nowhere, for a text has no folder of its own"
    raise ModelLoadError(
        f"mesh {filename!r} was not found. Searched: {searched}. Give package_dirs= "
        f"(--package-dir), {what}."
    )


def _places(filename: str, package_dirs: tuple[str, ...], path: Path | None) -> Iterator[Path]:
    """Where a mesh may be, the likeliest place first."""
    folders = [Path(folder) for folder in package_dirs]
    above = list(path.absolute().parents) if path is not None else []
    url = urlparse(filename)
    if url.scheme == "file":
        yield Path(unquote(url.path))
    elif url.scheme in ("package", "model"):
        package, rest = url.netloc, unquote(filename.split("://", 1)[1].partition("/")[2])
        for folder in folders:
            yield folder / package / rest
            yield folder / rest
        for folder in above:
            yield folder / package / rest
        for folder in _from_environment("ROS_PACKAGE_PATH"):
            yield folder / package / rest
            if folder.name == package:
                yield folder / rest
        for folder in _from_environment("AMENT_PREFIX_PATH"):
            yield folder / "share" / package / rest
        for folder in above:  # the package under another name, as a checkout may have
            yield folder / rest
    elif Path(filename).is_absolute():
        yield Path(filename)
    else:
        root = [folder for folder in above if _is_file(folder / "package.xml")][:1]
        for folder in above[:1] + root + folders:
            yield folder / filename


def _from_environment(variable: str) -> list[Path]:
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
