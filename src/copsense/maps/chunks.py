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
        there = np.flatnonzero(postures.converged)
        result = self._kernel.evaluate(postures.configurations[there])
        status, reason = self._status(postures, there, result)
        wide: Chunk = {
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
            wide["limit_margin"] = self._limits(
                self._table, postures.configurations[there], result, there, status, reason
            )
        found: Chunk = dict(zip(self._names, np.ascontiguousarray(values.T), strict=True))
        found |= {"status": status, "reason": reason}
        for name, array in wide.items():
            column = self._columns[name]
            rows = np.full((stop - start, *array.shape[1:]), fill_value(column), column.dtype)
            rows[there] = array
            found[name] = rows
        if self.plan.configurations:
            found["configuration"] = postures.configurations
        return found

    def _status(
        self, postures: PostureBatch, there: np.ndarray, result: BatchResult
    ) -> tuple[np.ndarray, np.ndarray]:
        shape = len(postures), len(self.plan.criteria)
        status = np.full(shape, EVALUATED, dtype=np.uint8)
        reason = np.full(shape, "", dtype=object)
        status[~postures.converged] = UNREACHABLE
        for row in np.flatnonzero(~postures.converged):
            reason[row] = postures.reasons[row]
        for (i, j), why in result.reasons.items():
            status[there[i], j], reason[there[i], j] = REJECTED, why
        return status, reason

    def _limits(
        self,
        table: MarginTable,
        configurations: np.ndarray,
        result: BatchResult,
        there: np.ndarray,
        status: np.ndarray,
        reason: np.ndarray,
    ) -> np.ndarray:
        """Margins of the criteria's own wrenches; marks the postures that the QP cannot solve."""
        kinds = limit_kinds(table)
        members = [np.array([k == kind for k in table.kinds]) for kind in kinds]
        margins = np.full((len(there), len(self.plan.criteria), len(kinds)), np.nan)
        for i, q in enumerate(configurations):
            here = self.plan.stance.at(q, check=False)
            for j, criterion in enumerate(self.plan.criteria):
                if status[there[i], j] != EVALUATED:
                    continue
                own = table.values(here.stack(result.wrenches[i, j]), result.torques[i, j])
                margins[i, j] = [own[rows].min() for rows in members]
                try:
                    solve_equilibrium(here, criterion, self.plan.limits)
                except CopsenseError as error:
                    broken = INFEASIBLE if isinstance(error, InfeasibleError) else UNSOLVED
                    status[there[i], j], reason[there[i], j] = broken, str(error)
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
