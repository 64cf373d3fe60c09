"""Movable: what of a stance an explorer can move, from where to where."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
import pinocchio as pin

from copsense.batch import PostureChart, coordinate_names
from copsense.path import COM_COORDINATES
from copsense.stance import Stance

_WRONG_SIDE = 2.5  # rad of yaw from which a base looks backwards


class Coordinate(NamedTuple):
    """What a slider moves.

    Attributes:
        name: as `PostureChart` has it.
        unit: of its value.
        home: the stance's own value [m, rad].
        low: from where on it can be asked for.
        high: up to where.
        kind: what it is of.
        sign: -1 where it is shown with the sign reversed, as roll and pitch of a base that looks
            backwards.
    """

    name: str
    unit: Literal["m", "rad"]
    home: float
    low: float
    high: float
    kind: Literal["com", "trunk", "joint", "foot"]
    sign: int = 1


def movable_coordinates(stance: Stance) -> Iterator[Coordinate]:
    """What can be moved, with generous ends."""
    robot = stance.robot
    names = coordinate_names(stance)
    size = float(stance.com[2]) - min(float(p.translation[2]) for p in stance.placements)
    backwards = False
    if robot.base_nv == 6:
        rotation = pin.Quaternion(np.array(stance.q[3:7])).matrix()
        backwards = abs(float(pin.rpy.matrixToRpy(rotation)[2])) > _WRONG_SIDE
    lower, upper = robot.position_limits
    for name in names:
        if (name == "com_x" and robot.base_nv != 6) or name.startswith("base_"):
            continue
        chart = PostureChart(stance, (name,), compiled=False)
        unit, home = chart.units[0], float(chart.values[0])
        if name in COM_COORDINATES:
            yield Coordinate(name, unit, home, home - 0.4 * size, home + 0.4 * size, "com")
        elif name in ("roll", "pitch", "yaw"):
            sign = -1 if backwards and name != "yaw" else 1
            yield Coordinate(name, unit, home, home - 0.7, home + 0.7, "trunk", sign)
        elif ":" in name:
            way = 0.7 if unit == "rad" else 0.4 * size
            yield Coordinate(name, unit, home, home - way, home + way, "foot")
        else:
            i = robot.velocity_index(name) - robot.base_nv
            low, high = float(lower[i]), float(upper[i])
            way = np.pi if unit == "rad" else size
            low = max(low, home - way) if np.isfinite(low) else home - way
            high = min(high, home + way) if np.isfinite(high) else home + way
            yield Coordinate(name, unit, home, min(low, home), max(high, home), "joint")
