"""Measurements: a robot's postures, how it moved there, and what its sensors said."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.contact import COMPONENT_NAMES
from copsense.content import ShortRepr, freeze
from copsense.cop import load_shares
from copsense.errors import InvalidInputError
from copsense.stance import Stance

_LEAST = 20  # rows
_MOVES = 1e-9  # spread of a channel, of its size, under which nothing was measured


@dataclass(frozen=True, eq=False, repr=False)
class EncoderErrors(ShortRepr):
    """Some rows as they would be if one encoder after the other read one deviation too much.

    Attributes:
        rows: which rows of the measurements (K,).
        shifted: those rows with each encoder's error in turn, one `Measurements` an encoder.
    """

    rows: Int[np.ndarray, " K"]
    shifted: tuple[Measurements, ...]

    def __post_init__(self) -> None:
        """Own the rows."""
        freeze(self, "rows")


@dataclass(frozen=True, eq=False, repr=False)
class Measurements(ShortRepr):
    """Rows of a record, in order of time, and the channels that were measured.

    Attributes:
        stances: the posture of each row (N,), in motion where inertia counts (`Stance.moving`).
        names: of the channels (c,), such as ``"load share of l_sole"`` or ``"torque of l_knee"``.
        values: measured (N, c), finite: shares [1], forces [N], moments [Nm], torques [Nm].
        encoders: constant errors of the encoders that intervals are to have in them.
    """

    stances: tuple[Stance, ...]
    names: tuple[str, ...]
    values: Float[np.ndarray, "N c"]
    encoders: EncoderErrors | None = None

    def __post_init__(self) -> None:
        """Own the values."""
        freeze(self, "values")

    @classmethod
    def of(
        cls,
        stances: Sequence[Stance],
        wrenches: ArrayLike | None = None,
        torques: ArrayLike | None = None,
    ) -> Measurements:
        """The channels that were measured throughout.

        Where only normal forces were measured these are load shares, of every contact but the
        last: a common scale of the sensors says nothing, but an offset of one changes the scale of
        the shares by its part of the weight. Of whole wrenches it is every component.

        Args:
            stances: the posture of each row, at least 20.
            wrenches: of the ground on each contact (N, nc, 6), contact axes; NaN where not
                measured, and None where none was.
            torques: of the motors (N, n), likewise.

        Raises:
            InvalidInputError: too few rows, other shapes, or nothing measured that moves.
        """
        stances = tuple(stances)
        if len(stances) < _LEAST:
            raise InvalidInputError(
                f"{len(stances)} rows are too few to identify anything from. Give {_LEAST} or more."
            )
        names, columns = _channels(stances, wrenches, torques)
        kept = [i for i, x in enumerate(columns) if np.ptp(x) > _MOVES * np.abs(x).max()]
        if not kept:
            raise InvalidInputError(
                "nothing was measured that moves: no load share, wrench or torque is known on all "
                "rows. Give rows on which sensors worked."
            )
        values = np.column_stack([columns[i] for i in kept])
        return cls(stances, tuple(names[i] for i in kept), values)

    def with_encoders(
        self,
        rows: Int[np.ndarray, " K"],
        records: Iterable[tuple[Sequence[Stance], ArrayLike, ArrayLike | None]],
    ) -> Measurements:
        """The same with constant errors of the encoders for the intervals.

        Args:
            rows: some of the rows.
            records: for each encoder the stances, wrenches and torques of those rows, as of `of`,
                if it read one standard deviation too much.
        """
        shifted = []
        for stances, wrenches, torques in records:
            columns = dict(zip(*_channels(tuple(stances), wrenches, torques), strict=True))
            values = np.column_stack([columns[name] for name in self.names])
            shifted.append(Measurements(tuple(stances), self.names, values))
        return replace(self, encoders=EncoderErrors(rows, tuple(shifted)))

    def predicted(
        self, forces: Float[np.ndarray, "N m *p"], torques: Float[np.ndarray, "N n *p"]
    ) -> Float[np.ndarray, "N c *p"]:
        """The linear channels of forces and torques; of load shares the forces (`shares_of`)."""
        first = self.stances[0]
        wrenches = np.array([first.unstack(f) for f in forces])
        columns = []
        for name in self.names:
            what, _, of = name.rpartition(" of ")
            if what == "torque":
                columns.append(torques[:, first.robot.torque_names.index(of)])
            elif what == "load share":
                columns.append(wrenches[:, first.contact_names.index(of), 2])
            else:
                contact, _, component = name.rpartition(" ")
                i = COMPONENT_NAMES.index(component)
                columns.append(wrenches[:, first.contact_names.index(contact), i])
        return np.stack(columns, axis=1)

    @property
    def shares(self) -> tuple[int, ...]:
        """Which channels are load shares."""
        return tuple(i for i, name in enumerate(self.names) if name.startswith("load share of "))

    def subset(self, rows: np.ndarray) -> Measurements:
        """Some of the rows."""
        return Measurements(tuple(self.stances[i] for i in rows), self.names, self.values[rows])


def _channels(
    stances: tuple[Stance, ...], wrenches: ArrayLike | None, torques: ArrayLike | None
) -> tuple[list[str], list[np.ndarray]]:
    """Names and columns of what was measured on all rows."""
    first = stances[0]
    names: list[str] = []
    columns: list[np.ndarray] = []
    if wrenches is not None:
        given = _rows(wrenches, "the wrenches", (len(stances), len(first.contacts), 6))
        for k, contact in enumerate(first.contacts):
            for i in contact.components:
                names.append(f"{contact.name} {COMPONENT_NAMES[i]}")
                columns.append(given[:, k, i])
        known = np.isfinite(columns).all(axis=1)
        if not known.all():  # normal forces alone
            if not np.isfinite(given[:, :, 2]).all() or len(first.contacts) < 2:
                names, columns = [], []
            else:
                names = [f"load share of {c.name}" for c in first.contacts[:-1]]
                columns = list(load_shares(given).T[:-1])
    if torques is not None:
        motors = first.robot.torque_names
        given = _rows(torques, "the torques", (len(stances), len(motors)))
        for i, name in enumerate(motors):
            if np.isfinite(given[:, i]).all():
                names.append(f"torque of {name}")
                columns.append(given[:, i])
    return names, columns


def _rows(values: ArrayLike, what: str, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of a shape; NaN where not measured."""
    array = np.array(values, dtype=float)
    finite_array(np.nan_to_num(array), what, shape)
    return array
