"""Extras: packages that only some functions need, asked for where they are used."""

from __future__ import annotations

import importlib.util

from copsense.errors import MissingExtraError

# Package -> the extra that installs it.
EXTRA_OF = {
    "xarray": "data",
    "pandas": "data",
    "netCDF4": "data",
    "matplotlib": "plots",
    "jinja2": "report",
    "numba": "fast",
    "numba_cuda": "gpu",
    "mujoco": "sim",
    "msgspec": "sim",
    "imageio_ffmpeg": "video",
    "zarr": "map",
    "distributed": "cluster",
    "h5py": "logs",
    "pyarrow": "logs",
    "rosbags": "logs",
    "ezc3d": "logs",
    "viser": "explore",
    "trimesh": "explore",
    "collada": "explore",
    "fast_simplification": "explore",
    "torch": "torch",
    "jax": "jax",
}


def require(package: str, purpose: str) -> None:
    """Raise unless an optional package is installed.

    Args:
        package: its name as imported, one of `EXTRA_OF`.
        purpose: what needs it, such as ``"drawing a figure"``; the message begins with it.

    Raises:
        MissingExtraError: it is not installed; the message names the line that installs it.
    """
    if importlib.util.find_spec(package) is None:
        raise MissingExtraError(package, EXTRA_OF[package], purpose)
