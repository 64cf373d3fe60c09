"""Compiled limits: the limited kernel's machine code, and the arrays that it reads and fills."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from copsense.batch.layout import RobotLayout
from copsense.batch.machine_code import HoldsMachineCode
from copsense.batch.statics.batch_result import BatchResult
from copsense.batch.statics.criteria import KernelCriteria
from copsense.batch.statics.kernel_limits import KernelLimits
from copsense.batch.statics.limit_offsets import limit_offsets
from copsense.batch.statics.limit_result import LimitResult, limit_arrays
from copsense.batch.workspace import WIDTH, workspace, workspace_offsets


class CompiledLimits(HoldsMachineCode):
    """The limited kernel of a robot, its contacts, some criteria and limits.

    It is compiled when first called, and only where limits are asked for.
    """

    def __init__(
        self, layout: RobotLayout, criteria: KernelCriteria, limits: KernelLimits, nq: int
    ) -> None:
        """Lay out the memory."""
        offset = workspace_offsets(layout, nq)
        self._offset = limit_offsets(layout, offset)
        self._given = (*layout.parts, criteria, limits, np.array(offset), np.array(self._offset))
        self._layout, self._limits, self._nq = layout, limits, nq
        self._criteria = len(criteria.kind)
        self._code: Callable[..., bool] | None = None

    @property
    def compiled(self) -> bool:
        """Whether the machine code is in this process or on disk."""
        from copsense.batch.compiler import is_compiled
        from copsense.batch.statics.limited_kernel import limit_postures

        return self._code is not None or is_compiled(limit_postures)

    def workspace(self, block: int) -> tuple[Any, ...]:
        """Memory for one thread that takes so many postures at a time."""
        from copsense.batch.statics.active_set import programs
        from copsense.batch.statics.limited_kernel import Pack

        feet = self._layout.feet
        m = feet.unknowns + 1
        pack = Pack(
            np.zeros(block, dtype=np.int64),
            np.zeros((block, self._criteria), dtype=np.uint8),
            np.zeros((WIDTH, self._nq)),
            np.zeros((WIDTH, 2 * (len(self._layout.tree.parent) + 5))),
            np.zeros(WIDTH, dtype=np.int64),
            np.zeros((WIDTH, m), dtype=np.int64),
            np.zeros((WIDTH, m)),
            np.zeros((WIDTH, m, m)),
            np.zeros((WIDTH, m, m)),
            np.zeros(WIDTH),
        )
        memory = programs(self._limits, len(feet.body), len(feet.support), feet.unknowns)
        return workspace(self._offset.size), memory, pack

    def filling(
        self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray, motions: np.ndarray
    ) -> Callable[..., bool]:
        """A function of a workspace (its three parts), a first row and an end.

        It puts these rows, filled by the kernel without limits, within the limits, and returns
        whether any of them is doubtful.

        Args:
            q: configurations (N, nq), contiguous.
            result: of N rows.
            doubtful: above zero where the reference must answer (N, nk).
            motions: of each block, as the kernel without limits left them; `NO_MOTIONS` has them
                computed once more.
        """
        from copsense.batch.compiler import bound
        from copsense.batch.statics.compiled_kernel import out_arrays
        from copsense.batch.statics.limit_outputs import LimitOut
        from copsense.batch.statics.limited_kernel import limit_postures

        assert isinstance(result.limits, LimitResult)
        out = out_arrays(result, doubtful, motions)
        arguments = (*self._given, q, out, LimitOut(**limit_arrays(result.limits)))
        if self._code is None:
            given = (*arguments, *self.workspace(1), 0, 0)
            self._code = bound(limit_postures, given, "the statics of many postures within limits")
        return partial(self._code, *arguments)
