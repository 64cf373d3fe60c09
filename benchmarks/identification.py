"""Coverage of the intervals of a log's slopes and of its identification: writes identification.md.

    python benchmarks/identification.py [--runs 400]

The iCub sways for 16 s under a criterion of known parameters; its log has coloured noise and an
offset in the load, and a constant error in every encoder. Takes about fifteen minutes of one core.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import numpy as np

import copsense
from copsense.identification import fit_family, log_measurements
from copsense.identification.families import identifiable
from copsense.logs import Log, WrenchSeries, compare_log
from copsense.timed_path import TimedPath

PERIOD, LENGTH, RATE = 5.0, 16.0, 10.0  # s, s, rows a second
NOISE, MEMORY, OFFSET = 0.01, 0.3, 0.03  # of the weight, s, of the weight
BIAS = np.radians(0.5)  # standard deviation of an encoder's constant error
ROWS = 40  # that are evaluated
LEGS = ("hip", "knee", "ankle")
# Family -> its true parameters; of a mix the torque's share is one, and the last is not seen.
CASES = {"joints": (1.4, 1.0), "stiffness": (0.7, 1.0), "length": (0.12,), "mix": (0.1, 0.3)}
TEXT = """# Identification

Written by `benchmarks/identification.py`. In {runs} seeded runs for each line the iCub, its upper
body locked, sways its centre of mass by 28 mm at 0.2 Hz for {LENGTH:g} s. The load of its feet, of
minimum torque for the slopes and of the family's truth for the others, with inertia, is measured
with noise of {NOISE:g} of the weight that remembers for {MEMORY:g} s, and an offset of {OFFSET:g};
every encoder reads a constant too much, normal with a standard deviation of {bias:g} deg, another
one in every run. {ROWS} rows are evaluated. *Covered*: how often the stated 95 % interval held the
truth, with the encoders' accuracy stated (`--encoders {bias:g}deg`) and not. The share of one foot
does not see the knees' weight.

| what | truth | mean estimate | covered | accuracy not stated |
| --- | --- | --- | --- | --- |
"""


def legs_alone() -> copsense.Stance:
    """The iCub with its upper body locked."""
    whole = copsense.load_stance("icub")
    names = [n for n in whole.robot.joint_names if any(part in n for part in LEGS)]
    robot = whole.robot.keeping(names)
    return copsense.load_stance(robot, contacts=whole.contacts)


def record(stance: copsense.Stance) -> tuple[list[copsense.Stance], np.ndarray]:
    """The stance in motion at every row, and the times."""
    path = copsense.lateral_sweep(stance, -0.028, 0.028, 29)
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    timed = TimedPath(path, copsense.controllers.Sine(0.028, 1.0 / PERIOD))
    return [timed.at(float(t)).stance for t in times], times


def coloured(rng: np.random.Generator, count: int) -> np.ndarray:
    """Noise of unit size whose autocorrelation falls with `MEMORY`."""
    keep = np.exp(-1.0 / (RATE * MEMORY))
    found = np.empty(count)
    found[0] = rng.standard_normal()
    for i in range(1, count):
        found[i] = keep * found[i - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
    return found


class Experiment:
    """A sway that is known exactly, and its logs."""

    def __init__(self) -> None:
        """Move the robot once."""
        self.stance = legs_alone()
        self.rows, self.times = record(self.stance)
        names = self.stance.robot.joint_names
        self.names = tuple(names)
        self.positions = np.array(
            [[row.robot.joint_position(row.q, name) for name in names] for row in self.rows]
        )

    def loads(self, criterion: copsense.Criterion) -> np.ndarray:
        """The true normal forces of both feet (N, 2)."""
        found = [copsense.solve_equilibrium(row, criterion).wrenches[:, 2] for row in self.rows]
        return np.array(found)

    def log(self, loads: np.ndarray, seed: int | None) -> Log:
        """A log of these loads; without noise and errors where the seed is None."""
        weight, positions, forces = self.stance.robot.weight, self.positions, loads.copy()
        if seed is not None:
            rng = np.random.default_rng(seed)
            moved = weight * (NOISE * coloured(rng, len(loads)) + OFFSET)
            forces += np.column_stack([moved, -moved])
            positions = positions + BIAS * rng.standard_normal(positions.shape[1])
        sensors = []
        for name, force in zip(self.stance.contact_names, forces.T, strict=True):
            values = np.full((len(loads), 6), np.nan)
            values[:, 2] = force
            sensors.append(WrenchSeries(name, name, "", "sole", values))
        return Log("synthetic", self.times, self.names, positions, tuple(sensors))

    def slopes(self, log: Log) -> dict[str, Interval]:
        """Source -> the load's slope."""
        torque = [copsense.minimum_torque()]
        found = compare_log(log, self.stance, torque, skip=0, postures=ROWS, encoders=BIAS)
        return {k: Interval(s.value, s.high - s.value, s.encoders)
                for k, s in found.slopes["load"].items()}  # fmt: skip

    def parameters(self, family: str, log: Log, truth: tuple[float, ...]) -> Interval:
        """The logarithm of the family's first parameter."""
        measured = log_measurements(log, self.stance, skip=0, postures=ROWS, encoders=BIAS)
        # From the truth: the search's own start is the tests' matter, and takes longer.
        fit = fit_family(identifiable(self.stance)[family], measured, truth)
        found = next(iter(fit.estimates.values()))
        value = float(np.log(found.value))
        return Interval(value, float(np.log(found.high)) - value, found.encoders)


@dataclass(frozen=True)
class Interval:
    """A value, half its 95 % interval, and the encoders' standard deviation in it."""

    value: float
    half: float
    encoders: float

    def holds(self, truth: float, stated: bool) -> bool:
        """Whether the truth is inside, with the encoders' part in it or not."""
        half = self.half if stated else np.sqrt(self.half**2 - (1.959964 * self.encoders) ** 2)
        return bool(abs(self.value - truth) <= half)


def line(what: str, truth: float, found: list[Interval], logarithm: bool = False) -> str:
    """A row of the table."""
    inside = [np.mean([f.holds(truth, stated) for f in found]) for stated in (True, False)]
    shown = [truth, float(np.mean([f.value for f in found]))]
    values = np.exp(shown) if logarithm else shown
    return f"| {what} | {values[0]:.4g} | {values[1]:.4g} | {inside[0]:.1%} | {inside[1]:.1%} |\n"


def main() -> None:
    """Identify synthetic records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=400)
    runs = parser.parse_args().runs
    experiment = Experiment()
    lines = [TEXT.format(**globals(), runs=runs, bias=np.degrees(BIAS))]

    def add(*row: object) -> None:
        lines.append(line(*row))  # type: ignore[arg-type]
        print(lines[-1], end="", flush=True)

    loads = experiment.loads(copsense.minimum_torque())
    truth = experiment.slopes(experiment.log(loads, None))
    logs = (experiment.log(loads, seed) for seed in range(runs))
    found = [experiment.slopes(log) for log in logs]
    for source, exact in truth.items():
        add(f"slope: {source}", exact.value, [slopes[source] for slopes in found])
    for name, values in CASES.items():
        family = identifiable(experiment.stance)[name]
        loads = experiment.loads(family.build(values))
        logs = (experiment.log(loads, seed) for seed in range(runs))
        fits = [experiment.parameters(name, log, values) for log in logs]
        add(f"{name}: {family.parameters[0]}", float(np.log(values[0])), fits, True)
    Path(__file__).with_suffix(".md").write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
