"""changed_travel: how far the CoM of a robot with other hardware goes, by its whole pipeline."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from copsense.content import ShortRepr
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.hardware.changed_robot import changed
from copsense.hardware.parameter import Parameter
from copsense.hardware.travel_end import SIDES, TravelEnd, travel_end
from copsense.limits import Limits
from copsense.path import LateralPath
from copsense.scan import PathScan
from copsense.stance import Stance


@dataclass(frozen=True, eq=False, repr=False)
class ChangedTravel(ShortRepr):
    """How far the CoM goes where one parameter has another value.

    Attributes:
        value: of the parameter.
        ends: of the travel, to +y and to -y; none where the robot cannot stand so.
        reason: why it cannot stand; empty where it does.
    """

    value: float
    ends: tuple[TravelEnd, ...]
    reason: str = ""

    @property
    def smallest(self) -> float | None:
        """The travel to the side where it is less [m]; None where the robot cannot stand."""
        return min(end.travel for end in self.ends) if self.ends else None

    @property
    def travels(self) -> dict[str, float | None]:
        """Side -> travel [m], infinite where no limit is met; None where it cannot stand."""
        return dict.fromkeys(SIDES) | {end.side: end.travel for end in self.ends}


def changed_travel(
    stance: Stance, criterion: Criterion, limits: Limits, values: Mapping[Parameter, float]
) -> ChangedTravel:
    """The travel of a robot with other hardware: posture, path and limits of its own.

    Args:
        stance: of the robot as it is.
        criterion: what shares the load.
        limits: what ends a travel.
        values: parameter -> what it is instead; the first one's value is the result's.

    Raises:
        InvalidInputError: a value that the parameter cannot have.
    """
    value = math.nan
    for parameter, given in reversed(list(values.items())):
        value = parameter.checked(given)
    try:
        there, weighed = changed(stance, criterion, values)
        scan = PathScan(LateralPath(there), weighed)
        ends = tuple(travel_end(scan, side, limits) for side in SIDES)
    except CopsenseError as error:
        return ChangedTravel(value, (), str(error))
    beyond = [end for end in ends if not end.travel]
    if beyond:
        return ChangedTravel(value, ends, f"as it stands it is beyond {beyond[0].limit}.")
    return ChangedTravel(value, ends)
