"""PathScan: one criterion along a path, and where on the way a limit is reached first.

Each posture is solved once, with the exact derivatives of forces and torques along the path. What
is asked of a limit is asked of its slack b - A f: between two postures it is the cubic through the
values and slopes at both, and its root is refined by solving the very posture where the path can
give it. Postures are solved outwards from the start and only as far as the question needs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Float

from copsense.criterion import Criterion, check_criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import Limits, check_limits
from copsense.margins import margin_table
from copsense.path import LateralPath, PosturePath, check_path
from copsense.roots import Track
from copsense.scan_point import ScanPoint, rates_or_nan
from copsense.sensitivity import cop_sensitivity
from copsense.stance import Stance
from copsense.statics import (
    ActiveSetChange,
    ConstrainedEquilibrium,
    distance_to_change,
    solve_equilibrium,
)
from copsense.travel import Crossing, LimitTravel, Travel

_HERE = 1e-7  # of the coordinate: what changes nearer than this changes here
_SAME = 1e-9  # of the coordinate: a posture so near to the start is the start
_ROUNDING = 1e-9  # shares of the weight, or of the cost's gradient, by which nothing has changed
_CLOSING = 1e-9  # share of a slack, per unit of the coordinate, that is not an approach
_PRECISION = 1e-9  # of a travel
_CHANGE_PRECISION = 1e-12  # of a change: so near that the limit is only touched

Measure = Callable[[ScanPoint], tuple[Float[np.ndarray, " r"], Float[np.ndarray, " r"]]]


class PathScan:
    """A criterion along a path, every posture solved once and kept.

    Attributes:
        path: the postures.
        criterion: what shares the load.
        limits: what the wrenches and torques respect; None for the criterion's own.
        start: the coordinate from which travel is measured.
    """

    def __init__(
        self,
        path: PosturePath | LateralPath,
        criterion: Criterion,
        limits: Limits | None = None,
        *,
        start: float | None = None,
    ) -> None:
        """Nothing is solved before it is asked for.

        Args:
            path: the postures; a `LateralPath` may serve several scans, which then share them.
            criterion: what shares the load.
            limits: what the wrenches and torques must respect; None for nothing.
            start: the coordinate from which travel is measured; default that of the middle posture.

        Raises:
            InvalidInputError: a policy, which has no derivatives.
        """
        check_path(path, search=True)
        if limits is not None:
            check_limits(limits)
        if callable(criterion):
            raise InvalidInputError(
                "a policy q -> wrenches has no exact derivatives to scan a path with. Give a "
                "Criterion."
            )
        check_criterion(criterion)
        self.path = path
        self.criterion = criterion
        self.limits = limits
        values = np.asarray(path.values, dtype=float)
        self.start: float = float(values[len(values) // 2] if start is None else start)
        nearest = float(values[int(np.argmin(np.abs(values - self.start)))])
        near = abs(nearest - self.start) <= _SAME
        # Where a search sets out: the start itself if the path has a posture there.
        self._begin = nearest if near or not path.continuous else self.start
        self._points: dict[float, ScanPoint] = {}

    def __repr__(self) -> str:
        """Criterion, limits, path, and how many postures are solved so far."""
        within = "" if self.limits is None else f" within {self.limits!r}"
        return (
            f"PathScan({self.criterion.name}{within} along {self.path!r}, from {self.start:.4g}; "
            f"{len(self._points)} equilibria so far)"
        )

    @property
    def begin(self) -> ScanPoint:
        """Where a search sets out: at the start, or at the posture nearest to it."""
        return self.at(self._begin)

    def at(self, value: float) -> ScanPoint:
        """The equilibrium at a value of the path's coordinate, solved once.

        Raises:
            CopsenseError: no posture there, or no wrenches.
        """
        value = float(value)
        if value not in self._points:
            stance, tangent = self.path.at(value)
            found = solve_equilibrium(stance, self.criterion, self.limits)
            self._points[value] = ScanPoint(value, tangent, found)
        return self._points[value]

    @property
    def points(self) -> tuple[ScanPoint, ...]:
        """The equilibria at all of the path's postures.

        Raises:
            CopsenseError: one of them has none.
        """
        return tuple(self.at(value) for value in self.path.values)

    @property
    def forces(self) -> Float[np.ndarray, "N m"]:
        """Stacked contact forces at the path's postures, contact axes [N, Nm]."""
        return np.array([point.forces for point in self.points])

    @property
    def torques(self) -> Float[np.ndarray, "N n"]:
        """Joint torques at the path's postures [Nm]."""
        return np.array([point.torques for point in self.points])

    @property
    def force_rates(self) -> Float[np.ndarray, "N m"]:
        """d forces / d coordinate at the path's postures."""
        return np.array([point.force_rates for point in self.points])

    @property
    def torque_rates(self) -> Float[np.ndarray, "N n"]:
        """d torques / d coordinate at the path's postures."""
        return np.array([point.torque_rates for point in self.points])

    def slacks(self, limits: Limits) -> tuple[Float[np.ndarray, "N r"], Float[np.ndarray, "N r"]]:
        """Slack b - A f of every row of limits at the path's postures, and its derivative.

        The rows are those of `margin_table`.
        """
        table = margin_table(self.points[0].stance, limits)
        return (
            table.slack(self.forces, self.torques),
            table.slack_rates(self.force_rates, self.torque_rates),
        )

    def margins(self, limits: Limits) -> Float[np.ndarray, "N g"]:
        """The smallest margin of each contact or joint to each kind of limit, in its own unit.

        The groups are those of `margin_table`. NaN to the edge of a sole that does not push.
        """
        table = margin_table(self.points[0].stance, limits)
        return table.group_margins(self.forces, self.torques)

    def first(
        self, measure: Measure, side: int = 1, *, reach: float = np.inf, exact: bool = True
    ) -> Crossing | None:
        """Where one of several quantities first falls below zero on the way to one side.

        Args:
            measure: a point -> the quantities (r,) and their derivatives along the coordinate (r,).
            side: +1 towards rising values of the coordinate, or -1.
            reach: how far to look.
            exact: refine the root by solving postures in between, if the path can give them; False
                leaves it at the cubic between its own postures.

        Returns:
            The first crossing; at the beginning where a quantity is below zero there already. None
            if none falls below zero within reach, or on the path.

        Raises:
            CopsenseError: a posture on the way has no equilibrium.
        """
        side = check_side(side)

        def evaluate(travel: float) -> tuple[np.ndarray, np.ndarray]:
            values, rates = measure(self.at(self.start + side * travel))
            return values, side * rates

        track = Track(evaluate if exact and self.path.continuous else None)
        before = 0.0
        for value in self._outwards(side):
            travel = self._travel(value, side)
            values, rates = measure(self.at(value))
            track.add(travel, values, side * rates)
            found = track.first_zero(after=before, tolerance=_PRECISION)
            if found:
                there, row = found
                return Crossing(row, there, self.start + side * there) if there <= reach else None
            if travel >= reach:
                return None
            before = travel
        return None

    def travel(self, limits: Limits, side: int = 1) -> Travel:
        """How far the path may be followed to one side until each limit is reached.

        Args:
            limits: what is to be met. The scan's own `PathScan.limits` are usually None here: the
                question is when the criterion's own wrenches would be clipped.
            side: +1 towards rising values of the coordinate, or -1.
        """
        side = check_side(side)
        begin = self.begin
        table = margin_table(begin.stance, limits)

        def measure(point: ScanPoint) -> tuple[np.ndarray, np.ndarray]:
            return table.slack(point.forces, point.torques), side * table.slack_rates(
                *rates_or_nan(point)
            )

        track = Track(lambda travel: measure(self.at(self.start + side * travel)))
        reach = 0.0
        for value in self._outwards(side):
            try:
                point = self.at(value)
            except CopsenseError:
                break  # no posture, or no wrenches, further on
            reach = self._travel(value, side)
            track.add(reach, *measure(point))
        slack = table.slack(begin.forces, begin.torques)
        rates = side * table.slack_rates(begin.force_rates, begin.torque_rates)
        values = table.values(begin.forces, begin.torques)
        nears = -rates > _CLOSING * np.abs(slack)
        closing = np.where(nears, slack / np.where(nears, -rates, 1.0), np.inf)
        closing = np.where(slack < 0, 0.0, closing)
        found = []
        for rows in table.groups:
            crossing = track.first_zero(rows, tolerance=_PRECISION)
            exact, row = crossing or (None, int(rows[int(np.argmin(closing[rows]))]))
            margin, first = table.margin(rows, values), float(closing[row])
            found.append(LimitTravel(margin, table.names[row], first, exact))
        found.sort(key=lambda f: (np.inf if f.exact is None else f.exact, f.first_order))
        return Travel(side, tuple(found), reach)

    def next_active_set_change(self, side: int = 1) -> ActiveSetChange | None:
        """Follow the path to one side until another set of the scan's limits presses.

        From a posture at which none does, that is where the first one binds.

        Args:
            side: +1 towards rising values of the coordinate, or -1.

        Returns:
            The change, or None if there is none within reach.

        Raises:
            InvalidInputError: the scan has no limits.
            InfeasibleError: no wrench respects the limits where the path begins.
        """
        side = check_side(side)
        if self.limits is None or not self.limits.any:
            raise InvalidInputError("no limit is switched on: there is none to meet. Give one.")
        limits, begin = self.limits, self.begin
        assert isinstance(begin.equilibrium, ConstrainedEquilibrium)
        predicted = begin.sensitivity.next_active_set_change(side * begin.tangent)
        pressing = begin.equilibrium.pressing_after(side * begin.tangent)

        def evaluate(travel: float) -> tuple[np.ndarray, np.ndarray]:
            here, tangent = self.path.at(self.start + side * travel)
            return distance_to_change(here, self.criterion, limits, pressing, side * tangent)

        track = Track(evaluate)
        before = _HERE
        track.add(before, *evaluate(before))
        if np.any(track.values_at(before) < -_ROUNDING):
            found: tuple[float, int] | None = (before, int(np.argmin(track.values_at(before))))
        else:
            found = None
            for value in self._outwards(side):
                travel = self._travel(value, side)
                if travel <= before:
                    continue
                try:
                    track.add(travel, *evaluate(travel))
                except CopsenseError:
                    break  # no posture further on
                a, b = track.values_at(before), track.values_at(travel)
                rows = np.flatnonzero((b < -_ROUNDING) | ((a > _ROUNDING) & (b > _ROUNDING)))
                found = track.first_zero(rows, after=before, tolerance=_CHANGE_PRECISION)
                if found:
                    break
                before = travel
        if found is None:
            return None
        travel, row = found
        there = self.start + side * travel
        left, right = self._sides(there, side)
        return ActiveSetChange(
            self.criterion.name,
            begin.equilibrium.names[row],
            begin.equilibrium.kinds[row],
            row not in pressing,
            travel,
            np.inf if predicted is None else predicted.travel,
            there,
            left,
            right,
        )

    def _outwards(self, side: int) -> Iterator[float]:
        """Values of the coordinate from the beginning to one end of the path."""
        values = np.asarray(self.path.values, dtype=float)
        yield self._begin
        beyond = values[side * (values - self._begin) > _SAME]
        yield from (float(value) for value in (beyond if side > 0 else beyond[::-1]))

    def _travel(self, value: float, side: int) -> float:
        """How far a value is from the start; of the start itself 0, not -0."""
        return side * (value - self.start) + 0.0

    def _sides(self, value: float, side: int) -> tuple[np.ndarray | None, np.ndarray | None]:
        """dCoP/dcoordinate before and after on the way; None where there is none."""
        try:
            here, tangent = self.path.at(value)
            there = cop_sensitivity(here, self.criterion, self.limits)
        except CopsenseError:
            return None, None  # a contact that just unloads has no centre of pressure to speak of
        found: list[np.ndarray | None] = []
        for one in (-side, side):
            try:
                found.append(there.one_sided(tangent, side=one))
            except CopsenseError:
                found.append(None)  # the limits may leave no way: a brink, or a sole's corner
        return found[0], found[1]


def limit_travel(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    direction: int = 1,
    *,
    reach: float = 0.15,
    samples: int = 15,
) -> Travel:
    """Travel of the CoM sideways until each limit binds, first order and exact.

    The path is the lateral sweep's through this stance: CoM x held, postures nearest to it. The
    wrenches are the criterion's own, without limits: the question is when they would be clipped.
    For several criteria or sides share the postures: ``PathScan(path, criterion).travel(limits)``
    with one `LateralPath`.

    Args:
        stance: where the path begins.
        criterion: what shares the load.
        limits: what is to be met.
        direction: +1 towards world +y, -1 towards -y.
        reach: how far to look [m].
        samples: postures looked at before the crossings are refined.

    Raises:
        InvalidInputError: a direction other than +1 or -1, or nothing to look at.
    """
    check_side(direction)
    return PathScan(LateralPath(stance, reach, samples), criterion).travel(limits, direction)


def next_active_set_change(
    stance: Stance,
    criterion: Criterion,
    limits: Limits,
    direction: int = 1,
    *,
    reach: float = 0.15,
    samples: int = 15,
) -> ActiveSetChange | None:
    """Follow the lateral path of a stance until another set of limits presses.

    The wrenches are those within the limits. For several criteria or sides share the postures:
    ``PathScan(path, criterion, limits).next_active_set_change(side)`` with one `LateralPath`.

    Args:
        stance: where the path begins.
        criterion: what shares the load.
        limits: what is to be met.
        direction: +1 towards world +y, -1 towards -y.
        reach: how far to look [m].
        samples: postures looked at before the change is refined.

    Returns:
        The change, its travel and value in metres of CoM y, or None if there is none within reach.

    Raises:
        InvalidInputError: a direction other than +1 or -1, or no limit to meet.
        InfeasibleError: no wrench respects the limits where the path begins.
    """
    check_side(direction)
    path = LateralPath(stance, reach, samples)
    return PathScan(path, criterion, limits).next_active_set_change(direction)


def check_side(side: int) -> int:
    """A side of a path.

    Raises:
        InvalidInputError: it is not +1 or -1.
    """
    if side not in (1, -1):
        raise InvalidInputError(
            f"the direction is +1 or -1 along the path's coordinate (world y), got {side}."
        )
    return int(side)
