"""ComRegion: a convex region of horizontal positions of the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.contact import half_planes
from copsense.regions.polygon import Points, distance, tidy
from copsense.stance import Stance

BOX = 10.0  # m: how far from the stance's CoM a region is followed along x and along y
_ON = 1e-9  # m: a point this near to a region belongs to it


@dataclass(frozen=True, eq=False)
class ComRegion:
    """A convex region of horizontal positions of the centre of mass.

    Attributes:
        polygon: its vertices (k, 2), world x and y, counter-clockwise, none on the line of its
            neighbours [m]. Two for a segment, one for a point, none for an empty region.
        gap: the region lies between `polygon` and this distance around it [m].
        bounded: False where the region reaches the box of `BOX` metres about the stance's CoM, at
            which it was cut.
        interval: whether the robot lives in a plane, so that its region has one dimension and
            `polygon` the interval's two ends.
    """

    polygon: Float[np.ndarray, "k 2"]
    gap: float
    bounded: bool
    interval: bool = False

    def __post_init__(self) -> None:
        """Own the vertices."""
        polygon = finite_array(self.polygon, "the polygon of a region", (None, 2), "x, y [m]")
        object.__setattr__(self, "polygon", polygon)

    @property
    def empty(self) -> bool:
        """Whether no position is in it."""
        return len(self.polygon) == 0

    @property
    def area(self) -> float:
        """Area [m^2]; zero for an interval, a segment, a point or nothing."""
        x, y = (self.polygon - self.polygon[:1]).T
        return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2

    def margin(self, point: ArrayLike) -> float:
        """Signed distance of a horizontal position to the polygon's boundary [m].

        Args:
            point: (2,) world x, y [m].

        Returns:
            Positive inside, negative outside, minus infinity where the region is empty. A segment
            or a point has no inside. In an interval only the way along it counts.
        """
        p = finite_array(point, "the point", (2,), "world x, y [m]")
        if self.empty:
            return -np.inf
        if len(self.polygon) >= 3 or (self.interval and len(self.polygon) == 2):
            normals, offsets = half_planes(self.polygon)
            nearest = float(np.min(offsets - normals @ p))
            if nearest >= 0 or self.interval:
                return nearest
        return -distance(p, self.polygon)

    def contains(self, point: ArrayLike) -> bool:
        """Whether a horizontal position (2,) [m] is in the polygon or within 1e-9 m of it."""
        return self.margin(point) >= -_ON


def region_between(
    stance: Stance, inner: Points, outer: Float[np.ndarray, "l 2"], *, interval: bool
) -> ComRegion:
    """A region from its inner polygon, made minimal, and the corners of an outer one."""
    polygon = tidy(inner)
    gap = max((distance(corner, polygon) for corner in outer), default=0.0)
    reach = np.abs(polygon - stance.com[:2]).max(initial=0.0)
    return ComRegion(polygon, gap, bool(reach < BOX * (1 - 1e-6)), interval)
