"""Store: a map on disk, a Zarr group that `xarray.open_zarr` opens, written chunk by chunk.

Layout (Zarr format 3). Each column is an array whose first dimension is ``posture``; a chunk of the
map is one Zarr chunk of every column, so that every file has one writer. ``done`` has one entry for
each chunk, written last: a chunk without it is evaluated again. The group ``parts`` holds
what each chunk contributes to the reductions. The root's attributes hold the parameters.
"""

from __future__ import annotations

import errno
import json
import math
import os
import warnings
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense._version import __version__
from copsense.errors import CopsenseError, OutputError
from copsense.extras import require
from copsense.files import check_output, checked_path
from copsense.freedom import com_span
from copsense.maps.columns import (
    EVALUATED,
    FLAGS,
    PENDING,
    STATE_WITHIN,
    STATUS,
    Chunk,
    Column,
    columns,
    coordinate_columns,
    fill_value,
    labels,
)
from copsense.maps.leftovers import held, new_folder, remove_folders, remove_partial_files
from copsense.maps.map_plan import FORMAT, MapPlan
from copsense.maps.reduction import QUANTITIES, WORST, Part
from copsense.provenance import differences, digest, worded

_PARAMETERS = "copsense_map"  # the attribute by which a store is known
_SPAN = "com_span"  # [m]; where it is finite
_SUFFIX = ".zarr"
_FULL = (errno.ENOSPC, errno.EDQUOT)


class MapStore:
    """A map on disk, open for reading and for writing whole chunks.

    Attributes:
        path: of its folder.
        parameters: what decides its numbers.
        coordinates: columns of the coordinates.
    """

    def __init__(self, path: Path, group: Any) -> None:
        """Wrap an open group; use `open_map` or `create_map`."""
        self.path = path
        self._group = group
        self.parameters: dict[str, Any] = map_parameters(group.attrs)
        self.coordinates: tuple[str, ...] = tuple(group.attrs["over"])
        self._arrays = dict(group.arrays())
        self._parts = dict(group["parts"].arrays())
        self._size = int(self.parameters["chunk"])

    def __repr__(self) -> str:
        """Where it is, and over what."""
        return f"MapStore({str(self.path)!r} over {', '.join(self.names)})"

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the root."""
        return dict(self._group.attrs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates, of which `coordinates` are the columns."""
        return tuple(axis["name"] for axis in self.parameters["sampling"]["axes"])

    @property
    def criteria(self) -> tuple[str, ...]:
        """Names of the criteria."""
        return tuple(c["name"] for c in self.parameters["criteria"])

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(c["name"] for c in self.parameters["contacts"])

    @property
    def com_span(self) -> float:
        """A length that the CoM's travel cannot exceed [m]; infinite where it is not recorded."""
        return float(self._group.attrs.get(_SPAN, math.inf))

    def units(self, column: str) -> str:
        """Units of a column."""
        return str(self._arrays[column].attrs.get("units", ""))

    def __len__(self) -> int:
        """Number of postures."""
        return int(self._arrays["status"].shape[0])

    def done(self) -> np.ndarray:
        """Which chunks are written (chunks,)."""
        with self._errors("be read"):
            return np.asarray(self._arrays["done"][:]).astype(bool)

    def bounds(self, chunk: int) -> tuple[int, int]:
        """First posture of a chunk, and the one after its last."""
        return chunk * self._size, min((chunk + 1) * self._size, len(self))

    def read(self, column: str, start: int, stop: int) -> np.ndarray:
        """Rows of a column."""
        with self._errors("be read"):
            return np.asarray(self._arrays[column][start:stop])

    def runs(self, rows: int = 1 << 17) -> Iterator[tuple[int, int]]:
        """Chunks that are done, as runs [first, end) of about so many rows: read as one each."""
        most = max(rows // self._size, 1)
        marks = np.concatenate([[0], self.done().astype(np.int8), [0]])
        starts, ends = (np.flatnonzero(np.diff(marks) == way).tolist() for way in (1, -1))
        for start, end in zip(starts, ends, strict=True):
            yield from ((i, min(i + most, end)) for i in range(start, end, most))

    def evaluated(
        self, columns: Sequence[str], first: int, end: int
    ) -> Float[np.ndarray, "n nq nk"]:
        """Columns over a run of chunks; NaN where a posture was not evaluated."""
        start, stop = self.bounds(first)[0], self.bounds(end - 1)[1]
        known = self.read("status", start, stop) == EVALUATED
        rows = [np.where(known, self.read(name, start, stop), np.nan) for name in columns]
        return np.stack(rows, axis=1)

    @property
    def limited(self) -> bool:
        """Whether the postures were evaluated within limits too."""
        return STATE_WITHIN in self._arrays

    def write(self, index: int, chunk: Chunk, part: Part) -> None:
        """Write a chunk; its mark comes last, so a chunk that is marked is whole.

        Raises:
            OutputError: the disk is full, or cannot be written.
        """
        start = index * self._size
        with self._errors("be written"), held(self.path):
            for name, rows in chunk.items():
                if name != "reason" or (rows != "").any():  # nothing stored reads as empty
                    self._arrays[name][start : start + len(rows)] = rows
            for name in ("counts", "worst", "values"):
                self._parts[name][index] = getattr(part, name)
            self._arrays["done"][index] = 1

    def remove_leftovers(self) -> None:
        """Remove what processes that were killed left of files, if no process writes now."""
        remove_partial_files(self.path)

    def parts(self, first: int, end: int) -> list[Part]:
        """What each chunk of a run contributes to the reductions."""
        with self._errors("be read"):
            read = [np.asarray(self._parts[n][first:end]) for n in ("counts", "worst", "values")]
        return [Part(*arrays) for arrays in zip(*read, strict=True)]

    @contextmanager
    def _errors(self, verb: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            reason = error.strerror or str(error)
            full = error.errno in _FULL
            raise OutputError(
                f"the map {self.path} cannot {verb}: {reason}. The chunks that are done are kept; "
                f"{'free some space' if full else 'make it accessible'}, and run the same again "
                "to resume."
            ) from None


def map_parameters(attributes: Mapping[Hashable, Any]) -> dict[str, Any]:
    """What decides a map's numbers, from its attributes."""
    return dict(json.loads(attributes[_PARAMETERS]))


def check_store(path: str | Path) -> Path:
    """A path where a map is or can be made, checked before the work starts.

    Raises:
        InvalidInputError: a path without ``.zarr``.
        OutputError: something else is there, or nothing can be written there.
        MissingExtraError: Zarr is not installed.
    """
    _zarr()
    path = checked_path(path, "a map")
    try:
        there = path.exists() or path.is_symlink()
    except (OSError, ValueError):
        there = False
    if there:
        open_map(path)
        return path
    return check_output(path, suffixes=(_SUFFIX,), overwrite=False)


def open_map(path: str | Path) -> MapStore:
    """Open a map to read it, or to write more chunks.

    Raises:
        OutputError: nothing is there, or it is not a map of this version of copsense.
    """
    zarr, path = _zarr(), checked_path(path, "a map")
    not_a_map = f"{str(path)[:300]} is not a map of copsense"
    remedy = "It was not touched. Give another path, such as map.zarr."
    try:
        if not path.exists():
            raise OutputError(f"there is no map at {path}. Make one with: copsense map ROBOT ...")
        if not (path / "zarr.json").is_file():
            raise OutputError(f"{not_a_map}: it has no zarr.json. {remedy}")
        group = zarr.open_group(path, mode="r+", zarr_format=3)
        if _PARAMETERS not in group.attrs:
            raise OutputError(f"{not_a_map}: it has no parameters. {remedy}")
        store = MapStore(path, group)
    except (OSError, ValueError, KeyError, TypeError) as error:
        if isinstance(error, CopsenseError):
            raise
        raise OutputError(f"{not_a_map} that can be read: {error}. {remedy}") from None
    if (made := store.parameters.get("format")) != FORMAT:
        raise OutputError(
            f"{str(path)[:300]} is a map of format {made}, whose columns mean other things than "
            f"those of format {FORMAT}, which this version of copsense reads and resumes. It was "
            "not touched. Give another path to make the map again; xarray.open_zarr opens this one."
        )
    return store


def create_map(path: Path, plan: MapPlan) -> MapStore:
    """Make an empty store under another name and rename it when whole; or open what is there.

    Raises:
        OutputError: the store that is there is of another plan; or none can be made.
    """
    parameters = plan.parameters()
    remove_folders(path)
    if path.exists():
        return _resumed(path, parameters)
    try:
        with new_folder(path) as made:
            made.chmod(0o777 & ~_mask())
            _lay_out(made, plan, parameters)
            made.rename(path)
    except OSError as error:
        if path.exists():  # another process was faster
            return _resumed(path, parameters)
        raise OutputError(
            f"{str(path)[:300]!r} cannot be written: {error.strerror or error}. Free some space, "
            "or choose another path."
        ) from None
    return open_map(path)


def _resumed(path: Path, parameters: dict[str, Any]) -> MapStore:
    store = open_map(path)
    stored, asked = store.parameters, json.loads(json.dumps(parameters))
    if differences(stored, asked):
        raise OutputError(
            f"{path} is a map of other parameters: {_told(stored, asked)}. It was not touched. "
            "Give the same parameters to resume it, or another path."
        )
    return store


def _told(stored: dict[str, Any], asked: dict[str, Any]) -> str:
    """What differs, in the words of the command where it has any."""
    words, parts = [], (dict(stored), dict(asked))
    there, here = (part.pop("sampling") for part in parts)
    if differences(there, here):
        words.append(f"it is over {_sampling(there)}, and asked for is {_sampling(here)}")
    models = [part.get("robot", {}).get("model") for part in parts]
    if models[0] != models[1]:
        words.append("the robot's model, its drives or its loads are others")
        parts = tuple({**part, "robot": {**part["robot"], "model": None}} for part in parts)  # type: ignore[assignment]
    if rest := differences(*parts):
        words.append(worded(rest))
    return "; ".join(words)


def _sampling(data: Mapping[str, Any]) -> str:
    """Axes as ``--over`` has them [m, rad], and the sample."""
    ranges = [
        f"{axis['name']}={axis['start']:.10g}:{axis['stop']:.10g}"
        + ("" if axis.get("count") is None else f":{axis['count']:g}")
        for axis in data["axes"]
    ]
    if data.get("sequence"):
        ranges.append(f"{data['count']} {data['sequence']} samples of seed {data['seed']}")
    return ", ".join(ranges) + " [m, rad]"


def _lay_out(path: Path, plan: MapPlan, parameters: dict[str, Any]) -> None:
    """Every array, empty, and the metadata in one place."""
    zarr, count = _zarr(), len(plan.sampling)
    coordinates = coordinate_columns(plan)
    names = labels(plan)
    span = com_span(plan.stance)
    sizes = {dim: len(found) for dim, found in names.items()} | {"posture": count}
    group = zarr.create_group(
        path,
        zarr_format=3,
        attributes={
            "title": f"Map of {plan.stance.robot.name}: static centre-of-pressure sensitivity",
            "source": f"copsense {__version__}",
            "robot": plan.stance.robot.name,
            "over": list(coordinates),
            "coordinates": " ".join(coordinates),  # as xarray reads it
            **({_SPAN: span} if math.isfinite(span) else {}),
            "digest": digest(parameters),
            _PARAMETERS: json.dumps(parameters),
            "conventions": "SI units, radians, world z up; float32 but for coordinates and "
            "configurations",
        },
    )

    def add(where: Any, name: str, column: Column, chunks: tuple[int, ...]) -> Any:
        attributes: dict[str, Any] = {"long_name": column.meaning}
        if column.units:
            attributes["units"] = column.units
        return where.create_array(
            name,
            shape=tuple(sizes[d] for d in column.dims),
            chunks=chunks,
            dtype=str if column.dtype == "str" else column.dtype,
            fill_value=fill_value(column),
            dimension_names=column.dims,
            attributes=attributes,
            # Noise in the last bits: compressing a float costs more than it saves.
            compressors=None if column.dtype.startswith("float") else "auto",
        )

    for name, column in columns(plan).items():
        inner = tuple(sizes[d] for d in column.dims[1:])
        array = add(group, name, column, (min(plan.size, count), *inner))
        if flags := FLAGS.get(name):
            array.attrs["flag_values"] = [*range(len(flags)), PENDING]
            array.attrs["flag_meanings"] = " ".join([*flags, "pending"])
    for dim, found in names.items():
        array = add(group, dim, Column((dim,), "str", "", dim.replace("_", " ")), (len(found),))
        array[:] = np.array(found, dtype=object)
    sizes |= {"chunk": plan.chunks, "code": len(STATUS), "quantity": len(QUANTITIES), "rank": WORST}
    mark = Column(("chunk",), "uint8", "", "1 where the chunk is written, which is done last")
    group.create_array(
        "done",
        shape=(plan.chunks,),
        chunks=(1,),
        dtype="uint8",
        fill_value=0,
        dimension_names=mark.dims,
        attributes={"long_name": mark.meaning},
    )
    parts = group.create_group("parts")
    nk, nq = sizes["criterion"], len(QUANTITIES)
    dims = ("chunk", "quantity", "criterion", "rank")
    counts = Column(("chunk", "criterion", "code"), "int64", "", "rows of each status")
    add(parts, "counts", counts, (1, nk, len(STATUS)))
    add(parts, "worst", Column(dims, "int64", "", "the worst postures"), (1, nq, nk, WORST))
    add(parts, "values", Column(dims, "float32", "", "the quantity there"), (1, nq, nk, WORST))
    with warnings.catch_warnings():
        # Not part of the specification yet; other readers read array by array.
        warnings.filterwarnings("ignore", message="Consolidated metadata is currently not part")
        zarr.consolidate_metadata(path)


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _zarr() -> ModuleType:
    require("zarr", "a map")
    import zarr

    return zarr
