"""Device kernel: the kernel on a graphics processor, postures sent there and results fetched."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from numba import cuda

from copsense.batch.compiler import is_compiled, kept
from copsense.batch.device import SIMULATED, device_name, for_device, itself
from copsense.batch.devices import compiling
from copsense.batch.statics import kernel
from copsense.batch.statics.batch_result import BatchResult
from copsense.batch.statics.compiled_kernel import out_arrays
from copsense.batch.workspace import Offsets
from copsense.errors import InvalidInputError

_ABREAST = 32768  # postures in flight at most: more than the registers of any device hold
_BLOCK = 32  # threads that are started together: small batches reach more of a device
_SHARE = 0.5  # of the device's free memory that is taken
_LOG = logging.getLogger(__name__)

_evaluate = for_device(kernel.evaluate_postures, {kernel._offsets: itself})


def _one_each(
    tree: Any, feet: Any, criteria: Any, offset: Any, q: Any, out: Any, W: Any, count: int
) -> None:
    """Each thread fills the results of one posture in its own column of the workspace."""
    row = cuda.grid(1)
    if row < count:
        _evaluate(tree, feet, criteria, offset, q, out, W[:, row], row, row + 1)


def _clear(W: Any) -> None:
    """What a kernel does not write it takes for zero: each thread clears a column."""
    column = cuda.grid(1)
    for row in range(W.shape[0]):
        W[row, column] = 0.0


_kernel, _clearing = kept(cuda.jit, _one_each), kept(cuda.jit, _clear)


class DeviceKernel:
    """The kernel for a robot, its contacts and some criteria, on a device that is there."""

    def __init__(
        self, parts: tuple[Any, ...], offset: Offsets, empty: Callable[[int], BatchResult]
    ) -> None:
        """Send the robot to the device.

        Args:
            parts: robot, contacts and criteria, as the kernel takes them.
            offset: how a workspace is laid out.
            empty: makes results of so many postures, to be filled.

        Raises:
            InvalidInputError: the device's memory is too small.
        """
        self._given = *map(_sent, parts), offset
        self._rows, self._empty, self._lock = offset.size, empty, Lock()
        self._memory: tuple[Any, ...] = ()
        each = 8 * self._rows + empty(1).nbytes
        free = cuda.current_context().get_memory_info().free
        self._abreast = int(min(_ABREAST, _SHARE * free / each)) // _BLOCK * _BLOCK
        if not self._abreast:
            raise InvalidInputError(
                f"{device_name()} has {free / 1e6:.0f} MB of memory free, and {_BLOCK} postures "
                f"need {_BLOCK * each / _SHARE / 1e6:.0f}. Free some, or leave device out."
            )

    def fill(self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray) -> None:
        """Fill the results of all postures.

        Args:
            q: configurations (N, nq), contiguous.
            result: of N rows.
            doubtful: set above zero where the reference must answer (N, nk).
        """
        host = out_arrays(result, doubtful)
        with self._lock:
            for first in range(0, len(q), self._abreast):
                stop = min(first + self._abreast, len(q))
                self._evaluate(q[first:stop])
                for there, here in zip(self._memory[1], host, strict=True):
                    if len(here):
                        there[: stop - first].copy_to_host(here[first:stop])

    def _evaluate(self, q: np.ndarray) -> None:
        """Results of some postures, left on the device."""
        count = len(q)
        if not self._memory or count > len(self._memory[0]):
            self._allocate(-(-count // _BLOCK) * _BLOCK, q.shape[1])
        configurations, out, W = self._memory
        configurations[:count].copy_to_device(q)
        new = not SIMULATED and not is_compiled(_kernel)
        if new:
            _LOG.warning("compiling the statics of many postures for %s", device_name())
        began = time.monotonic()
        with compiling():
            _kernel[-(-count // _BLOCK), _BLOCK](*self._given, configurations, out, W, count)
        if new:
            _LOG.warning("compiled it in %.0f s", time.monotonic() - began)

    def _allocate(self, postures: int, nq: int) -> None:
        """Memory on the device; columns of criteria that the kernel leaves out stay as they are."""
        self._memory = ()  # the old goes before the new comes
        result = self._empty(postures)
        doubtful = np.ones((postures, len(result.criteria)), dtype=np.uint8)
        self._memory = (
            cuda.device_array((postures, nq)),
            _sent(out_arrays(result, doubtful)),
            cuda.device_array((self._rows, postures)),
        )
        with compiling():
            _clearing[postures // _BLOCK, _BLOCK](self._memory[2])


def _sent(parts: Any) -> Any:
    """A named tuple with its arrays on the device."""
    return type(parts)(*(cuda.to_device(p) if isinstance(p, np.ndarray) else p for p in parts))
