"""How the kernel's cost grows, for `speed.py`: with joints, contacts, postures and threads.

Every function returns the rows of a Markdown table. Rows of a table take turns, many short rounds.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from equality import draw, with_hands
from numba.core.runtime import _nrt_python, rtsys

import copsense
from copsense.batch import BatchKernel

CRITERIA = (copsense.minimum_wrench(1.0), copsense.minimum_torque())
CHUNK = 4096
POOL = 32768  # different postures; longer runs go through them again
CALLS = 20000


def interleaved(
    runs: dict[str, Callable[[], float]], rounds: int, progress: Callable[[str], None]
) -> dict[str, list[float]]:
    """Seconds per posture of every run, each once a round; the first round is thrown away."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(rounds + 1):
        progress(f"round {number} of {rounds}")
        for name, run in runs.items():
            seconds = run()
            if number:
                times[name].append(seconds)
    return times


def batches(kernel: BatchKernel, q: np.ndarray, *, calls: int = 1) -> Callable[[], float]:
    """A run: CPU seconds per posture of evaluating q into memory of its own."""
    out = kernel.empty(len(q))

    def run() -> float:
        start = time.thread_time()
        for _ in range(calls):
            kernel.evaluate(q, out=out)
        return (time.thread_time() - start) / (calls * len(q))

    return run


def microseconds(times: list[float]) -> str:
    """Median and least, as two cells."""
    return f"{statistics.median(times) * 1e6:.2f} | {min(times) * 1e6:.2f}"


def sizes(rounds: int, progress: Callable[[str], None]) -> list[str]:
    """Robots by joints, then the iCub by contacts: cells of names, joints, contacts, times."""
    hand_wall, hand_table = ("l_hand", (-1, 0.2, 0.1)), ("r_hand", (0.1, 0.0, 1.0))
    cases = {
        "iCub, 23 joints": copsense.load_stance("icub"),
        "Talos": copsense.load_stance("talos"),
        "G1": copsense.load_stance("g1"),
        "iCub, all joints": copsense.load_stance("iCubGenova04"),
        "iCub, a hand on a wall (point)": with_hands("icub", hand_wall),
        "iCub, a hand laid flat": with_hands("icub", ("l_hand", None)),
        "iCub, hands on wall and table (points)": with_hands("icub", hand_wall, hand_table),
        "ANYmal C (four points)": copsense.load_stance("anymal_c"),
    }
    runs = {}
    for name, stance in cases.items():
        kernel = BatchKernel(stance, CRITERIA, gains=False)
        if kernel.fallback_reason:
            raise SystemExit(f"{name}: {kernel.fallback_reason}")
        runs[name] = batches(kernel, draw(stance, CHUNK, seed=1))
    times = interleaved(runs, rounds, progress)
    first = statistics.median(next(iter(times.values())))
    return [
        f"| {name} | {len(cases[name].robot.joint_names)} | {len(cases[name].contacts)} "
        f"| {microseconds(each)} | {statistics.median(each) / first:.2f} |"
        for name, each in times.items()
    ]


def in_chunks(kernel: BatchKernel, pool: np.ndarray, count: int) -> float:
    """The least load share of `count` postures, chunk by chunk into the same memory."""
    out, least = kernel.empty(min(CHUNK, count)), np.inf
    for start in range(0, count, CHUNK):
        size, at = min(CHUNK, count - start), start % len(pool)
        given = out if size == len(out) else kernel.empty(size)
        found = kernel.evaluate(pool[at : at + size], out=given)
        least = min(least, float(found.load_share.min()))
    return least


def counts(rounds: int, progress: Callable[[str], None]) -> list[str]:
    """From a hundred to a million postures: cells of N, times, peak memory of a process."""
    stance = copsense.load_stance("icub")
    kernel, pool = BatchKernel(stance, CRITERIA, gains=False), draw(stance, POOL, seed=2)

    def run(count: int) -> float:
        repeats = max(1, CHUNK // count)
        start = time.thread_time()
        for _ in range(repeats):
            in_chunks(kernel, pool, count)
        return (time.thread_time() - start) / (repeats * count)

    numbers = [10**k for k in range(2, 7)]
    times = interleaved({str(n): partial(run, n) for n in numbers}, min(rounds, 7), progress)
    rows = []
    for n in numbers:
        progress(f"memory of {n} postures")
        peak, before = peak_memory(n)
        rows.append(f"| {n} | {microseconds(times[str(n)])} | {peak:.0f} | {before:.0f} |")
    return rows


def peak_memory(count: int) -> tuple[float, float]:
    """Peak resident memory [MB] of a process that evaluates so many postures, and before."""
    command = [sys.executable, __file__, str(count)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    peak, before = (float(word) for word in said.split())
    return peak, before


def threads(rounds: int, progress: Callable[[str], None], cores: set[int]) -> list[str]:
    """One and two threads on all cores, by the clock: cells of N, threads, times, speed-up."""
    stance = copsense.load_stance("icub")
    kernel, pool = BatchKernel(stance, CRITERIA, gains=False), draw(stance, POOL, seed=2)

    def run(q: np.ndarray, out: copsense.batch.BatchResult, number: int) -> float:
        start = time.perf_counter()
        kernel.evaluate(q, out=out, threads=number)
        return (time.perf_counter() - start) / len(q)

    runs = {}
    for n in (CHUNK, POOL):
        out = kernel.empty(n)
        for number in (1, 2):
            runs[f"{n} | {number}"] = partial(run, pool[:n], out, number)
    mine = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        times = interleaved(runs, rounds, progress)
    finally:
        os.sched_setaffinity(0, mine)
    load = os.getloadavg()[0]  # with the cores taken, a second thread finds none
    rows = []
    for name, each in times.items():
        alone = times[name.rpartition("|")[0] + "| 1"]
        gain = statistics.median(alone) / statistics.median(each), min(alone) / min(each)
        rows.append(
            f"| {name} | {microseconds(each)} | {gain[0]:.2f} | {gain[1]:.2f} | {load:.1f} |"
        )
    return rows


def single(progress: Callable[[str], None]) -> tuple[list[str], dict[str, float]]:
    """Latency of `BatchKernel.one` by the clock, and what a call allocates."""
    stance = copsense.load_stance("icub")
    q = list(draw(stance, CHUNK, seed=3))
    plain = BatchKernel(stance, CRITERIA, gains=False)
    gains = BatchKernel(stance, CRITERIA)
    spoiler = np.zeros(2**22)  # 32 MB: what was in the caches is not there any more
    rows, medians = [], {}
    for name, kernel, cold in (
        ("back to back", plain, False),
        ("back to back, with CoM gain and travel", gains, False),
        ("after 32 MB of other work", plain, True),
    ):
        progress(f"one posture, {name}")
        calls = CALLS // 20 if cold else CALLS
        values = np.sort(list(latencies(kernel, q, calls, spoiler if cold else None)))
        medians[name] = float(np.median(values))
        cells = [f"{v:.1f}" for v in np.percentile(values, [0, 50, 90, 99, 99.9, 100])]
        rows.append(f"| {name} | {calls} | " + " | ".join(cells) + " |")
    return rows, medians | allocations(plain, q)


def latencies(
    kernel: BatchKernel, q: list[np.ndarray], calls: int, spoiler: np.ndarray | None
) -> Iterator[float]:
    """Microseconds by the clock of each call, after a few."""
    for i in range(100):
        kernel.one(q[i])
    for i in range(calls):
        if spoiler is not None:
            spoiler += 1.0
        row = q[i % len(q)]
        start = time.perf_counter_ns()
        kernel.one(row)
        yield (time.perf_counter_ns() - start) / 1e3


def allocations(kernel: BatchKernel, q: list[np.ndarray], calls: int = 1000) -> dict[str, float]:
    """What `calls` calls leave behind, and the most that one holds while it runs."""
    one, rows = kernel.one, q[:calls]
    one(rows[0])
    before = sys.getallocatedblocks()
    for row in rows:
        one(row)
    kept = sys.getallocatedblocks() - before
    _nrt_python.memsys_enable_stats()
    compiled = rtsys.get_allocation_stats().alloc
    for row in rows:
        one(row)
    compiled = rtsys.get_allocation_stats().alloc - compiled
    _nrt_python.memsys_disable_stats()
    tracemalloc.start()
    one(rows[0])
    tracemalloc.reset_peak()
    base = tracemalloc.get_traced_memory()[0]
    for row in rows:
        one(row)
    passing = tracemalloc.get_traced_memory()[1] - base
    tracemalloc.stop()
    return {"kept": kept, "compiled": compiled, "passing": passing, "calls": calls}


def resident(what: str) -> float:
    """Memory of this process by Linux [MB]: VmRSS, or VmHWM, the most since it was set back."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(what)) / 1024


def main() -> None:
    """Evaluate so many postures in chunks; print the process's peak memory and what it had."""
    stance = copsense.load_stance("icub")
    pool = draw(stance, CHUNK, seed=2)
    kernel = BatchKernel(stance, CRITERIA, gains=False)
    in_chunks(kernel, pool, 8)  # load the machine code
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts from here
    before = resident("VmRSS")
    in_chunks(kernel, pool, int(sys.argv[1]))
    print(resident("VmHWM"), before)


if __name__ == "__main__":
    main()
