"""PostureProgram: the nonlinear program of a posture, its constraints by name.

In epigraph form: maximise t such that every row of the objective is at least t. The variables are
those of `Variables` and t; that the contacts stay in place is an equality, so that every point has
values and derivatives, beyond a straight knee as well, and the solver sees where it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from copsense.batch.postures.coordinates import chart_coordinates, row_units
from copsense.batch.postures.reference_search import (
    constraint_errors,
    contact_target,
    moved_configuration,
)
from copsense.content import ShortRepr
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, UnloadedContactError
from copsense.optimisation.objectives import Gauge, Quantity, quantity_named
from copsense.optimisation.variables import Range, Variables, shown
from copsense.path import COM_COORDINATES
from copsense.posture import pull_back
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium, solve_equilibrium, with_tie_break

_TENTH = 10.0  # of a metre or radian, per unit of a constraint
_TEN = 10.0  # the objective's usual size, in units of t
_FAILED = -1e4  # what a constraint is worth where there is no equilibrium
_STEP, _FINE = 1e-6, 1e-5  # of the variables, for forward and for central differences
_RANK = 1e-7  # of the contacts' singular values: what is below says nothing of its own


@dataclass(frozen=True, eq=False, repr=False)
class Point(ShortRepr):
    """The program at some variables.

    Attributes:
        equal: what is to be zero (m,).
        rows: of the objective, to be at least t (r,).
        rest: what is to be at least zero (c,).

    Of derivatives each has a second dimension, the variables.
    """

    equal: Float[np.ndarray, "m *d"]
    rows: Float[np.ndarray, "r *d"]
    rest: Float[np.ndarray, "c *d"]


class PostureProgram:
    """What is to be optimised, and within which constraints.

    Attributes:
        stance: where it begins.
        variables: what may change.
        objective: what is optimised.
        scale: units of t per unit of the objective.
        equal_names: what each equality keeps.
        row_names: what each row of the objective is.
        rest_names: what each other constraint asks for.
    """

    def __init__(
        self,
        stance: Stance,
        criterion: Criterion,
        variables: Variables,
        gauge: Gauge,
        objective: Quantity,
        *,
        require: Mapping[str, float],
        within: Mapping[str, Range],
        distance: Range | None,
    ) -> None:
        """Lay the constraints out.

        Args:
            stance: where it begins.
            criterion: what shares the load, unless the variables have a family.
            variables: what may change.
            gauge: of the limits.
            objective: what is to be optimised.
            require: other quantity -> the least, or the most, that it may be.
            within: coordinate of the CoM -> where it must stay [m].
            distance: between any two contacts, horizontally, least and largest [m].
        """
        self.stance: Stance = stance
        self.variables: Variables = variables
        self.gauge: Gauge = gauge
        self.objective: Quantity = objective
        self.scale: float = _TEN / objective.size
        self._criterion = with_tie_break(stance, criterion)
        self._built: tuple[tuple[float, ...], Criterion] = ((), self._criterion)
        self._require = [(quantity_named(n, "quantity"), value) for n, value in require.items()]
        self._within = [(COM_COORDINATES.index(n), *ends) for n, ends in within.items()]
        self._distance = distance
        self._standing = objective.sign < 0 and bool(gauge.names(_MARGIN))
        plan = variables.plan
        loops = stance.closures.names if stance.closures else ()
        self.equal_names: tuple[str, ...] = (
            *(f"{name} in place" for name, _ in row_units(stance, plan)),
            *(f"{name} closed" for name in loops),
        )
        self.row_names: tuple[str, ...] = gauge.names(objective)
        names = [f"limit: {n}" for n in gauge.names(_MARGIN)] if self._standing else []
        for quantity, value in self._require:
            side = "at least" if quantity.sign > 0 else "at most"
            asked = f"{quantity.name} {side} {quantity.shown(value)}"
            names += [f"{asked}: {row}" for row in gauge.names(quantity)]
        for axis, low, high in self._within:
            com = COM_COORDINATES[axis]
            names += [f"{com} at least {shown(low, 'm')}", f"{com} at most {shown(high, 'm')}"]
        for a, b in combinations(stance.contact_names, 2) if distance else ():
            low, high = distance or (0.0, 0.0)
            between = f"the distance of {a} and {b}"
            names += [
                f"{between} at least {shown(low, 'm')}",
                f"{between} at most {shown(high, 'm')}",
            ]
        self.rest_names: tuple[str, ...] = tuple(names)

    def __repr__(self) -> str:
        """Robot, objective, and how many variables and constraints there are."""
        return (
            f"PostureProgram({self.stance.robot.name!r}: {self.objective.name}; "
            f"{len(self.variables)} variables, {len(self.equal_names)} equalities, "
            f"{len(self.row_names) + len(self.rest_names)} inequalities)"
        )

    def check(self) -> None:
        """Measure the stance itself, so that what has no sense here says so at once.

        Raises:
            InvalidInputError: the objective or a required quantity has none for this robot.
        """
        found = solve_equilibrium(self.stance, self._criterion)
        for quantity in (self.objective, *(each for each, _ in self._require)):
            with suppress(UnloadedContactError):
                self.gauge.rows(quantity, found)

    def criterion(self, x: Float[np.ndarray, " k"]) -> Criterion:
        """The criterion at some variables."""
        family = self.variables.family
        if family is None:
            return self._criterion
        parameters = self.variables.parameters(x)
        if self._built[0] != parameters:
            built = with_tie_break(self.stance, family.build(parameters))
            self._built = parameters, built
        return self._built[1]

    def posture(self, x: Float[np.ndarray, " k"]) -> Stance:
        """The posture of some variables, its contacts where they are to be but for the search."""
        given = self.variables.given(x)
        return self._at(given)

    def settled(self, x: Float[np.ndarray, " k"]) -> Stance:
        """The posture of some variables, its contacts exactly in place.

        Raises:
            UnreachablePostureError: they cannot be brought there.
        """
        given, plan = self.variables.given(x), self.variables.plan
        first = self.stance.robot.model.nv + 3
        targets = []
        for k in range(len(self.stance.contacts)):
            place, axes = contact_target(plan, k, given[first + 3 * k : first + 3 * k + 3])
            targets.append(pin.SE3(axes, place))
        here = pull_back(self._at(given), targets)
        return self.stance.at(here.q)

    def projected(self, x: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """The variables of the settled posture.

        Raises:
            UnreachablePostureError: there is none.
        """
        plan, before = self.variables.plan, self.variables.given(x)
        given = np.array(chart_coordinates(self.settled(x), plan.names).given)
        nb = self.stance.robot.base_nv
        turns = slice(3, 6) if nb == 6 else slice(2, 3)  # within half a turn of what they were
        given[turns] -= 2 * np.pi * np.round((given[turns] - before[turns]) / (2 * np.pi))
        return self.variables.at(given, self.variables.parameters(x))

    def equilibrium(self, x: Float[np.ndarray, " k"]) -> StaticEquilibrium:
        """The equilibrium at some variables."""
        return solve_equilibrium(self.posture(x), self.criterion(x))

    def at(self, x: Float[np.ndarray, " k"]) -> Point:
        """The program at some variables."""
        given = self.variables.given(x)
        here = self._at(given)
        errors, _ = constraint_errors(here, self.variables.plan, given)
        if here.closures is not None:
            errors = np.concatenate([errors, here.closures.error])
        try:
            found = solve_equilibrium(here, self.criterion(x))
            rows = self.objective.sign * self.scale * self.gauge.rows(self.objective, found)
            rest = self._rest(found)
        except CopsenseError:
            rows = np.full(len(self.row_names), _FAILED)
            rest = np.full(len(self.rest_names), _FAILED)
        return Point(_TENTH * errors, rows, rest)

    def broken(self, x: Float[np.ndarray, " k"]) -> float:
        """By how much some variables break a constraint, apart from the bounds."""
        point = self.at(x)
        return max(float(np.abs(point.equal).max(initial=0.0)), float(-point.rest.min(initial=0.0)))

    def value(self, point: Point) -> float:
        """The objective, in its own unit."""
        return float(self.objective.sign * point.rows.min() / self.scale)

    def slopes(self, x: Float[np.ndarray, " k"], point: Point, *, fine: bool = False) -> Point:
        """Derivatives of a point over the variables (.., k).

        Args:
            x: the variables.
            point: the program there.
            fine: by central differences.
        """
        step = _FINE if fine else _STEP
        ahead = [self.at(x + step * e) for e in np.eye(len(x))]
        behind = [self.at(x - step * e) for e in np.eye(len(x))] if fine else [point] * len(x)
        width = 2 * step if fine else step
        equal, rows, rest = (
            np.array([getattr(a, n) - getattr(b, n) for a, b in zip(ahead, behind, strict=True)])
            .reshape(len(x), -1)
            .T
            / width
            for n in ("equal", "rows", "rest")
        )
        return Point(equal, rows, rest)

    def independent(self, slopes: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "m i"]:
        """A basis of the equalities that say something of their own, as columns.

        Contacts of one foot say the same several times, which the solver does not bear.
        """
        u, s, _ = np.linalg.svd(slopes, full_matrices=False)
        kept = s > _RANK * max(float(s.max(initial=0.0)), 1e-300)
        return np.eye(len(slopes)) if kept.all() and len(s) == len(slopes) else u[:, kept]

    def _at(self, given: np.ndarray) -> Stance:
        stance, plan = self.stance, self.variables.plan
        nv = stance.robot.model.nv
        q = moved_configuration(stance, plan, stance.q, plan.given[:nv], given[:nv])
        return stance.at(q, check=False)

    def _rest(self, found: StaticEquilibrium) -> Float[np.ndarray, " c"]:
        here = found.stance
        parts = [_TEN * self.gauge.rows(_MARGIN, found)] if self._standing else []
        for quantity, value in self._require:
            beyond = quantity.sign * (self.gauge.rows(quantity, found) - value)
            parts.append(beyond * _TEN / quantity.size)
        for axis, low, high in self._within:
            parts.append(_TENTH * np.array([here.com[axis] - low, high - here.com[axis]]))
        if self._distance is not None:
            low, high = self._distance
            for a, b in combinations(here.placements, 2):
                apart = float(np.linalg.norm((a.translation - b.translation)[:2]))
                parts.append(_TENTH * np.array([apart - low, min(high - apart, _TENTH)]))
        return np.concatenate(parts) if parts else np.zeros(0)


_MARGIN = quantity_named("margin")
