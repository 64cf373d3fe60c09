"""Device: a kernel's own functions compiled for a graphics processor, one thread a posture.

Nothing is written twice. A kernel says all it does through the functions of `lanes` and `transfer`;
here those few stand for a single number, and `for_device` has the kernel's own text compiled once
more with these in their place. A workspace stays (rows, postures abreast), a column for each
thread: neighbours read neighbouring numbers.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import config, cuda

from copsense.batch import lanes, transfer

SIMULATED = bool(config.ENABLE_CUDASIM)  # every thread in Python, on the processor


def device_name() -> str:
    """The device's name."""
    if SIMULATED:
        return "a simulated device (NUMBA_ENABLE_CUDASIM)"
    name = cuda.get_current_device().name
    return name.decode() if isinstance(name, bytes) else str(name)


def why_absent() -> str:
    """Why there is no device that code can be compiled for; empty where there is."""
    if cuda.is_available():
        return ""
    found = cuda.cuda_error()
    return " ".join(str(found).split()) if found else "CUDA's compiler is not installed"


def load(W: Any, row: int) -> float:
    """`lanes.load`."""
    return W[row]


def store(W: Any, row: int, value: float) -> None:
    """`lanes.store`."""
    W[row] = value


def splat(number: float) -> float:
    """`lanes.splat`."""
    return float(number)


def where_less(a: float, b: float, then: float, otherwise: float) -> float:
    """`lanes.where_less`."""
    return then if a < b else otherwise


def any_less(a: float, b: float) -> bool:
    """`lanes.any_less`, of one posture."""
    return a < b


def get(W: Any, row: int, lane: int) -> float:
    """`lanes.get`: there is one lane."""
    return W[row]


def put(W: Any, row: int, lane: int, number: float) -> None:
    """`lanes.put`."""
    W[row] = number


def root(x: float) -> float:
    """`lanes.root`."""
    return math.sqrt(x)


def floor(x: float) -> float:
    """`lanes.floor`."""
    return float(math.floor(x))


def magnitude(x: float) -> float:
    """`lanes.magnitude`."""
    return abs(x)


def read_postures(W: Any, row: int, values: Any, first: int, count: int) -> None:
    """`transfer.read_postures`."""
    for i in range(values.shape[1]):
        W[row + i] = values[first, i]


def write_postures(W: Any, row: int, values: Any, first: int, count: int, column: int) -> None:
    """`transfer.write_postures`."""
    for i in range(values.shape[2]):
        values[first, column, i] = W[row + i]


def itself(offsets: Any) -> Any:
    """A function of `compiler.from_array`: a device takes the named tuple as it is."""
    return offsets


_LANES = (load, store, splat, where_less, any_less, get, put, root, floor, magnitude)
_TRANSFER = (read_postures, write_postures)
_FORMS: dict[Any, Callable[..., Any]] = {
    **{getattr(lanes, form.__name__): form for form in _LANES},
    **{getattr(transfer, form.__name__): form for form in _TRANSFER},
}


def for_device(function: Any, forms: dict[Any, Callable[..., Any]]) -> Any:
    """A kernel's function as one of the device, with all that it calls.

    Args:
        function: compiled for the processor.
        forms: functions that generate their own instructions, and what stands for them here.

    Raises:
        NotImplementedError: it calls one for which nothing stands.
    """
    return _translated(function, _FORMS | forms, {})


def _translated(function: Any, forms: dict[Any, Callable[..., Any]], done: dict[Any, Any]) -> Any:
    if function not in done:
        source = forms.get(function) or getattr(function, "py_func", None)
        if source is None:
            raise NotImplementedError(f"{function!r} has no form for a device; see {__name__}")
        source = inspect.unwrap(source)  # a checker of shapes may have wrapped it
        given = source.__globals__
        names: dict[str, Any] = {"__builtins__": __builtins__}
        for name in source.__code__.co_names:
            value = given.get(name)
            if hasattr(value, "py_func") or type(value).__name__ == "_Intrinsic":
                names[name] = _translated(value, forms, done)
            elif name in given:
                names[name] = 1 if name == "WIDTH" else value
        copy = FunctionType(source.__code__, names, source.__name__, source.__defaults__)
        done[function] = cuda.jit(device=True)(copy)
    return done[function]
