"""Travel: what is met on the way along a path, and how far away it is."""

from __future__ import annotations

from dataclasses import dataclass

from copsense.margins import LimitMargin


@dataclass(frozen=True)
class Crossing:
    """Where on its way one of several quantities first falls below zero.

    Attributes:
        row: which of them.
        travel: how far from the start, in units of the path's coordinate.
        value: the coordinate there.
    """

    row: int
    travel: float
    value: float


@dataclass(frozen=True)
class LimitTravel:
    """How far the path may be followed until one limit is reached.

    Attributes:
        margin: the margin of the contact or joint to this kind of limit where the path begins.
        name: the very limit that is met (another edge than the nearest one at the start, say);
            where none is met within reach, the one predicted.
        first_order: its travel predicted by the slack and its derivative there [m]; infinite if it
            moves away, 0 where it is beyond its bound already.
        exact: its travel found along the path [m]; None if no such limit is met within reach.
    """

    margin: LimitMargin
    name: str
    first_order: float
    exact: float | None


@dataclass(frozen=True, repr=False)
class Travel:
    """What the CoM meets on its way to one side.

    Attributes:
        direction: +1 towards rising values of the path's coordinate (world +y), or -1.
        limits: every limit, the nearest by exact travel first.
        reach: how far the path was followed [m]; less than asked where no posture was found.
    """

    direction: int
    limits: tuple[LimitTravel, ...]
    reach: float

    def __repr__(self) -> str:
        """The limit that is met first, and how far the path was followed."""
        way = f"{'+' if self.direction > 0 else '-'}{self.reach * 1e3:.1f} mm"
        if self.first is None or self.first.exact is None:
            return f"Travel(none of {len(self.limits)} limits met within {way})"
        return (
            f"Travel({self.first.exact * 1e3:.1f} mm to {self.first.name}, the first of "
            f"{len(self.limits)} limits; followed to {way})"
        )

    @property
    def first(self) -> LimitTravel | None:
        """The limit met first, or None if none is met within reach."""
        return self.limits[0] if self.limits and self.limits[0].exact is not None else None
