"""ComRegion: a convex region of horizontal positions of the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import finite_array
from copsense.polygon import Polygon
from copsense.regions.refinement import Points
from copsense.stance import Stance

BOX = 10.0  # m: how far from the stance's CoM a region is followed along x and along y
MERGE = 1e-8  # m: vertices nearer than this to the line of their neighbours are left out
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
        object.__setattr__(self, "polygon", self.outline.vertices)

    def __repr__(self) -> str:
        """Its extent, area and whether it was cut."""
        if self.empty:
            return "ComRegion(empty)"
        (x0, y0), (x1, y1) = self.polygon.min(axis=0), self.polygon.max(axis=0)
        size = f"{self.area * 1e4:.4g} cm2"
        if self.area == 0:
            size = f"{float(np.linalg.norm(self.polygon[-1] - self.polygon[0])) * 1e3:.4g} mm long"
        return (
            f"ComRegion({size}, {len(self.polygon)} vertices, x {x0:.4g} to {x1:.4g} m, "
            f"y {y0:.4g} to {y1:.4g} m{'' if self.bounded else ', cut at the box: without end'})"
        )

    @cached_property
    def outline(self) -> Polygon:
        """The polygon as a figure, with edges and distances."""
        return Polygon(self.polygon)

    @property
    def empty(self) -> bool:
        """Whether no position is in it."""
        return not self.outline

    @property
    def area(self) -> float:
        """Area [m^2]; zero for an interval, a segment, a point or nothing."""
        return self.outline.area

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
        if len(self.outline) >= 3 or (self.interval and len(self.outline) == 2):
            nearest = float(self.outline.margins(p))
            if nearest >= 0 or self.interval:
                return nearest
        return -self.outline.boundary_distance(p)

    def contains(self, point: ArrayLike) -> bool:
        """Whether a horizontal position (2,) [m] is in the polygon or within 1e-9 m of it."""
        return self.margin(point) >= -_ON


def region_between(
    stance: Stance, inner: Points, outer: Float[np.ndarray, "l 2"], *, interval: bool
) -> ComRegion:
    """A region from its inner polygon, made minimal, and the corners of an outer one."""
    polygon = Polygon.merged(inner, MERGE)
    gap = max((polygon.boundary_distance(corner) for corner in outer), default=0.0)
    reach = np.abs(polygon.vertices - stance.com[:2]).max(initial=0.0)
    return ComRegion(polygon.vertices, gap, bool(reach < BOX * (1 - 1e-6)), interval)
