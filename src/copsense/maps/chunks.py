"""Chunks: one stretch of a map's postures, from their coordinates to the store."""

from __future__ import annotations

import numpy as np

from copsense.batch import BatchKernel, BatchResult, PostureBatch, PostureChart
from copsense.batch.statics.limit_states import IMPOSSIBLE, PRESSED, UNANSWERED, UNLOADED
from copsense.errors import CopsenseError
from copsense.maps.columns import (
    CHANGE_LIMIT,
    CHANGE_TRAVEL,
    EVALUATED,
    INFEASIBLE,
    REJECTED,
    STATE_WITHIN,
    UNREACHABLE,
    UNSOLVED,
    Chunk,
    columns,
    coordinate_columns,
    fill_value,
    limit_kinds,
)
from copsense.maps.heights import check_heights
from copsense.maps.map_plan import MapPlan
from copsense.maps.reduction import reduce_chunk
from copsense.maps.sampling import Sampling
from copsense.maps.store import MapStore
from copsense.margins import margin_table
from copsense.reach import check_coordinate
from copsense.sensitivity import cop_sensitivity
from copsense.uncertainty import Uncertainty, robust_com_travel

_PIECE = 4096  # postures that the kernel is given at a time


class ChunkEvaluator:
    """A plan made ready to evaluate its chunks, in any order and from several threads.

    Attributes:
        plan: what is mapped.
    """

    def __init__(self, plan: MapPlan) -> None:
        """Lay out chart, kernel and limits.

        Raises:
            InvalidInputError: coordinates, criteria or limits that do not fit the stance.
            UnknownNameError: a coordinate or a joint that does not exist.
        """
        self.plan = plan
        self._chart = PostureChart(plan.stance, plan.sampling.names, over=plan.sampling.ends)
        _check_magnitudes(self._chart, plan.sampling)
        self._kernel = BatchKernel(plan.stance, plan.criteria)
        self._names = tuple(coordinate_columns(plan))
        self._columns = columns(plan)
        self._within: BatchKernel | None = None
        if plan.limits is not None:
            self._within = BatchKernel(plan.stance, plan.criteria, plan.limits)
            self._kinds = limit_kinds(margin_table(plan.stance, plan.limits))

    def fill(self, store: MapStore, index: int) -> None:
        """Evaluate a chunk and write it, its mark last."""
        chunk = self.evaluate(index)
        store.write(index, chunk, reduce_chunk(chunk, self.plan.bounds(index)[0]))

    def evaluate(self, index: int) -> Chunk:
        """Columns of a chunk, its postures first. The same chunk is the same bits."""
        start, stop = self.plan.bounds(index)
        values = self.plan.sampling.values(start, stop)
        postures = self._chart.solve(values)
        found: Chunk = dict(zip(self._names, np.ascontiguousarray(values.T), strict=True))
        found |= self._unreached(postures)
        there = np.flatnonzero(postures.converged)
        # In pieces: the kernel's answers are many times what is kept of them.
        for first in range(0, max(len(there), 1), _PIECE):
            rows = there[first : first + _PIECE]
            answers = self._answers(postures.configurations[rows], rows, found)
            for name, array in answers.items():
                if name not in found:
                    column = self._columns[name]
                    shape = stop - start, *array.shape[1:]
                    found[name] = np.full(shape, fill_value(column), column.dtype)
                found[name][rows] = array
        if self.plan.configurations:
            found["configuration"] = postures.configurations
        return found

    def _unreached(self, postures: PostureBatch) -> Chunk:
        """Status and reason before anything is evaluated."""
        shape = len(postures), len(self.plan.criteria)
        status = np.full(shape, EVALUATED, dtype=np.uint8)
        reason = np.full(shape, "", dtype=object)
        status[~postures.converged] = UNREACHABLE
        for row in np.flatnonzero(~postures.converged):
            reason[row] = postures.reasons[row]
        found: Chunk = {"status": status, "reason": reason}
        if self._within is not None:
            found[STATE_WITHIN] = np.full(shape, UNANSWERED, dtype=np.uint8)
        return found

    def _answers(self, configurations: np.ndarray, rows: np.ndarray, found: Chunk) -> Chunk:
        """What the kernel answers at some rows; status and reason go into `found`."""
        result = self._kernel.evaluate(configurations)
        status, reason = found["status"], found["reason"]
        for (i, j), why in result.reasons.items():
            status[rows[i], j], reason[rows[i], j] = REJECTED, why
        answers: Chunk = {
            "least_com_travel": np.minimum(result.com_travel, result.unloading_travel).min(axis=-1),
            "largest_com_gain": _largest_singular_value(result.com_gain).max(axis=-1),
            "com_travel": result.com_travel,
            "unloading_travel": result.unloading_travel,
            "tipping_edge": result.tipping_edge,
            "com_gain": result.com_gain,
            "cop": result.cops,
            "margin": result.margin,
            "load_share": result.load_share,
            "com": result.com,
        }
        if self._within is not None:
            answers |= self._limits(self._within, configurations, result, rows, found)
        if self.plan.sources:
            answers |= self._robust(configurations, rows, found)
        return answers

    def _robust(self, configurations: np.ndarray, rows: np.ndarray, found: Chunk) -> Chunk:
        """What the model's errors leave of the travel, posture by posture."""
        plan, status, reason = self.plan, found["status"], found["reason"]
        assert isinstance(plan.uncertainty, Uncertainty)
        left = np.full((2, len(configurations), len(plan.criteria)), np.nan)
        for i, q in enumerate(configurations):
            here = plan.stance.at(q, check=False)
            for j, criterion in enumerate(plan.criteria):
                if status[rows[i], j] != EVALUATED:
                    continue
                try:
                    sensitivity = cop_sensitivity(here, criterion)
                    travels = robust_com_travel(sensitivity, plan.sources, plan.uncertainty.sigmas)
                    left[:, i, j] = [each.min() for each in travels]
                except CopsenseError as error:
                    status[rows[i], j], reason[rows[i], j] = REJECTED, str(error)
        return {"likely_com_travel": left[0], "robust_com_travel": left[1]}

    def _limits(
        self,
        within: BatchKernel,
        configurations: np.ndarray,
        own: BatchResult,
        rows: np.ndarray,
        found: Chunk,
    ) -> Chunk:
        """The same postures within the limits; marks those where no wrench was found."""
        result = within.limited(configurations, own)
        limits, status, reason = result.limits, found["status"], found["reason"]
        assert limits is not None
        for (i, j), why in result.reasons.items():
            state = limits.state[i, j]
            if (i, j) in own.reasons or state == UNLOADED:  # wrenches there are
                continue
            status[rows[i], j] = INFEASIBLE if state == IMPOSSIBLE else UNSOLVED
            reason[rows[i], j] = why
        kinds = np.array([kind for _, kind in limits.margin_names])
        margins = [limits.own_margins[..., kinds == kind].min(axis=-1) for kind in self._kinds]
        without = np.isnan(result.cops).any(axis=(-1, -2))
        state = np.where(without & (limits.state <= PRESSED), UNANSWERED, limits.state)
        known = (state <= PRESSED) | (state == UNLOADED)
        return {
            "limit_margin": np.stack(margins, axis=-1),
            STATE_WITHIN: state,
            "active_limits": np.where(known, (limits.pressing >= 0).sum(axis=-1), -1),
            # What the limits leave without load has multipliers that are not unique.
            CHANGE_TRAVEL: np.where(state <= PRESSED, limits.change_travel, np.nan),
            CHANGE_LIMIT: np.where(state <= PRESSED, limits.change_limit, -1),
            "cop_within": result.cops,
            "com_gain_within": result.com_gain,
        }


def _largest_singular_value(G: np.ndarray) -> np.ndarray:
    """Of 2 x 2 matrices [[a, b], [c, d]]: (|(a+d, c-b)| + |(a-d, c+b)|) / 2."""
    a, b, c, d = G[..., 0, 0], G[..., 0, 1], G[..., 1, 0], G[..., 1, 1]
    return np.asarray((np.hypot(a + d, c - b) + np.hypot(a - d, c + b)) / 2)


def _check_magnitudes(chart: PostureChart, sampling: Sampling) -> None:
    """Reject coordinates that only another unit explains: no posture of theirs would be reached."""
    for axis, unit, own in zip(sampling.axes, chart.units, chart.values.tolist(), strict=True):
        for end in (axis.start, axis.stop):
            check_coordinate(chart.stance.robot, axis.name, unit, own, end)
    check_heights(chart.stance, sampling)
