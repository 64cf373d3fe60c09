"""Evaluation: many configurations in, wrenches, CoPs and sensitivities out.

The compiled kernel answers what it covers; the clear path answers everything else, row by row,
into the same arrays, and so does it where the kernel finds a posture in doubt: contacts that lose
rank, a contact without load or off its plane. Without Numba the clear path answers all.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import ModuleType
from typing import Any, TypeGuard

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, whole_number
from copsense.batch.choice import choices
from copsense.batch.clear import fill_row, sole_edges
from copsense.batch.layout import layout, not_covered
from copsense.batch.result import GAINS, BatchResult, array_names, empty_result
from copsense.batch.rows import rows
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.stance import Stance
from copsense.statics import WrenchPolicy, policy_name

_CHUNK = 512  # postures whose results stay in a core's cache
_UNIT = 1e-6  # by which a quaternion may miss unit length, as in `Robot.check_configuration`


class BatchKernel:
    """A robot, its contacts and some criteria, made ready for many configurations.

    Attributes:
        stance: gives robot and contacts; its configuration does not matter.
        criteria: the criteria or laws, of distinct names.
        gains: whether CoM gain and CoM travel are computed too.
        fallback_reason: why the reference answers everything; empty where the kernel does its
            part.
    """

    def __init__(
        self, stance: Stance, criteria: Sequence[Criterion | WrenchPolicy], *, gains: bool = True
    ) -> None:
        """Check the criteria and lay the robot out.

        Raises:
            InvalidInputError: no criterion, two of one name, or weights that do not fit.
        """
        if isinstance(criteria, Criterion):
            raise InvalidInputError("criteria is a single criterion. Give a list of them.")
        self.stance, self.criteria, self.gains = stance, tuple(criteria), gains
        names = [str(c.name) if isinstance(c, Criterion) else policy_name(c) for c in criteria]
        if not names or len(set(names)) != len(names):
            raise InvalidInputError(
                f"a batch needs criteria of distinct names, got {', '.join(names) or 'none'}. "
                "Give at least one; Criterion.named(...) renames one."
            )
        self.names = tuple(names)
        self._single: Any = None
        self._nq = stance.robot.model.nq
        self._arrays = _arrays(self.empty(0))
        self._choices = choices(stance, self.criteria)
        self.fallback_reason = not_covered(stance.robot, tuple(stance.contacts))
        if not self.fallback_reason and importlib.util.find_spec("numba") is None:
            self.fallback_reason = 'Numba is not installed (pip install "copsense[fast]")'
        if not self.fallback_reason and not len(self._choices.column):
            self.fallback_reason = "no criterion is a weighted norm of torques and wrenches"
        if not self.fallback_reason:
            self._layout = layout(stance, sole_edges(stance))
            self._rows = rows(self._layout, stance.robot.model.nq)
            if not len(self._layout.feet.support):
                self.fallback_reason = "no joint moves between the contacts"

    def empty(self, count: int) -> BatchResult:
        """Arrays for the results of `count` postures, to be filled with ``out=``."""
        size = whole_number(count, "the number of postures", least=0)
        return empty_result(self.stance, self.names, size, gains=self.gains)

    def evaluate(
        self,
        configurations: ArrayLike,
        *,
        out: BatchResult | None = None,
        threads: int = 1,
    ) -> BatchResult:
        """Evaluate every criterion at every configuration; see `evaluate_batch`."""
        q = self._checked(configurations)
        threads = whole_number(threads, "threads")
        result = self.empty(len(q)) if out is None else self._fitting(out, len(q))
        doubtful = np.ones((len(q), len(self.names)), dtype=np.uint8)
        if not self.fallback_reason and len(q):
            self._run(q, result, doubtful, threads)
        reasons = {}
        for i, j in np.argwhere(doubtful):
            row, column = int(i), int(j)
            reason = fill_row(self.stance, q[row], self.criteria[column], result, row, column)
            if reason:
                reasons[row, column] = reason
        return replace(result, reasons=reasons)

    def one(self, q: np.ndarray) -> BatchResult:
        """Evaluate one configuration (nq,), for a controller's loop: nothing is allocated.

        Returns:
            One row, overwritten by the next call.

        Raises:
            InvalidInputError: a configuration that is no contiguous array of nq floats, not finite
                or not normalised.
        """
        if self._single is None:
            self._single = self._single_kernel()
        single, row = self._single, q
        if not _is_row(row, self._nq):
            row = self.stance.robot.check_configuration(row)
        if isinstance(single, BatchResult):
            result, doubtful = single, list(range(len(self.names)))
        else:
            result = single.result
            if not single.evaluate(row):
                return result
            doubtful = [int(j) for j in np.flatnonzero(single.doubtful)]
        self.stance.robot.check_configuration(row)
        reasons = {}
        for j in doubtful:
            reason = fill_row(self.stance, row, self.criteria[j], result, 0, j)
            if reason:
                reasons[0, j] = reason
        return replace(result, reasons=reasons)

    def _single_kernel(self) -> Any:
        """What `one` runs: a kernel, or for the clear path alone a row to fill."""
        empty = self.empty(1)
        if self.fallback_reason:
            return empty
        from copsense.batch.single import Single

        return Single(self._layout, self._choices, self._rows, empty, nq=self._nq, gains=self.gains)

    def _run(self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray, threads: int) -> None:
        kernel, lanes = _kernel()
        out = kernel.Out(
            **{n: _flat(a) for n, a in _arrays(result).items() if n != "com"},
            com=result.com,
            doubtful=doubtful,
        )
        blocks = -(-len(q) // _CHUNK)

        def run(share: int) -> None:
            W = lanes.workspace(self._rows.size)
            for block in range(share, blocks, threads):
                start, stop = block * _CHUNK, min((block + 1) * _CHUNK, len(q))
                kernel.run(
                    *self._layout.parts,
                    self._choices,
                    self._rows,
                    q,
                    out,
                    W,
                    start,
                    stop,
                    lanes.WIDTH,
                )

        if threads == 1:
            run(0)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(run, range(threads)))

    def _checked(self, configurations: ArrayLike) -> Float[np.ndarray, "N nq"]:
        robot = self.stance.robot
        nq = robot.model.nq
        what = f"the configurations of robot {robot.name!r}"
        q = configurations
        if not (_is_plain(q) and q.shape[1] == nq and np.isfinite(q).all()):
            q = finite_array(configurations, what, (None, nq), "one configuration in each row")
        # An array that differs in any of these would have the kernel compiled anew.
        q = np.require(q, np.float64, ["C", "A", "W", "E"])
        if robot.base_nv == 6:
            length = np.einsum("ij,ij->i", q[:, 3:7], q[:, 3:7])
            bad = np.flatnonzero(np.abs(length - 1.0) > _UNIT)
            # Whoever is refused here is refused by the robot itself, which words it.
            for row in bad:
                try:
                    robot.check_configuration(q[row])
                except InvalidInputError as error:
                    raise InvalidInputError(f"row {row}: {error}") from None
        return q

    def _fitting(self, out: BatchResult, count: int) -> BatchResult:
        if not isinstance(out, BatchResult):
            raise InvalidInputError(
                f"out is of type {type(out).__name__}. Make it with BatchKernel.empty({count})."
            )
        for name, array in _arrays(out).items():
            first = 0 if name in GAINS and not self.gains else count
            shape = (first, *self._arrays[name].shape[1:])
            wanted = self._arrays[name].dtype
            fits = array.shape == shape and array.dtype == wanted
            if not (fits and array.flags.carray):
                raise InvalidInputError(
                    f"out.{name} is {array.dtype} of shape {array.shape}, or not contiguous and "
                    f"writeable; the batch needs {wanted} of shape {shape}. Make it with "
                    f"BatchKernel.empty({count})."
                )
        if out.criteria != self.names:
            raise InvalidInputError(
                f"out holds the criteria {', '.join(out.criteria)}, the batch "
                f"{', '.join(self.names)}. Make it with BatchKernel.empty({count})."
            )
        return out


def evaluate_batch(
    stance: Stance,
    configurations: ArrayLike,
    criteria: Sequence[Criterion | WrenchPolicy],
    *,
    gains: bool = True,
    out: BatchResult | None = None,
    threads: int = 1,
) -> BatchResult:
    """Equilibria and sensitivities of many postures.

    Args:
        stance: gives robot and contacts; its own configuration does not matter.
        configurations: one in each row (N, nq).
        criteria: criteria of distinct names, or laws q -> wrenches.
        gains: compute CoM gain and CoM travel too.
        out: results of the same shape to overwrite, so that nothing is allocated.
        threads: threads that share the postures; the results do not depend on it.

    Returns:
        Results equal to `cop_sensitivity`'s of every row. A row that it would refuse is NaN and
        has its reason in `BatchResult.reasons`.

    Raises:
        InvalidInputError: configurations of the wrong shape, not finite or not normalised;
            criteria that do not fit; `out` of another shape.
    """
    batch = BatchKernel(stance, criteria, gains=gains)
    return batch.evaluate(configurations, out=out, threads=threads)


def _kernel() -> tuple[ModuleType, ModuleType]:
    from copsense.batch import kernel, lanes

    return kernel, lanes


def _arrays(result: BatchResult) -> dict[str, np.ndarray]:
    return {name: getattr(result, name) for name in array_names()}


def _flat(array: np.ndarray) -> np.ndarray:
    """The same memory with one axis after posture and criterion (-1 fails on empty arrays)."""
    return array.reshape(*array.shape[:2], math.prod(array.shape[2:]))


def _is_row(value: object, nq: int) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype == np.float64
        and value.shape == (nq,)
        and value.flags.c_contiguous
    )


def _is_plain(value: object) -> TypeGuard[np.ndarray]:
    return isinstance(value, np.ndarray) and value.dtype == np.float64 and value.ndim == 2
