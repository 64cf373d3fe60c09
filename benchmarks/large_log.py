"""How much memory and time a gigabyte of CSV takes: writes one, runs copsense log on it.

    python benchmarks/large_log.py [--gigabytes 1] [--rate 100]

The iCub sways in simulation; the recording's rows (time, joint positions, velocities and torques,
wrenches of both feet) are repeated, time going on, until the file is large enough. Prints the rows,
the time, the processor's time and the largest memory of the command.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import numpy as np

import copsense
from copsense.controllers import Sine
from copsense.simulation import Scenario

PERIOD = 5.0  # s
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")


def period(rate):
    """Headings but for the time, and the lines of one period of a sway, without it."""
    scenario = Scenario(2 * PERIOD, reference=Sine(0.02, 1 / PERIOD), control_period=2e-3)
    found = copsense.balance(copsense.load_stance("icub"), copsense.minimum_torque(), scenario)
    t = found["time"].values
    rows = np.searchsorted(t, PERIOD + np.arange(round(PERIOD * rate)) / rate)
    joints = found["joint"].values.tolist()
    feet = found["contact"].values.tolist()
    heads = [f"{j}{kind}" for kind in ("", "_vel", "_torque") for j in joints]
    heads += [f"{foot}_{axis}" for foot in feet for axis in WRENCH]
    parts = [found[name].values[rows] for name in ("joint_position", "joint_velocity", "torque")]
    wrenches = found["wrench"].values[rows].reshape(len(rows), -1)
    numbers = np.hstack([*parts, wrenches])
    return heads, [",".join(f"{x:.12g}" for x in row) for row in numbers.tolist()]


def write(path, size, rate):
    """Write rows until the file has so many bytes; how many there are."""
    heads, lines = period(rate)
    rows = 0
    with path.open("w") as file:
        file.write(",".join(["time", *heads]) + "\n")
        while file.tell() < size:
            file.writelines(f"{(rows + k) / rate:.6f},{line}\n" for k, line in enumerate(lines))
            rows += len(lines)
    return rows, 1 + len(heads)


def main():
    """Write, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gigabytes", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=100.0, help="[Hz]")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.csv"
        rows, columns = write(path, args.gigabytes * 1e9, args.rate)
        print(f"{path.stat().st_size / 1e9:.2f} GB, {rows} rows of {columns} columns", flush=True)
        command = [sys.executable, "-m", "copsense", "log", str(path), "--robot", "icub"]
        begin = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        clock = time.perf_counter() - begin
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(done.stdout[-600:] or done.stderr[-600:])
    print(*(line for line in done.stderr.splitlines() if line.startswith("note")), sep="\n")
    print(
        f"{clock:.0f} s by the clock, {used.ru_utime + used.ru_stime:.0f} s of CPU, "
        f"{used.ru_maxrss / 1024:.0f} MB at most"
    )
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
