"""Chunks: one stretch of a map's postures, from their coordinates to the store."""

from __future__ import annotations

import numpy as np

from copsense.batch import BatchKernel, BatchResult, PostureBatch, PostureChart
from copsense.errors import CopsenseError, InfeasibleError
from copsense.magnitudes import check_angle
from copsense.maps.columns import (
    EVALUATED,
    INFEASIBLE,
    REJECTED,
    UNREACHABLE,
    UNSOLVED,
    Chunk,
    columns,
    coordinate_columns,
    fill_value,
    limit_kinds,
)
from copsense.maps.map_plan import MapPlan
from copsense.maps.reduction import reduce_chunk
from copsense.maps.sampling import Sampling
from copsense.maps.store import MapStore
from copsense.margins import MarginTable, margin_table
from copsense.reach import SWEPT, check_within_reach
from copsense.statics import solve_equilibrium

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
        self._chart = PostureChart(plan.stance, plan.sampling.names)
        _check_magnitudes(self._chart, plan.sampling)
        self._kernel = BatchKernel(plan.stance, plan.criteria)
        self._names = tuple(coordinate_columns(plan))
        self._columns = columns(plan)
        self._table = None if plan.limits is None else margin_table(plan.stance, plan.limits)

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
        return {"status": status, "reason": reason}

    def _answers(self, configurations: np.ndarray, rows: np.ndarray, found: Chunk) -> Chunk:
        """What the kernel answers at some rows; status and reason go into `found`."""
        result = self._kernel.evaluate(configurations)
        status, reason = found["status"], found["reason"]
        for (i, j), why in result.reasons.items():
            status[rows[i], j], reason[rows[i], j] = REJECTED, why
        answers: Chunk = {
            "least_com_travel": result.com_travel.min(axis=-1),
            "largest_com_gain": _largest_singular_value(result.com_gain).max(axis=-1),
            "com_travel": result.com_travel,
            "tipping_edge": result.tipping_edge,
            "com_gain": result.com_gain,
            "cop": result.cops,
            "margin": result.margin,
            "load_share": result.load_share,
            "com": result.com,
        }
        if self._table is not None:
            answers["limit_margin"] = self._limits(self._table, configurations, result, rows, found)
        return answers

    def _limits(
        self,
        table: MarginTable,
        configurations: np.ndarray,
        result: BatchResult,
        rows: np.ndarray,
        found: Chunk,
    ) -> np.ndarray:
        """Margins of the criteria's own wrenches; marks the postures that the QP cannot solve."""
        status, reason = found["status"], found["reason"]
        kinds = limit_kinds(table)
        members = [np.array([k == kind for k in table.kinds]) for kind in kinds]
        margins = np.full((len(configurations), len(self.plan.criteria), len(kinds)), np.nan)
        for i, q in enumerate(configurations):
            here = self.plan.stance.at(q, check=False)
            for j, criterion in enumerate(self.plan.criteria):
                if status[rows[i], j] != EVALUATED:
                    continue
                own = table.values(here.stack(result.wrenches[i, j]), result.torques[i, j])
                margins[i, j] = [own[those].min() for those in members]
                try:
                    solve_equilibrium(here, criterion, self.plan.limits)
                except CopsenseError as error:
                    broken = INFEASIBLE if isinstance(error, InfeasibleError) else UNSOLVED
                    status[rows[i], j], reason[rows[i], j] = broken, str(error)
        return margins


def _largest_singular_value(G: np.ndarray) -> np.ndarray:
    """Of 2 x 2 matrices [[a, b], [c, d]]: (|(a+d, c-b)| + |(a-d, c+b)|) / 2."""
    a, b, c, d = G[..., 0, 0], G[..., 0, 1], G[..., 1, 0], G[..., 1, 1]
    return np.asarray((np.hypot(a + d, c - b) + np.hypot(a - d, c + b)) / 2)


def _check_magnitudes(chart: PostureChart, sampling: Sampling) -> None:
    """Reject coordinates that only another unit explains: no posture of theirs would be reached."""
    robot = chart.stance.robot
    for axis, unit, own in zip(sampling.axes, chart.units, chart.values.tolist(), strict=True):
        for end in (axis.start, axis.stop):
            if axis.name in robot.joint_names:
                robot.checked_position(axis.name, end)
            elif unit == "m":
                check_within_reach(
                    robot, end - own, f"{axis.name}, from the stance's own,", SWEPT, end
                )
            else:
                check_angle(end, axis.name)
