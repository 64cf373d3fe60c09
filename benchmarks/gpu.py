"""What a batch costs on a graphics processor, sending and fetching included, beside the processor.

    python benchmarks/gpu.py                  # where there is a device (copsense[gpu])
    python benchmarks/gpu.py --compile 9.0    # where there is none: down to its machine code

Both criteria with CoM gain and travel. Every result is compared with the processor's first. Prints
a Markdown table: microseconds per posture by the clock, median and least of interleaved rounds,
and the ratio to one thread. A simulated device (NUMBA_ENABLE_CUDASIM=1) is compared and not timed.
"""

import argparse
import importlib.metadata
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from postures import drawn

import copsense
from copsense.batch import BatchKernel
from copsense.batch.statics.batch_result import arrays_of
from copsense.errors import CopsenseError
from copsense.extras import require

ROBOTS = ("icub", "talos", "anymal_c")
ROUNDS = 7
COUNT = 131072
CRITERIA = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
REMEDY = 'pip install "copsense[gpu]" brings it.'
BOUND = 1e-9  # of a difference, relative to one more than the value


def main():
    """Compare and time, or compile."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--compile", metavar="CAPABILITY", help="compile for it, such as 9.0")
    options = parser.parse_args()
    try:
        if options.compile:
            compile_for(tuple(int(digit) for digit in options.compile.split(".")))
        else:
            compare()
    except CopsenseError as error:
        sys.exit(f"error: {error}")


def configurations(name, count):
    """A robot's batch and so many configurations on its contacts."""
    chart, values = drawn(name, "com")
    values = values[: max(4 * count, 64)]
    solved = chart.solve(values)
    q = solved.configurations[solved.converged]
    return BatchKernel(chart.stance, CRITERIA), np.ascontiguousarray(
        np.resize(q, (count, q.shape[1]))
    )


def compare():
    """Check the results on the device, then time them, robot by robot."""
    from copsense.batch.devices import is_on_device

    is_on_device("cuda")  # or its error
    from copsense.batch.device import SIMULATED, device_name

    print(f"{device_name()}; {platform.machine()}, {os.cpu_count()} threads; {COUNT} postures\n")
    for name in ROBOTS:
        kernel, q = configurations(name, 2 if SIMULATED else COUNT)
        results, there = kernel.empty(len(q)), kernel.empty(len(q))
        kernel.evaluate(q, out=results, threads=os.cpu_count())
        began = time.perf_counter()
        kernel.evaluate(q, out=there, device="cuda")
        first = time.perf_counter() - began
        gap = difference(results, there)
        print(f"{name}: largest relative difference {gap:.1e}", flush=True)
        if not gap < BOUND:
            sys.exit(f"error: {name} differs on the device by {gap:.1e}, more than {BOUND:.0e}.")
        if not SIMULATED:
            print(f"first call {first:.1f} s\n")
            table(name, contenders(kernel, q, results, there))


def difference(here, there):
    """The largest difference of two results, relative to one more than the value; NaN as equal."""
    gaps = []
    for name, wanted in arrays_of(here).items():
        found = arrays_of(there)[name]
        with np.errstate(invalid="ignore"):
            same = (found == wanted) | (np.isnan(found) & np.isnan(wanted))
            gaps.append(np.where(same, 0.0, abs(found - wanted) / (1 + abs(wanted))).max())
    return max(gaps) if not np.isnan(gaps).any() else np.nan


def contenders(kernel, q, results, there):
    """Name -> what is timed."""
    every = os.cpu_count()
    return {
        "processor, 1 thread": lambda: kernel.evaluate(q, out=results),
        f"processor, {every} threads": lambda: kernel.evaluate(q, out=results, threads=every),
        "device, there and back": lambda: kernel.evaluate(q, out=there, device="cuda"),
    }


def table(robot, runs):
    """Time all of them, one after the other in every round, and print the table."""
    times = {name: [] for name in runs}
    for _ in range(ROUNDS):
        for name, run in runs.items():
            began = time.perf_counter()
            run()
            times[name].append(1e6 * (time.perf_counter() - began) / COUNT)
    base = statistics.median(next(iter(times.values())))
    print(f"| {robot} | us per posture, median (least) | ratio |\n|---|---|---|")
    for name, each in times.items():
        middle = statistics.median(each)
        print(f"| {name} | {middle:.3f} ({min(each):.3f}) | {middle / base:.3f} |")
    print(flush=True)


def compile_for(capability):
    """The kernel for a device of this compute capability: its registers, stack and spills.

    Nothing runs. CUDA's compilers come with copsense[gpu]; no driver is needed.
    """
    require("numba_cuda", "compiling for a graphics processor")
    check_compiler()
    assembler()
    from numba import cuda, typeof

    from copsense.batch.statics import device_kernel
    from copsense.batch.statics.compiled_kernel import out_arrays

    # Functions of a device are compiled for the one at hand, and here is none.
    at_hand = SimpleNamespace(compute_capability=capability)
    sys.modules["numba.cuda.dispatcher"].get_current_device = lambda: at_hand
    kernel = BatchKernel(copsense.load_stance(ROBOTS[0]), CRITERIA)
    *parts, _ = kernel._kernel._given
    offset, nq = kernel._kernel._offset, kernel.stance.robot.model.nq
    out = out_arrays(kernel.empty(1), np.ones((1, len(CRITERIA)), dtype=np.uint8))
    q, W = np.zeros((1, nq)), np.zeros((offset.size, 2))
    began = time.process_time()
    text, _ = cuda.compile(
        device_kernel._one_each,
        tuple(typeof(a) for a in (*parts, offset, q, out, W, 1)),
        cc=capability,
        device=False,
        abi="numba",
        output="ptx",
    )
    print(
        f"{len(text) / 1e6:.1f} MB of PTX in {time.process_time() - began:.0f} s of CPU", flush=True
    )
    with tempfile.TemporaryDirectory() as folder:
        ptx = Path(folder) / "kernel.ptx"
        ptx.write_bytes(text if isinstance(text, bytes) else text.encode())
        target = "-arch=sm_{}{}".format(*capability)
        done = subprocess.run(
            [assembler(), "-v", target, str(ptx), "-o", str(ptx.with_suffix(".cubin"))],
            capture_output=True,
            text=True,
        )
        if done.returncode:
            sys.exit(f"error: {done.stderr}")
        size = ptx.with_suffix(".cubin").stat().st_size
    print(f"{size / 1e6:.1f} MB of machine code for {target.removeprefix('-arch=')}")
    print("\n".join(re.findall(r"\d+ bytes stack frame.*|Used \d+ registers.*", done.stderr)))


def check_compiler():
    """End with one line where CUDA's compiler cannot be loaded."""
    from cuda import pathfinder

    try:
        pathfinder.load_nvidia_dynamic_lib("nvrtc")
    except pathfinder.DynamicLibNotFoundError:
        sys.exit("error: CUDA's compiler (NVRTC) is not installed. " + REMEDY)


def assembler():
    """Where the wheel of CUDA's compilers has ptxas."""
    for name in ("nvidia-cuda-nvcc-cu12", "nvidia-cuda-nvcc"):
        try:
            files = importlib.metadata.files(name) or []
        except importlib.metadata.PackageNotFoundError:
            continue
        for file in files:
            if file.name == "ptxas":
                return str(file.locate())
    sys.exit("error: CUDA's assembler (ptxas) is not installed. " + REMEDY)


if __name__ == "__main__":
    main()
