"""What a map costs: iCub postures on the manifold, both criteria, into a Zarr store.

    python benchmarks/map.py [--threads 2] [--write benchmarks/map.md]

For each number of postures a fresh process evaluates CoM travel, CoM gain and margins of both
criteria and writes them; compiling (cached on disk) and loading the robot are in its time. Prints a
Markdown table: seconds, microseconds per posture, peak memory of the process, size of the store.
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


def measure(count, threads, folder):
    """One map in this process; prints its figures as JSON."""
    start = time.perf_counter()
    import copsense

    stance = copsense.load_stance("icub")
    sample = copsense.maps.Sample(
        tuple(copsense.maps.Axis(name, *ends) for name, ends in RANGES.items()), count
    )
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    path = Path(folder) / f"{count}.zarr"
    ready = time.perf_counter()
    summary = copsense.map_postures(stance, sample, criteria, path, threads=threads)
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


def table(threads):
    """The figures of every count, as lines of Markdown."""
    import numba
    import numpy as np
    import pinocchio as pin
    import zarr

    load = os.getloadavg()[0]
    lines = [
        "# What a map costs",
        "",
        "`python benchmarks/map.py --write benchmarks/map.md`. A Sobol sample of the 23-joint",
        "iCub on two feet over CoM x, y, z; both criteria; CoM gain, travel, margins, CoPs and",
        "shares of the load. A fresh process each, start, robot and writing included.",
        "",
        f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__},",
        f"Pinocchio {pin.__version__}, Zarr {zarr.__version__}, {platform.machine()},",
        f"{os.cpu_count()} cores (load {load:.1f} when it began), {threads} threads.",
        "",
        "| postures | seconds | of it mapping | us per posture | peak memory [MB] | store [MB] |"
        " evaluated |",
        "|---|---|---|---|---|---|---|",
    ]
    for count in COUNTS:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, __file__, "--threads", str(threads), "--one", str(count)]
            run = subprocess.run(
                [*command, folder], check=True, capture_output=True, text=True, timeout=3600
            )
        f = json.loads(run.stdout)
        each = f["mapping"] / count * 1e6
        lines.append(
            f"| {count:,} | {f['total']:.1f} | {f['mapping']:.1f} | {each:.1f} | "
            f"{f['memory'] / 1e6:.0f} | {f['store'] / 1e6:.0f} | {f['evaluated']:.1%} |"
        )
        print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines) + "\n"


def main():
    """Measure, or as a process of its own measure one count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--one", nargs=2, metavar=("COUNT", "FOLDER"))
    options = parser.parse_args()
    if options.one:
        measure(int(options.one[0]), options.threads, options.one[1])
        return
    text = table(options.threads)
    print(text)
    if options.write:
        options.write.write_text(text)


if __name__ == "__main__":
    main()
