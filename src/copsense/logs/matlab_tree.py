"""The arrays and texts of a MATLAB file, v5 or v7.3, under names such as ``out.signals.values``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from copsense.errors import LogReadError
from copsense.extras import require

_DEEPEST = 12  # structures within structures


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


def read_tree(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object]]:
    """The leaves of a MATLAB file, what cannot be read of it, and what closes the file.

    Raises:
        LogReadError: it is not a MATLAB file, or is cut short.
    """
    try:
        with path.open("rb") as file:
            head = file.read(1024)
    except OSError as error:
        raise LogReadError(f"{path} cannot be opened: {error}.") from None
    if b"\x89HDF\r\n\x1a\n" in (head[:8], head[512:520]):
        return _read_hdf5(path)
    return _read_v5(path)


def _read_v5(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object]]:
    from scipy.io import loadmat

    try:
        held = loadmat(path, struct_as_record=False, squeeze_me=False, chars_as_strings=True)
    # SciPy raises whatever it stumbles over in a damaged file.
    except Exception as error:
        raise LogReadError(
            f"{path} is not a whole MATLAB file: {type(error).__name__}: {error}. It may have been "
            "cut short; copy it again."
        ) from None
    notes: list[str] = []
    leaves: list[Leaf] = []
    for name, value in held.items():
        if not name.startswith("__"):
            leaves += _v5_leaves(name, value, notes, 0)
    return leaves, notes, held.clear


def _v5_leaves(key: str, value: Any, notes: list[str], depth: int) -> Iterator[Leaf]:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if depth > _DEEPEST:
        return
    if isinstance(value, MatlabOpaque | MatlabFunction):
        notes.append(_object(key, "an object"))
    elif hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _v5_leaves(f"{key}.{field}", getattr(value, field), notes, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "US":
        yield Leaf(key, (), None, tuple(str(text).strip() for text in value.ravel()))
    elif isinstance(value, np.ndarray) and value.dtype == object:
        parts = list(value.ravel())
        texts = [_one_text(part) for part in parts]
        if parts and all(text is not None for text in texts):
            yield Leaf(key, (), None, tuple(str(text) for text in texts))
        else:
            for i, part in enumerate(parts):
                place = key if len(parts) == 1 else f"{key}({i + 1})"
                yield from _v5_leaves(place, part, notes, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.size:

        def read(axis: int, begin: int, end: int, array: np.ndarray = value) -> np.ndarray:
            return np.asarray(np.moveaxis(array, axis, 0)[begin:end], float)

        yield Leaf(key, value.shape, read)


def _one_text(part: Any) -> str | None:
    if isinstance(part, str):
        return part
    if isinstance(part, np.ndarray) and part.dtype.kind in "US" and part.size == 1:
        return str(part.ravel()[0]).strip()
    return None


def _read_hdf5(path: Path) -> tuple[list[Leaf], list[str], Callable[[], object]]:
    require("h5py", "reading a MATLAB v7.3 file")
    import h5py

    notes: list[str] = []
    leaves: list[Leaf] = []
    try:
        file = h5py.File(path, "r")
    except (OSError, RuntimeError) as error:
        raise LogReadError(
            f"{path} is not a whole MATLAB v7.3 file: {error}. It may have been cut short; copy it "
            "again."
        ) from None
    try:
        strings = iter(_object_strings(file))
        for name in sorted(file, key=lambda n: _order(file, n)):
            if not name.startswith("#"):
                leaves += _hdf5_leaves(file, name, file[name], notes, strings, 0)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        file.close()
        raise LogReadError(f"{path} is damaged: {error}. Copy it again.") from None
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
        f"{key} is {what} that only MATLAB reads, and was left out. Where it holds data that is "
        "needed, save its numbers as arrays: x.Time, x.Data."
    )
