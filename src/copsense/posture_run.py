"""PostureRun: postures one after the other, as they were recorded, logged, swept or searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from copsense.arrays import check_type, finite_array
from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class PostureRun(ShortRepr):
    """Postures in order, of one robot on the same contacts, with what was measured there.

    Attributes:
        stance: the robot and the contacts; every posture is one of its own.
        axis: what `values` are: ``"time"``, or what was swept or counted.
        unit: of them.
        values: one for each posture, rising or falling (N,).
        configurations: the postures (N, nq).
        rows: which rows of the source they are; those without a posture are left out (N,).
        measured: centres of pressure in contact axes (N, nc, 2) [m], NaN where a contact carries
            nothing; None where nothing was measured.
        velocities: of a motion (N, nv), NaN where it is not known; None for postures at rest.
        accelerations: likewise, dv/dt (N, nv).
        source: where they come from, in a word or two; a file's path.
        python: lines that make ``run``, this one; ``{stance}`` stands for the stance in them. Empty
            where only the caller has it.
    """

    stance: Stance
    axis: str
    unit: str
    values: Float[np.ndarray, " N"]
    configurations: Float[np.ndarray, "N nq"]
    rows: Int[np.ndarray, " N"]
    measured: Float[np.ndarray, "N nc 2"] | None = None
    velocities: Float[np.ndarray, "N nv"] | None = None
    accelerations: Float[np.ndarray, "N nv"] | None = None
    source: str = ""
    python: str = ""

    def __post_init__(self) -> None:
        """Own the arrays."""
        optional = ("measured", "velocities", "accelerations")
        freeze(self, "values", "configurations", "rows")
        freeze(self, *(name for name in optional if getattr(self, name) is not None))

    def __len__(self) -> int:
        """Number of postures."""
        return len(self.values)

    def at(self, row: int) -> Stance:
        """A posture, at rest.

        In closed loop and in a log a foot may be off its place by a little: it is where it was.
        """
        return self.stance.at(self.configurations[row], check=False)

    def moving(self, row: int) -> Stance | None:
        """A posture with its motion, which what is solved on it then carries; None without."""
        if self.velocities is None or self.accelerations is None:
            return None
        v, a = self.velocities[row], self.accelerations[row]
        if not (np.isfinite(v).all() and np.isfinite(a).all()):
            return None
        return self.at(row).moving(v, a)

    @classmethod
    def of_stances(
        cls,
        stances: Sequence[Stance],
        values: ArrayLike | None = None,
        axis: str = "posture",
        unit: str = "",
        source: str = "postures",
    ) -> PostureRun:
        """The run of some stances, such as a path's or what a search went through.

        Args:
            stances: of one robot on the same contacts.
            values: what stands along the run, rising or falling; default their numbers.
            axis: what the values are.
            unit: of them.
            source: where they come from.

        Raises:
            InvalidInputError: there is none, they differ in robot or contacts, or the values do not
                fit them.
        """
        for each in stances:
            check_type(each, Stance, "a stance of a run", "Give copsense.Stance values.")
        if not stances:
            raise InvalidInputError("a run needs at least one stance.")
        first = stances[0]
        if any(s.robot is not first.robot or s.contacts != first.contacts for s in stances):
            raise InvalidInputError(
                "the stances of a run differ in their robot or contacts: give those of one path, "
                "or of one stance.at(q)."
            )
        along = np.arange(len(stances), dtype=float)
        if values is not None:
            along = finite_array(values, "the values of a run", (len(stances),), axis)
        q = np.array([s.q for s in stances])
        return cls(first, axis, unit, along, q, np.arange(len(stances)), source=source)
