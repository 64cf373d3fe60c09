"""What limits cost in the batch: the iCub on two feet, both criteria, on one thread.

    python benchmarks/within_limits.py [--write benchmarks/within_limits.md]

Postures over CoM x, y and z are evaluated without limits, within limits, and a few of them one at a
time by the reference into the same arrays, in turns: CPU time, the least of several turns. Prints a
Markdown table, one row for each set of limits; exits with 1 if limits add more than 15 us a posture
where all postures have wrenches within them.
"""

import argparse
import os
import platform
import sys
import time
from functools import partial
from pathlib import Path

import numba
import numpy as np

import copsense
from copsense import Limits
from copsense.batch import BatchKernel, PostureChart
from copsense.batch.statics.reference import fill_row

COUNT, TURNS, FEW, ALONE, ALLOWED = 4096, 9, 40, 3, 15.0
SETS = {
    "friction 0.5, model's torques": Limits(friction=0.5, torque="model"),
    "friction 0.3, 20 Nm, torsion 10 mm": Limits(friction=0.3, torque=20.0, torsion=0.01),
    "the same, CoP 10 mm inside": Limits(friction=0.3, torque=20.0, torsion=0.01, cop_margin=0.01),
    "the same, 9 Nm": Limits(friction=0.3, torque=9.0, torsion=0.01, cop_margin=0.01),
}


def postures(stance):
    """Random postures, some with the CoM near the soles' edges (count, nq)."""
    chart = PostureChart(stance, ["com_x", "com_y", "com_z"])
    rng = np.random.default_rng(0)
    offset = np.array([0.03, 0.06, 0.02]) * rng.uniform(-1, 1, (3 * COUNT, 3)) - [0, 0, 0.02]
    batch = chart.solve(chart.values + offset)
    return batch.configurations[batch.converged][:COUNT]


def seconds(function):
    """CPU time of a call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def by_reference(stance, q, criteria, out):
    """Evaluate a few postures one at a time, as the batch does what its kernel leaves."""
    for i, row in enumerate(q):
        for j, criterion in enumerate(criteria):
            fill_row(stance, row, criterion, out, i, j)


def measure():
    """The table's rows, and the largest added cost."""
    stance = copsense.load_stance("icub")
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    q, rows, worst = postures(stance), [], 0.0
    free = BatchKernel(stance, criteria)
    for name, limits in SETS.items():
        within = BatchKernel(stance, criteria, limits)
        outs = free.empty(len(q)), within.empty(len(q))
        found = within.evaluate(q)
        given = partial(free.evaluate, q, out=outs[0]), partial(within.evaluate, q, out=outs[1])
        turns = [[seconds(each) for each in given] for _ in range(TURNS)]
        plain, limited = np.min(turns, axis=0) / len(q) * 1e6
        alone = partial(by_reference, stance, q[:FEW], criteria, within.empty(FEW))
        slow = min(seconds(alone) for _ in range(ALONE)) / FEW * 1e6
        state = found.limits.state
        shares = [f"{np.mean(state == code):.0%}" for code in (0, 1, 2)]
        rows.append(
            f"| {name} | {' | '.join(shares)} | {plain:.1f} | {limited:.1f} | "
            f"{limited - plain:.1f} | {slow:.0f} | {slow / limited:.0f} |"
        )
        print(rows[-1], file=sys.stderr, flush=True)
        if not (state == 2).any():
            worst = max(worst, limited - plain)
    return rows, worst


def main():
    """Measure, print, and write the page if asked to."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path, help="write the page here")
    arguments = parser.parse_args()
    rows, worst = measure()
    lines = [
        "# What limits cost in the batch",
        "",
        "`python benchmarks/within_limits.py --write benchmarks/within_limits.md`. The 23-joint",
        "iCub on two feet, both criteria: sensitivities, gains, travels, margins, and within",
        "limits multipliers, optimality and the nearest change; one thread, CPU time [us a",
        f"posture], the least of {TURNS} turns. The first three numbers are shares of the answers;",
        "*times*: what the reference takes for the same arrays over what the batch takes.",
        "",
        f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__}, "
        f"{platform.machine()}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.",
        "",
        "| limits | within | pressed | infeasible | without | with | added | reference | times |",
        "|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        f"Where wrenches exist limits add at most {worst:.1f} us a posture; {ALLOWED:.0f} are",
        "allowed. An infeasible answer costs more: its least relaxation is a linear program, and",
        "its reason is put into words.",
    ]
    text = "\n".join(lines) + "\n"
    print(text)
    if arguments.write:
        arguments.write.write_text(text)
    return int(worst > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
