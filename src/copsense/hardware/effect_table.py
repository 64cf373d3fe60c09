"""Effects and sweeps of hardware as text that a mechanical engineer reads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from copsense.hardware.altered_travel import ChangedTravel
from copsense.hardware.effects import HardwareEffects
from copsense.hardware.parameter import Parameter
from copsense.hardware.travel_end import TravelEnd
from copsense.listing import first_few

if TYPE_CHECKING:
    from copsense.hardware.value_sweep import HardwareSweep

ROWS = 8
# Unit -> how it is shown: factor, unit, decimals.
_SHOWN = {"m": (1e3, "mm", 1), "kg": (1.0, "kg", 3)}


def effect_table(effects: HardwareEffects, rows: int = ROWS) -> str:
    """The effects by group, best first.

    Args:
        effects: the effects.
        rows: of each group, at most; 0 for all.
    """
    lines = [*_heading(effects)]
    for group, order in effects.ranking.items():
        shown = order[:rows] if rows else order
        lines += ["", *_group(effects, group, shown)]
        if len(shown) < len(order):
            lines.append(f"  and {len(order) - len(shown)} that buy less (--rows 0 lists all)")
    lines += ["", *_summary(effects)]
    return "\n".join(lines)


def sweep_table(sweep: HardwareSweep) -> str:
    """The travels of a sweep, a line for each value."""
    p = sweep.parameter
    lines = [
        f"{sweep.nominal.stance.robot.name}: {p.name} ({', '.join(p.where)}), "
        f"{shown_value(p, p.nominal)} as it is",
        f"  {p.name:>14}  {'+y [mm]':>8}  {'-y [mm]':>8}  {'smallest':>8}  limit",
    ]
    for point in sweep.points:
        value = shown_value(p, point.value)
        if not point.ends:
            lines.append(f"  {value:>14}  cannot stand: {point.reason}")
            continue
        numbers = "  ".join(
            f"{_mm(travel):>8}" for travel in (*point.travels.values(), point.smallest)
        )
        first = min(point.ends, key=lambda end: end.travel)
        lines.append(f"  {value:>14}  {numbers}  {point.reason or _limit(first)}")
    best = sweep.best
    now = sweep.nominal.smallest
    lines.append(
        f"best of these: {shown_value(p, best.value)}, {_mm(best.smallest)} mm to the shorter side "
        f"({_mm(now)} mm as it is)"
    )
    return "\n".join(lines)


def shown_value(parameter: Parameter, value: float) -> str:
    """A value of a parameter with its unit, as people write it."""
    factor, unit, decimals = _SHOWN.get(parameter.unit, (1.0, parameter.unit, 0))
    return f"{round(value * factor, decimals) + 0.0:.{decimals}f} {unit}"


def _heading(effects: HardwareEffects) -> Iterator[str]:
    yield (
        f"{effects.stance.robot.name} under {effects.criterion.name}: the CoM goes "
        f"{effects.smallest * 1e3:.1f} mm to the shorter side before a limit is met"
    )
    for end in effects.ends:
        yield f"  to {end.side}: {_mm(end.travel)} mm, {_limit(end)}"


def _limit(end: TravelEnd) -> str:
    if end.limit is None:
        return f"no limit met within {end.reach * 1e3:.0f} mm"
    return end.limit


def _group(effects: HardwareEffects, group: str, order: tuple[int, ...]) -> Iterator[str]:
    names = [effects.parameters[i].name for i in order]
    width = max(len(name) for name in names)
    checked = any(name in effects.checks for name in names)
    amount = effects.amount_of(group)[1]
    columns = ["as it is", f"{amount} more", "less", "better"]
    step = f"{effects.step * 100:g}%"
    columns += [f"step ({step})", "step less", "step more"] if checked else []
    more = effects.gains(effects.units)[:, 2] * 1e3
    less = effects.gains(-effects.units)[:, 2] * 1e3
    cells = []
    for i in order:
        p = effects.parameters[i]
        cannot = p.nominal - effects.units[i] <= p.low
        row = [
            shown_value(p, p.nominal),
            _gain(more[i]),
            "-" if cannot else _gain(less[i]),
            effects.better[i],
        ]
        if checked:
            size = shown_value(p, effects.step * p.size)
            row += [size, *(_check(each, effects) for each in effects.checks.get(p.name, ()))]
        cells.append(row)
    widths = [
        max(len(columns[k]), *(len(row[k]) for row in cells if k < len(row)))
        for k in range(len(columns))
    ]
    yield f"{group}: mm of travel for {amount}"
    for name, row in (("", columns), *zip(names, cells, strict=True)):
        padded = [word.rjust(w) for word, w in zip(row, widths, strict=False)]
        yield f"  {name:{width}}  {'  '.join(padded)}".rstrip()


def _check(found: ChangedTravel, effects: HardwareEffects) -> str:
    """The whole pipeline's gain with a step of the parameter."""
    if found.smallest is None:
        return "cannot stand"
    if not np.isfinite(found.smallest):
        return "no limit"
    return _gain((found.smallest - effects.smallest) * 1e3, 2)


def _summary(effects: HardwareEffects) -> Iterator[str]:
    for group, order in effects.ranking.items():
        i = order[0]
        p, bought, amount = effects.parameters[i], effects.bought[i], effects.amount_of(group)[1]
        if bought <= 0:
            yield f"best of {group}: none; changed alone, each costs travel either way."
            continue
        yield (
            f"best of {group}: {p.name}, {bought * 1e3:+.3f} mm of travel for {amount} "
            f"{effects.better[i]} ({first_few(p.where, 4)})"
        )
    for name, pair in effects.checks.items():
        for point in pair:
            if point.reason:
                p = next(each for each in effects.parameters if each.name == name)
                yield f"{name} at {shown_value(p, point.value)}: {point.reason}"
    if effects.idle:
        yield f"moves nothing here: {first_few(effects.idle, 8)}"
    if effects.left_out:
        yield (
            f"left out under an exact wrench cone: {first_few(effects.left_out, 8)}; --change "
            "sweeps them"
        )


def _gain(millimetres: float, decimals: int = 3) -> str:
    return f"{round(millimetres, decimals) + 0.0:+.{decimals}f}"


def _mm(travel: float | None) -> str:
    if travel is None:
        return "-"
    return f"{travel * 1e3:.1f}" if np.isfinite(travel) else "none"
