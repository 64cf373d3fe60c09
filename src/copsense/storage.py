"""Storage: writing a sweep to a file that other tools open, and reading it back."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from copsense.errors import InvalidInputError, OutputError

_SUFFIXES = (".nc", ".csv")


def write_results(dataset: xr.Dataset, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a sweep as netCDF (``.nc``) or as a table (``.csv``).

    The table has a row per posture, criterion and contact; netCDF has everything. The file is
    written beside its place and renamed, so that it is whole or not there.

    Raises:
        InvalidInputError: another suffix.
        OutputError: the file exists, or cannot be written.
    """
    path = check_output(path, suffixes=_SUFFIXES, overwrite=overwrite)
    if path.suffix == ".nc":
        write_beside(path, lambda temporary: _write_netcdf(dataset, temporary))
    else:
        write_beside(path, lambda temporary: table(dataset).to_csv(temporary, index=False))
    return path


def load_results(path: str | Path) -> xr.Dataset:
    """Read a sweep back from netCDF.

    Raises:
        InvalidInputError: no such file, or not a sweep of copsense.
    """
    path = Path(path)
    if not path.is_file():
        raise InvalidInputError(
            f"no file at {path}. Write one with: copsense sweep ... --output FILE.nc"
        )
    try:
        with xr.open_dataset(path, engine="netcdf4") as opened:
            dataset = opened.load()
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{path} is no netCDF file that can be read: {error}") from None
    missing = {"cop", "wrench", "reason"} - set(dataset.variables)
    if missing:
        raise InvalidInputError(
            f"{path} is no sweep of copsense: it lacks {', '.join(sorted(missing))}."
        )
    dataset["pulling"] = dataset["pulling"].astype(bool)
    return dataset


def load_configurations(path: str | Path) -> np.ndarray:
    """Configurations (N, nq) from a ``.npy`` array or a ``.csv`` of numbers, a row each.

    Raises:
        InvalidInputError: no such file, or not a table of numbers.
    """
    path = Path(path)
    try:
        rows = np.load(path) if path.suffix == ".npy" else np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise InvalidInputError(
            f"{path} is no table of configurations (.npy, or .csv with nq numbers a row): {error}"
        ) from None
    if rows.ndim != 2 or not len(rows):
        raise InvalidInputError(f"{path} must hold rows of nq numbers; got shape {rows.shape}.")
    return np.asarray(rows, dtype=float)


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """A sweep as a tidy table: a row per posture, criterion and contact."""
    coordinate = dataset.attrs["coordinate"]
    frames: list[pd.DataFrame] = []
    contacts = [str(c) for c in dataset["contact"].values]
    for j, criterion in enumerate(dataset["criterion"].values):
        for k, contact in enumerate(contacts):
            here = dataset.isel(criterion=j, contact=k)
            columns: dict[str, np.ndarray] = {
                "posture": here["posture"].values,
                coordinate: here[coordinate].values,
            }
            columns["criterion"] = np.full(len(here["posture"]), str(criterion))
            columns["contact"] = np.full(len(here["posture"]), contact)
            for name in (
                "com",
                "cop",
                "wrench",
                "margin",
                "margin_side",
                "com_travel",
                "unloading_travel",
                "cop_gain",
                "cop_slope",
                "worst_case_gain",
                "pulling",
                "residual",
                "reason",
                "torque",
                "cop_sensitivity",
            ):
                columns |= _flat(name, here[name])
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames).sort_values(["posture", "criterion"], kind="stable")


def check_output(path: str | Path, *, suffixes: tuple[str, ...], overwrite: bool) -> Path:
    """A path that can be written, checked before the work starts.

    Raises:
        InvalidInputError: the suffix is none of `suffixes`.
        OutputError: the file exists and may not be overwritten, or its folder cannot be written.
    """
    path = Path(path)
    if suffixes and path.suffix not in suffixes:
        raise InvalidInputError(
            f"{path.name!r} has no known suffix; choose {' or '.join(suffixes)}."
        )
    if path.exists() and (path.is_dir() or not overwrite):
        what = "is a folder" if path.is_dir() else "exists already"
        raise OutputError(f"{path} {what}. Give another path, or --force (overwrite=True).")
    folder = path.parent
    if not folder.is_dir():
        raise OutputError(f"there is no folder {folder} to write {path.name} in. Create it first.")
    if not os.access(folder, os.W_OK):
        raise OutputError(f"the folder {folder} cannot be written to. Choose another.")
    return path


def write_beside(path: Path, write: Callable[[Path], object]) -> None:
    """Run `write` on a temporary file beside `path`, then rename it there."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        # mkstemp is private to its user; a result file has the usual permissions.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except OSError as error:
        raise OutputError(f"{path} could not be written: {error}.") from None
    finally:
        temporary.unlink(missing_ok=True)


def _write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    encoding = {
        str(name): {"zlib": True, "complevel": 4}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    plain = dataset.assign(pulling=dataset["pulling"].astype("int8"))
    plain.to_netcdf(path, engine="netcdf4", encoding=encoding)


def _flat(name: str, variable: xr.DataArray) -> dict[str, np.ndarray]:
    """A variable over postures as columns, one per index of its other dimensions."""
    dims = [d for d in variable.dims if d != "posture"]
    if not dims:
        return {name: variable.values}
    array = variable.transpose("posture", *dims).values
    columns = {}
    for index in np.ndindex(array.shape[1:]):
        labels = [str(variable[d].values[i]) for d, i in zip(dims, index, strict=True)]
        columns["_".join([name, *labels])] = array[(slice(None), *index)]
    return columns
