"""Coverage of the intervals of an identification: writes identification.md.

    python benchmarks/identification.py [--runs 400]

The iCub sways for 16 s; what a criterion of known parameters says of the load is measured with
coloured noise and an offset, and identified. Takes about five minutes.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import numpy as np

import copsense
from copsense.identification import Measurements, fit_family
from copsense.identification.families import identifiable
from copsense.identification.fitting import predict
from copsense.timed_path import TimedPath, instant

PERIOD, LENGTH, RATE = 5.0, 16.0, 5.0  # s, s, rows a second
NOISE, MEMORY, OFFSET = 0.01, 0.3, 0.03  # of the weight, s, of the weight
CASES = {"joints": (1.4, 1.0), "length": (0.12,)}
TEXT = """# Identification

Written by `benchmarks/identification.py`. In {runs} seeded runs for each family the iCub sways its
centre of mass by 28 mm at 0.2 Hz for {LENGTH:g} s; the left foot's load share, of a criterion with
known parameters and with inertia, is measured {RATE:g} times a second with noise of {noise:g} of
the weight that remembers for {MEMORY:g} s, and an offset of {OFFSET:g}. *Covered*: how often the
stated 95 % interval held the truth. The share of one foot does not see the knees' weight.

| family | parameter | truth | mean estimate | covered |
| --- | --- | --- | --- | --- |
"""


def record(stance: copsense.Stance) -> list[copsense.Stance]:
    """The stance in motion at every row."""
    path = copsense.lateral_sweep(stance, -0.028, 0.028, 29)
    times = np.arange(0.0, LENGTH, 1.0 / RATE)
    timed = TimedPath(path, copsense.controllers.Sine(0.028, 1.0 / PERIOD))
    found = []
    for t in times:
        value, rate, second = timed.signal.at(float(t))
        found.append(instant(path, value, rate, second).stance)
    return found


def coloured(rng: np.random.Generator, count: int) -> np.ndarray:
    """Noise of unit size whose autocorrelation falls with `MEMORY`."""
    keep = np.exp(-1.0 / (RATE * MEMORY))
    found = np.empty(count)
    found[0] = rng.standard_normal()
    for i in range(1, count):
        found[i] = keep * found[i - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
    return found


def main() -> None:
    """Identify synthetic records."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=400)
    runs = parser.parse_args().runs
    stance = copsense.load_stance("icub")
    rows = record(stance)
    lines = [TEXT.format(runs=runs, noise=NOISE, LENGTH=LENGTH, RATE=RATE, MEMORY=MEMORY,
                         OFFSET=OFFSET)]  # fmt: skip
    for name, truth in CASES.items():
        family = identifiable(stance)[name]
        blank = Measurements(tuple(rows), ("load share of l_sole",), np.zeros((len(rows), 1)))
        exact, _ = predict(family.build(truth), blank)
        inside, values = 0, []
        for seed in range(runs):
            noise = coloured(np.random.default_rng(seed), len(rows))[:, None]
            measured = Measurements(blank.stances, blank.names, exact + NOISE * noise + OFFSET)
            # From the truth: the search's own start is the tests' matter, and takes longer.
            fit = fit_family(family, measured, truth)
            first = fit.estimates[family.parameters[0]]
            inside += first.low <= truth[0] <= first.high
            values.append(first.value)
        lines.append(
            f"| {name} | {family.parameters[0]} | {truth[0]:g} | {np.mean(values):.4f} | "
            f"{inside / runs:.1%} |\n"
        )
        print(lines[-1], end="", flush=True)
    Path(__file__).with_suffix(".md").write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
