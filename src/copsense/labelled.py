"""LabelledResult: what every result over a labelled dataset can do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from copsense.arrays import check_type
from copsense.errors import InvalidInputError
from copsense.extras import require
from copsense.files import check_output, checked_path, file_at, write_beside

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

R = TypeVar("R", bound="LabelledResult")


class LabelledResult:
    """A frozen result round an xarray dataset, which it copies and makes read-only.

    ``result["cop"]`` is a variable, `to_xarray` the dataset, `to_pandas` a tidy table. Two results
    are equal where their names, numbers, units and attributes are.

    Args:
        dataset: as the function that computes this result makes it.

    Raises:
        InvalidInputError: the dataset lacks what this result consists of.
    """

    _needs: ClassVar[tuple[str, ...]] = ()  # variables
    _needs_attributes: ClassVar[tuple[str, ...]] = ()
    _what: ClassVar[str] = "a result"
    _made_by: ClassVar[str] = "copsense"  # the function, for messages
    _command: ClassVar[str] = "copsense ... --output FILE.nc"
    _suffixes: ClassVar[tuple[str, ...]] = (".nc", ".csv")

    __slots__ = ("_dataset",)
    _dataset: xr.Dataset
    __hash__: ClassVar[None]  # type: ignore[assignment]  # as Python sets it beside __eq__

    def __init__(self, dataset: xr.Dataset) -> None:
        """Copy the dataset."""
        import xarray as xr

        remedy = f"Give what {self._made_by} returns, or read a file with .load(path)."
        check_type(dataset, xr.Dataset, f"the dataset of {self._what}", remedy)
        self._check(dataset, "this dataset", f"Give what {self._made_by} returns")
        own = dataset.copy(deep=True)
        for variable in own.variables.values():
            if isinstance(variable.data, np.ndarray):
                variable.data.flags.writeable = False
        object.__setattr__(self, "_dataset", own)

    def __setattr__(self, name: str, value: object) -> None:
        """Reject a change."""
        raise AttributeError(
            f"{type(self).__name__} is frozen. Make a new one from .to_xarray(), or with "
            ".with_attributes(...)."
        )

    def __getitem__(self, name: str) -> xr.DataArray:
        """A variable or coordinate, with labels, unit and meaning; its numbers are read-only."""
        return self._dataset[name].copy(deep=False)

    def __contains__(self, name: object) -> bool:
        """Whether there is a variable of that name."""
        return name in self._dataset.variables

    def __iter__(self) -> Iterator[str]:
        """The names of the variables and coordinates."""
        return iter(str(name) for name in self._dataset.variables)

    def __eq__(self, other: object) -> bool:
        """Whether names, numbers, units and attributes are the same."""
        return type(self) is type(other) and self._dataset.identical(other._dataset)

    def equals(self, other: LabelledResult) -> bool:
        """Whether numbers and labels are the same, whatever the units and attributes."""
        return self._dataset.equals(other._dataset)

    def __getstate__(self) -> xr.Dataset:
        """What pickle keeps."""
        return self._dataset

    def __setstate__(self, dataset: xr.Dataset) -> None:
        """Take what pickle kept."""
        LabelledResult.__init__(self, dataset)

    def __copy__(self: R) -> R:
        """The result itself: it is frozen."""
        return self

    def __deepcopy__(self: R, memo: object) -> R:
        """The result itself: it is frozen."""
        return self

    @property
    def attrs(self) -> Mapping[str, Any]:
        """The attributes of the whole: robot, mass, versions and what made the numbers."""
        return MappingProxyType(dict(self._dataset.attrs))

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know about robot and criteria, such as what of the file is not used.

        Empty for a file of an earlier version, which did not record it.
        """
        return tuple(map(str, json.loads(self.attrs.get("notes", "[]"))))

    @property
    def sizes(self) -> Mapping[str, int]:
        """Dimension -> size."""
        return {str(name): size for name, size in self._dataset.sizes.items()}

    def labels(self, dimension: str) -> tuple[str, ...]:
        """The names along a dimension."""
        return tuple(str(name) for name in np.atleast_1d(self._dataset[dimension].values))

    def sel(self, **labels: Any) -> xr.Dataset:
        """A part by labels, as `xarray.Dataset.sel` gives it."""
        return self._dataset.sel(**labels)

    def isel(self, **indices: Any) -> xr.Dataset:
        """A part by positions, as `xarray.Dataset.isel` gives it."""
        return self._dataset.isel(**indices)

    def with_attributes(self: R, **attributes: Any) -> R:
        """The same result with attributes added or replaced."""
        return type(self)(self._dataset.assign_attrs(**attributes))

    def with_notes(self: R, notes: Iterable[str]) -> R:
        """The same result with notes added."""
        return self.with_attributes(notes=json.dumps([*self.notes, *notes]))

    def to_xarray(self) -> xr.Dataset:
        """The dataset, a copy that may be changed."""
        return self._dataset.copy(deep=True)

    def to_pandas(self) -> pd.DataFrame:
        """A tidy table."""
        raise NotImplementedError

    def to_dict(self) -> dict[str, Any]:
        """What a person wants to know first, as plain data: None for what is infinite."""
        raise NotImplementedError

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write netCDF (``.nc``, everything) or the table of `to_pandas` (``.csv``).

        The file is written beside its place and renamed, so that it is whole or not there.

        Raises:
            InvalidInputError: another suffix.
            OutputError: the file exists and `overwrite` is false, or it cannot be written.
        """
        path = check_output(path, suffixes=self._suffixes, overwrite=overwrite)
        if path.suffix == ".nc":
            write_beside(path, lambda temporary: write_netcdf(self._dataset, temporary))
        else:
            table = self.to_pandas()
            write_beside(path, lambda temporary: table.to_csv(temporary, index=False))
        return path

    @classmethod
    def load(cls: type[R], path: str | Path) -> R:
        """Read a result back from netCDF.

        Raises:
            InvalidInputError: there is no such file, or it holds something else.
        """
        remedy = f"Write one with: {cls._command}"
        dataset = read_netcdf(checked_path(path, cls._what), remedy)
        cls._check(dataset, str(path), remedy)
        return cls(dataset)

    @classmethod
    def _check(cls, dataset: xr.Dataset, subject: str, remedy: str) -> None:
        missing = sorted(set(cls._needs) - set(map(str, dataset.variables)))
        missing += [f"the attribute {a!r}" for a in cls._needs_attributes if a not in dataset.attrs]
        if missing:
            raise InvalidInputError(
                f"{subject} is not {cls._what} of copsense: it lacks {', '.join(missing)}. "
                f"{remedy}."
            )


def write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as compressed netCDF; truth values, which it lacks, as bytes 0 and 1."""
    require("netCDF4", "writing netCDF")
    encoding = {
        str(name): {"zlib": True, "complevel": 4}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    flags = {name: v.astype("int8") for name, v in dataset.data_vars.items() if v.dtype == bool}
    dataset.assign(flags).to_netcdf(path, engine="netcdf4", encoding=encoding)


def read_netcdf(path: Path, remedy: str) -> xr.Dataset:
    """A netCDF file as a dataset in memory; bytes that `write_netcdf` made are truth values again.

    Raises:
        InvalidInputError: there is no such file, or it is not netCDF; the message ends in `remedy`.
    """
    require("netCDF4", "reading netCDF")
    import xarray as xr

    if not file_at(path):
        raise InvalidInputError(f"no file at {str(path)[:300]!r}. {remedy}.")
    try:
        with xr.open_dataset(path, engine="netcdf4") as opened:
            dataset = opened.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise InvalidInputError(
            f"{path} is not a netCDF file that can be read: {error}. {remedy}."
        ) from None
    flags = {n: v.astype(bool) for n, v in dataset.data_vars.items() if v.dtype == np.int8}
    return dataset.assign(flags)


def tidy_table(
    dataset: xr.Dataset, rows: Sequence[str], first: Sequence[str], others: Sequence[str]
) -> pd.DataFrame:
    """A table with a row for every combination of some dimensions, in the dataset's order.

    Args:
        dataset: the dataset.
        rows: the dimensions that make the rows.
        first: coordinates that stand first, over one of `rows` each.
        others: variables; one with further dimensions has a column for each of their labels,
            ``cop_x``. One that the dataset lacks is left out, as is a column that stands already.
    """
    require("pandas", "a table")
    import pandas as pd

    shape = tuple(dataset.sizes[d] for d in rows)
    columns: dict[str, np.ndarray] = {}
    for name in (*first, *(n for n in others if n in dataset)):
        variable = dataset[name]
        dims = [str(d) for d in variable.dims if d not in rows]
        here = [d for d in rows if d in variable.dims]
        array = variable.transpose(*here, *dims).values
        lead = tuple(n if d in here else 1 for d, n in zip(rows, shape, strict=True))
        array = array.reshape(*lead, *array.shape[len(here) :])
        for index in np.ndindex(array.shape[len(rows) :]):
            labels = [str(dataset[d].values[i]) for d, i in zip(dims, index, strict=True)]
            column = np.broadcast_to(array[(..., *index)], shape).reshape(-1)
            columns.setdefault("_".join([name, *labels]), column)
    return pd.DataFrame(columns)
