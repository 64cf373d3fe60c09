"""Storage: writing a sweep or a recording to a file that other tools open, and reading it back."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from copsense.arrays import finite_array
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
    _check_sweep(dataset, "this dataset is", "Give what copsense.sweep returns")
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
    write_one = "Write one with: copsense sweep ... --output FILE.nc"
    dataset = _read_netcdf(Path(path), write_one)
    _check_sweep(dataset, f"{path} is", write_one)
    dataset["pulling"] = dataset["pulling"].astype(bool)
    return dataset


def write_recording(dataset: xr.Dataset, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write the recording of a rollout as netCDF (``.nc``), whole or not at all.

    Raises:
        InvalidInputError: another suffix, or no recording.
        OutputError: the file exists, or cannot be written.
    """
    _check_recording(dataset, "this dataset is", "Give what copsense.simulation.rollout returns")
    path = check_output(path, suffixes=(".nc",), overwrite=overwrite)
    write_beside(path, lambda temporary: _write_netcdf(dataset, temporary))
    return path


def load_recording(path: str | Path) -> xr.Dataset:
    """Read the recording of a rollout back from netCDF.

    Raises:
        InvalidInputError: no such file, or not a recording of copsense.
    """
    write_one = "Write one with: copsense balance ... --output FILE.nc"
    dataset = _read_netcdf(Path(path), write_one)
    _check_recording(dataset, f"{path} is", write_one)
    return dataset


def load_configurations(path: str | Path) -> np.ndarray:
    """Configurations (N, nq) from a ``.npy`` array or a ``.csv`` of numbers, a row each.

    Raises:
        InvalidInputError: no such file, or not a table of numbers.
    """
    path = Path(path)
    need = "Give .npy, or .csv without a heading, with nq numbers a row"
    if not _tells(path.is_file):
        raise InvalidInputError(f"no file of configurations at {str(path)[:300]!r}. {need}.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty file is refused below
            npy = path.suffix == ".npy"
            rows = np.load(path) if npy else np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError, EOFError) as error:
        raise InvalidInputError(f"{path} is no table of configurations: {error}. {need}.") from None
    if not isinstance(rows, np.ndarray) or not rows.size:
        raise InvalidInputError(f"{path} holds no table of configurations. {need}.")
    return finite_array(rows, str(path), (None, None), "nq numbers a row")


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
                # The coordinate stands first: com_y is asked for, and known where a row failed.
                columns = columns | _flat(name, here[name]) | columns
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames).sort_values(["posture", "criterion"], kind="stable")


def check_output(path: str | Path, *, suffixes: tuple[str, ...], overwrite: bool) -> Path:
    """A path that can be written, checked before the work starts.

    Raises:
        InvalidInputError: the suffix is none of `suffixes`.
        OutputError: the file exists and may not be overwritten, or its folder cannot be written.
    """
    path = Path(path)
    if "\0" in str(path):
        raise OutputError(f"{str(path)!r} is no path. Leave the null character out.")
    if suffixes and path.suffix not in suffixes:
        raise InvalidInputError(
            f"the output {path.name!r} has no known suffix. Choose {' or '.join(suffixes)}."
        )
    if _tells(path.is_dir):
        raise OutputError(f"{path} is a folder. Give the path of a file.")
    if _tells(path.exists) and not overwrite:
        raise OutputError(f"{path} exists already. Give another path, or --force (overwrite=True).")
    folder = path.parent
    if not _tells(folder.is_dir):
        raise OutputError(f"there is no folder {folder} to write {path.name} in. Create it first.")
    # Asking for permissions answers wrongly (for root, on /proc, on a full disk): try.
    _temporary(path).unlink()
    return path


def _temporary(path: Path) -> Path:
    """A new empty file beside a path.

    Raises:
        OutputError: none can be made there, or the path's own name is not possible.
    """
    try:
        path.exists()  # raises where the name is too long for the folder
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".copsense-", suffix=path.suffix)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise OutputError(
            f"{str(path)[:300]!r} cannot be written: {reason}. Choose another path."
        ) from None
    os.close(handle)
    return Path(name)


def _tells(test: Callable[[], bool]) -> bool:
    """What a question about a path says; no, for a name that nothing can have."""
    try:
        return test()
    except OSError:
        return False


def _check_sweep(dataset: xr.Dataset, what: str, remedy: str) -> None:
    """Refuse a dataset that is not what `copsense.sweeps.sweep` returns."""
    known = {"cop", "wrench", "torque", "com", "reason", "pulling", "margin", "cop_sensitivity"}
    missing = sorted(known - set(map(str, dataset.variables)))
    if "coordinate" not in dataset.attrs:
        missing.append("the attribute 'coordinate'")
    if missing:
        raise InvalidInputError(
            f"{what} no sweep of copsense: it lacks {', '.join(missing)}. {remedy}."
        )


def _check_recording(dataset: xr.Dataset, what: str, remedy: str) -> None:
    """Refuse a dataset that is not what `copsense.simulation.rollout` returns."""
    missing = sorted({"time", "com", "wrench", "cop", "torque"} - set(map(str, dataset.variables)))
    missing += [
        f"the attribute {a!r}" for a in ("end_kind", "end_reason") if a not in dataset.attrs
    ]
    if missing:
        raise InvalidInputError(
            f"{what} no recording of copsense: it lacks {', '.join(missing)}. {remedy}."
        )


def _read_netcdf(path: Path, remedy: str) -> xr.Dataset:
    """A netCDF file as a dataset in memory."""
    if not _tells(path.is_file):
        raise InvalidInputError(f"no file at {str(path)[:300]!r}. {remedy}.")
    try:
        with xr.open_dataset(path, engine="netcdf4") as opened:
            return opened.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise InvalidInputError(
            f"{path} is no netCDF file that can be read: {error}. {remedy}."
        ) from None


def write_beside(path: Path, write: Callable[[Path], object]) -> None:
    """Run `write` on a temporary file beside `path`, then rename it there."""
    temporary = _temporary(path)
    try:
        write(temporary)
        # mkstemp is private to its user; a result file has the usual permissions.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:  # the netCDF library raises the latter
        raise OutputError(
            f"{path} could not be written: {error}. Free some space, or choose another path."
        ) from None
    finally:
        temporary.unlink(missing_ok=True)


def _write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    encoding = {
        str(name): {"zlib": True, "complevel": 4}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    flags = {name: v.astype("int8") for name, v in dataset.data_vars.items() if v.dtype == bool}
    dataset.assign(flags).to_netcdf(path, engine="netcdf4", encoding=encoding)


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
