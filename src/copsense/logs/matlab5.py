"""The arrays and texts of a MATLAB v5 file, as a program that `apart.read_apart` runs.

SciPy's reader is compiled, and ends the interpreter over some damaged files.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

_DEEPEST = 12  # structures within structures


def main() -> None:
    """Write arrays and lists of texts by their places, and the places of objects."""
    from scipy.io import loadmat

    held = loadmat(sys.argv[1], struct_as_record=False, squeeze_me=False, chars_as_strings=True)
    objects: list[str] = []
    found: dict[str, np.ndarray] = {}
    for name, value in held.items():
        if not name.startswith("__"):
            found |= dict(_leaves(name, value, objects, 0))
    # A variable of the file may have the name of an argument.
    held = {f"={key}": value for key, value in found.items()}
    held["objects"] = np.array(objects, dtype=str)
    np.savez(sys.stdout.buffer, **held)


def _leaves(key: str, value: Any, objects: list[str], depth: int) -> Iterator[tuple[str, Any]]:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if depth > _DEEPEST:
        return
    if isinstance(value, MatlabOpaque | MatlabFunction):
        objects.append(key)
    elif hasattr(value, "_fieldnames"):
        for field in value._fieldnames:
            yield from _leaves(f"{key}.{field}", getattr(value, field), objects, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "US":
        yield key, np.array([str(text).strip() for text in value.ravel()], dtype=str)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        parts = list(value.ravel())
        texts = [_one_text(part) for part in parts]
        if parts and all(text is not None for text in texts):
            yield key, np.array(texts, dtype=str)
        else:
            for i, part in enumerate(parts):
                place = key if len(parts) == 1 else f"{key}({i + 1})"
                yield from _leaves(place, part, objects, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.size:
        yield key, value


def _one_text(part: Any) -> str | None:
    if isinstance(part, str):
        return part
    if isinstance(part, np.ndarray) and part.dtype.kind in "US" and part.size == 1:
        return str(part.ravel()[0]).strip()
    return None


if __name__ == "__main__":
    main()
