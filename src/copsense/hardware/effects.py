"""hardware_effects: which millimetre or gram of a robot buys most travel of its CoM."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from copsense.arrays import check_type, finite_array, finite_number, whole_number
from copsense.blas import one_blas_thread
from copsense.content import freeze
from copsense.criterion import Criterion
from copsense.errors import InvalidInputError
from copsense.hardware.altered_travel import ChangedTravel, changed_travel
from copsense.hardware.parameter import Parameter
from copsense.hardware.parameter_list import check_parameters, hardware_parameters
from copsense.hardware.stance_rates import HardwareRates
from copsense.hardware.travel_end import SIDES, TIED, EndRates, TravelEnd, end_rates, travel_end
from copsense.limits import Limits, optional_limits
from copsense.listing import first_few, listed
from copsense.path import LateralPath
from copsense.scan import PathScan
from copsense.stance import Stance, check_stance
from copsense.statics import tie_break_note, with_tie_break
from copsense.statics.tie_breaks import TIE_BREAK
from copsense.uncertainty import check_uncertain

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

# Groups, in the order in which they are listed.
ORDER = ("lengths", "masses", "stiffnesses")
_LIGHT = 10.0  # kg: links of lighter robots are compared by 10 g
STEP = 0.1  # of a parameter's size, by which it is changed for the check
_IDLE = 1e-5  # m of travel, to first order, for all that there is of it: it moves nothing


@dataclass(frozen=True, eq=False, repr=False)
class HardwareEffects:
    """What a robot's dimensions, masses and stiffnesses make of its CoM's travel.

    Attributes:
        stance: the robot as it is.
        criterion: what shares the load.
        limits: what ends a travel.
        parameters: those that move something (p in all).
        idle: names of those that move nothing here.
        left_out: names of the soles that were not changed: under an exact wrench cone.
        ends: of the travel to +y and to -y, as the robot is.
        rates: how they follow the parameters, exact.
        step: share of each parameter's size by which it is changed for the check.
        checks: parameter -> the travels with so much less and more of it, whole pipelines.
    """

    stance: Stance
    criterion: Criterion
    limits: Limits
    parameters: tuple[Parameter, ...]
    idle: tuple[str, ...]
    left_out: tuple[str, ...]
    ends: tuple[TravelEnd, ...]
    rates: tuple[EndRates, ...]
    step: float
    checks: Mapping[str, tuple[ChangedTravel, ChangedTravel]]

    def __post_init__(self) -> None:
        """Own the mapping."""
        freeze(self, "checks")

    def __repr__(self) -> str:
        """The robot, its travel, and the parameter that buys most of each group."""
        best = "; ".join(
            f"{self.parameters[order[0]].name} {self.bought[order[0]] * 1e3:+.3f} mm per "
            f"{self.amount_of(group)[1]}"
            for group, order in self.ranking.items()
        )
        return (
            f"HardwareEffects({self.stance.robot.name!r} under {self.criterion.name}: travel "
            f"{self.smallest * 1e3:.1f} mm; {best})"
        )

    def __str__(self) -> str:
        """The table, as ``copsense hardware`` prints it."""
        from copsense.hardware.effect_table import effect_table

        return effect_table(self)

    @property
    def smallest(self) -> float:
        """The travel to the side where it is less [m]."""
        return min(end.travel for end in self.ends)

    @property
    def units(self) -> Float[np.ndarray, " p"]:
        """The amount of each parameter that it is compared by (p,), in its unit."""
        return np.array([self.amount_of(p.group)[0] for p in self.parameters])

    def amount_of(self, group: str) -> tuple[float, str]:
        """What parameters of a group are compared by: how much in SI, and in words."""
        if group == "lengths":
            return 1e-3, "1 mm"
        if group == "masses":
            return (0.01, "10 g") if self.stance.robot.mass < _LIGHT else (0.1, "100 g")
        return 100.0, "100 N m/rad"

    def gains(self, amounts: Float[np.ndarray, " p"]) -> Float[np.ndarray, "p 3"]:
        """What each parameter's own amount more gains to +y, to -y, and of the smallest (p, 3) [m].

        To first order, of the limits that are then met first.

        Args:
            amounts: of each parameter, in its unit; negative for less of it.
        """
        amounts = finite_array(amounts, "an amount of each parameter", (len(self.parameters),))
        sides = [
            end.travel + rates.gained(amounts)
            for end, rates in zip(self.ends, self.rates, strict=True)
        ]
        least = np.minimum(*sides) - self.smallest
        each = [
            np.where(np.isfinite(there), there, 0.0) - (end.travel if end.limit else 0.0)
            for there, end in zip(sides, self.ends, strict=True)
        ]
        return np.column_stack([*each, least])

    @property
    def slopes(self) -> Float[np.ndarray, "p 3 2"]:
        """d travel per unit more, and per unit less, of each parameter: +y, -y, the smallest.

        Exact one-sided derivatives (p, 3, 2), per m, kg or N m/rad.
        """
        each = np.array([[r.rise, r.fall] for r in self.rates])  # side, way, parameter
        shortest = [i for i, end in enumerate(self.ends) if end.travel - self.smallest <= TIED]
        whole = np.concatenate([each, each[shortest].min(axis=0, keepdims=True)])
        return np.asarray(whole.transpose(2, 0, 1))

    @property
    def bought(self) -> Float[np.ndarray, " p"]:
        """What a unit of each buys of the smallest travel, in its better direction (p,) [m].

        Negative where both ways cost travel.
        """
        return self._ways.max(axis=1)

    @property
    def better(self) -> tuple[str, ...]:
        """``"more"``, ``"less"`` or ``"neither"`` of each parameter is better for travel."""
        words = ("more", "less")
        return tuple(
            words[int(np.argmax(ways))] if ways.max() > 0 else "neither" for ways in self._ways
        )

    @property
    def _ways(self) -> Float[np.ndarray, "p 2"]:
        """What a unit more and less gains of the smallest travel; -inf where there is no less."""
        more, less = self.gains(self.units)[:, 2], self.gains(-self.units)[:, 2]
        there = [p.nominal - u > p.low for p, u in zip(self.parameters, self.units, strict=True)]
        return np.column_stack([more, np.where(there, less, -np.inf)])

    @property
    def notes(self) -> tuple[str, ...]:
        """What the criterion left open, and limits met together: what gains to one costs to it."""
        tied = self.criterion.tie_break is TIE_BREAK
        found = [tie_break_note(self.criterion.name)] if tied else []
        costly = [
            p.name for p, way in zip(self.parameters, self.better, strict=True) if way == "neither"
        ]
        for end, rates in zip(self.ends, self.rates, strict=True):
            if costly and len(rates.limits) > 1:
                found.append(
                    f"to {end.side} {rates.limits[1]} is met {rates.gaps[1] * 1e3:.2g} mm after "
                    f"{rates.limits[0]}: either way {first_few(costly, 4)} cost travel to one."
                )
        return tuple(found)

    @property
    def ranking(self) -> dict[str, tuple[int, ...]]:
        """Group -> its parameters by index, what buys most per unit first."""
        bought = self.bought
        found: dict[str, tuple[int, ...]] = {}
        for group in ORDER:
            own = [i for i, p in enumerate(self.parameters) if p.group == group]
            if own:
                found[group] = tuple(sorted(own, key=lambda i: -float(bought[i])))
        return found

    def to_dict(self) -> dict[str, Any]:
        """Plain data, SI units; the parameters of each group by what they buy."""
        slopes, units = self.slopes, self.units
        more, less = self.gains(units), self.gains(-units)
        rows = {}
        for order in self.ranking.values():
            for rank, i in enumerate(order, start=1):
                p = self.parameters[i]
                rows[p.name] = {
                    "group": p.group,
                    "rank": rank,
                    "changes": list(p.where),
                    "nominal": p.nominal,
                    "unit": p.unit,
                    "better": self.better[i],
                    "per_unit_more": dict(zip(_COLUMNS, slopes[i, :, 0].tolist(), strict=True)),
                    "per_unit_less": dict(zip(_COLUMNS, slopes[i, :, 1].tolist(), strict=True)),
                    "compared_by": float(units[i]),
                    "gain_more": dict(zip(_COLUMNS, more[i].tolist(), strict=True)),
                    "gain_less": dict(zip(_COLUMNS, less[i].tolist(), strict=True)),
                    "step": self.step * p.size,
                    "checks": [travel_row(each) for each in self.checks.get(p.name, ())],
                }
        return {
            "robot": self.stance.robot.name,
            "criterion": self.criterion.name,
            "limits": self.limits.to_dict(),
            "travel": {end.side: end_row(end) for end in self.ends},
            "smallest": self.smallest,
            "parameters": rows,
            "idle": list(self.idle),
            "left_out": list(self.left_out),
            "notes": list(self.notes),
        }

    def to_xarray(self) -> xr.Dataset:
        """The table over parameter and side, with units."""
        from copsense.hardware.hardware_data import effect_dataset

        return effect_dataset(self)

    def to_pandas(self) -> pd.DataFrame:
        """The same as a table, a row for each parameter."""
        from copsense.hardware.hardware_data import effect_frame

        return effect_frame(self)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write netCDF (``.nc``) or the table (``.csv``).

        Raises:
            InvalidInputError: another suffix.
            OutputError: the file exists and `overwrite` is false, or it cannot be written.
        """
        from copsense.hardware.hardware_data import save_data

        return save_data(self, path, overwrite=overwrite)

    def plot(self) -> Figure:
        """What buys most, as bars."""
        from copsense.plots import plot_hardware

        return plot_hardware(self)


_COLUMNS = (*SIDES, "smallest")


@one_blas_thread()
def hardware_effects(
    stance: Stance,
    criterion: Criterion,
    limits: Limits | None = None,
    parameters: Sequence[Parameter] | None = None,
    *,
    step: float = STEP,
    checked: int = 0,
    progress: Callable[[int], object] = lambda _: None,
) -> HardwareEffects:
    """What each dimension, mass and stiffness of a robot buys of its CoM's travel.

    The travel is the exact one along the lateral path until the first limit, to both sides. A robot
    with other hardware stands on the same places with its centre of mass over the same point, in
    the nearest posture, and has a path of its own. Derivatives are exact.

    Args:
        stance: the robot as it is.
        criterion: what shares the load; it is given a tie-break where it needs one.
        limits: what ends a travel; default ``Limits()``: contacts that do not pull or slip,
            centres of pressure in their soles.
        parameters: what may change; default all of `hardware_parameters`.
        step: share of a parameter's size by which it is changed for a check.
        checked: how many parameters of each group, the best first, are checked by whole pipelines
            with that much less and more of them.
        progress: called with 1 after each of these.

    Raises:
        InvalidInputError: a stance in motion or with parts that hang, no limit within reach to
            either side, one that is passed already, or a wrench cone and nothing but soles.
        CopsenseError: the criterion has no solution here.
    """
    check_stance(stance)
    check_uncertain(stance, "hardware")
    remedy = "Give one, such as copsense.minimum_torque()."
    check_type(criterion, Criterion, "a criterion", remedy)
    criterion = with_tie_break(stance, criterion)
    share = finite_number(step, "the step of a check", positive=True)
    if share >= 1:
        raise InvalidInputError(
            f"a step of {share:.0%} leaves nothing of a dimension. Give less than 100 %, such as "
            "10%."
        )
    count = whole_number(checked, "how many parameters are checked", least=0)
    within = optional_limits(limits) or Limits()
    if parameters is None:
        parameters = hardware_parameters(stance, criterion)
    given = check_parameters(stance, parameters)
    given, left_out = _without_soles(given) if within.torsion == "cone" else (given, ())
    scan = PathScan(LateralPath(stance), criterion)
    ends = nominal_ends(scan, within)
    all_rates = HardwareRates(stance, given)
    found = [end_rates(scan, end, within, all_rates) for end in ends]
    sizes = np.array([p.size for p in given])
    moved = np.max([np.abs(r.rates).max(axis=0, initial=0.0) * sizes for r in found], axis=0)
    keep = [i for i, distance in enumerate(moved) if distance > _IDLE]
    if not keep:
        raise InvalidInputError(
            f"no dimension, mass or stiffness of {stance.robot.name!r} moves its travel under "
            f"{criterion.name}: it ends where {listed([str(e.limit) for e in ends if e.limit])}. "
            "Where the feet stand moves it (--width, copsense optimise), or give other limits."
        )
    effects = HardwareEffects(
        stance,
        criterion,
        within,
        tuple(given[i] for i in keep),
        tuple(p.name for i, p in enumerate(given) if i not in keep),
        left_out,
        ends,
        tuple(EndRates(r.limits, r.gaps, r.rates[:, keep]) for r in found),
        share,
        {},
    )
    return _with_checks(effects, count, progress)


def nominal_ends(scan: PathScan, limits: Limits) -> tuple[TravelEnd, ...]:
    """Where the travel ends to both sides as the robot is.

    Raises:
        InvalidInputError: a limit is passed where it stands, or none is met within reach.
    """
    ends = tuple(travel_end(scan, side, limits) for side in SIDES)
    for end in ends:
        if not end.travel:
            raise InvalidInputError(
                f"as it stands the robot is beyond {end.limit}: there is no travel to gain. Put "
                "its CoM elsewhere (--com-y), or give other limits."
            )
    if not any(end.limit for end in ends):
        reach = max(end.reach for end in ends)
        if reach < float(scan.path.values[-1]) - scan.start - 1e-6:
            raise InvalidInputError(
                f"no limit is met before the limbs of {scan.begin.stance.robot.name!r} end: with "
                f"its contacts in place its CoM goes {reach * 1e3:.0f} mm to either side. Bend its "
                "legs (--com-z), or stand it elsewhere (--width)."
            )
        raise InvalidInputError(
            f"no limit is met within {reach * 1e3:.0f} mm to either side, so that nothing buys "
            "travel. Give limits that are (--limits friction=0.4,torque=model), or soles "
            "(--sole X0:X1:Y0:Y1)."
        )
    return ends


def _without_soles(given: tuple[Parameter, ...]) -> tuple[tuple[Parameter, ...], tuple[str, ...]]:
    """What changes no sole, and the names of the rest: a cone's faces turn with its sole.

    Raises:
        InvalidInputError: nothing is left.
    """
    kept = tuple(p for p in given if not p.alteration.soles)
    left_out = tuple(p.name for p in given if p.alteration.soles)
    if not kept:
        raise InvalidInputError(
            f"the exact wrench cone leaves out what changes a sole: {first_few(left_out, 8)}. Give "
            "another torsion limit, or sweep one (hardware_sweep, --change)."
        )
    return kept, left_out


def _with_checks(
    effects: HardwareEffects, count: int, progress: Callable[[int], object]
) -> HardwareEffects:
    """The same with the best parameters of each group changed by a step, less and more."""
    from dataclasses import replace

    checks = {}
    for order in effects.ranking.values():
        for i in order[:count]:
            p = effects.parameters[i]
            pair = []
            for way in (-1, 1):
                value = p.nominal + way * effects.step * p.size
                pair.append(
                    changed_travel(effects.stance, effects.criterion, effects.limits, {p: value})
                )
                progress(1)
            checks[p.name] = (pair[0], pair[1])
    return replace(effects, checks=checks)


def end_row(end: TravelEnd) -> dict[str, Any]:
    """A travel's end as plain data."""
    return {"travel": end.travel, "limit": end.limit, "where": end.where or None}


def travel_row(found: ChangedTravel) -> dict[str, Any]:
    """The travels of a changed robot as plain data."""
    return {
        "value": found.value,
        "travel": {end.side: end_row(end) for end in found.ends},
        "smallest": found.smallest,
        "reason": found.reason or None,
    }
