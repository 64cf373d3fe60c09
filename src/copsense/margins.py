"""Margins: how far an equilibrium is from each limit, in its own unit and in CoM travel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.optimize
from jaxtyping import Float

from copsense.arrays import finite_number
from copsense.contact import Contact
from copsense.criterion import Criterion
from copsense.errors import CopsenseError, InvalidInputError
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.path import lateral_posture
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium, solve_equilibrium

# Of a margin, by the limit's kind; "N" for the others.
UNITS = {"cop": "m", "torsion": "N m", "torque": "N m"}
_STILL = 1e-12  # rates under which a margin does not change
_PRECISION = 1e-9  # of an exact travel [m]


@dataclass(frozen=True)
class LimitMargin:
    """The distance to one limit of one contact or joint.

    Attributes:
        name: the nearest row of it, such as ``"l_sole: CoP at the +y (left) edge"``.
        where: name of the contact or joint.
        kind: ``"cop"``, ``"friction"``, ``"normal force"``, ``"torsion"``, ``"wrench cone"`` or
            ``"torque"``.
        value: signed distance, negative beyond the limit.
        unit: ``"m"`` for the centre of pressure, ``"N"`` or ``"N m"``.
    """

    name: str
    where: str
    kind: str
    value: float
    unit: str


@dataclass(frozen=True)
class LimitTravel:
    """How far the CoM may go along a path until one limit is reached.

    Attributes:
        margin: the margin of the contact or joint to this kind of limit where the path begins.
        name: the very limit that is met (another edge than the nearest one at the start, say);
            where none is met within reach, the one predicted.
        first_order: its travel predicted by the sensitivity there [m]; infinite if it moves away,
            0 where it is beyond its bound already.
        exact: its travel found along the path [m]; None if no such limit is met within reach.
    """

    margin: LimitMargin
    name: str
    first_order: float
    exact: float | None


@dataclass(frozen=True)
class Travel:
    """What the CoM meets on its way to one side.

    Attributes:
        direction: +1 towards world +y, -1 towards -y.
        limits: every limit, the nearest by exact travel first.
        reach: how far the path was followed [m]; less than asked where no posture was found.
    """

    direction: int
    limits: tuple[LimitTravel, ...]
    reach: float

    @property
    def first(self) -> LimitTravel | None:
        """The limit met first, or None if none is met within reach."""
        return self.limits[0] if self.limits and self.limits[0].exact is not None else None


def limit_margins(equilibrium: StaticEquilibrium, limits: Limits) -> tuple[LimitMargin, ...]:
    """The margin of every contact and joint to every kind of limit, the smallest row of each."""
    table = margin_table(equilibrium.stance, limits)
    values = table.values(equilibrium.forces, equilibrium.torques)
    return tuple(table.margin(rows, values) for rows in table.groups)


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
    check_search(direction, reach, samples)
    table = margin_table(stance, limits)
    y0 = float(stance.com[1])

    def at(y: float, near: Stance) -> tuple[Stance, np.ndarray]:
        here, _ = lateral_posture(stance, y, near=near)
        solved = solve_equilibrium(here, criterion)
        return here, table.values(solved.forces, solved.torques)

    start, tangent = lateral_posture(stance, y0)
    begin = solve_equilibrium(start, criterion)
    values = table.values(begin.forces, begin.torques)
    df, dtau = (d[:, 0] for d in begin.derivative(tangent[:, None]))
    rates = table.rates(begin, values, df, dtau) * direction

    walked: list[tuple[float, Stance, np.ndarray]] = [(0.0, start, values)]
    for step in np.linspace(0.0, reach, samples + 1)[1:]:
        try:
            walked.append((float(step), *at(y0 + direction * float(step), walked[-1][1])))
        except CopsenseError:
            break  # no posture, or no normal force, further on
    closing = np.where(rates < -_STILL, -values / np.minimum(rates, -_STILL), np.inf)
    closing = np.where(values < 0, 0.0, closing)
    found = []
    for rows in table.groups:
        crossing = _first_crossing(rows, walked, lambda s, near: at(y0 + direction * s, near)[1])
        row, exact = crossing or (int(rows[int(np.argmin(closing[rows]))]), None)
        first = float(closing[row])
        found.append(LimitTravel(table.margin(rows, values), table.names[row], first, exact))
    found.sort(key=lambda f: (np.inf if f.exact is None else f.exact, f.first_order))
    return Travel(direction, tuple(found), walked[-1][0])


def check_search(direction: int, reach: float, samples: int) -> None:
    """Refuse a search along the lateral path that has no side, no length or no posture.

    Raises:
        InvalidInputError: says which, and what would do.
    """
    if direction not in (1, -1):
        raise InvalidInputError(f"the direction is +1 or -1 along world y, got {direction}.")
    finite_number(reach, "the reach [m]", positive=True)
    if samples < 1:
        raise InvalidInputError(f"the search needs 1 sample or more, got {samples}.")


def _first_crossing(
    rows: np.ndarray,
    walked: list[tuple[float, Stance, np.ndarray]],
    evaluate: Callable[[float, Stance], np.ndarray],
) -> tuple[int, float] | None:
    """The first row to be at its bound, and the travel at which it is; None if all stay within."""
    begin = walked[0][2][rows]
    if np.any(begin < 0):
        return int(rows[int(np.argmin(begin))]), 0.0
    for (a, near, before), (b, _, after) in pairwise(walked):
        crossed = [i for i in rows if before[i] >= 0 > after[i]]
        if crossed:
            roots = []
            for i in crossed:

                def one(s: float, row: int = i, start: Stance = near) -> float:
                    return float(evaluate(s, start)[row])

                root = float(scipy.optimize.brentq(one, a, b, xtol=_PRECISION))
                roots.append((root, int(i)))
            travel, row = min(roots)
            return row, travel
    return None


class MarginTable:
    """Rows of limits in their own units, grouped by contact or joint and kind.

    Made once, it serves every equilibrium of a path.

    Attributes:
        names: what each row limits (r,).
        kinds: the kind of each row (r,).
        where: the contact or joint of each row (r,).
        groups: indices of the rows of each contact or joint and kind.
    """

    def __init__(self, contacts: Sequence[Contact], rows: LimitRows) -> None:
        """Lay the rows of these contacts, from `limit_rows`, out."""
        self.contact_rows, self.fz = rows, _normal_rows(contacts)
        self.joint, self.sign = rows.joint, rows.sign
        self.limit = rows.torque[self.joint]
        self.names = rows.names + rows.torque_names
        self.kinds = rows.kinds + ("torque",) * len(self.joint)
        self.where = tuple(contacts[k].name for k in rows.contacts) + tuple(
            rows.joints[i] for i in self.joint
        )
        self.is_cop = np.array([kind == "cop" for kind in rows.kinds], dtype=bool)
        self.row_fz = self.fz[np.array(rows.contacts, dtype=int)]
        keys = list(zip(self.where, self.kinds, strict=True))
        self.groups = [
            np.array([i for i, other in enumerate(keys) if other == key])
            for key in dict.fromkeys(keys)
        ]

    def values(
        self, forces: Float[np.ndarray, " m"], torques: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " r"]:
        """Signed distance of each row [m, N or N m]."""
        values = self.slack(forces, torques)
        # A CoP row is f_z (b - a p): its distance is that over f_z.
        values[: len(self.is_cop)][self.is_cop] /= forces[self.row_fz[self.is_cop]]
        return values

    def slack(
        self, forces: Float[np.ndarray, " m"], torques: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " r"]:
        """The same as forces and moments, b - A f [N, N m], so linear in the forces."""
        contact = self.contact_rows.bound - self.contact_rows.matrix @ forces
        return np.concatenate([contact, self.limit - self.sign * torques[self.joint]])

    def rates(
        self,
        at: StaticEquilibrium,
        values: Float[np.ndarray, " r"],
        df: Float[np.ndarray, " m"],
        dtau: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, " r"]:
        """Derivatives of `values` along a motion that changes forces and torques by df, dtau."""
        change, cop = -self.contact_rows.matrix @ df, self.is_cop
        k = len(change)
        fz = self.row_fz[cop]
        change[cop] = (change[cop] - values[:k][cop] * df[fz]) / at.forces[fz]
        return np.concatenate([change, -self.sign * dtau[self.joint]])

    def margin(self, rows: np.ndarray, values: np.ndarray) -> LimitMargin:
        """The smallest of a group."""
        i = int(rows[int(np.argmin(values[rows]))])
        kind = self.kinds[i]
        return LimitMargin(
            self.names[i], self.where[i], kind, float(values[i]), UNITS.get(kind, "N")
        )


def margin_table(stance: Stance, limits: Limits) -> MarginTable:
    """The table of a stance's limits."""
    return MarginTable(stance.contacts, limit_rows(stance, limits))


def _normal_rows(contacts: Sequence[Contact]) -> np.ndarray:
    """Row of the normal force of each contact in stacked forces."""
    starts = np.cumsum([0, *(len(contact.components) for contact in contacts)])
    return np.array([start + c.normal_row for c, start in zip(contacts, starts, strict=False)])
