"""Regions of the CoM as `copsense analyse --regions` draws and prints them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.limits import Limits
    from copsense.regions import ComRegions
    from copsense.stance import Stance

_REACH, _POSTURES = 0.05, 21  # of the CoM's path that is drawn with the regions [m]


def save_regions(
    stance: Stance,
    criteria: list[Criterion],
    limits: Limits,
    picture: str,
    *,
    overwrite: bool,
) -> ComRegions:
    """Draw the regions that limits leave, with the soles and the lateral path, and return them."""
    from copsense.path import lateral_sweep
    from copsense.plots import plot_regions, save_figure
    from copsense.plots.style import Figure
    from copsense.regions import com_regions
    from copsense.sweeps import sweep

    regions = com_regions(stance, criteria, limits)
    y = float(stance.com[1])
    x = None if stance.robot.base_nv != 6 else float(stance.com[0])
    path = lateral_sweep(stance, y - _REACH, y + _REACH, _POSTURES, com_x=x)
    figure = plot_regions(regions, sweep(path, criteria), com=stance.com[:2]).figure
    assert isinstance(figure, Figure)
    save_figure(figure, picture, overwrite=overwrite)
    return regions


def region_lines(regions: Mapping[str, Any]) -> Iterator[str]:
    """How large they are, and how far the CoM is inside."""
    yield "regions of the CoM, contacts and joints held at this posture:"
    width = max(map(len, regions))
    for name, row in regions.items():
        yield f"  {name:{width}}  {_size(row)}"


def _size(row: Mapping[str, Any]) -> str:
    if not len(row["polygon"]):
        return "empty"
    if not row["bounded"]:
        return "without end"
    size = f"{row['area'] * 1e4:8.1f} cm2"
    if row["area"] == 0:
        size = f"{math.dist(row['polygon'][0], row['polygon'][-1]) * 1e3:8.1f} mm wide"
    where = "inside" if row["margin"] >= 0 else "outside"
    return f"{size}, the CoM {abs(row['margin']) * 1e3:.1f} mm {where}"
