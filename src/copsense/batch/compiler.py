"""Compiler: how the functions of a kernel become machine code, and how they are called.

Kernels take a hundred arrays. Numba would read the type of each at every call, take it from Python
with an allocation, and count its owners: longer than the statics of a posture. So nothing here
owns an array (the caller keeps them alive), and `bound` looks the machine code up once.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import config, njit, typeof, types
from numba.core import cgutils
from numba.extending import intrinsic

from copsense.batch.machine_code import COMPILING_TAKES
from copsense.path import COM_COORDINATES
from copsense.polygon import ON_EDGE
from copsense.posture import TOLERANCE
from copsense.sensitivity import HELD, STILL
from copsense.stance import AT_LIMIT, RANK_TOLERANCE

_Function = TypeVar("_Function", bound=Callable[..., Any])
# Without a configuration of logging this goes to standard error: no one waits in silence.
_LOG = logging.getLogger(__name__)

# Numba would look at a function's own file alone, and call an older version of a function from
# another one: machine code is of use while neither the text of the kernels nor what they take from
# the reference changes.
SHARED = {
    "AT_LIMIT": AT_LIMIT,
    "COM_COORDINATES": COM_COORDINATES,
    "HELD": HELD,
    "ON_EDGE": ON_EDGE,
    "RANK_TOLERANCE": RANK_TOLERANCE,
    "STILL": STILL,
    "TOLERANCE": TOLERANCE,
}
_STAMP = hashlib.sha256(
    b"".join(file.read_bytes() for file in sorted(Path(__file__).parent.rglob("*.py")))
    + repr(SHARED).encode()
).hexdigest()


def compiled(function: _Function) -> _Function:
    """Part of a kernel: called from compiled code alone."""
    return _jit(function, no_cpython_wrapper=True)


def inlined(function: _Function) -> _Function:
    """The same, repeated where it is called: handing it the robot costs more than what it does."""
    return _jit(function, no_cpython_wrapper=True, forceinline=True)


def entry(function: _Function) -> _Function:
    """A kernel that Python calls; see `bound`."""
    return _jit(function)


def bound(kernel: Any, arguments: tuple[Any, ...], what: str) -> Callable[..., Any]:
    """A kernel's machine code for arguments of these types, compiled or read from disk.

    Arguments of other types than these must not be given to it. Compiling takes seconds, and is
    logged.

    Args:
        kernel: an `entry`.
        arguments: as it will get them.
        what: the kernel in words.
    """
    new = not is_compiled(kernel)
    if new:
        _LOG.warning("compiling %s, once on a machine; it takes %s", what, COMPILING_TAKES)
    start = time.monotonic()
    found: Callable[..., Any] = kernel.compile(tuple(typeof(a) for a in arguments))
    if new:
        _LOG.warning("compiled %s in %.0f s", what, time.monotonic() - start)
    return found


def from_array(kind: Any) -> Any:
    """A function for compiled code: an array of whole numbers as a named tuple of this kind.

    Sixty numbers take Python half a microsecond to hand over one by one, and an array no time.
    """
    size = len(kind._fields)

    def unpack(typing: Any, array: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            data = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0]).data
            entries = [builder.load(cgutils.gep(builder, data, i)) for i in range(size)]
            return context.make_tuple(builder, sig.return_type, entries)

        return types.NamedUniTuple(array.dtype, size, kind)(array), generate

    return intrinsic(unpack)


def is_compiled(kernel: Any) -> bool:
    """Whether a kernel's machine code is in this process or on disk."""
    if kernel.signatures:
        return True
    try:
        return bool(kernel._cache._cache_file._load_index())
    except (AttributeError, OSError):  # nowhere to keep it
        return False


def kept(jit: Callable[..., Any], function: Callable[..., Any], **options: Any) -> Any:
    """Have a function compiled on first use, its machine code kept on disk where there is a place.

    Args:
        jit: Numba's decorator for the processor or for a device.
        function: Python.
        options: of the decorator.
    """
    plain = inspect.unwrap(function)  # a checker of shapes may have wrapped it
    try:
        dispatcher = jit(cache=True, **options)(plain)
        file = dispatcher._cache._cache_file
        if not hasattr(file, "_source_stamp"):  # or older machine code would be called
            raise AttributeError("no _source_stamp")
        file._source_stamp = _STAMP
    except (RuntimeError, AttributeError) as error:
        if not (config.ENABLE_CUDASIM or config.DISABLE_JIT):  # there nothing is compiled
            _warn_not_kept(
                f"Numba {numba.__version__} keeps it otherwise than copsense knows; install another"
                if isinstance(error, AttributeError)
                else "there is no folder for it; set NUMBA_CACHE_DIR to one that can be written"
            )
        dispatcher = jit(**options)(plain)
    return dispatcher


@lru_cache  # there are two hundred functions
def _warn_not_kept(why: str) -> None:
    _LOG.warning("machine code is not kept on disk, so every process compiles it again: %s", why)


def _jit(function: _Function, **more: Any) -> _Function:
    """Compile for the processor, and let other threads run meanwhile."""
    options: dict[str, Any] = {
        "nogil": True,
        "fastmath": {"contract"},  # a * b + c in one instruction; nothing is reordered
        "error_model": "numpy",
        "no_cfunc_wrapper": True,
        "_nrt": False,  # no owners are counted, and nothing is allocated
        **more,
    }
    return kept(njit, function, **options)
