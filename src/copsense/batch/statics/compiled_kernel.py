"""Compiled kernel: the machine code, and the arrays that it reads and fills as it takes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from copsense.batch.layout import RobotLayout
from copsense.batch.machine_code import HoldsMachineCode
from copsense.batch.statics.batch_result import BatchResult, arrays_of
from copsense.batch.statics.criteria import KernelCriteria
from copsense.batch.workspace import workspace, workspace_offsets


class CompiledKernel(HoldsMachineCode):
    """The kernel for a robot, its contacts and some criteria; compiled when first called."""

    _of_this_process = ("_code", "_device")

    def __init__(self, layout: RobotLayout, criteria: KernelCriteria, nq: int) -> None:
        """Lay out the memory."""
        self._offset = workspace_offsets(layout, nq)
        self._given = (*layout.parts, criteria, np.array(self._offset))
        self._code: Callable[..., bool] | None = None
        self._device: Any = None

    @property
    def compiled(self) -> bool:
        """Whether the machine code is in this process or on disk."""
        from copsense.batch.compiler import is_compiled
        from copsense.batch.statics.kernel import evaluate_postures

        return self._code is not None or is_compiled(evaluate_postures)

    def workspace(self) -> np.ndarray:
        """Memory for one thread."""
        return workspace(self._offset.size)

    def filling(
        self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray, motions: np.ndarray
    ) -> Callable[[np.ndarray, int, int], bool]:
        """A function of a workspace, a first row and an end, that fills these rows.

        It returns whether any of them is doubtful for a criterion that the kernel serves.

        Args:
            q: configurations (N, nq), contiguous.
            result: of N rows.
            doubtful: set above zero where the reference must answer (N, nk).
            motions: to be filled for the limits, as of `kernel.Out`; `NO_MOTIONS` without limits.
        """
        from copsense.batch.compiler import bound
        from copsense.batch.statics.kernel import evaluate_postures

        arguments = (*self._given, q, out_arrays(result, doubtful, motions))
        if self._code is None:
            given = (*arguments, self.workspace(), 0, 0)
            self._code = bound(evaluate_postures, given, "the statics of many postures")
        return partial(self._code, *arguments)

    def on_device(self, empty: Callable[[int], BatchResult]) -> Any:
        """The same as a `DeviceKernel`, made when first asked for; `empty` makes results."""
        from copsense.batch.statics.device_kernel import DeviceKernel

        self._device = self._device or DeviceKernel(self._given[:-1], self._offset, empty)
        return self._device


NO_MOTIONS = np.zeros((0, 0))


def out_arrays(result: BatchResult, doubtful: np.ndarray, motions: np.ndarray = NO_MOTIONS) -> Any:
    """A result's arrays as `kernel.Out`, the form in which kernels fill them."""
    from copsense.batch.statics.kernel import Out

    arrays: dict[str, Any] = {n: a if n == "com" else flat(a) for n, a in arrays_of(result).items()}
    return Out(**arrays, doubtful=doubtful, motions=motions)


def flat(array: np.ndarray) -> np.ndarray:
    """The same memory with one axis after posture and criterion (-1 fails on empty arrays)."""
    return array.reshape(*array.shape[:2], math.prod(array.shape[2:]))
