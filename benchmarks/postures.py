"""What it costs to solve postures: charts beside the reference, interleaved in one process.

    python benchmarks/postures.py

Rows of random coordinates (CoM or base position, orientation of the base, every joint off the
legs). Prints a Markdown table: microseconds per row, median and least, the ratio to the first line,
the share of rows that have a posture, and the mean number of steps to it. Rows without one count.

A second table holds what starting between known postures saves, as maps do: rows over CoM x, y, z
as `map.py` draws them, from the stance and between the postures of a lattice, in turns; CPU time,
and that of the lattice by the row of a map of a million. The last lines are the kernel's cost for
the same rows, and whether any row is lost or has another posture.
"""

import argparse
import platform
import statistics
import time

import numba
import numpy as np
import pinocchio as pin
from map import RANGES

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.posture_system import supporting_joints

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


def nearby():
    """Lines of a table: rows of a map from the stance and between known postures, in turns."""
    lines = []
    for name in ("icub", "talos", "g1", "human", "anymal_c"):
        stance = copsense.load_stance(name)
        own = RANGES if name == "icub" else around(stance)
        names, ends = list(own), np.array(list(own.values())).T
        values = ends[0] + np.random.default_rng(1).random((COUNT, 3)) * (ends[1] - ends[0])
        plain, near = PostureChart(stance, names), PostureChart(stance, names, over=tuple(ends))
        outs = plain.empty(COUNT), near.empty(COUNT)
        expected, found = plain.solve(values), near.solve(values)
        there = expected.converged
        kernel = BatchKernel(stance, [copsense.minimum_wrench(1.0), copsense.minimum_torque()])
        q = np.where(there[:, None], expected.configurations, stance.q)[:CHUNK]
        results = kernel.empty(CHUNK)
        runs = (
            (lambda p=plain, v=values, o=outs[0]: p.solve(v, out=o), COUNT),
            (lambda p=near, v=values, o=outs[1]: p.solve(v, out=o), COUNT),
            (lambda k=kernel, q=q, r=results: k.evaluate(q, out=r), CHUNK),
            (lambda s=stance, n=names, e=ends: lattice(s, n, e), 10**6),
        )
        turns = [[cpu_time(run) / count * 1e6 for run, count in runs] for _ in range(ROUNDS + 1)]
        least = np.min(turns[1:], axis=0)
        off = np.abs(found.configurations - expected.configurations)[there & found.converged]
        lost = int((there & ~found.converged).sum())
        lines.append(
            f"| {name} | {least[0]:.2f} | {least[1]:.2f} | {least[1] / least[0]:.2f} "
            f"| {least[3]:.3f} | {least[2]:.2f} | {expected.iterations[there].mean():.1f} "
            f"| {found.iterations[there].mean():.1f} | {there.mean():.2f} | {lost} "
            f"| {int((found.converged & ~there).sum())} | {off.max():.0e} |"
        )
    return lines


def around(stance):
    """Ends of the CoM's x, y, z: a few centimetres around and under a stance's own."""
    x, y, z = stance.com
    return {
        "com_x": (x - 0.02, x + 0.02),
        "com_y": (y - 0.05, y + 0.05),
        "com_z": (z - 0.06, z - 0.02),
    }


def lattice(stance, names, ends):
    """The lattice of known postures alone, which the first row asks for."""
    chart = PostureChart(stance, names, over=tuple(ends))
    chart.solve(ends[:1])


def cpu_time(run):
    """Seconds of this thread."""
    start = time.thread_time()
    run()
    return time.thread_time() - start


def main():
    """Measure every line once a round, and print the tables."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
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
    print("\n## Rows of a map over CoM x, y, z: from the stance and between known postures\n")
    print("CPU time, least of the rounds [us per row].\n")
    print(
        "| robot | from the stance | between | ratio | lattice, of 10^6 rows | kernel | steps "
        "| between | solved | lost | gained | differs by |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    print("\n".join(nearby()))


if __name__ == "__main__":
    main()
