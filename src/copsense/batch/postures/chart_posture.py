"""Chart posture: the one posture of a chart at some values."""

from __future__ import annotations

from collections.abc import Mapping

from copsense.arrays import finite_number
from copsense.batch.postures.chart import PostureChart
from copsense.errors import UnreachablePostureError
from copsense.stance import Stance


def chart_posture(stance: Stance, at: Mapping[str, float]) -> Stance:
    """The one posture of a chart at some values, without the compiler.

    Args:
        stance: what the coordinates not named are kept from.
        at: coordinate of `PostureChart` -> value [m, rad].

    Raises:
        UnreachablePostureError: there is none; the message says what remains.
        InvalidInputError: as `PostureChart`, or a value that is not a number.
        UnknownNameError: a name that is not a coordinate.
    """
    chart = PostureChart(stance, tuple(at), compiled=False)
    values = [finite_number(value, f"the coordinate {name}") for name, value in at.items()]
    found = chart.solve([values])
    if not found.converged[0]:
        raise unreachable(stance, at, str(found.reasons[0]))
    return stance.at(found.configurations[0])


def unreachable(stance: Stance, at: Mapping[str, float], reason: str) -> UnreachablePostureError:
    """The error of a chart that has no posture at some values."""
    asked = ", ".join(f"{name} = {round(value, 6) + 0.0:g}" for name, value in at.items())
    return UnreachablePostureError(
        f"no posture of {stance.robot.name!r} at {asked}: {reason.rstrip('.')}. The coordinates "
        "that are not named keep the stance's values: ask for less, or name fewer."
    )
