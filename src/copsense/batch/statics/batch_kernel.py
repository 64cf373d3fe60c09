"""Batch kernel: many configurations in, wrenches, CoPs and sensitivities out.

The compiled kernel answers what it covers. The reference, one posture at a time, answers everything
else into the same arrays: criteria and robots that the kernel does not cover, and postures that it
marks as doubtful, where contacts lose rank, carry no load or are off their planes. Without Numba
the reference answers all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeGuard

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array, whole_number
from copsense.batch.blocks import fill_blocks
from copsense.batch.devices import is_on_device
from copsense.batch.layout import robot_layout, why_not_covered
from copsense.batch.machine_code import HoldsMachineCode
from copsense.batch.statics.batch_result import (
    BatchResult,
    arrays_of,
    check_out,
    clear_unanswered,
    empty_result,
    set_reasons,
)
from copsense.batch.statics.compiled_kernel import NO_MOTIONS, CompiledKernel
from copsense.batch.statics.compiled_limits import CompiledLimits
from copsense.batch.statics.criteria import kernel_criteria
from copsense.batch.statics.kernel_limits import kernel_limits
from copsense.batch.statics.limit_result import (
    LimitResult,
    empty_limits,
    limit_template,
)
from copsense.batch.statics.reference import fill_row, sides, sole_edges
from copsense.content import FrozenMapping
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.limits import Limits, optional_limits
from copsense.stance import Stance, check_stance
from copsense.statics import WrenchPolicy, named_criteria

_CHUNK = 512  # postures whose results stay in a core's cache
_SAME_COM = 1e-9  # m, by which two ways to compute it may differ
_UNIT = 1e-6  # by which a quaternion may miss unit length, as in `Robot.check_configuration`


class BatchKernel(HoldsMachineCode):
    """A robot, its contacts and some criteria, made ready for many configurations.

    Attributes:
        stance: gives robot and contacts; its configuration does not matter.
        criteria: the criteria or policies, of distinct names.
        names: of the criteria.
        limits: what wrenches and torques must respect; None for nothing.
        gains: whether CoM gain, tipping edge and CoM travels are computed too.
        fallback_reason: why the reference answers everything; empty where the kernel does its
            part.
        by_reference: criterion -> why the reference answers it where the kernel does its part.
    """

    _of_this_process = ("_single",)
    stance: Stance
    criteria: tuple[Criterion | WrenchPolicy, ...]
    names: tuple[str, ...]
    limits: Limits | None
    gains: bool
    fallback_reason: str
    by_reference: Mapping[str, str]

    def __repr__(self) -> str:
        """Robot and criteria, and whether the kernel serves them."""
        how = f"; one at a time: {self.fallback_reason}" if self.fallback_reason else ""
        return f"BatchKernel({self.stance.robot.name!r}; criteria {', '.join(self.names)}{how})"

    def __init__(
        self,
        stance: Stance,
        criteria: Iterable[Criterion | WrenchPolicy],
        limits: Limits | None = None,
        *,
        gains: bool = True,
    ) -> None:
        """Check the criteria and lay out the robot.

        Args:
            stance: gives robot and contacts.
            criteria: criteria of distinct names, or policies q -> wrenches.
            limits: what wrenches and torques must respect; None for nothing. Policies take none.
            gains: compute CoM gain, tipping edge and CoM travels (to tipping, to unloading) too.

        Raises:
            InvalidInputError: no stance; no criterion, two of one name, weights or limits that do
                not fit.
            UnknownNameError: limits of a contact or a joint that does not exist.
        """
        check_stance(stance)
        chosen = named_criteria(criteria, "a batch")
        self.stance, self.criteria, self.gains = stance, tuple(chosen.values()), gains
        self.names = tuple(chosen)
        self.limits = optional_limits(limits)
        self._template: LimitResult | None = None
        if self.limits is not None:
            if policies := [n for n, c in chosen.items() if not isinstance(c, Criterion)]:
                raise InvalidInputError(
                    f"limits apply to a Criterion; the policy {policies[0]!r} has to respect them "
                    "itself. Leave limits or the policy out."
                )
            self._template = limit_template(stance, self.limits, self.names)
        self._single: _Single | None = None
        self._nq = int(stance.robot.model.nq)
        self._nothing = self.empty(0)
        self.fallback_reason = why_not_covered(stance)
        for criterion in self.criteria:
            if isinstance(criterion, Criterion):
                criterion.at(stance)  # weights that do not fit are an error, not a failed row
        lines = [c.name for c in stance.contacts if c.sole is not None and len(c.sole) == 2]
        if not self.fallback_reason and lines:
            self.fallback_reason = f"the sole of {lines[0]} is a line"
        self.by_reference, self._served = FrozenMapping({}), np.zeros(0, dtype=np.int64)
        if not self.fallback_reason:
            layout = robot_layout(stance, sole_edges(stance))
            served, self.by_reference = kernel_criteria(stance, layout.feet, self.criteria)
            self._served = served.column
            if not len(layout.feet.support):
                self.fallback_reason = "no joint moves between the contacts"
            elif not len(served.column):
                self.fallback_reason = "; ".join(f"{n}: {w}" for n, w in self.by_reference.items())
            self._kernel = CompiledKernel(layout, served, self._nq)
            if self.limits is not None:
                rows = kernel_limits(stance, self.limits)
                self._within = CompiledLimits(layout, served, rows, self._nq)

    @property
    def compiled(self) -> bool:
        """Whether the kernel is compiled: if not, the first evaluation waits for it; see `compile`.

        True where the reference answers everything.
        """
        if self.fallback_reason:
            return True
        return self._kernel.compiled and (self.limits is None or self._within.compiled)

    def compile(self) -> None:
        """Have the kernel compiled now, once on a machine; the code is kept on disk.

        It is logged as it begins and ends. Nothing is done where it is `compiled`.
        """
        if not self.compiled:
            self._single = _Single(self)

    def empty(self, count: int) -> BatchResult:
        """Arrays for the results of `count` postures, to be filled with ``out=``."""
        size = whole_number(count, "the number of postures", least=0)
        result = empty_result(self.stance, self.names, size, gains=self.gains)
        if self._template is None:
            return result
        return replace(result, limits=empty_limits(self._template, size, gains=self.gains))

    def evaluate(
        self,
        configurations: ArrayLike,
        *,
        out: BatchResult | None = None,
        threads: int = 1,
        device: str = "cpu",
    ) -> BatchResult:
        """Evaluate every criterion at every configuration; see `evaluate_batch`.

        Returns:
            `out` where it is given.
        """
        q = self._checked(configurations)
        threads = whole_number(threads, "threads")
        sent = is_on_device(device)
        if out is not None:
            check_out(out, self._nothing, len(q), gains=self.gains)
        result = self.empty(len(q)) if out is None else out
        doubtful = np.ones((len(q), len(self.names)), dtype=np.uint8)
        if not self.fallback_reason and len(q):
            if sent:
                self._kernel.on_device(self.empty).fill(q, result, doubtful)
            if not sent or self.limits is not None:
                self._fill(q, result, doubtful, threads, within=sent)
        return self._answered(q, result, doubtful)

    def limited(
        self, configurations: ArrayLike, own: BatchResult, *, threads: int = 1
    ) -> BatchResult:
        """Results without limits put within the limits: what `evaluate` gives, for half its work.

        Args:
            configurations: one in each row (N, nq).
            own: of the same criteria at these configurations, from a batch without limits. What
                failed there fails here. That it is of these is checked by the CoM of three rows.
            threads: as of `evaluate`.

        Raises:
            InvalidInputError: the batch has no limits, or `own` is of other criteria or postures,
                or within limits.
        """
        q = self._checked(configurations)
        if self.limits is None:
            raise InvalidInputError("the batch has no limits. Give them to BatchKernel.")
        result = self.empty(len(q))
        given, wanted = arrays_of(own), arrays_of(result)
        remedy = "Give the result of a batch without limits at these."
        if own.criteria != self.names or any(a.shape != wanted[n].shape for n, a in given.items()):
            raise InvalidInputError(
                f"own is {own!r}, and not of the {len(q)} configurations and the criteria "
                f"{', '.join(self.names)}. {remedy}"
            )
        if own.limits is not None:
            raise InvalidInputError(f"own is {own!r} within limits. {remedy}")
        self._check_same(q, own.com, remedy)
        for name, array in given.items():
            wanted[name][...] = array
        left = np.full((len(q), len(self.names)), bool(self.fallback_reason))
        failed = np.zeros_like(left)
        for row, column in own.reasons:
            failed[row, column] = True
        if not self.fallback_reason:
            left[:] = ~np.isin(np.arange(len(self.names)), self._served)
        doubtful = (left | failed).astype(np.uint8)
        if not self.fallback_reason and len(q):
            self._fill(q, result, doubtful, whole_number(threads, "threads"), within=True)
        doubtful[failed] = 0
        self._answered(q, result, doubtful)
        set_reasons(result, {**result.reasons, **own.reasons})
        return result

    def one_sided_gains(
        self, configurations: ArrayLike, result: BatchResult
    ) -> Float[np.ndarray, "N nk 2 nc 2 2"]:
        """d cop / d CoM just before and just after each posture, as CoM x or y rises.

        Both are `BatchResult.com_gain`, but where a limit only touches: there the reference finds
        each side, in milliseconds a row. NaN where no way was found on a side.

        Args:
            configurations: one in each row (N, nq).
            result: of these, from `evaluate`, with gains.

        Raises:
            InvalidInputError: the result is of other postures or criteria, or without gains.
        """
        q = self._checked(configurations)
        if result.criteria != self.names or len(result.com_gain) != len(q):
            raise InvalidInputError(
                f"{result!r} has no gains of the criteria {', '.join(self.names)} at {len(q)} "
                "configurations. Evaluate these with gains=True first."
            )
        gains = np.repeat(result.com_gain[:, :, None], 2, axis=2)
        if result.limits is None:
            return gains
        answered = ~np.isnan(result.cops).any(axis=(-1, -2))
        for i, j in np.argwhere((result.limits.touching > 0) & answered):
            gains[i, j] = sides(self.stance.at(q[i]), self.criteria[j], result.limits.limits)
        return gains

    def one(self, q: np.ndarray) -> BatchResult:
        """Evaluate one configuration (nq,), for a controller's loop: no array is allocated.

        Returns:
            One row, overwritten by the next call.

        Raises:
            InvalidInputError: a configuration that is not an array of nq floats, not finite or
                not normalised.
        """
        single = self._single = self._single or _Single(self)
        row = q if _is_row(q, single.row) else self.stance.robot.check_configuration(q)
        if not single.evaluate(row):
            return single.result
        self.stance.robot.check_configuration(row)
        return self._answered(single.q, replace(single.result), single.doubtful)

    def _fill(
        self,
        q: np.ndarray,
        result: BatchResult,
        doubtful: np.ndarray,
        threads: int,
        *,
        within: bool = False,
    ) -> None:
        """Have the kernel fill the results, block by block, or only put them `within` limits."""
        make = self._limiting if within else self._filling
        fill_blocks(lambda: make(q, result, doubtful, _CHUNK), len(q), _CHUNK, threads)

    def _filling(
        self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray, block: int
    ) -> Callable[[int, int], bool]:
        """A function of a first row and an end, at most a block apart, for one thread.

        It has the kernel fill these rows, and returns whether any of them is doubtful.
        """
        motions = NO_MOTIONS
        if self.limits is not None and self.gains:
            motions = np.zeros((block, 2 * int(self.stance.robot.model.nv)))
        fill = partial(self._kernel.filling(q, result, doubtful, motions), self._kernel.workspace())
        if self.limits is None:
            return fill
        limit = self._limiting(q, result, doubtful, block, motions)

        def both(start: int, stop: int) -> bool:
            fill(start, stop)
            return limit(start, stop)

        return both

    def _limiting(
        self,
        q: np.ndarray,
        result: BatchResult,
        doubtful: np.ndarray,
        block: int,
        motions: np.ndarray = NO_MOTIONS,
    ) -> Callable[[int, int], bool]:
        """The same for rows that the kernel without limits has filled."""
        memory = self._within.workspace(block)
        return partial(self._within.filling(q, result, doubtful, motions), *memory)

    def _answered(self, q: np.ndarray, result: BatchResult, doubtful: np.ndarray) -> BatchResult:
        """The result, its doubtful rows filled by the reference."""
        reasons = {}
        for i, j in np.argwhere(doubtful):
            row, column = int(i), int(j)
            reason = fill_row(self.stance, q[row], self.criteria[column], result, row, column)
            if reason:
                reasons[row, column] = reason
        if result.limits is not None:
            reasons |= clear_unanswered(result, result.limits, doubtful)
        set_reasons(result, reasons)
        return result

    def _check_same(self, q: np.ndarray, com: np.ndarray, remedy: str) -> None:
        """Reject results of other postures: the first, the middle or the last one differs."""
        for row in sorted({0, len(q) // 2, len(q) - 1}) if len(q) else ():
            here = self.stance.at(q[row], check=False).com
            if np.any(np.abs(com[row] - here) > _SAME_COM):  # false where a row has none
                raise InvalidInputError(
                    f"own is of other configurations: the CoM of its row {row} is "
                    f"{np.abs(com[row] - here).max():.2g} m from that of row {row}. {remedy}"
                )

    def _checked(self, configurations: ArrayLike) -> Float[np.ndarray, "N nq"]:
        robot, nq = self.stance.robot, self._nq
        what = f"the configurations of robot {robot.name!r}"
        q = configurations
        if not (_is_plain(q) and q.shape[1] == nq and np.isfinite(q).all()):
            q = finite_array(configurations, what, (None, nq), "one configuration in each row")
        # An array that differs in any of these would have the kernel compiled once more.
        q = np.require(q, np.float64, ["C", "A", "W", "E"])
        if robot.base_nv == 6:
            length = np.einsum("ij,ij->i", q[:, 3:7], q[:, 3:7])
            bad = np.flatnonzero(np.abs(length - 1.0) > _UNIT)
            for row in bad:  # the robot's own check words the error
                try:
                    robot.check_configuration(q[row])
                except InvalidInputError as error:
                    raise InvalidInputError(f"row {row}: {error}") from None
        return q


class _Single:
    """The memory of a kernel that is called for one configuration at a time.

    Attributes:
        q: the configuration (1, nq).
        row: the same memory (nq,).
        result: one row, overwritten by every call.
        doubtful: above zero where the reference must answer, by criterion (1, nk).
    """

    def __init__(self, kernel: BatchKernel) -> None:
        """Allocate it, and take hold of the machine code."""
        self.q, self.result = np.zeros((1, kernel._nq)), kernel.empty(1)
        self.row = self.q[0]
        self.doubtful = np.ones((1, len(kernel.names)), dtype=np.uint8)
        self._partial = len(kernel._served) < len(kernel.names)  # in doubt whatever the kernel says
        self._fill: Callable[[int, int], bool] | None = None
        if not kernel.fallback_reason:
            self._fill = kernel._filling(self.q, self.result, self.doubtful, 1)

    def evaluate(self, q: np.ndarray) -> bool:
        """Fill the result for a configuration (nq,); whether any criterion is in doubt."""
        self.row[:] = q
        if self._fill is None:
            return True
        return bool(self._fill(0, 1)) or self._partial


def evaluate_batch(
    stance: Stance,
    configurations: ArrayLike,
    criteria: Iterable[Criterion | WrenchPolicy],
    limits: Limits | None = None,
    *,
    gains: bool = True,
    out: BatchResult | None = None,
    threads: int = 1,
    device: str = "cpu",
) -> BatchResult:
    """Equilibria and sensitivities of many postures.

    Args:
        stance: gives robot and contacts; its own configuration does not matter.
        configurations: one in each row (N, nq).
        criteria: criteria of distinct names, or policies q -> wrenches.
        limits: what wrenches and torques must respect; None for nothing. The results are then those
            within the limits, and `BatchResult.limits` says which limits press.
        gains: compute CoM gain, tipping edge and CoM travels (to tipping, to unloading) too.
        out: results of the same shape to overwrite, reasons included, and to return: nothing is
            allocated.
        threads: threads that share the postures; the results do not depend on it. Rows that the
            reference answers (`BatchKernel.fallback_reason` and `by_reference`) are answered on one
            thread, one after the other.
        device: ``"cpu"``, or ``"cuda"`` for a graphics processor of NVIDIA's, which evaluates what
            the compiled kernel covers, without limits; the processor puts the results within them.
            Results differ in rounding alone.

    Returns:
        Results equal to `cop_sensitivity`'s of every row. A row for which it raises is NaN and has
        its reason in `BatchResult.reasons`.

    Raises:
        InvalidInputError: configurations of the wrong shape, not finite or not normalised;
            criteria that do not fit; `out` of another shape; no device that can be used.
        MissingExtraError: a device without ``copsense[gpu]``.
    """
    batch = BatchKernel(stance, criteria, limits, gains=gains)
    return batch.evaluate(configurations, out=out, threads=threads, device=device)


def _is_row(value: object, row: np.ndarray) -> bool:
    return isinstance(value, np.ndarray) and value.shape == row.shape and value.dtype == row.dtype


def _is_plain(value: object) -> TypeGuard[np.ndarray]:
    return isinstance(value, np.ndarray) and value.dtype == np.float64 and value.ndim == 2
