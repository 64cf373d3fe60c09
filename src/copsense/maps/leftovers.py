"""Leftovers: what a killed process left of files it was writing, removed once no one holds it.

Every process holds the folder that it writes into, by a lock of the operating system that ends
with the process. What lies there unfinished while no process holds the folder was left by one that
was killed. Where there are no such locks (on Windows, on some network file systems) no one
knows, and everything stays.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]

_PARTIAL = re.compile(r"\.[0-9a-f]{32}\.partial$")  # as Zarr names what it is about to rename


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold a folder beside others that hold it; waits while its leftovers are removed."""
    with _opened(folder) as handle:
        if handle is not None:
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_SH)
        yield


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A new folder beside a path, held, and removed in the end unless it was renamed.

    Raises:
        OSError: none can be made.
    """
    while True:
        made = Path(tempfile.mkdtemp(dir=path.parent, prefix=_prefix(path), suffix=path.suffix))
        with held(made):
            if not made.exists():  # taken for a leftover before it was held
                continue
            try:
                yield made
            finally:
                shutil.rmtree(made, ignore_errors=True)
            return


def remove_folders(path: Path) -> None:
    """Remove new folders beside a path that no process holds any more."""
    for folder in path.parent.glob(f"{_prefix(path)}*{path.suffix}"):
        with _alone(folder) as alone:
            if alone:
                shutil.rmtree(folder, ignore_errors=True)


def remove_partial_files(folder: Path) -> None:
    """Remove files below a folder that were never written to their end, if no process holds it."""
    with _alone(folder) as alone:
        for place, _, names in os.walk(folder) if alone else ():
            for name in names:
                if _PARTIAL.search(name):
                    with suppress(OSError):
                        (Path(place) / name).unlink()


def _prefix(path: Path) -> str:
    return f".copsense-{hashlib.sha256(path.name.encode(errors='replace')).hexdigest()[:8]}-"


@contextmanager
def _alone(folder: Path) -> Iterator[bool]:
    """Whether no one else holds a folder, nor can until the end; false where that is unknown."""
    with _opened(folder) as handle:
        alone = handle is not None
        try:
            if handle is not None:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            alone = False
        yield alone


@contextmanager
def _opened(folder: Path) -> Iterator[int | None]:
    """The folder as one that can be locked; None where it cannot be."""
    try:
        handle = None if fcntl is None else os.open(folder, os.O_RDONLY)
    except OSError:
        handle = None
    try:
        yield handle
    finally:
        if handle is not None:
            os.close(handle)
