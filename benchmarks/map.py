"""What a map costs: iCub postures on the manifold, both criteria, into a Zarr store.

    python benchmarks/map.py [--limits] [--threads 2] [--count 100000] [--write benchmarks/map.md]

For each number of postures a fresh process evaluates CoM travel, CoM gain and margins of both
criteria and writes them; loading the robot and the compiled kernels is in its time. Compiling them
is not: a small map comes first. With `--limits` every map is made within limits as well. Prints a
Markdown table: seconds, microseconds per posture, peak memory of the process, size of the store.
Exits with 1 if the largest map takes more than 9 us a posture, or 20 within limits.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COUNTS = (100_000, 300_000, 1_000_000)
RANGES = {"com_x": (-0.02, 0.02), "com_y": (-0.05, 0.05), "com_z": (0.47, 0.51)}  # m
LIMITS = {"friction": 0.33, "torque": "model"}
SMALL = 64  # postures of the map that has the kernels compiled
ALLOWED = {False: 9.0, True: 20.0}  # us a posture by the clock, without and within limits


def measure(count, threads, folder, within):
    """One map in this process; prints its figures as JSON."""
    start = time.perf_counter()
    import copsense

    stance = copsense.load_stance("icub")
    sample = copsense.maps.Sample(
        tuple(copsense.maps.Axis(name, *ends) for name, ends in RANGES.items()), count
    )
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    limits = copsense.Limits(**LIMITS) if within else None
    path = Path(folder) / f"{count}.zarr"
    ready = time.perf_counter()
    summary = copsense.map_postures(stance, sample, criteria, path, limits, threads=threads)
    end = time.perf_counter()
    counts = next(iter(summary.criteria.values())).counts
    figures = {
        "total": end - start,
        "mapping": end - ready,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "store": sum(f.stat().st_size for f in path.rglob("*") if f.is_file()),
        "evaluated": counts["evaluated"] / count,
    }
    print(json.dumps(figures))


def pressed(path):
    """Share of the answers within limits in which a limit presses."""
    import copsense

    state = copsense.load_map(path)["state_within"]  # 0 within, 1 pressed
    return float((state == 1).sum() / max((state <= 1).sum(), 1))


def one_map(count, threads, within):
    """The figures of a map that a fresh process makes."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, "--threads", str(threads), "--one", str(count), folder]
        command += ["--limits"] if within else []
        run = subprocess.run(command, check=True, capture_output=True, text=True, timeout=3600)
        figures = json.loads(run.stdout)
        if within:
            figures["pressed"] = pressed(Path(folder) / f"{count}.zarr")
    return figures


def table(threads, counts, limited):
    """The figures of every count, as lines of Markdown; whether the largest maps are fast enough.

    Args:
        threads: of each map.
        counts: postures of each map.
        limited: whether maps are made within limits too.
    """
    import numba
    import numpy as np
    import pinocchio as pin
    import zarr

    load = os.getloadavg()[0]
    words = ", ".join(f"{name} {value}" for name, value in LIMITS.items())
    lines = [
        "# What a map costs",
        "",
        f"`python benchmarks/map.py{' --limits' if limited else ''} --write benchmarks/map.md`."
        " A Sobol sample of the 23-joint",
        "iCub on two feet over CoM x, y, z; both criteria; CoM gain, travel, margins, CoPs and",
        "shares of the load. A fresh process each, start, robot and writing included.",
        *([f"*limits*: within {words} as well, and in how many answers one presses."] * limited),
        "",
        f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},",
        f"Pinocchio {pin.__version__}, Zarr {zarr.__version__}, {platform.machine()},",
        f"{os.cpu_count()} cores (load {load:.1f} when it began), {threads} threads.",
        "",
        "| postures | limits | seconds | of it mapping | us per posture | peak memory [MB] |"
        " store [MB] | evaluated |",
        "|---|---|---|---|---|---|---|---|",
    ]
    fast = True
    for within in (False, True)[: 1 + limited]:
        one_map(SMALL, threads, within)
        for count in counts:
            f = one_map(count, threads, within)
            each = f["mapping"] / count * 1e6
            fast = fast and (count < counts[-1] or each <= ALLOWED[within])
            presses = f"{f['pressed']:.1%}" if within else "none"
            lines.append(
                f"| {count:,} | {presses} | {f['total']:.1f} | {f['mapping']:.1f} | {each:.1f} | "
                f"{f['memory'] / 1e6:.0f} | {f['store'] / 1e6:.0f} | {f['evaluated']:.1%} |"
            )
            print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines) + "\n", fast


def main():
    """Measure, or as a process of its own measure one count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--limits", action="store_true", help="maps within limits too")
    parser.add_argument("--count", type=int, nargs="*", default=COUNTS, help="postures of each map")
    parser.add_argument("--write", type=Path)
    parser.add_argument("--one", nargs=2, metavar=("COUNT", "FOLDER"))
    options = parser.parse_args()
    if options.one:
        count, folder = options.one
        measure(int(count), options.threads, folder, options.limits)
        return 0
    text, fast = table(options.threads, sorted(options.count), options.limits)
    print(text)
    if options.write:
        options.write.write_text(text)
    return int(not fast)


if __name__ == "__main__":
    sys.exit(main())
