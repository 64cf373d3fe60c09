"""Margins: how far an equilibrium is from each limit, in the limit's own unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from copsense.arrays import read_only
from copsense.contact import Contact
from copsense.limits import LimitRows, Limits, limit_rows
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium

# Of a margin, by the limit's kind; "N" for the others.
UNITS = {"cop": "m", "torsion": "N m", "torque": "N m"}


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


def limit_margins(equilibrium: StaticEquilibrium, limits: Limits) -> tuple[LimitMargin, ...]:
    """The margin of every contact and joint to every kind of limit, the smallest row of each."""
    table = margin_table(equilibrium.stance, limits)
    values = table.values(equilibrium.contact_forces, equilibrium.torques)
    return tuple(table.margin(rows, values) for rows in table.groups)


class MarginTable:
    """Rows of limits in their own units, grouped by contact or joint and kind.

    Made once, it serves every equilibrium of a path. Forces (..., m) are stacked over the contacts,
    torques (..., n) over the joints; results have their leading dimensions.

    Attributes:
        names: what each row limits (r,).
        kinds: the kind of each row (r,).
        where: the contact or joint of each row (r,).
        groups: indices of the rows of each contact or joint and kind.
    """

    def __init__(self, contacts: Sequence[Contact], rows: LimitRows) -> None:
        """Lay the rows of these contacts, from `limit_rows`, out."""
        self._contact_rows, fz = rows, _normal_rows(contacts)
        self._joint, self._sign = rows.joint, rows.sign
        self._limit = rows.torque[self._joint]
        self.names: tuple[str, ...] = rows.all_names
        self.kinds: tuple[str, ...] = rows.all_kinds
        self.where: tuple[str, ...] = tuple(contacts[k].name for k in rows.contacts) + tuple(
            rows.joints[i] for i in self._joint
        )
        # Rows of the centres of pressure, and of the normal force under each of them.
        self._cop = np.flatnonzero([kind == "cop" for kind in rows.kinds])
        self._under = fz[np.array(rows.contacts, dtype=int)[self._cop]]
        keys = list(zip(self.where, self.kinds, strict=True))
        self.groups: tuple[Int[np.ndarray, " k"], ...] = tuple(
            read_only(np.array([i for i, other in enumerate(keys) if other == key]))
            for key in dict.fromkeys(keys)
        )

    def __repr__(self) -> str:
        """How many rows and groups, and of which kinds."""
        kinds = ", ".join(dict.fromkeys(self.kinds)) or "none"
        return f"MarginTable({len(self.names)} rows in {len(self.groups)} groups; kinds: {kinds})"

    def values(
        self, forces: Float[np.ndarray, "*p m"], torques: Float[np.ndarray, "*p n"]
    ) -> Float[np.ndarray, "*p r"]:
        """Signed distance of each row [m, N or N m]."""
        values = self.slack(forces, torques)
        # A CoP row is f_z (b - a p): its distance is that over f_z.
        values[..., self._cop] /= forces[..., self._under]
        return values

    def slack(
        self, forces: Float[np.ndarray, "*p m"], torques: Float[np.ndarray, "*p n"]
    ) -> Float[np.ndarray, "*p r"]:
        """The same as forces and moments, b - A f [N, N m], so linear in the forces.

        Of a centre of pressure it is f_z (b - a p): affine in the CoM where the wrenches are, and
        negative for at least one edge where the contact pulls.
        """
        contact = self._contact_rows.bound - forces @ self._contact_rows.matrix.T
        return np.concatenate(
            [contact, self._limit - self._sign * torques[..., self._joint]], axis=-1
        )

    def slack_rates(
        self, force_rates: Float[np.ndarray, "*p m"], torque_rates: Float[np.ndarray, "*p n"]
    ) -> Float[np.ndarray, "*p r"]:
        """Derivatives of `slack` along a motion that changes forces and torques at these rates."""
        contact = -force_rates @ self._contact_rows.matrix.T
        return np.concatenate([contact, -self._sign * torque_rates[..., self._joint]], axis=-1)

    def value_rates(
        self,
        values: Float[np.ndarray, " r"],
        slack_rates: Float[np.ndarray, "r p"],
        forces: Float[np.ndarray, " m"],
        force_rates: Float[np.ndarray, "m p"],
    ) -> Float[np.ndarray, "r p"]:
        """Derivatives of `values` in p directions, by those of the slacks and of the forces."""
        found = np.array(slack_rates)
        # value = slack / f_z of a centre of pressure: the quotient rule.
        normal = forces[self._under][:, None]
        change = values[self._cop][:, None] * force_rates[self._under]
        found[self._cop] = (found[self._cop] - change) / normal
        return found

    def group_margins(
        self, forces: Float[np.ndarray, "*p m"], torques: Float[np.ndarray, "*p n"]
    ) -> Float[np.ndarray, "*p g"]:
        """The smallest margin of each group; NaN to a sole's edge where its contact does not push.

        Such a contact has no centre of pressure.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            values = self.values(forces, torques)
        pushes = forces[..., self._under] > 0
        values[..., self._cop] = np.where(pushes, values[..., self._cop], np.nan)
        margins = np.empty((*values.shape[:-1], len(self.groups)))
        for i, rows in enumerate(self.groups):
            margins[..., i] = values[..., rows].min(axis=-1)
        return margins

    def margin(self, rows: np.ndarray, values: Float[np.ndarray, " r"]) -> LimitMargin:
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
