"""hardware_sweep: the travel over a range of one dimension, mass or stiffness, exact throughout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from copsense.arrays import check_type, finite_array
from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.hardware.altered_travel import ChangedTravel, changed_travel
from copsense.hardware.effects import HardwareEffects, hardware_effects, travel_row
from copsense.hardware.parameter import Parameter
from copsense.hardware.parameter_list import check_parameters, parameter_named
from copsense.limits import Limits
from copsense.stance import Stance
from copsense.statics import with_tie_break

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

_UNMOVED = 1e-7  # m


@dataclass(frozen=True, eq=False, repr=False)
class HardwareSweep:
    """The travel of robots that differ in one parameter.

    Attributes:
        parameter: what differs.
        points: one for each value, in their order.
        nominal: the robot as it is, with its derivatives by this parameter.
    """

    parameter: Parameter
    points: tuple[ChangedTravel, ...]
    nominal: HardwareEffects

    def __repr__(self) -> str:
        """The parameter, its range, and how many of its values the robot cannot stand with."""
        low, high = self.values[0], self.values[-1]
        lost = sum(1 for point in self.points if not point.ends)
        more = f"; {lost} cannot stand" if lost else ""
        return (
            f"HardwareSweep({self.parameter.name} of {self.nominal.stance.robot.name!r} from "
            f"{low:.4g} to {high:.4g} {self.parameter.unit}, {len(self.points)} values{more})"
        )

    def __str__(self) -> str:
        """A table of it."""
        from copsense.hardware.effect_table import sweep_table

        return sweep_table(self)

    @property
    def values(self) -> Float[np.ndarray, " N"]:
        """Of the parameter (N,)."""
        return np.array([point.value for point in self.points])

    @property
    def failures(self) -> dict[float, str]:
        """Values with which the robot cannot stand -> why."""
        return {point.value: point.reason for point in self.points if not point.ends}

    @property
    def best(self) -> ChangedTravel:
        """The value with the largest smallest travel.

        Raises:
            InvalidInputError: with none of them can the robot stand.
        """
        standing = [point for point in self.points if point.smallest is not None]
        if not standing:
            raise InvalidInputError(
                f"robot {self.nominal.stance.robot.name!r} cannot stand with any of these values "
                f"of {self.parameter.name}: {self.points[0].reason}"
            )
        return max(standing, key=lambda point: point.smallest or 0.0)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units."""
        return {
            "parameter": self.parameter.name,
            "changes": list(self.parameter.where),
            "unit": self.parameter.unit,
            "nominal": self.parameter.nominal,
            "points": [travel_row(point) for point in self.points],
        }

    def to_xarray(self) -> xr.Dataset:
        """The travels over value and side."""
        from copsense.hardware.hardware_data import sweep_dataset

        return sweep_dataset(self)

    def to_pandas(self) -> pd.DataFrame:
        """The same as a table, a row for each value."""
        from copsense.hardware.hardware_data import sweep_frame

        return sweep_frame(self)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write netCDF (``.nc``) or the table (``.csv``).

        Raises:
            InvalidInputError: another suffix.
            OutputError: the file exists and `overwrite` is false, or it cannot be written.
        """
        from copsense.hardware.hardware_data import save_data

        return save_data(self, path, overwrite=overwrite)

    def plot(self) -> Figure:
        """The travels over the parameter."""
        from copsense.plots import plot_hardware_sweep
        from copsense.plots.style import whole_figure

        return whole_figure(plot_hardware_sweep(self))


@one_blas_thread()
def hardware_sweep(
    stance: Stance,
    criterion: Criterion,
    parameter: Parameter | str,
    values: ArrayLike,
    limits: Limits | None = None,
    *,
    nominal: HardwareEffects | None = None,
    progress: Callable[[int], object] = lambda _: None,
) -> HardwareSweep:
    """The travel over values of one parameter: a robot, posture and path of its own for each.

    Args:
        stance: the robot as it is.
        criterion: what shares the load.
        parameter: of `hardware_parameters`, or its name; ``"mass@l_foot"`` is of one foot alone.
        values: what it is instead (N,) [m, kg, N m/rad].
        limits: what ends a travel; default ``Limits()``.
        nominal: the effects at the robot as it is, where they are known already; `limits` are then
            theirs.
        progress: called with 1 after each value.

    Raises:
        UnknownNameError: no such parameter.
        InvalidInputError: a parameter that makes no sense for this robot, a value that it cannot
            have, or one that moves nothing with any of these values.
    """
    if isinstance(parameter, str):
        parameter = parameter_named(parameter, stance, criterion)
    remedy = "Give one of copsense.hardware.hardware_parameters(stance), or its name."
    check_type(parameter, Parameter, "a parameter", remedy)
    assert isinstance(parameter, Parameter)
    given = finite_array(values, f"the values of {parameter.name}", (None,), parameter.unit)
    if not len(given):
        raise InvalidInputError(f"there is no value of {parameter.name} to try. Give one.")
    for value in given.tolist():
        parameter.checked(value)
    check_parameters(stance, [parameter])
    nominal = nominal or hardware_effects(stance, criterion, limits)
    criterion = with_tie_break(stance, criterion)
    remedy = "Give hardware_effects(stance, criterion) of the same two, or leave it out."
    check_type(nominal, HardwareEffects, "the nominal robot's effects", remedy)
    if nominal.stance is not stance or nominal.criterion != criterion:
        raise InvalidInputError(f"the nominal effects are of another stance or criterion. {remedy}")
    points = []
    for value in given.tolist():
        points.append(changed_travel(stance, criterion, nominal.limits, {parameter: value}))
        progress(1)
    found = HardwareSweep(parameter, tuple(points), nominal)
    others = {end.side: end.travel for end in nominal.ends}
    if not any(_differs(point, others) for point in points):
        valid = [p.name for p in nominal.parameters]
        raise InvalidInputError(
            f"{parameter.name} moves nothing of {stance.robot.name!r} from {given.min():.4g} to "
            f"{given.max():.4g} {parameter.unit}: the travel stays {nominal.smallest * 1e3:.1f} "
            f"mm. What moves it here: {', '.join(valid[:20])}."
        )
    return found


def _differs(point: ChangedTravel, others: dict[str, float]) -> bool:
    if not point.ends:
        return True
    return any(
        end.travel != others[end.side] and not abs(end.travel - others[end.side]) < _UNMOVED
        for end in point.ends
    )
