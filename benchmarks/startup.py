"""What starting costs: CPU time of an import, of the help and of one analysis, beside its parts.

Run: .venv/bin/python benchmarks/startup.py [--cold]

`--cold` compiles every kernel with an empty cache instead, as on a new machine.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile

REPEATS = 7
ENTRY = "from copsense.cli import main; main()"
# what it is -> (arguments of the interpreter, the most it may take [s]; None for the yardstick)
STARTS = {
    "import numpy, pinocchio": (["-c", "import numpy, pinocchio"], None),
    "import copsense": (["-c", "import copsense"], 0.5),
    "copsense --help": (["-c", ENTRY, "--help"], 0.4),
    "copsense analyse icub": (["-c", ENTRY, "analyse", "icub"], 1.5),
}
COLD = """
import copsense
from copsense.batch import BatchKernel, PostureChart
stance = copsense.load_stance("icub")
PostureChart(stance, ["com_y"]).compile()
criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
BatchKernel(stance, criteria).compile()
BatchKernel(stance, criteria, copsense.Limits()).compile()
"""


def cpu_time(arguments: list[str], **environment: str) -> float:
    """User and system time of one process [s]."""
    before = os.times()
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        env=os.environ | environment,
    )
    if done.returncode:
        raise SystemExit(done.stderr)
    after = os.times()
    return (after.children_user - before.children_user) + (
        after.children_system - before.children_system
    )


def measure(name: str) -> float:
    """Median CPU time of one of `STARTS` [s]; the first run, which may compile, is not counted."""
    arguments, _ = STARTS[name]
    cpu_time(arguments)
    return statistics.median(cpu_time(arguments) for _ in range(REPEATS))


def measure_cold() -> float:
    """CPU time of a process that compiles every kernel [s], its start included."""
    with tempfile.TemporaryDirectory() as folder:
        return cpu_time(["-c", COLD], NUMBA_CACHE_DIR=folder)


if __name__ == "__main__":
    if "--cold" in sys.argv:
        print(f"every kernel compiled: {measure_cold():.1f} s of CPU time  (at most 40)")
        sys.exit()
    print(f"{'CPU time, median of ' + str(REPEATS):26}  seconds")
    for name, (_, most) in STARTS.items():
        allowed = "" if most is None else f"  (at most {most})"
        print(f"{name:26}  {measure(name):7.2f}{allowed}")
