"""Files: outputs, written whole or not at all; TOML and tables of configurations read in."""

from __future__ import annotations

import os
import tempfile
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from copsense.arrays import check_type, finite_array
from copsense.errors import CopsenseError, InvalidInputError, OutputError


def check_output(
    path: str | Path, *, suffixes: tuple[str, ...], overwrite: bool, option: str = "--force"
) -> Path:
    """A path that can be written, checked before the work starts.

    Args:
        path: where to write.
        suffixes: the suffixes that the writer knows; empty for any.
        overwrite: whether an existing file may be replaced.
        option: of the shell that lets it be replaced.

    Raises:
        InvalidInputError: another suffix.
        OutputError: the file exists and may not be overwritten, or its folder cannot be written.
    """
    path = checked_path(path, "an output")
    if "\0" in str(path):
        raise OutputError(f"{str(path)!r} is not a path. Leave the null character out.")
    if suffixes and path.suffix not in suffixes:
        raise InvalidInputError(
            f"the output {path.name!r} has no known suffix. Choose {' or '.join(suffixes)}."
        )
    if _holds(path.is_dir):
        raise OutputError(f"{path} is a folder. Give the path of a file.")
    if _holds(path.exists) and not overwrite:
        raise OutputError(
            f"{path} exists already. Give another path, or {option} (overwrite=True)."
        )
    folder = path.parent
    if not _holds(folder.is_dir):
        raise OutputError(f"there is no folder {folder} to write {path.name} in. Create it first.")
    # Permission bits mislead (for root, on /proc, on a full disk): try.
    _temporary(path).unlink()
    return path


def write_beside(path: Path, write: Callable[[Path], object]) -> None:
    """Write to a temporary file beside a path, then rename it: the file is whole or not there.

    Args:
        path: where the file shall be.
        write: called with the path of the temporary file.

    Raises:
        OutputError: the file cannot be written; what stood there before is unchanged.
    """
    temporary = _temporary(path)
    try:
        write(temporary)
        # mkstemp makes a private file; a result has the usual permissions.
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


def checked_path(path: object, what: str) -> Path:
    """A path as such.

    Raises:
        InvalidInputError: it is something else.
    """
    check_type(path, (str, os.PathLike), f"a path of {what}", "Give a text or a pathlib.Path.")
    return Path(cast("str | os.PathLike[str]", path))


def file_at(path: str | Path) -> bool:
    """Whether there is a file at a path; false for a name that no file can have."""
    return _holds(Path(path).is_file)


def read_toml(
    path: str | Path, what: str, remedy: str, error: type[CopsenseError] = InvalidInputError
) -> dict[str, Any]:
    """The tables of a TOML file, with or without a byte-order mark.

    Args:
        path: of the file.
        what: how a message calls it, such as ``"plan"``.
        remedy: a sentence that says what to give where there is no such file.
        error: what is raised.

    Raises:
        CopsenseError: of the kind asked for: no such file, or it is not TOML.
    """
    path = checked_path(path, f"a {what}")
    if not file_at(path):
        raise error(f"no {what} at {str(path)[:300]!r}. {remedy}")
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as reason:
        raise error(f"the {what} {path} cannot be read: {reason.strerror}. {remedy}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as reason:
        raise error(f"the {what} {path} is not valid TOML: {reason}. Correct the file.") from None


def load_configurations(path: str | Path) -> Float[np.ndarray, "N nq"]:
    """Configurations from a ``.npy`` array or a ``.csv`` of numbers, one row each.

    Returns:
        Base position, quaternion (x, y, z, w) and joints, as Pinocchio orders them.

    Raises:
        InvalidInputError: there is no such file, or it is not a table of numbers.
    """
    path = Path(path)
    need = "Give .npy, or .csv without a heading, with nq numbers a row"
    if not file_at(path):
        raise InvalidInputError(f"no file of configurations at {str(path)[:300]!r}. {need}.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty file is rejected below
            npy = path.suffix == ".npy"
            rows = np.load(path) if npy else np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError, EOFError) as error:
        raise InvalidInputError(
            f"{path} is not a table of configurations: {str(error).rstrip('.')}. {need}."
        ) from None
    if not isinstance(rows, np.ndarray) or not rows.size:
        raise InvalidInputError(f"{path} holds no table of configurations. {need}.")
    return finite_array(rows, str(path), (None, None), "nq numbers a row")


def _temporary(path: Path) -> Path:
    """A new empty file beside a path.

    Raises:
        OutputError: the folder does not take one, or the path's own name is not possible.
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


def _holds(test: Callable[[], bool]) -> bool:
    """The answer of a test of a path; false where the operating system rejects the name."""
    try:
        return test()
    except OSError:
        return False
