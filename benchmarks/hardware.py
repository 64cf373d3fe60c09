"""Derivatives of the CoM's travel by a robot's hardware: writes hardware.md.

    python benchmarks/hardware.py [--workers N]

Every derivative against finite differences of the whole pipeline, on five robots: the changed robot
stands up in a posture of its own, and goes its own path until a limit. Takes about five minutes on
two free cores.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import copsense
from copsense.criterion import criterion_named
from copsense.hardware import HardwareEffects, Parameter, changed, hardware_effects
from copsense.hardware.travel_end import travel_end
from copsense.path import LateralPath
from copsense.stiffness import stiffness

TORQUE = copsense.minimum_torque()
CASES = {
    "icub": (TORQUE, copsense.Limits()),
    "icub, servos": (stiffness({"*hip*": 4000.0, "*": 2000.0}), copsense.Limits()),
    "talos": (TORQUE, copsense.Limits()),
    "g1": (TORQUE, copsense.Limits(friction=0.4, torque="model")),
    "human": (criterion_named("inertia-weighted-torque"), copsense.Limits(friction=0.4)),
    "solo12": (TORQUE, copsense.Limits(friction=0.7)),
    "four_bar": (TORQUE, copsense.Limits()),
}
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
TIED = 1e-4  # m: limits so near to each other are followed one by one
SHARE = 1e-3  # of the largest effect of its group: what is less is compared with that
TEXT = """# Derivatives by hardware

Written by `benchmarks/hardware.py`, the presets' own postures. Each dimension, mass and stiffness
of a robot is one right-hand side; the judge is the fourth-order difference of the whole pipeline:
the changed robot, its posture with the contacts in place, its path, and the exact travel to both
sides until the limit that ends it. The largest difference of any parameter, relative to its
derivative (of one that hardly moves anything, to a thousandth of the greatest of its kind).

| robot | criterion | parameters | that move it | travel +y, -y [mm] | largest difference | of |
| --- | --- | --- | --- | --- | --- | --- |
"""
BEST = """
## What buys most

The best of each group, and what whole pipelines with 10 % less and more of it make of the smallest
travel.

| robot | parameter | as it is | for 1 mm, 100 g (10 g) or 100 N m/rad | 10 % less | 10 % more |
| --- | --- | --- | --- | --- | --- |
"""


def main() -> None:
    """Compare and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--workers", type=int, default=2)
    lines, best = [TEXT], [BEST]
    with ProcessPoolExecutor(parser.parse_args().workers) as pool:
        for line, rows in pool.map(case, CASES):
            print(line, end="", flush=True)
            lines.append(line)
            best += rows
    Path(__file__).with_suffix(".md").write_text("".join(lines + best), encoding="utf-8")


def case(name: str) -> tuple[str, list[str]]:
    """The row of one robot, and those of what buys most."""
    criterion, limits = CASES[name]
    stance = copsense.load_stance(name.partition(",")[0])
    effects = hardware_effects(stance, criterion, limits, checked=1)
    errors = {p.name: difference(effects, i) for i, p in enumerate(effects.parameters)}
    worst = max(errors, key=errors.__getitem__)
    travels = ", ".join(f"{end.travel * 1e3:.2f}" for end in effects.ends)
    count = len(effects.parameters)
    line = (
        f"| {name} | {criterion.name} | {count + len(effects.idle)} | {count} | {travels} | "
        f"{errors[worst]:.0e} | {worst} |\n"
    )
    return line, [best_row(name, effects, order[0]) for order in effects.ranking.values()]


def best_row(name: str, effects: HardwareEffects, i: int) -> str:
    """What one parameter buys, and its check."""
    from copsense.hardware.effect_table import shown_value

    p = effects.parameters[i]
    less, more = (
        "no limit" if not np.isfinite(each.smallest) else
        f"{(each.smallest - effects.smallest) * 1e3:+.2f} mm"
        for each in effects.checks[p.name]
    )  # fmt: skip
    return (
        f"| {name} | {p.name} | {shown_value(p, p.nominal)} | "
        f"{effects.bought[i] * 1e3:+.3f} mm ({effects.better[i]}) | {less} | {more} |\n"
    )


def difference(effects: HardwareEffects, i: int) -> float:
    """Of one parameter's derivatives to both sides, relative."""
    p, step = effects.parameters[i], _step(effects.parameters[i])
    alike = [k for k, other in enumerate(effects.parameters) if other.group == p.group]
    worst = 0.0
    for end, rates in zip(effects.ends, effects.rates, strict=True):
        if end.limit is None:
            continue
        tied = len(rates.gaps) > 1 and rates.gaps[1] < TIED
        numeric = 0.0
        for k, weight in STENCIL:
            there, criterion = changed(effects.stance, effects.criterion, {p: p.nominal + k * step})
            scan = copsense.PathScan(LateralPath(there), criterion)
            own = travel_end(
                scan, end.side, effects.limits, limit=rates.limits[0] if tied else None
            )
            numeric += weight * own.travel / step
        size = max(abs(rates.rates[0, i]), SHARE * float(np.abs(rates.rates[0, alike]).max()))
        worst = max(worst, abs(numeric - rates.rates[0, i]) / size)
    return worst


def _step(parameter: Parameter) -> float:
    if parameter.unit == "m":
        return 4e-4
    return min(2e-2, 0.05 * parameter.nominal) if parameter.unit == "kg" else parameter.size / 100


if __name__ == "__main__":
    main()
