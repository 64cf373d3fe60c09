"""Chart: named coordinates in, postures with the contacts in place out, many at once.

A chart takes the base's pose and the joints off the limbs as they are given, and solves the limbs:
a leg of six joints under a flat foot is a 6 x 6 system of its own. See `PostureChart`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import whole_number
from copsense.batch.blocks import fill_blocks
from copsense.batch.layout import robot_layout, why_not_covered
from copsense.batch.machine_code import HoldsMachineCode
from copsense.batch.postures.chart_values import checked_ends, checked_values
from copsense.batch.postures.closed_search import closed_one
from copsense.batch.postures.coordinates import (
    Coordinates,
    Unit,
    chart_coordinates,
    joint_units,
    row_units,
    solved_whole,
)
from copsense.batch.postures.nearby import Nearby, nothing_nearby, postures_nearby
from copsense.batch.postures.posture_batch import PostureBatch, empty_postures
from copsense.batch.postures.reference_search import search_one
from copsense.batch.postures.search_plan import plan_search
from copsense.batch.postures.search_settings import BEYOND, ELSEWHERE, SOLVED, STUCK
from copsense.batch.workspace import workspace, workspace_offsets
from copsense.errors import InvalidInputError
from copsense.freedom import held_com_axes, missing_joints
from copsense.path import COM_COORDINATES
from copsense.posture import TOLERANCE
from copsense.stance import Stance, check_stance

_BLOCK = 512  # postures that a thread takes at a time


class PostureChart(HoldsMachineCode):
    """Postures of a stance by named coordinates, its contacts in place.

    A coordinate is one of

    - ``com_x``, ``com_y``, ``com_z``: the CoM in the world [m]; the base moves along that axis;
    - ``base_x``, ``base_y``, ``base_z``: the base's origin in the world [m];
    - ``roll``, ``pitch``, ``yaw``: its orientation Rz(yaw) Ry(pitch) Rx(roll) [rad];
    - a joint's name [rad, or m for a prismatic joint];
    - ``CONTACT:x``, ``CONTACT:y``: world x and y of a contact, which stays on its plane [m];
      ``CONTACT:yaw``: its x axis' angle in the plane, from the world's x axis laid on it [rad].

    What is not named keeps the stance's value; the joints of the limbs in contact are solved for.
    Where a limb cannot follow (a joint of a leg is named; a leg has fewer joints than its foot has
    directions) the base coordinates that are not named are solved for too. Where joints or base
    leave a choice, every step of the search is the smallest one. Each row starts from the stance's
    own configuration, so that it depends on its values alone.

    Many rows between known ends are found faster with ``over``: a lattice over the ends is solved
    once, and where postures are isolated, a row starts between those around it and takes two steps
    instead of six. Where that leads nowhere it starts from the stance. What is found is the same to
    1e-9; a row depends on its values and the ends alone.

    Where loops, couplings or hanging joints tie base and limbs together, the whole robot is solved
    for (`solve_posture`): base coordinates cannot be named, and what is not named stays as near to
    the stance's own as it can.

    Contacts that a chart moves need nothing more from `evaluate_batch`: where they stand follows
    from the configuration, and they stay on the planes that the stance states.

    Attributes:
        stance: where the search starts, and what the coordinates not named are kept from.
        names: the coordinates.
        units: ``"m"`` or ``"rad"`` for each.
        values: of the stance itself (k,).
        fallback_reason: why postures are solved one at a time; empty where the kernel does it.
    """

    nearest: ClassVar[bool] = False  # whether values are whole postures to come near to
    stance: Stance
    names: tuple[str, ...]
    units: tuple[Unit, ...]
    values: Float[np.ndarray, " k"]
    fallback_reason: str

    def __repr__(self) -> str:
        """Robot and coordinates."""
        return f"PostureChart({self.stance.robot.name!r} over {', '.join(self.names)})"

    def __init__(
        self,
        stance: Stance,
        coordinates: Sequence[str],
        *,
        compiled: bool = True,
        over: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> None:
        """Find out what the names mean.

        Args:
            stance: where the search starts.
            coordinates: their names.
            compiled: whether the kernel may serve; False searches one posture at a time, which
                takes milliseconds for each and waits for no compiler.
            over: least and largest value of each coordinate, (k,) and (k,), between which most rows
                will be [m, rad]. One posture at a time always starts from the stance.

        Raises:
            InvalidInputError: no stance; no name, one twice, or two that contradict each other;
                ends that are not finite, or in the wrong order.
            UnknownNameError: a name that is not a coordinate.
        """
        check_stance(stance)
        if not len(coordinates):
            raise InvalidInputError("a chart needs one coordinate at least, got none. Name one.")
        self.stance = stance
        self._coordinates = self._meaning_on(stance, coordinates)
        self.names, self.units = self._coordinates.names, self._coordinates.units
        self.values = self._coordinates.given[self._coordinates.place]
        self.values.flags.writeable = False
        self._joints, self._rows_named = joint_units(stance), row_units(stance, self._coordinates)
        self._code: Callable[..., None] | None = None
        self.fallback_reason = why_not_covered(stance) if compiled else "nothing is to be compiled"
        self._whole = solved_whole(stance)
        feet = any(":" in name for name in self.names)  # feet that move carry the CoM along
        asked = {axis: n for axis, n in enumerate(COM_COORDINATES) if n in self.names and not feet}
        held = held_com_axes(stance) if asked else ()
        self._held_axes = {a: self.names.index(n) for a, n in asked.items() if a in held}
        if not self.fallback_reason and stance.false_motions.shape[1]:
            self.fallback_reason = "the contacts hold a motion to second order only"
        if not self.fallback_reason and not stance.robot.model.jointPlacements[1].isIdentity(0.0):
            self.fallback_reason = "the model's root is not the world"
        if not self.fallback_reason:
            layout = robot_layout(stance, [np.zeros((0, 3)) for _ in stance.contacts])
            offset = workspace_offsets(layout, int(stance.robot.model.nq))
            search_plan, search = plan_search(stance, layout, offset, self._coordinates)
            self._given = (*layout.parts, search_plan, offset, search)
            self._size = search.size
        self._over = None if over is None else checked_ends(over, self.names)
        known = self._over is not None and not self.fallback_reason
        self._nearby = None if known else nothing_nearby(self._coordinates)

    @property
    def meaning(self) -> Coordinates:
        """What the coordinates set and free."""
        return self._coordinates

    @staticmethod
    def _meaning_on(stance: Stance, names: Sequence[str]) -> Coordinates:
        return chart_coordinates(stance, names)

    @property
    def compiled(self) -> bool:
        """Whether the kernel is compiled: if not, the first search waits for it; see `compile`.

        True where postures are solved one at a time.
        """
        if self.fallback_reason or self._code is not None:
            return True
        from copsense.batch.compiler import is_compiled
        from copsense.batch.postures.newton import solve_postures

        return is_compiled(solve_postures)

    def compile(self) -> None:
        """Have the kernel compiled now, once on a machine; the code is kept on disk.

        It is logged as it begins and ends. Nothing is done where it is `compiled`.
        """
        if not self.compiled:
            self.solve([self.values])

    def empty(self, count: int) -> PostureBatch:
        """Arrays for `count` postures, to be filled with ``out=``."""
        return empty_postures(self.stance, whole_number(count, "the number of postures", least=0))

    def solve(
        self, values: ArrayLike, out: PostureBatch | None = None, threads: int = 1
    ) -> PostureBatch:
        """Solve for many postures.

        Args:
            values: of the coordinates, one posture in each row (N, k) [m, rad].
            out: a batch of the same size to overwrite.
            threads: threads that share the postures; the results do not depend on it. Postures
                that are solved one at a time, see `fallback_reason`, are so on one thread.

        Returns:
            Postures that meet every constraint within 1e-12. A row that has none, or that
            is beyond a joint limit, is NaN and has its reason.

        Raises:
            InvalidInputError: values of the wrong shape or not finite; `out` of another size.
        """
        x = checked_values(values, self.names)
        threads = whole_number(threads, "threads")
        batch = self.empty(len(x)) if out is None else self._fitting(out, len(x))
        return self._search(x, batch, threads, self._known())

    def _known(self) -> Nearby:
        """Postures between which rows start, solved before the first; all threads find the same."""
        if self._nearby is None:
            assert self._over is not None
            self._nearby = postures_nearby(
                self.stance,
                self._coordinates,
                self._over,
                lambda x, nearby: self._search(x, self.empty(len(x)), 1, nearby),
            )
        return self._nearby

    def _search(
        self, x: np.ndarray, batch: PostureBatch, threads: int, nearby: Nearby
    ) -> PostureBatch:
        batch.reasons[:] = ""
        status = np.full(len(x), ELSEWHERE, dtype=np.int64)
        which, excess = np.zeros(len(x), dtype=np.int64), np.zeros(len(x))
        if not self.fallback_reason and len(x):
            self._run(x, nearby, batch, status, which, excess, threads)
        said: dict[int, str] = {}
        for row in np.flatnonzero(status == ELSEWHERE):
            if self._whole:
                found, said[int(row)] = closed_one(self.stance, self._coordinates, x[row])
            else:
                found = search_one(self.stance, self._coordinates, x[row])
            batch.configurations[row], batch.residuals[row] = found.q, found.residual
            batch.iterations[row], status[row] = found.iterations, found.status
            which[row], excess[row] = found.which, found.excess
        np.equal(status, SOLVED, out=batch.converged)
        failed = np.flatnonzero(~batch.converged)
        batch.configurations[failed] = np.nan
        for row in failed:
            batch.reasons[row] = (
                said.get(int(row))
                or (self._held(x[row]) if status[row] != BEYOND else "")
                or self._why_not(
                    int(status[row]), int(which[row]), excess[row], batch.residuals[row]
                )
            )
        return batch

    def _held(self, values: Float[np.ndarray, " k"]) -> str:
        """Whether a row asks the CoM to go where the contacts hold it fast, and why; or ""."""
        for axis, at in self._held_axes.items():
            if abs(values[at] - self.values[at]) > TOLERANCE:
                lacking = "; ".join(missing_joints(self.stance))
                return f"unreachable: the contacts hold the CoM's {'xyz'[axis]} fast" + (
                    f": {lacking}" if lacking else ""
                )
        return ""

    def _run(
        self,
        x: np.ndarray,
        nearby: Nearby,
        batch: PostureBatch,
        status: np.ndarray,
        which: np.ndarray,
        excess: np.ndarray,
        threads: int,
    ) -> None:
        from copsense.batch.compiler import bound
        from copsense.batch.postures.newton import Found, solve_postures

        found = Found(
            batch.configurations, batch.residuals, batch.iterations, status, which, excess
        )
        arguments = (*self._given, nearby, x, found)
        if self._code is None:
            given = (*arguments, workspace(1), 0, 0)
            self._code = bound(solve_postures, given, "the search for postures")
        solve = partial(self._code, *arguments)
        fill_blocks(lambda: partial(solve, workspace(self._size)), len(x), _BLOCK, threads)

    def _why_not(self, status: int, which: int, excess: float, residual: float) -> str:
        """Why a row has no posture."""
        if status == BEYOND:
            name, unit = self._joints[which]
            return f"joint {name} over its limit by {excess:.3g} {unit}"
        how = "unreachable" if status == STUCK else "did not converge"
        label, unit = self._rows_named[which]
        return f"{how}: {label} remains {residual:.2e} {unit} off"

    def _fitting(self, out: PostureBatch, count: int) -> PostureBatch:
        if not isinstance(out, PostureBatch):
            raise InvalidInputError(
                f"out is of type {type(out).__name__}. Make it with PostureChart.empty({count})."
            )
        wanted = self.empty(0)
        for field in fields(PostureBatch):
            array = getattr(out, field.name)
            like = getattr(wanted, field.name)
            shape = (count, *like.shape[1:])
            fits = array.shape == shape and array.dtype == like.dtype
            if not (fits and array.flags.carray):
                raise InvalidInputError(
                    f"out.{field.name} is {array.dtype} of shape {array.shape}, or not contiguous "
                    f"and writeable; the chart needs {like.dtype} of shape {shape}. Make it with "
                    f"PostureChart.empty({count})."
                )
        return out
