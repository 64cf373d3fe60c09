"""Errors of the model, to first order and whole: writes uncertainty.md.

    python benchmarks/uncertainty.py [--models N] [--workers N]

Every derivative against finite differences of the whole pipeline, on five robots; ellipses against
whole models with random errors; travels against the model of the worst case. Takes about ten
minutes on two free cores with the usual 100000 models.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import argparse
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import copsense
from copsense.margins import margin_table
from copsense.path import LateralPath
from copsense.uncertainty import (
    Source,
    Spread,
    Uncertainty,
    perturbed,
    perturbed_limits,
    propagate_uncertainty,
    sample_models,
)
from copsense.uncertainty.path_travel import exact_travel
from copsense.uncertainty.propagation import SAMPLES
from copsense.uncertainty.uncertainty_tables import DEFAULT

ROBOTS = ("icub", "talos", "g1", "solo12", "four_bar")
TORQUE = copsense.minimum_torque()
LIMITS = copsense.Limits(friction=0.4)
EVERYTHING = {
    "links": {"*": {"mass_percent": 5.0, "com_m": 0.005}},
    "joints": {"*": {"offset_deg": 0.25, "torque_Nm": 0.5}},
    "contacts": {
        "*": {
            "x_m": 0.002,
            "y_m": 0.002,
            "height_m": 0.001,
            "roll_deg": 0.25,
            "pitch_deg": 0.25,
            "yaw_deg": 0.5,
            "sole_x_m": 0.002,
            "sole_y_m": 0.002,
            "sole_yaw_deg": 0.5,
            "friction": 0.05,
        }
    },
}
STEPS = {"kg": 2e-2, "m": 2e-4, "rad": 2e-4, "N m": 1e-3, "N": 1e-3, "1": 1e-3}
STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
CHUNK = 500
SCALES = {"icub": (1.0, 6.0), "four_bar": (1.0, 6.0)}  # times the usual deviations
MANY = ("icub", 1.0)  # of which all models are drawn; of the others a fiftieth
TEXT = """# Errors of the model

Written by `benchmarks/uncertainty.py`. Minimum torque, the presets' own postures.

## Derivatives

Each error of the model is one right-hand side; the judge is the fourth-order difference of the
whole pipeline at models that truly have the error: links, payload, joints, contacts moved on the
ground, soles on their links, slope, torques beside the motors', friction. The largest difference
of any error, relative to the largest entry of its derivative (of one that hardly moves anything, to
a thousandth of the greatest).

| robot | errors | wrenches and torques | centres of pressure | slacks of limits | travels |
| --- | --- | --- | --- | --- | --- |
"""
SAMPLED = """
## Ellipses

Models with random errors, each evaluated whole: the standard deviation of the centre of pressure of
the first contact along the axes of its ellipse, and to first order. *Report* is what
`Spread.nonlinearity` says of that contact with its own {samples} models; over 5 % it is a note.
Where a contact may carry no load (six times the usual errors; a note of its own says so) its centre
of pressure has no finite spread, and a few models make all of the sampled one.

| robot | errors | models | sampled [mm] | first order [mm] | off | report |
| --- | --- | --- | --- | --- | --- | --- |
"""
TRAVELS = """
## Travels

The CoM's travel to the left, by the model, and what is left of it by {sigmas:g} standard
deviations. *Exactly* is the model of the worst case, whole.

| robot | errors | travel [mm] | likely left [mm] | at worst [mm] | exactly [mm] |
| --- | --- | --- | --- | --- | --- |
"""


def main() -> None:
    """Compare and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--models", type=int, default=100_000)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    count = given.models
    cases = [(robot, scale) for robot in ROBOTS for scale in SCALES.get(robot, (1.0,))]
    with ProcessPoolExecutor(given.workers) as pool:
        spreads = {case: _spread(*case) for case in cases}
        drawn = {
            case: _submit(pool, spreads[case], case, count if case == MANY else count // 50)
            for case in cases
        }
        lines = [TEXT]
        for robot in ROBOTS:  # while the workers are busy
            lines.append(_derivatives(robot))
            print(lines[-1], end="", flush=True)
        lines.append(SAMPLED.format(samples=SAMPLES))
        travels = []
        for (robot, scale), spread in spreads.items():
            called = "usual" if scale == 1 else f"{scale:g} times"
            for line in _sampled(drawn[robot, scale], spread):
                lines.append(f"| {robot} | {called} {line}")
                print(lines[-1], end="", flush=True)
            each = spread.travels["+y"]
            exact = "-" if each.exact is None else f"{each.exact * 1e3:.1f}"
            travels.append(
                f"| {robot} | {called} | {each.travel * 1e3:.1f} | {each.likely * 1e3:.1f} | "
                f"{each.worst * 1e3:.1f} | {exact} |\n"
            )
    lines += [TRAVELS.format(sigmas=spread.sigmas), *travels]
    Path(__file__).with_suffix(".md").write_text("".join(lines), encoding="utf-8")


def _everything(stance: copsense.Stance) -> Uncertainty:
    slope = {"roll_deg": 0.5, "pitch_deg": 0.5}
    if stance.robot.base_nv != 6:
        del slope["pitch_deg"]
    robot = stance.robot
    payloads = [{"frame": robot.base_frame, "mass_kg": 0.02, "com_m": [0.05, 0.02, 0.1]}]
    if robot.base_frame not in robot.frame_names:  # the four-bar is drawn without links
        payloads = []
    return Uncertainty.from_dict({**EVERYTHING, "ground": slope, "payloads": payloads})


def _derivatives(robot: str) -> str:
    stance = copsense.load_stance(robot)
    spread = propagate_uncertainty(stance, TORQUE, _everything(stance), LIMITS, samples=0)
    sources, m = spread.sources, len(spread.force_rates)
    table = margin_table(stance, LIMITS)
    exact = {
        "forces": np.vstack([spread.force_rates, spread.torque_rates]),
        "cop": spread.cop_rates.reshape(-1, len(sources)),
        "margins": spread.margin_rates,
    }
    found: dict[str, list[np.ndarray]] = {name: [] for name in exact}
    nearest = [
        table.names.index(margin.name)
        if table.names.count(margin.name) == 1
        else min(
            (i for i, name in enumerate(table.names) if name == margin.name),
            key=lambda i: table.values(
                spread.equilibrium.contact_forces, spread.equilibrium.torques
            )[i],
        )
        for margin in spread.margins
    ]
    for i, source in enumerate(sources):
        step, errors = _step(source), np.zeros(len(sources))
        sums: dict[str, Any] = dict.fromkeys(exact, 0.0)
        for k, weight in STENCIL:
            errors[i] = k * step
            there = perturbed(stance, sources, errors)
            limits = perturbed_limits(there, LIMITS, sources, errors)
            at = copsense.solve_equilibrium(there, TORQUE, limits)
            values = margin_table(there, limits).values(at.contact_forces, at.torques)
            outcome: dict[str, Any] = {
                "forces": np.concatenate([at.contact_forces, at.torques]),
                "cop": copsense.cop.contact_cops(at).ravel(),
                "margins": values[nearest],
            }
            for name, value in outcome.items():
                sums[name] = sums[name] + weight * value / step
        for name in exact:
            found[name].append(sums[name])
    errors_of = [_largest(exact[name], np.array(found[name]).T) for name in exact]
    assert m == len(spread.equilibrium.contact_forces)
    errors_of.append(_travel_error(spread))
    cells = " | ".join("-" if e is None else f"{e:.0e}" for e in errors_of)
    return f"| {robot} | {len(sources)} | {cells} |\n"


def _step(source: Source) -> float:
    """Of the differences: links are light, and their masses stay positive."""
    return min(STEPS[source.unit], source.deviation) if source.unit == "kg" else STEPS[source.unit]


def _largest(exact: np.ndarray, numeric: np.ndarray) -> float | None:
    sizes = np.abs(exact).max(axis=0)
    if not sizes.max() > 1e-12:
        return None
    sizes = np.maximum(sizes, 1e-3 * sizes.max())
    return float((np.abs(exact - numeric).max(axis=0) / sizes).max())


def _travel_error(spread: Spread) -> float | None:
    """Of one error of each kind, that which moves the travel to the left most."""
    each, stance = spread.travels["+y"], spread.equilibrium.stance
    if each.limit is None or not each.travel:
        return None
    scan = copsense.PathScan(LateralPath(stance), TORQUE)
    kinds = {(s.kind, s.part) for s in spread.sources}
    worst, size = 0.0, np.abs(each.rates * spread.deviations).max()
    for kind in kinds:
        own = [i for i, s in enumerate(spread.sources) if (s.kind, s.part) == kind]
        i = max(own, key=lambda j: abs(each.rates[j]))
        rate, deviation = each.rates[i], spread.sources[i].deviation
        if abs(rate) * deviation < 1e-3 * size:
            continue
        step, errors, numeric = _step(spread.sources[i]), np.zeros(len(spread.sources)), 0.0
        for k, weight in STENCIL:
            errors[i] = k * step
            there = exact_travel(
                scan,
                1,
                LIMITS,
                spread.sources,
                errors,
                each.travel + 0.02,
                limit=each.limit,
                precision=1e-14,
            )
            numeric += weight * there / step
        worst = max(worst, abs(numeric - rate) / abs(rate))
    return worst


def _spread(robot: str, scale: float) -> Spread:
    stance = copsense.load_stance(robot)
    usual = Uncertainty.default(stance).to_dict()
    for name in ("links", "joints", "contacts"):
        usual[name] = {"*": {k: v * scale for k, v in DEFAULT[name]["*"].items()}}
    usual["ground"] = {k: v * scale for k, v in usual["ground"].items()}
    return propagate_uncertainty(stance, TORQUE, Uncertainty.from_dict(usual))


def _submit(
    pool: ProcessPoolExecutor, spread: Spread, case: tuple[str, float], count: int
) -> list[Future[np.ndarray]]:
    if not spread.axes.any():  # contacts are points
        return []
    return [pool.submit(_chunk, *case, seed) for seed in range(max(count // CHUNK, 1))]


def _sampled(parts: list[Future[np.ndarray]], spread: Spread) -> list[str]:
    if not parts:
        return []
    cops = np.concatenate([part.result() for part in parts])[:, 0]
    good = np.isfinite(cops).all(axis=1)
    values, turn = np.linalg.eigh(spread.covariance[0])
    lines = []
    for axis in (1, 0):
        first = float(np.sqrt(max(values[axis], 0.0)))
        if first < 1e-9:
            continue
        sampled = float(((cops[good] - spread.cop[0]) @ turn[:, axis]).std())
        lines.append(
            f"| {int(good.sum())} | {sampled * 1e3:.3f} | {first * 1e3:.3f} | "
            f"{sampled / first - 1:+.1%} | {spread.nonlinearity[0]:.1%} |\n"
        )
    return lines


_KNOWN: dict[tuple[str, float], Spread] = {}


def _chunk(robot: str, scale: float, seed: int) -> np.ndarray:
    spread = _KNOWN.get((robot, scale)) or _KNOWN.setdefault((robot, scale), _spread(robot, scale))
    random = np.random.default_rng((seed, 1))
    errors = random.standard_normal((CHUNK, len(spread.sources))) * spread.deviations
    stance = spread.equilibrium.stance
    return sample_models(stance, TORQUE, spread.sources, errors)


if __name__ == "__main__":
    main()
