"""Apart: readers that end the interpreter over some damaged files, in a process of their own.

A module that is run so is a program: it writes the arrays it read to its standard output, as
`numpy.savez` does, and imports nothing of copsense, whose imports would take longer than the file.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from copsense.errors import LogReadError

_PATIENCE = 60.0  # s, and
_SLOWEST = 2e6  # bytes/s more: a damaged count makes a reader go on for minutes
_LARGEST = 1_000_000_000  # bytes of a file that is read whole, several times over in memory


def read_apart(module: str, path: Path, what: str, instead: str) -> dict[str, np.ndarray]:
    """The arrays that a module, run as a program, reads from a file.

    Args:
        module: its name in this package.
        path: of the file.
        what: it should be, such as ``"C3D file"``.
        instead: what to do with a file that is too large to be read whole, a sentence.

    Raises:
        LogReadError: it ended with an error, crashed, or did not end, or the file is too large.
    """
    size = path.stat().st_size
    if size > _LARGEST:
        raise LogReadError(
            f"{path} is {size / 1e9:.2f} GB: a {what} is read whole, and the most is "
            f"{_LARGEST / 1e9:g} GB. {instead}"
        )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    program = Path(__file__).with_name(f"{module}.py")
    command = [sys.executable, "-P", str(program), str(path.absolute())]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            env=environment,
            timeout=_PATIENCE + size / _SLOWEST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise LogReadError(f"{path} is damaged: reading it does not end. Copy it again.") from None
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        why = said[-1].rstrip(".") if said and done.returncode > 0 else "its reader crashed"
        raise LogReadError(
            f"{path} is not a whole {what}: {why}. It may have been cut short; copy it again."
        )
    with np.load(io.BytesIO(done.stdout)) as held:
        return dict(held)
