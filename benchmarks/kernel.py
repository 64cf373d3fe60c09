"""What a posture costs: the batch kernel beside the clear path, interleaved in one process.

    python benchmarks/kernel.py

Both criteria, wrenches, CoPs and projected gradients of the 23-joint iCub on two feet. Prints a
Markdown table: microseconds per posture, median and least, and the ratio to the first row.
"""

import platform
import statistics
import time

import numba
import numpy as np
import pinocchio as pin

import copsense
from copsense.batch import BatchKernel

ROUNDS = 15


def postures(stance, count, seed=0):
    """Configurations (count, nq) near a stance, the contacts in place."""
    rng, Z = np.random.default_rng(seed), stance.admissible_motions
    near = [
        copsense.retract(stance, Z @ (0.1 * rng.standard_normal(Z.shape[1]))).q for _ in "x" * 32
    ]
    return np.array(near)[np.arange(count) % len(near)]


def evaluation(kernel, q, threads):
    """A call that evaluates q into memory of its own."""
    out = kernel.empty(len(q))
    return lambda: kernel.evaluate(q, out=out, threads=threads)


def rows():
    """Name -> (what to run, postures in it)."""
    stance = copsense.load_stance("icub")
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    kernel, gains = BatchKernel(stance, criteria, gains=False), BatchKernel(stance, criteria)
    q, found = postures(stance, 32768), {}
    for count in (4096, 512, 32768):
        found[f"kernel, N = {count}"] = (kernel, q[:count], 1)
    found["kernel, N = 32768, 2 threads"] = (kernel, q, 2)
    found["kernel with CoM gain and travel, N = 4096"] = (gains, q[:4096], 1)
    runs = {name: (evaluation(*how), len(how[1])) for name, how in found.items()}
    runs["kernel, one posture called alone, caches cold"] = (lambda: kernel.one(q[0]), 1)
    runs["clear path"] = (
        lambda: [copsense.cop_sensitivity(stance.at(q[0]), c).gradient for c in criteria],
        1,
    )
    return runs


def main():
    """Measure every row once a round, and print the table."""
    runs = rows()
    times = {name: [] for name in runs}
    for round_number in range(ROUNDS + 1):
        for name, (run, count) in runs.items():
            start = time.perf_counter()
            run()
            if round_number:  # the first compiles and touches the memory
                times[name].append((time.perf_counter() - start) / count * 1e6)
    first = statistics.median(times[next(iter(times))])
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},")
    print(f"Pinocchio {pin.__version__}, {platform.machine()}, {platform.system()}.\n")
    print("| how | us per posture | least | ratio |\n|---|---|---|---|")
    for name, values in times.items():
        middle = statistics.median(values)
        print(f"| {name} | {middle:.2f} | {min(values):.2f} | {middle / first:.2f} |")


if __name__ == "__main__":
    main()
