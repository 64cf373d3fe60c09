"""The arrays and texts of a MATLAB file, v5 or v7.3, under names such as ``out.signals.values``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.extras import require
from copsense.logs.apart import read_apart
from copsense.logs.channel import reading

_DEEPEST = 12  # structures within structures, as in `matlab5`


@dataclass(frozen=True)
class Leaf:
    """An array of numbers, or texts, in a MATLAB file.

    Attributes:
        key: its place, such as ``"joints_state.positions.data"``.
        shape: as MATLAB says it; empty for texts.
        read: (axis, begin, end) -> the array with that axis first, from begin to end.
        texts: the texts, where it holds texts.
    """

    key: str
    shape: tuple[int, ...]
    read: Callable[[int, int, int], Float[np.ndarray, "n *k"]] | None = None
    texts: tuple[str, ...] = ()

    @property
    def group(self) -> str:
        """The structure it is a field of."""
        return self.key.rpartition(".")[0]

    @property
    def field(self) -> str:
        """Its own name in that structure."""
        return self.key.rpartition(".")[2]


def read_tree(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object] | None]:
    """The leaves of a MATLAB file, what cannot be read of it, and what closes it if it is open.

    Raises:
        LogReadError: it is not a MATLAB file, or is cut short.
    """
    with reading(path, "MATLAB file"), path.open("rb") as file:
        head = file.read(1024)
    if b"\x89HDF\r\n\x1a\n" in (head[:8], head[512:520]):
        return _read_hdf5(path)
    return _read_v5(path)


def _read_v5(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object] | None]:
    held = read_apart(
        "matlab5", path, "MATLAB v5 file", "Save it with save(..., '-v7.3'), which is streamed."
    )
    notes = [_object(key, "an object") for key in map(str, held.pop("objects"))]
    leaves = []
    for name, value in held.items():
        key = name.removeprefix("=")
        if value.dtype.kind == "U":
            leaves.append(Leaf(key, (), None, tuple(map(str, value))))
            continue

        def read(axis: int, begin: int, end: int, array: np.ndarray = value) -> np.ndarray:
            return np.asarray(np.moveaxis(array, axis, 0)[begin:end], float)

        leaves.append(Leaf(key, value.shape, read))
    return leaves, notes, None


def _read_hdf5(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object] | None]:
    require("h5py", "reading a MATLAB v7.3 file")
    import h5py

    notes: list[str] = []
    leaves: list[Leaf] = []
    with reading(path, "MATLAB v7.3 file"):
        file = h5py.File(path, "r")
        try:
            strings = iter(_object_strings(file))
            for name in sorted(file, key=lambda n: _order(file, n)):
                if not name.startswith("#"):
                    leaves += _hdf5_leaves(file, name, file[name], notes, strings, 0)
        except BaseException:
            file.close()
            raise
    return leaves, notes, file.close


def _order(file: Any, name: str) -> int:
    """Objects are numbered in the order in which they were saved."""
    item = file[name]
    if item.attrs.get("MATLAB_object_decode", 0) == 3 and hasattr(item, "shape") and item.size > 4:
        return int(item[()].ravel()[4])
    return 0


def _hdf5_leaves(
    file: Any, key: str, item: Any, notes: list[str], strings: Iterator[Any], depth: int
) -> Iterator[Leaf]:
    import h5py

    if depth > _DEEPEST:
        return
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if isinstance(item, h5py.Group):
        for name in item:
            yield from _hdf5_leaves(file, f"{key}.{name}", item[name], notes, strings, depth + 1)
        return
    if item.attrs.get("MATLAB_empty", 0):
        return
    if kind == "char":
        yield Leaf(key, (), None, (_text(item),))
    elif kind == "string":
        texts = next(strings, None)
        if texts:
            yield Leaf(key, (), None, tuple(texts))
        else:
            notes.append(_object(key, "a string array"))
    elif item.dtype == h5py.ref_dtype:
        parts = [file[ref] for ref in item[()].T.ravel()]
        chars = [p.attrs.get("MATLAB_class", b"") in (b"char", "char") for p in parts]
        if parts and all(chars):
            yield Leaf(key, (), None, tuple(_text(p) for p in parts))
        else:
            for i, part in enumerate(parts):
                place = key if len(parts) == 1 else f"{key}({i + 1})"
                yield from _hdf5_leaves(file, place, part, notes, strings, depth + 1)
    elif "MATLAB_object_decode" in item.attrs:
        notes.append(_object(key, f"an object of class {kind}"))
    elif item.dtype.kind in "biuf" and item.size:

        def read(axis: int, begin: int, end: int, data: Any = item) -> np.ndarray:
            # The file's axes are MATLAB's the other way round.
            own = data.ndim - 1 - axis
            part = data[(slice(None),) * own + (slice(begin, end),)]
            return np.asarray(np.moveaxis(part.transpose(), axis, 0), float)

        yield Leaf(key, tuple(reversed(item.shape)), read)


def _text(item: Any) -> str:
    if item.attrs.get("MATLAB_empty", 0):
        return ""
    return "".join(map(chr, item[()].T.ravel() if item.ndim > 1 else item[()]))


def _object_strings(file: Any) -> list[list[str]]:
    """The string arrays of a v7.3 file, in the order of their objects.

    MATLAB keeps them away from their names, each as 64-bit words: 1, the number of sizes, the
    sizes, every text's length, then all texts as UTF-16.
    """
    found = []
    for name in file.get("#refs#", {}):
        item = file["#refs#"][name]
        if getattr(item, "dtype", None) != np.uint64 or "MATLAB_empty" in item.attrs:
            continue
        words = item[()].ravel()
        if len(words) < 4 or words[0] != 1 or not 2 <= words[1] <= 8 or len(words) < 2 + words[1]:
            continue
        sizes = words[2 : 2 + int(words[1])].astype(int)
        count = int(np.prod(sizes))
        begin = 2 + len(sizes)
        lengths = words[begin : begin + count].astype(int)
        text = words[begin + count :].tobytes().decode("utf-16-le", errors="replace")
        if len(lengths) != count or lengths.sum() > len(text) or np.any(lengths < 0):
            continue
        ends = np.cumsum(lengths)
        found.append([text[e - n : e] for n, e in zip(lengths, ends, strict=True)])
    return found


def _object(key: str, what: str) -> str:
    return (
        f"{key} is {what} that only MATLAB reads, and was left out. A timeseries is saved for "
        f"others by: x = struct('time', {key}.Time, 'data', {key}.Data); "
        "save('log.mat', 'x', '-v7.3')."
    )
