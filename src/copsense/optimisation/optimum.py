"""Optimum: the best posture that was found, what it is worth, and what holds it back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion
from copsense.json_data import json_data
from copsense.limits import Limits
from copsense.optimisation.objectives import QUANTITIES, TRAVELS
from copsense.optimisation.variables import shown
from copsense.sensitivity import CopSensitivity, cop_sensitivity
from copsense.stance import Stance

if TYPE_CHECKING:
    from copsense.explore.showing import ShownPage
    from copsense.plots.style import Figure

SIDES = ("+y", "-y")
PROVEN = 1e-3  # of the KKT conditions' residual, under which a place is a local optimum


@dataclass(frozen=True)
class Binding:
    """A bound or a constraint that holds the optimum back.

    Attributes:
        name: what it is.
        price: what the objective would gain per unit that it yields, in the objective's unit per
            metre or radian; 0 where it is not known, as of a row of the objective itself.
        share: its multiplier beside the others of its kind.
        kind: ``"objective"``, ``"bound"`` or ``"constraint"``.
        unit: of what would yield, ``"m"``, ``"rad"`` or ``"1"``.
    """

    name: str
    price: float
    share: float
    kind: str
    unit: str = "1"


@dataclass(frozen=True)
class ExactTravel:
    """How far the CoM may go along an exact path.

    Attributes:
        way: ``"+x"``, ``"-x"``, ``"+y"`` or ``"-y"``, in the world.
        distance: to the first limit [m]; infinite where none is met within reach.
        limit: which one.
    """

    way: str
    distance: float
    limit: str


@dataclass(frozen=True, eq=False, repr=False)
class Valuation(ShortRepr):
    """What a posture is worth under a criterion.

    Attributes:
        stance: the posture.
        criterion: what shares the load.
        quantities: name of each of `QUANTITIES` -> its value; NaN where it has none.
        travels: along exact paths, to both sides and, where it can, forwards and back.
        coordinates: what varies -> its value [m, rad].
        parameters: of the criterion, where they vary.
    """

    stance: Stance
    criterion: Criterion
    quantities: Mapping[str, float]
    travels: tuple[ExactTravel, ...]
    coordinates: Mapping[str, float]
    parameters: Mapping[str, float]

    def __post_init__(self) -> None:
        """Own the mappings."""
        freeze(self, "quantities", "coordinates", "parameters")

    def worth(self, objective: str) -> float:
        """What counts of an objective: of travels the exact ones too, in the objective's unit."""
        if objective == "travel":
            return self.smallest_travel
        return self.sideways_travel if objective == "sideways" else self.quantities[objective]

    @cached_property
    def sensitivity(self) -> CopSensitivity:
        """Wrenches and centres of pressure there, and how they move."""
        return cop_sensitivity(self.stance, self.criterion)

    @property
    def exact_travel(self) -> float:
        """The smallest of the exact travels [m]."""
        return min((travel.distance for travel in self.travels), default=math.nan)

    @property
    def smallest_travel(self) -> float:
        """The smaller of `exact_travel` and the travel any other way, to first order [m]."""
        return min(self.exact_travel, self.quantities["travel"])

    @property
    def sideways_travel(self) -> float:
        """The smaller of the exact travels to both sides [m]."""
        return min((t.distance for t in self.travels if t.way in SIDES), default=math.nan)

    def to_dict(self) -> dict[str, Any]:
        """Plain data, without posture and criterion."""
        travels = {t.way: {"distance": t.distance, "limit": t.limit} for t in self.travels}
        return {
            "quantities": dict(self.quantities),
            "exact_travel": travels,
            "smallest_travel": self.smallest_travel,
            "sideways_travel": self.sideways_travel,
            "coordinates": dict(self.coordinates),
            "parameters": dict(self.parameters),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(ShortRepr):
    """The best posture that was found.

    Attributes:
        objective: name of what was optimised.
        before: the stance as it was given, under the criterion given.
        after: the best that was found.
        limits: what was not to be broken.
        units: coordinate that varies -> ``"m"`` or ``"rad"``.
        binding: what holds the optimum back, what counts most first.
        residual: of the KKT conditions there, relative to the objective's gradient; what is under
            `PROVEN` is a local optimum.
        finished: whether the solver ended by itself.
        iterations: that it took, over all starts.
        starts: value of the objective that the search reached from each start; NaN where it found
            no posture that keeps the constraints.
        exact: whether the exact path's travel was the objective at the end.
        notes: what to know about it.
    """

    objective: str
    before: Valuation
    after: Valuation
    limits: Limits
    units: Mapping[str, str]
    binding: tuple[Binding, ...]
    residual: float
    finished: bool
    iterations: int
    starts: tuple[float, ...]
    exact: bool
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Own the mapping."""
        freeze(self, "units")

    @property
    def stance(self) -> Stance:
        """The best posture."""
        return self.after.stance

    @property
    def criterion(self) -> Criterion:
        """The criterion there, the designed one where its weights varied."""
        return self.after.criterion

    @property
    def converged(self) -> bool:
        """Whether the posture is a local optimum, by the KKT conditions."""
        return self.finished and self.residual <= PROVEN

    @cached_property
    def verdict(self) -> str:
        """One sentence: what it gains."""
        quantity = QUANTITIES[self.objective]
        a, b = (v.worth(self.objective) for v in (self.before, self.after))
        names = {"travel": "smallest travel", "sideways": "exact travel to both sides"}
        what = names.get(self.objective, self.objective)
        if not math.isfinite(a) or a == 0:
            return f"{what} {quantity.shown(b)}, where there was none"
        return f"{what} {quantity.shown(a)} -> {quantity.shown(b)} ({(b / a - 1) * 100:+.1f} %)"

    def show(self) -> ShownPage:
        """Before and after in 3-D, `copsense.explore.showing.show`."""
        from copsense.explore.showing import show

        return show(self)

    def plot(self) -> Figure:
        """The robot before and after, `copsense.plots.plot_optimum`."""
        from copsense.plots import plot_optimum

        return plot_optimum(self)

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense optimise --json`` prints: plain data, SI units."""
        data = {
            "robot": self.stance.robot.name,
            "objective": self.objective,
            "criterion": self.criterion.to_dict(),
            "limits": self.limits.to_dict(),
            "before": self.before.to_dict(),
            "after": self.after.to_dict(),
            "verdict": self.verdict,
            "binding": [vars(each) for each in self.binding],
            "kkt_residual": self.residual,
            "converged": self.converged,
            "finished": self.finished,
            "iterations": self.iterations,
            "starts": self.starts,
            "notes": self.notes,
        }
        return dict(json_data(data))

    def __str__(self) -> str:
        """What was gained, where, and what holds it back."""
        return "\n".join(
            [
                f"{self.stance.robot.name}: {self.objective} under {self.criterion.name}",
                *_comparison(self.before, self.after),
                "",
                *_moved(self),
                "",
                f"best: {self.verdict}",
                *_held(self),
                *_proof(self),
            ]
        )


@dataclass(frozen=True, eq=False, repr=False)
class Front(ShortRepr):
    """What one quantity costs of another: postures that no other beats in both.

    Attributes:
        objectives: names of the two.
        before: the stance as it was given.
        points: the postures, from the best of the first to the best of the second.
        notes: what to know about it.
    """

    objectives: tuple[str, str]
    before: Valuation
    points: tuple[Optimum, ...]
    notes: tuple[str, ...] = ()

    def plot(self) -> Figure:
        """The front, and the robot at its ends, `copsense.plots.plot_front`."""
        from copsense.plots import plot_front

        return plot_front(self)

    def to_dict(self) -> dict[str, Any]:
        """What ``copsense optimise --pareto --json`` prints."""
        data = {
            "objectives": self.objectives,
            "before": self.before.to_dict(),
            "points": [point.to_dict() for point in self.points],
            "notes": self.notes,
        }
        return dict(json_data(data))

    def __str__(self) -> str:
        """A table with a row per posture."""
        first, second = (QUANTITIES[name] for name in self.objectives)
        robot = self.before.stance.robot.name
        order = ", travels to first order" if {*self.objectives} & {*TRAVELS} else ""
        lines = [
            f"{robot}: {first.name} against {second.name}{order}",
            f"{first.name:>12}  {second.name:>12}  exact travel [mm]  KKT residual",
        ]
        for point in self.points:
            a, b = (point.after.quantities[q.name] for q in (first, second))
            lines.append(
                f"{first.shown(a, 1):>12}  {second.shown(b, 1):>12}  "
                f"{point.after.exact_travel * 1e3:17.1f}  {point.residual:12.1e}"
            )
        a, b = (self.before.quantities[q.name] for q in (first, second))
        lines.append(
            f"{first.shown(a, 1):>12}  {second.shown(b, 1):>12}  "
            f"{self.before.exact_travel * 1e3:17.1f}  before"
        )
        return "\n".join(lines)


def _comparison(before: Valuation, after: Valuation) -> list[str]:
    lines = [f"{'':26} {'before':>12} {'after':>12}"]
    for name, quantity in QUANTITIES.items():
        a, b = (quantity.shown(v.quantities[name]) for v in (before, after))
        lines.append(f"{name:26} {a:>12} {b:>12}  {quantity.words}")
    for old, new in zip(before.travels, after.travels, strict=True):
        met = f"to {new.limit}" if new.limit else "no limit within reach"
        what = f"exact travel towards {new.way}"
        lines.append(f"{what:26} {_mm(old.distance):>12} {_mm(new.distance):>12}  {met}")
    return lines


def _mm(distance: float) -> str:
    return f"{distance * 1e3:.2f} mm" if math.isfinite(distance) else "none"


def _moved(found: Optimum) -> list[str]:
    lines = []
    units = {**found.units, **dict.fromkeys(found.after.parameters, "1")}
    before = {**found.before.coordinates, **found.before.parameters}
    after = {**found.after.coordinates, **found.after.parameters}
    for name, new in after.items():
        old = before.get(name, math.nan)
        was = shown(old, units[name]) if math.isfinite(old) else ""
        lines.append(f"  {name:24} {was:>12} {shown(new, units[name]):>12}")
    return lines


def _held(found: Optimum) -> list[str]:
    lines = []
    rows = [b.name for b in found.binding if b.kind == "objective"]
    if len(rows) > 1 or QUANTITIES[found.objective].sign > 0:
        lines.append(f"limited by: {_names(rows)}")
    others = [b for b in found.binding if b.kind != "objective"]
    unit = QUANTITIES[found.objective].unit
    lines += [f"binds: {each.name}{_price(each, unit)}" for each in others]
    if not others and found.converged:
        lines.append("nothing else binds: the optimum is inside every range")
    return lines


def _names(rows: Sequence[str]) -> str:
    return "; ".join(rows) if rows else "nothing"


def _price(each: Binding, unit: str) -> str:
    if not each.price:
        return ""
    value, objective = each.price, "" if unit == "1" else f"{unit} "
    if unit == "m":
        value, objective = value * 1e3, "mm "
    if each.unit == "rad":
        return f" ({value * math.pi / 180:.3g} {objective}per degree)"
    if each.unit == "m":
        return f" ({value / 1e3:.3g} {objective}per mm)"
    return ""


def _proof(found: Optimum) -> list[str]:
    shown_as = QUANTITIES[found.objective].shown
    starts = ", ".join("none" if math.isnan(v) else shown_as(v) for v in found.starts)
    kept = "a local optimum" if found.converged else "not proven to be an optimum"
    count = len(found.starts)
    order = ", to first order" if found.objective in TRAVELS else ""
    return [
        f"KKT residual {found.residual:.1e}: {kept}; {found.iterations} iterations; the search "
        f"reached from {count} start{'s' * (count != 1)}{order}: {starts}"
    ]
