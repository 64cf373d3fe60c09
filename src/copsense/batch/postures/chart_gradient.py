"""Chart gradient: how what depends on the posture changes with a chart's coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.arrays import whole_number
from copsense.batch.blocks import fill_blocks
from copsense.batch.layout import robot_layout
from copsense.batch.machine_code import HoldsMachineCode
from copsense.batch.postures.chart import PostureChart
from copsense.batch.postures.coordinates import BASE, Limb, roll_pitch_yaw, solved_whole
from copsense.batch.postures.reference_search import base_rates
from copsense.batch.postures.search_plan import plan_search
from copsense.batch.workspace import workspace, workspace_offsets
from copsense.errors import InvalidInputError
from copsense.stance import RANK_TOLERANCE, Stance

_BLOCK = 512  # postures that a thread takes at a time
_LOST = 1e-9  # singular values, of the largest, under which something is not decided


class ChartGradient(HoldsMachineCode):
    """Turns gradients over velocities into gradients over a chart's coordinates.

    What a chart solves for follows from its coordinates, so a function of the posture is one of
    them. Its gradient is exact, by the implicit function theorem.

    Attributes:
        chart: the coordinates.
    """

    chart: PostureChart

    def __repr__(self) -> str:
        """The chart."""
        return f"ChartGradient of {self.chart!r}"

    def __init__(self, chart: PostureChart) -> None:
        """Check that the coordinates decide the posture.

        Raises:
            InvalidInputError: they leave a choice, cannot all be met, or move a contact; the
                message names the remedy.
        """
        self.chart = chart
        stance, plan = chart.stance, chart.meaning
        if feet := [name for name in plan.names if ":" in name]:
            raise InvalidInputError(
                f"{feet[0]} moves a contact: gradients are along motions that hold the contacts. "
                "Leave it out; name the CoM, the base or joints."
            )
        if solved_whole(stance):
            raise InvalidInputError(
                f"robot {stance.robot.name!r} has loops, couplings or hanging joints: its postures "
                "are found by a search that has no gradient over its coordinates. Take a robot "
                "without, or differentiate along admissible motions (copsense.cop_sensitivity)."
            )
        nv = stance.robot.model.nv
        self._unknown = sorted({u for limb in plan.limbs for u in limb.unknowns})
        self._nearest = chart.nearest
        columns = [p for p in plan.place.tolist() if p < nv]
        if self._nearest:
            self._columns = columns
        else:
            self._columns = self._unknown + columns
            self._check_decided()
        self._code: Callable[..., None] | None = None
        if not chart.fallback_reason:
            self._lay_out()

    def pull(
        self,
        configurations: Float[np.ndarray, "N nq"],
        gradient: Float[np.ndarray, "N outputs nv"],
        *,
        threads: int = 1,
    ) -> Float[np.ndarray, "N outputs k"]:
        """Gradients over the chart's coordinates.

        Args:
            configurations: that the chart found for its coordinates.
            gradient: over velocities, of any outputs at each; what it says of motions that move a
                contact does not count.
            threads: threads that share the postures.

        Returns:
            d output / d coordinate [per m, per rad]; NaN where the coordinates decide no posture,
            as on a straight leg.
        """
        count, outputs, _ = gradient.shape
        pulled = np.full((count, outputs, len(self.chart.names)), np.nan)
        if self.chart.fallback_reason:
            for row in range(count):
                pulled[row] = self._reference(configurations[row], gradient[row])
            return pulled
        doubtful = np.zeros(count, dtype=np.uint8)
        if count and outputs:
            q, g = np.ascontiguousarray(configurations), np.ascontiguousarray(gradient)
            flat = pulled.reshape(count, 1, -1)
            self._run(q, g.reshape(count, -1), flat, doubtful, whole_number(threads, "threads"))
        pulled[doubtful != 0] = np.nan
        return pulled

    def _run(
        self,
        q: np.ndarray,
        gradient: np.ndarray,
        pulled: np.ndarray,
        doubtful: np.ndarray,
        threads: int,
    ) -> None:
        from copsense.batch.compiler import bound
        from copsense.batch.postures.pulling import PullOffsets, pull_gradients

        sizes = self._sizes | {"gradient": gradient.shape[1], "pulled": pulled.shape[2]}
        starts, end = {}, self._size
        for name, size in sizes.items():
            starts[name], end = end, end + size
        more = PullOffsets(**starts, size=end)
        arguments = (*self._given, more, q, gradient, pulled, doubtful)
        if self._code is None:
            given = (*arguments, workspace(1), 0, 0)
            self._code = bound(pull_gradients, given, "the gradients of postures")
        pull = partial(self._code, *arguments)
        fill_blocks(lambda: partial(pull, workspace(end)), len(q), _BLOCK, threads)

    def _lay_out(self) -> None:
        """What the kernel reads."""
        from copsense.batch.postures.pulling import PullPlan

        stance, plan = self.chart.stance, self.chart.meaning
        contacts = tuple(k for limb in plan.limbs for k in limb.contacts)
        layout = robot_layout(stance, [np.zeros((0, 3)) for _ in stance.contacts])
        offset = workspace_offsets(layout, int(stance.robot.model.nq))
        whole = replace(plan, limbs=(Limb(contacts, tuple(self._columns)),))
        search_plan, search = plan_search(stance, layout, offset, whole)
        rows = len(stance.component_index) + len(plan.com_axes)
        nv, solved = stance.robot.model.nv, 0 if self._nearest else len(self._unknown)
        column, row, given = [], [], []
        for place in plan.place.tolist():
            is_com = place >= nv
            column.append(-1 if is_com else solved + self._columns[solved:].index(place))
            row.append(
                rows - len(plan.com_axes) + plan.com_axes.index(place - nv) if is_com else -1
            )
            given.append(-1 if is_com else place)
        pull = PullPlan(rows, solved, *(np.array(x, dtype=np.int64) for x in (column, row, given)))
        self._given = (*layout.parts, search_plan, pull, offset, search)
        self._size = search.size
        width = len(self._columns) if self._nearest else solved
        most = max(rows, width)
        self._sizes = {
            "A": rows * width,
            "R": most * most,
            "T": most * most,
            "felt": most,
            "multiplier": rows,
        }

    def _check_decided(self) -> None:
        """Reject coordinates that leave a choice, or that contradict each other, at the stance."""
        stance, plan = self.chart.stance, self.chart.meaning
        J, N = self._derivative(stance)
        if not J.shape[1]:
            raise InvalidInputError(
                "the coordinates set everything that could keep the contacts in place. Leave the "
                "joints of the legs out."
            )
        values = np.linalg.svd(J, compute_uv=False)
        rank = int(np.sum(values > _LOST * values[0]))
        names = ", ".join(plan.names)
        if left := J.shape[1] - rank:
            raise InvalidInputError(
                f"the coordinates {names} leave {left} of the robot's motions open: a search would "
                "choose them, by a rule that has no gradient. Name as many more coordinates "
                f"(joints, or of {', '.join(BASE)}), or none of a leg's joints."
            )
        both = np.linalg.svd(np.hstack([J, N]), compute_uv=False)
        if int(np.sum(both > _LOST * both[0])) > rank:
            raise InvalidInputError(
                f"the coordinates {names} cannot be set one by one: the contacts hold some of "
                "them. Name fewer."
            )

    def _derivative(self, here: Stance) -> tuple[np.ndarray, np.ndarray]:
        """h_u and h_x at a posture."""
        plan, nv = self.chart.meaning, here.robot.model.nv
        rows = np.vstack([here.jacobian, here.com_jacobian[list(plan.com_axes)]])
        nb, contacts = here.robot.base_nv, len(here.jacobian)
        rows[:, :nb] = rows[:, :nb] @ base_rates(here, _angles(here))
        N = np.zeros((len(rows), len(plan.place)))
        for j, place in enumerate(plan.place.tolist()):
            if place < nv:
                N[:, j] = rows[:, place]
            else:
                N[contacts + plan.com_axes.index(place - nv), j] = -1.0
        return rows[:, self._unknown], N

    def _reference(self, q: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """The same, one posture at a time, with Pinocchio's Jacobians (outputs, k)."""
        plan = self.chart.meaning
        here = self.chart.stance.at(q, check=False)
        nb, nv = here.robot.base_nv, here.robot.model.nv
        g = gradient.copy()
        g[:, :nb] = g[:, :nb] @ base_rates(here, _angles(here))
        J, N = self._derivative(here)
        if self._nearest:
            g -= g @ np.linalg.pinv(J, rcond=RANK_TOLERANCE) @ J
            return np.asarray(g[:, plan.place])
        values = np.linalg.svd(J, compute_uv=False)
        if values[-1] <= _LOST * values[0]:
            return np.full((len(g), len(plan.place)), np.nan)
        own = np.zeros((len(g), len(plan.place)))
        named = plan.place < nv
        own[:, named] = g[:, plan.place[named]]
        return np.asarray(own - g[:, self._unknown] @ np.linalg.pinv(J) @ N)


def _angles(here: Stance) -> np.ndarray:
    """A base's coordinates as `base_rates` reads them: its angles are where they belong."""
    if here.robot.base_nv != 6:
        return np.array([0.0, 0.0, np.arctan2(here.q[3], here.q[2])])
    root = here.robot.model.jointPlacements[1].rotation @ _rotation(here.q)
    return np.concatenate([np.zeros(3), roll_pitch_yaw(root)])


def _rotation(q: np.ndarray) -> np.ndarray:
    return np.asarray(pin.XYZQUATToSE3(np.array(q[:7])).rotation)
