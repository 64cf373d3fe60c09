"""What it costs to solve postures: charts beside the reference, interleaved in one process.

    python benchmarks/postures.py

Rows of random coordinates (CoM or base position, orientation of the base, every joint off the
legs). Prints a Markdown table: microseconds per row, median and least, the ratio to the first line,
the share of rows that have a posture, and the mean number of steps to it. Rows without one count.
"""

import platform
import statistics
import time

import numba
import numpy as np
import pinocchio as pin

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.posture import supporting_joints

ROUNDS = 9
COUNT = 16384
CHUNK = 4096  # of the pipeline: its memory is used again


def drawn(name, base, *, reach=0.02):
    """A chart of a robot and rows of values around its stance."""
    stance = copsense.load_stance(name)
    mask, rng = supporting_joints(stance), np.random.default_rng(0)
    free = [j for j in stance.robot.joint_names if not mask[stance.robot.velocity_index(j)]]
    chart = PostureChart(
        stance, [f"{base}_x", f"{base}_y", f"{base}_z", "roll", "pitch", "yaw", *free]
    )
    size = np.array([reach] * 3 + [0.1] * 3 + [0.3] * len(free))
    offset = size * rng.uniform(-1, 1, (COUNT, len(size)))
    offset[:, 2] -= reach  # lower, where the legs can follow
    return chart, chart.values + offset


def pipeline(chart, values, threads):
    """Solve and evaluate both criteria with CoM gain and travel, chunk by chunk."""
    kernel = BatchKernel(chart.stance, [copsense.minimum_wrench(1.0), copsense.minimum_torque()])
    postures, results = chart.empty(CHUNK), kernel.empty(CHUNK)

    def run():
        for start in range(0, len(values), CHUNK):
            batch = chart.solve(values[start : start + CHUNK], out=postures, threads=threads)
            # Rows without a posture are evaluated as the stance: every row costs the same.
            batch.configurations[~batch.converged] = chart.stance.q
            kernel.evaluate(batch.configurations, out=results, threads=threads)

    return run


def rows():
    """Name -> (what to run, rows in it, the share solved, mean steps)."""
    found = {}
    for name in ("icub", "talos", "g1", "human", "anymal_c"):
        for base in ("com", "base"):
            chart, values = drawn(name, base)
            out = chart.empty(COUNT)
            batch = chart.solve(values, out=out)
            notes = (batch.converged.mean(), batch.iterations[batch.converged].mean())
            found[f"{name}, {base}"] = (
                lambda chart=chart, values=values, out=out: chart.solve(values, out=out),
                COUNT,
                *notes,
            )
            if name == "icub" and base == "com":
                for threads in (1, 2):
                    text = f"icub, com, then both criteria with gain and travel, {threads} thread"
                    found[text + "s" * (threads > 1)] = (
                        pipeline(chart, values, threads),
                        COUNT,
                        *notes,
                    )
                found["icub, com, 2 threads"] = (
                    lambda chart=chart, values=values, out=out: chart.solve(
                        values, out=out, threads=2
                    ),
                    COUNT,
                    *notes,
                )
                reference = PostureChart(chart.stance, chart.names)
                reference.fallback_reason = "measured"
                found["icub, com, reference"] = (
                    lambda reference=reference, values=values: reference.solve(values[:8]),
                    8,
                    *notes,
                )
    return found


def main():
    """Measure every line once a round, and print the table."""
    lines = rows()
    times = {name: [] for name in lines}
    for round_number in range(ROUNDS + 1):
        for name, (run, count, *_) in lines.items():
            start = time.perf_counter()
            run()
            if round_number:  # the first compiles and touches the memory
                times[name].append((time.perf_counter() - start) / count * 1e6)
    first = statistics.median(times[next(iter(times))])
    print("# What solving postures costs\n")
    print("`python benchmarks/postures.py > benchmarks/postures.md`.\n")
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},")
    print(f"Pinocchio {pin.__version__}, {platform.machine()}, {platform.system()}.\n")
    print("| chart | us per row | least | ratio | solved | steps |\n|---|---|---|---|---|---|")
    for name, (_, _, solved, steps) in lines.items():
        middle = statistics.median(times[name])
        print(
            f"| {name} | {middle:.2f} | {min(times[name]):.2f} | {middle / first:.2f} "
            f"| {solved:.2f} | {steps:.1f} |"
        )


if __name__ == "__main__":
    main()
