"""Quantities: what an optimisation makes larger or smaller, each the least or the largest of rows.

Rows are smooth over postures, so that they have gradients: a quantity itself has kinks where
another row takes over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from copsense.contact import Contact
from copsense.cop import contact_cops
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import Limits, limit_rows
from copsense.margins import margin_table
from copsense.path import COM_COORDINATES, level_posture
from copsense.pushes import push_planes
from copsense.sensitivity import cop_rates
from copsense.stance import Stance
from copsense.statics import StaticEquilibrium, solve_equilibrium

_STILL = 1e-12  # change of a slack [N] per metre of the CoM that is none
_FAR = 1.0  # m, or of a push weights: limits farther away are not looked at
_UNLOADED = 1e-3  # share of the weight under which a contact's force is not divided by
_FLAT = 1e-6  # m: a sole with less room is a line
_TINY = 1e-9  # N m: a torque limit of nothing


@dataclass(frozen=True)
class Quantity:
    """Something to be optimised.

    Attributes:
        name: as ``--objective`` says it.
        unit: ``"m"``, ``"N"``, ``"N m"`` or ``"1"``.
        sign: +1 where more is better, and the least row counts; -1 where less is.
        size: a usual value, which sets the scale of the program.
        words: what it is.
        along: whether rows at the ends of exact paths belong to it as well, see `Gauge.ends`.
    """

    name: str
    unit: Literal["m", "N", "N m", "1"]
    sign: int
    size: float
    words: str
    along: bool = False

    def value(self, rows: Float[np.ndarray, " r"]) -> float:
        """The quantity, from its rows."""
        return float(self.sign * (self.sign * rows).min())

    def most(self, weight: float) -> float:
        """The most that is measured of it, under a robot of a weight [N]; in its unit."""
        if self.sign < 0:
            return math.inf
        return _FAR * weight if self.unit == "N" else _FAR if self.unit == "m" else 1.0

    def shown(self, value: float, digits: int = 2) -> str:
        """A value with its unit, as people read it; of a length so many digits of its mm."""
        if math.isnan(value):
            return "none"
        if self.unit == "m":
            return f"over {_FAR:g} m" if value >= _FAR else f"{value * 1e3:.{digits}f} mm"
        return f"{value:.4g}" + ("" if self.unit == "1" else f" {self.unit}")


QUANTITIES = {
    each.name: each
    for each in (
        Quantity("travel", "m", 1, 0.03, "least travel of the CoM to a limit, to first order"),
        Quantity("sideways", "m", 1, 0.03, "the same to the sides alone, -y and +y"),
        Quantity("margin", "1", 1, 0.3, "least share of a limit that is left"),
        Quantity("push", "N", 1, 20.0, "least horizontal push that is not borne"),
        Quantity("gain", "1", -1, 1.0, "largest |dCoP/dCoM| of a contact"),
        Quantity("torque", "N m", -1, 10.0, "norm of the joint torques"),
    )
}

TRAVELS = ("travel", "sideways")
"""Names of the quantities that are travels of the CoM."""


def quantity_named(name: object, what: str = "objective") -> Quantity:
    """A quantity by its name.

    Raises:
        UnknownNameError: no such quantity.
    """
    if name not in QUANTITIES:
        raise UnknownNameError(what, str(name), QUANTITIES)
    return QUANTITIES[str(name)]


def way_of(coordinate: str, side: int) -> str:
    """A way along an axis, such as ``"+y"`` of ``"com_y"`` and 1."""
    return f"{'+' if side > 0 else '-'}{coordinate[-1]}"


class Gauge:
    """Measures the quantities of a stance's equilibria; laid out once, it serves every posture.

    Attributes:
        limits: what is not to be broken.
        frame: what is pushed.
        ends: of the paths that a quantity `along` them looks at: coordinate of the CoM, side, and
            how far from the middle [m].
    """

    ends: tuple[tuple[str, int, float], ...] = ()

    def __init__(self, stance: Stance, limits: Limits, frame: str | None = None) -> None:
        """Lay the rows of the limits out.

        Raises:
            UnknownNameError: no such frame.
        """
        self.limits: Limits = limits
        self.frame: str = stance.robot.base_frame if frame is None else frame
        self._pushed = stance.robot.base_nv == 6
        if self._pushed or frame is not None:
            stance.robot.frame(self.frame)
        self._weight = stance.robot.weight
        self._table = margin_table(stance, limits)
        self._contacts = stance.contact_names
        self._rows = limit_rows(stance, limits)
        self._scale, self._under = self._scales(stance)

    def __repr__(self) -> str:
        """The limits' rows, and what is pushed."""
        return f"Gauge({self._table!r}; pushed at {self.frame})"

    def names(self, quantity: Quantity) -> tuple[str, ...]:
        """What each row of a quantity is."""
        if quantity.along:
            ways = [f"CoM to {way_of(coordinate, side)}" for coordinate, side, _ in self.ends]
            ahead = [f"{name}, {way}" for way in ways for name in self._table.names]
            return (*self._table.names, *ahead) if quantity.name == "travel" else tuple(ahead)
        if quantity.name == "gain":
            return tuple(f"CoP of {name}" for name in self._contacts)
        return ("torques",) if quantity.name == "torque" else self._table.names

    def rows(self, quantity: Quantity, equilibrium: StaticEquilibrium) -> Float[np.ndarray, " r"]:
        """The rows of a quantity at an equilibrium, in its unit.

        Raises:
            CopsenseError: it has no such thing, such as the gain of a contact without load.
        """
        if quantity.name == "torque":
            return np.array([np.linalg.norm(equilibrium.torques)])
        if quantity.name == "margin":
            return self._margins(equilibrium)
        if quantity.name == "push":
            criterion = equilibrium.criterion
            assert isinstance(criterion, Criterion)
            if not self._pushed:
                raise InvalidInputError(
                    f"robot {equilibrium.stance.robot.name!r} lives in a plane: it cannot be "
                    "pushed out of it. Choose another objective."
                )
            normals, offsets = push_planes(equilibrium.stance, criterion, self.limits, self.frame)
            return _distances(offsets, np.linalg.norm(normals, axis=1), _FAR * self._weight)
        if quantity.along:
            ahead = [self._ahead(equilibrium, *end) for end in self.ends]
            if quantity.name == "travel":  # any other way to first order
                ahead.insert(0, self.rows(QUANTITIES["travel"], equilibrium))
            return np.concatenate(ahead)
        forces, torques = equilibrium.derivative(equilibrium.stance.com_motions)
        if quantity.name == "gain":
            change = equilibrium.stance.unstack(forces)
            gain = cop_rates(equilibrium, contact_cops(equilibrium), change)
            return np.asarray(np.linalg.norm(gain, 2, axis=(1, 2)))
        slack = self._table.slack(equilibrium.contact_forces, equilibrium.torques)
        rates = self._table.slack_rates(forces.T[:, : len(equilibrium.contact_forces)], torques.T)
        speed = abs(rates[1]) if quantity.name == "sideways" else np.linalg.norm(rates, axis=0)
        return _distances(slack, speed, _FAR)

    def measure(self, quantity: Quantity, equilibrium: StaticEquilibrium) -> float:
        """The quantity at an equilibrium, in its unit."""
        return quantity.value(self.rows(quantity, equilibrium))

    def _ahead(
        self, equilibrium: StaticEquilibrium, coordinate: str, side: int, along: float
    ) -> Float[np.ndarray, " r"]:
        """Travel along a level path to one side, to first order from `along` on it.

        Exact where a limit is met just there.
        """
        stance, criterion = equilibrium.stance, equilibrium.criterion
        middle = float(stance.com[COM_COORDINATES.index(coordinate)])
        end, tangent = level_posture(stance, coordinate, middle + side * along)
        found = solve_equilibrium(end, criterion)
        forces, torques = found.derivative(side * tangent[:, None])
        slack = self._table.slack(found.contact_forces, found.torques)
        rates = self._table.slack_rates(forces[: len(found.contact_forces), 0], torques[:, 0])
        closing = -rates > _STILL
        ahead = np.where(closing, slack / np.where(closing, -rates, 1.0), _FAR)
        # What is passed already and comes back was met before, how far before is not known here.
        ahead = np.where(~closing & (slack < 0), -along, ahead)
        return np.clip(along + ahead, 0.0, _FAR)

    def _margins(self, equilibrium: StaticEquilibrium) -> Float[np.ndarray, " r"]:
        """Share of each limit that is left: 0 where it is reached, negative beyond."""
        forces = equilibrium.contact_forces
        slack = self._table.slack(forces, equilibrium.torques)
        load = np.maximum(forces[self._under], _UNLOADED * self._weight)
        return slack / np.where(self._under < 0, self._scale, self._scale * load)

    def _scales(self, stance: Stance) -> tuple[Float[np.ndarray, " r"], Int[np.ndarray, " r"]]:
        """What each slack is a share of, and the normal force to multiply that with, or -1."""
        rows, rooms = self._rows, [_room(contact) for contact in stance.contacts]
        normal = [s.start + c.normal_row for c, s in zip(stance.contacts, stance.rows, strict=True)]
        scale, under = np.ones(len(rows.all_names)), np.full(len(rows.all_names), -1)
        for i, kind in enumerate(rows.all_kinds):
            if kind == "torque":
                scale[i] = max(float(rows.torque[rows.joint[i - len(rows.names)]]), _TINY)
                continue
            under[i] = normal[rows.contacts[i]]
            if kind == "cop":
                scale[i] = rooms[rows.contacts[i]]
            elif kind != "normal force":  # of friction, its coefficient
                scale[i] = abs(rows.matrix[i, under[i]]) or float(np.linalg.norm(rows.matrix[i]))
        return scale, under


def _room(contact: Contact) -> float:
    """How far inside its edges a sole's middle is [m]; of a line, half its length."""
    if contact.sole is None:
        return 1.0
    room = float(contact.sole.room(0.0 if contact.kind == "planar" else None))
    return room if room > _FLAT else float(np.ptp(contact.sole.vertices, axis=0).max()) / 2


def _distances(
    slack: Float[np.ndarray, " r"], speed: Float[np.ndarray, " r"], far: float
) -> Float[np.ndarray, " r"]:
    """slack / speed, no farther than `far`; of what stands still by its sign."""
    moves = speed > _STILL
    found = np.where(moves, slack / np.where(moves, speed, 1.0), np.where(slack < 0, -far, far))
    return np.clip(found, -far, far)
