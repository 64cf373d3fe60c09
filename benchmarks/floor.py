"""How near the kernel is to the floor: the same work in C++ written for one robot, in turns.

    python benchmarks/floor.py [--rounds 40]

`lane_kernel/lane_kernel.cpp` computes what one call of `BatchKernel` computes for the iCub on two
flat feet (minimum wrench and minimum torque, without CoM gains) into arrays of the same layout. It
is compiled here for this processor, twice: with the robot's joints and their order known to the
compiler, which is the floor, and with the same numbers as variables, as the kernel has them. Every
answer is compared with the kernel's first. Then they take turns on one core, CPU time. Writes
benchmarks/floor.md; without a C++ compiler it prints why nothing was measured, and writes nothing.
CXX names another compiler.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import speed
import speed_scaling as scaling
from equality import draw
from threadpoolctl import threadpool_limits

import copsense
from copsense.batch import BatchKernel, BatchResult
from copsense.batch.layout import RobotLayout, robot_layout
from copsense.batch.statics.reference import sole_edges
from copsense.batch.workspace import WIDTH

HERE = Path(__file__).parent
SOURCE = HERE / "lane_kernel" / "lane_kernel.cpp"
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-std=c++17", "-shared", "-fPIC")
KERNEL = "the kernel's machine code"
FLOOR = "C++ lanes that know the robot: the floor"
VARIANTS = {FLOOR: (), "the same C++, the robot's sizes and order as variables": ("-DUNKNOWN",)}
WHAT = ("wrenches", "torques", "cops", "gradient", "margin", "load_share", "com")
EXACT = 1e-9  # largest difference, relative to the largest entry
WANTED = 1.6  # how many times the floor the kernel may cost
WARM = 20  # rounds before the clock counts
Fill = Callable[[], object]


def header(layout: RobotLayout, nq: int) -> str:
    """robot.h: sizes and order of the robot's parts, as constants or as variables."""
    tree, feet = layout.parts
    held = feet.order[0]
    if len(feet.body) != 2 or feet.point.any() or held or tree.kind.any():
        raise SystemExit("the lane kernel serves revolute joints on two soles, and no other robot.")
    n, ns = len(tree.parent) - 1, len(feet.support)
    side = [0 if feet.member[group, held] else 1 for group in feet.group]
    tables = {
        "PARENT": tree.parent,
        "COLUMN": tree.column,
        "SUPPORTS": feet.support,
        "SIDE": side,
        "ANCHOR": feet.anchor,
        "REST": feet.rest,
        "FOOT": feet.body,
        "FIRST_EDGE": feet.edge_first,
    }
    lines = ["#ifdef UNKNOWN", "#define KNOWN", "#else", "#define KNOWN constexpr", "#endif"]
    lines += [f"constexpr int N = {n}, NQ = {nq}, NS = {ns}, EDGES = {len(feet.edges)};"]
    lines += [f"KNOWN int JOINTS = {n}, SUPPORT = {ns};"]
    lines += [f"KNOWN int {name}[] = {{{numbers(table)}}};" for name, table in tables.items()]
    return "\n".join(lines) + "\n"


def numbers(table: Sequence[int]) -> str:
    """A table's entries, separated by commas."""
    return ", ".join(str(int(entry)) for entry in table)


def constants(layout: RobotLayout) -> np.ndarray:
    """The struct Robot of lane_kernel.cpp."""
    tree, feet = layout.parts
    parts = (tree.placement, tree.mass, tree.moment, tree.carried, tree.gravity, tree.level)
    parts += (feet.placement, feet.plane, feet.edges, [feet.weight, 1.0])
    return np.concatenate([np.ravel(part) for part in parts])


def compiler() -> str:
    """The path of a C++ compiler; ends the program where there is none."""
    name = os.environ.get("CXX", "g++")
    found = shutil.which(name)
    if found is None:
        print(f"nothing measured: no C++ compiler {name!r} on the path. Install one or set CXX.")
        raise SystemExit(0)
    return found


def build(text: str, folder: Path, name: str, options: Sequence[str]) -> tuple[ctypes.CDLL, float]:
    """The lane kernel compiled for a robot, and how long that took [s]."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.h").write_text(text)
    target = folder / f"{name}.so"
    start = time.perf_counter()
    command = [compiler(), *FLAGS, *options, f"-I{folder}", str(SOURCE), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stderr}")
    return ctypes.CDLL(str(target)), time.perf_counter() - start


def lanes(
    library: ctypes.CDLL, robot: np.ndarray, q: np.ndarray, out: BatchResult, doubtful: np.ndarray
) -> Fill:
    """A function that has a lane kernel fill the results; all of these must stay alive."""
    arrays = [*(getattr(out, what) for what in WHAT), doubtful]
    results = (ctypes.c_void_p * len(arrays))(*(a.ctypes.data for a in arrays))
    given = ctypes.c_void_p(robot.ctypes.data), results, ctypes.c_void_p(q.ctypes.data)

    def fill() -> None:
        library.evaluate(*given, ctypes.c_long(len(q)))

    return fill


def compiled(kernel: BatchKernel, q: np.ndarray, out: BatchResult, doubtful: np.ndarray) -> Fill:
    """A function that has the kernel's machine code fill the results, without checks in Python."""
    fill = kernel._filling(q, out, doubtful, len(q))
    return lambda: fill(0, len(q))


def difference(given: BatchResult, expected: BatchResult) -> float:
    """Largest difference, relative to the largest entry of its kind."""
    worst = 0.0
    for what in WHAT:
        right = getattr(expected, what)
        wrong = np.abs(getattr(given, what) - right).max() / np.abs(right).max()
        worst = max(worst, float(wrong))
    return worst


def timed(fill: Fill, count: int) -> Callable[[], float]:
    """A run: CPU seconds per posture."""

    def run() -> float:
        start = time.thread_time()
        fill()
        return (time.thread_time() - start) / count

    return run


def row(name: str, each: list[float], floor: list[float], wrong: float) -> str:
    """A row of the table."""
    middle = statistics.median(each) / statistics.median(floor)
    least = min(each) / min(floor)
    return f"| {name} | {scaling.microseconds(each)} | {middle:.2f} | {least:.2f} | {wrong:.0e} |"


def main() -> None:
    """Build, compare, measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--output", type=Path, default=HERE / "floor.md")
    options = parser.parse_args()
    tool = compiler()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    threadpool_limits(1)
    stance = copsense.load_stance("icub")
    layout = robot_layout(stance, sole_edges(stance))
    kernel = BatchKernel(stance, scaling.CRITERIA, gains=False)
    q = draw(stance, scaling.CHUNK, seed=0)
    expected, robot = kernel.evaluate(q), constants(layout)
    doubtful = np.ones((len(q), len(scaling.CRITERIA)), dtype=np.uint8)
    runs = {KERNEL: timed(compiled(kernel, q, expected, doubtful), len(q))}
    runs["`BatchKernel.evaluate`"] = scaling.batches(kernel, q)
    wrong, built, kept = dict.fromkeys(runs, 0.0), [], []
    folder = HERE.parent / "build" / "lane_kernel"
    for index, (name, flags) in enumerate(VARIANTS.items()):
        library, seconds = build(header(layout, q.shape[1]), folder, f"lanes{index}", flags)
        out, doubts = kernel.empty(len(q)), np.ones_like(doubtful)
        fill = lanes(library, robot, q, out, doubts)
        fill()
        wrong[name] = difference(out, expected)
        if not wrong[name] <= EXACT or doubts.any():
            raise SystemExit(f"{name} differs from the kernel by {wrong[name]:.1e}.")
        runs[name] = timed(fill, len(q))
        built.append(f"{seconds:.0f} s")
        kept.append((out, doubts))
    abreast = library.lanes()

    def progress(text: str) -> None:
        print(f"\r{text:60}", end="", file=sys.stderr, flush=True)

    scaling.interleaved(runs, WARM, progress)
    times = scaling.interleaved(runs, options.rounds, progress)
    print(file=sys.stderr)
    version = subprocess.run([tool, "--version"], capture_output=True, text=True).stdout
    with_flags = f"{version.splitlines()[0]} {' '.join(FLAGS[:3])}"
    near = statistics.median(times[KERNEL]) / statistics.median(times[FLOOR])
    least = min(times[KERNEL]) / min(times[FLOOR])
    met = "met" if max(near, least) <= WANTED else "not met"
    lines = ["# How near the kernel is to the floor", ""]
    lines += ["Written by `python benchmarks/floor.py`.", "", speed.machine()]
    lines += [f"{with_flags}; built in {' and '.join(built)}."]
    lines += [f"Postures abreast: {abreast} in C++, {WIDTH} in the kernel.", ""]
    lines += ["One posture of the 23-joint iCub on two flat feet, both criteria, N = 4096, CPU"]
    lines += [f"time, in turns, {options.rounds} rounds. Answers equal to the kernel's.", ""]
    lines += ["| how | us per posture | least | times the floor | of the least | differs by |"]
    lines += ["|---|---|---|---|---|---|"]
    lines += [row(name, times[name], times[FLOOR], wrong[name]) for name in times]
    lines += ["", "| required | measured | |", "|---|---|---|"]
    lines += [f"| at most {WANTED} times the floor | {near:.2f} (least {least:.2f}) | {met} |"]
    text = "\n".join(lines) + "\n"
    print(text)
    options.output.write_text(text)


if __name__ == "__main__":
    main()
