"""What a posture costs: the kernel beside everything else that a user might run, in turns.

    python benchmarks/speed.py [--peers] [--rounds 15]

The unit of work is one posture of the 23-joint iCub on two flat feet: wrenches, torques and CoPs of
minimum wrench and minimum torque, and the CoPs' exact sensitivity along all 17 admissible
directions. Every contender's answers are compared with the kernel's first. Then they take turns
on one core, many short rounds, CPU time. `--peers` also makes an environment under build/ for
CasADi and JAX with adam (a C compiler is needed; the builds take minutes) and lets them take turns
from a process on the same core. SPEED_GCC sets the compiler's level: -O1, because gcc 12
took over five minutes with -O2, and over eight with -O3. Scaling, memory and the
latency of single calls follow. Writes benchmarks/speed.md.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import icub_models
import numba
import numpy as np
import pinocchio as pin
import speed_contenders as contenders
import speed_scaling as scaling
from equality import draw
from threadpoolctl import threadpool_limits

import copsense
from copsense.batch import BatchKernel

HERE = Path(__file__).parent
BUILD = HERE.parent / "build"
PACKAGES = ("adam-robotics[casadi,jax]",)
PEERS = {"casadi": "CasADi with adam, generated C", "jax": "JAX with adam, jacrev, batches of 512"}
WHAT = ("wrenches", "torques", "cops", "gradient")
EXACT, DIFFERENCED = 1e-9, 1e-6  # how near the kernel's answers a contender's must be
FEET = ["l_sole", "r_sole"]
SCRIPT = "Pinocchio + NumPy, analytic, with CoM gain and travel"
REFERENCE = "reference path with CoM gain and travel"
LIMITED = "reference path with CoM gain and travel, within limits"
SHOWN = ("avx2", "fma", "avx512f", "avx512vl")


class Peers:
    """A process on this core, in an environment of its own."""

    def __init__(self, q: np.ndarray, joints: tuple[str, ...], gravity: np.ndarray) -> None:
        """Install the peers, write the problem down and start them."""
        python, folder = BUILD / "peers" / "bin" / "python", BUILD / "speed"
        folder.mkdir(parents=True, exist_ok=True)
        if not python.exists():
            subprocess.run([sys.executable, "-m", "venv", BUILD / "peers"], check=True)
        install = [python, "-m", "pip", "install", "-q", "--only-binary", ":all:", *PACKAGES]
        subprocess.run(install, check=True)
        urdf = folder / "icub.urdf"
        urdf.write_text(with_unit_axes(Path(icub_models.get_model_file("iCubGenova04"))))
        problem = {
            "urdf": str(urdf),
            "joints": joints,
            "frames": FEET,
            "gravity": gravity.tolist(),
            "q": q.tolist(),
        }
        (folder / "problem.json").write_text(json.dumps(problem))
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [python, HERE / "speed_peers.py", folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(folder / "peers.log").open("w"),
            text=True,
            env=environment,
        )

    def ask(self, do: str, tool: str) -> dict[str, Any]:
        """One request and its answer."""
        assert self.process.stdin
        assert self.process.stdout
        print(json.dumps({"do": do, "tool": tool}), file=self.process.stdin, flush=True)
        line = self.process.stdout.readline()
        return json.loads(line) if line else {"error": "the process ended"}


def with_unit_axes(path: Path) -> str:
    """A URDF with axes of unit length: Pinocchio normalises them, adam does not."""
    root = ElementTree.parse(path).getroot()
    for axis in root.iter("axis"):
        v = np.array(axis.attrib["xyz"].split(), dtype=float)
        axis.attrib["xyz"] = " ".join(repr(float(x)) for x in v / np.linalg.norm(v))
    return ElementTree.tostring(root, encoding="unicode")


def check(name: str, given: dict[str, Any], expected: Any, allowed: float) -> float:
    """Largest difference, relative to the largest entry; ends the program where it is too large."""
    worst = 0.0
    for what in WHAT:
        right = getattr(expected, what)
        wrong = np.abs(np.asarray(given[what]) - right).max() / np.abs(right).max()
        worst = max(worst, float(wrong))
    if not worst <= allowed:
        raise SystemExit(f"{name} differs from the kernel by {worst:.1e}, over {allowed:.0e}.")
    return worst


def per_posture(function: Callable[[np.ndarray], Any], q: np.ndarray) -> Callable[[], float]:
    """A run: CPU seconds per posture of a function of one configuration."""

    def run() -> float:
        start = time.thread_time()
        for row in q:
            function(row)
        return (time.thread_time() - start) / len(q)

    return run


def with_gains(
    stance: copsense.Stance, q: np.ndarray, limits: copsense.Limits | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """CoM gains and travels of both criteria by the reference path, and all that they need."""
    at = stance.at(q)
    found = [copsense.cop_sensitivity(at, criterion, limits) for criterion in scaling.CRITERIA]
    return np.array([c.com_gain for c in found]), np.array([c.com_travel for c in found])


def script_with_gains(stance: copsense.Stance) -> Callable[[np.ndarray], Any]:
    """The plain script for CoM gains and travels of both criteria."""
    soles = [contact.sole for contact in stance.contacts]
    return contenders.analytic_with_gains(
        stance.robot.model, FEET, [(sole.normals, sole.offsets) for sole in soles]
    )


def reference_path(stance: copsense.Stance, q: np.ndarray) -> dict[str, np.ndarray]:
    """The reference path's answer at one configuration."""
    at = stance.at(q)
    found = [copsense.cop_sensitivity(at, criterion) for criterion in scaling.CRITERIA]
    return {
        "wrenches": np.array([c.equilibrium.wrenches for c in found]),
        "torques": np.array([c.equilibrium.torques for c in found]),
        "cops": np.array([c.cop for c in found]),
        "gradient": np.array([c.gradient for c in found]),
    }


def near_standing(stance: copsense.Stance) -> np.ndarray:
    """Configurations along the lateral path, the CoM within 3 cm of the middle."""
    return np.array([at.q for at in copsense.lateral_sweep(stance, -0.03, 0.03, 16).stances])


def compare(options: argparse.Namespace, progress: Callable[[str], None]) -> dict[str, Any]:
    """Check and time every contender: name -> (times, largest difference), and notes."""
    stance = copsense.load_stance("icub")
    model = stance.robot.model
    q = draw(stance, scaling.CHUNK, seed=0)
    kernel = BatchKernel(stance, scaling.CRITERIA, gains=False)
    expected = kernel.evaluate(q[:32])
    runs = {
        "kernel, N = 4096": scaling.batches(kernel, q),
        "kernel, N = 512": scaling.batches(kernel, q[:512], calls=8),
        "kernel with CoM gain and travel, N = 4096": scaling.batches(
            BatchKernel(stance, scaling.CRITERIA), q
        ),
        "kernel, one posture a call": per_posture(kernel.one, q[:512]),
    }
    wrong = dict.fromkeys(runs, 0.0)
    wrong["kernel, one posture a call"] = check(
        "one", stacked([kernel_row(kernel.one(row)) for row in q[:32]]), expected, EXACT
    )
    for name, function, allowed, count in (
        (
            "Pinocchio, central differences, put back on the contacts",
            contenders.finite_differences(model, FEET, retract=True),
            DIFFERENCED,
            4,
        ),
        (
            "Pinocchio, central differences along the tangents alone",
            contenders.finite_differences(model, FEET, retract=False),
            DIFFERENCED,
            4,
        ),
        ("Pinocchio + NumPy, analytic", contenders.analytic(model, FEET), EXACT, 32),
    ):
        answers = [contenders.gradient(function(row)) for row in q[:32]]
        wrong[name] = check(name, stacked(answers), expected, allowed)
        runs[name] = per_posture(function, q[:count])
    name = "reference path"
    answers = [reference_path(stance, row) for row in q[:32]]
    wrong[name] = check(name, stacked(answers), expected, EXACT)
    runs[name] = per_posture(lambda row: reference_path(stance, row), q[:16])
    script = script_with_gains(stance)
    runs[SCRIPT] = per_posture(script, q[:16])
    runs[REFERENCE] = per_posture(lambda row: with_gains(stance, row), q[:16])
    # Only postures that have an equilibrium within the limits: near standing.
    limits, near = copsense.Limits(torque="model"), near_standing(stance)
    runs[LIMITED] = per_posture(lambda row: with_gains(stance, row, limits), near)
    pairs = [zip(script(row), with_gains(stance, row), strict=True) for row in q[:16]]
    wrong[REFERENCE] = wrong[LIMITED] = 0.0
    wrong[SCRIPT] = max(
        float(np.abs(a - b).max() / np.abs(b).max()) for pair in pairs for a, b in pair
    )
    if not wrong[SCRIPT] <= EXACT:
        raise SystemExit(f"{SCRIPT} differs from the reference path by {wrong[SCRIPT]:.1e}.")
    notes = {}
    if options.peers:
        peers = Peers(q[:32], stance.robot.joint_names, model.gravity.linear)
        for tool, name in PEERS.items():
            progress(f"building {name}")
            built = peers.ask("build", tool)
            answer = built if "error" in built else peers.ask("answer", tool)
            if "error" in answer:
                notes[name] = f"not measured: {answer['error']}"
                continue
            notes[name] = f"{built['versions']}; built in {built['seconds']:.0f} s"
            wrong[name] = check(name, answer, expected, EXACT)
            runs[name] = lambda tool=tool: peers.ask("time", tool)["seconds"]
    times = scaling.interleaved(runs, options.rounds, progress)
    return {"times": times, "wrong": wrong, "notes": notes}


def kernel_row(result: Any) -> dict[str, np.ndarray]:
    """A copy of the one row of a result."""
    return {what: getattr(result, what)[0].copy() for what in WHAT}


def stacked(answers: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Answers at several configurations as one, the configuration first."""
    return {what: np.array([answer[what] for answer in answers]) for what in WHAT}


def machine() -> str:
    """Versions, processor and load."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    facts = dict(
        (part.strip() for part in line.split(":", 1)) for line in text.splitlines() if ":" in line
    )
    flags = [flag for flag in SHOWN if flag in facts.get("flags", "").split()]
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    return (
        f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {numba.__version__}, "
        f"Pinocchio {pin.__version__}, {platform.system()}, "
        f"{facts.get('model name', platform.machine())} (family {facts.get('cpu family', '?')}, "
        f"model {facts.get('model', '?')}), {os.cpu_count()} cores, {' '.join(flags)}.\n"
        f"Load average {load}."
    )


def requirements(found: dict[str, Any], medians: dict[str, float]) -> list[str]:
    """Required and measured, one row each."""
    times = found["times"]
    kernel = times["kernel, N = 4096"]
    rows = []
    for name, wanted in (
        ("Pinocchio, central differences, put back on the contacts", 800),
        ("Pinocchio, central differences along the tangents alone", 800),
        ("Pinocchio + NumPy, analytic", 80),
        (PEERS["casadi"], 15),
    ):
        if name not in times:
            rows.append(f"| {name}: at least {wanted}x | not measured | – |")
            continue
        middle = statistics.median(times[name]) / statistics.median(kernel)
        least = min(times[name]) / min(kernel)
        met = "met" if min(middle, least) >= wanted else "not met"
        if middle >= wanted > least or least >= wanted > middle:
            met = "met by one of the two"
        text = f"{middle:.1f}x (of the least times {least:.1f}x)"
        rows.append(f"| {name}: at least {wanted}x | {text} | {met} |")
    for name, most in ((REFERENCE, 2), (LIMITED, 4)):
        middle = statistics.median(times[name]) / statistics.median(times[SCRIPT])
        least = min(times[name]) / min(times[SCRIPT])
        met = "met" if max(middle, least) <= most else "not met"
        text = f"{middle:.1f}x (of the least times {least:.1f}x)"
        rows.append(f"| {name}: at most {most}x of {SCRIPT} | {text} | {met} |")
    middle, least = statistics.median(kernel) * 1e6, min(kernel) * 1e6
    met = "met" if middle <= 3 else "not met"
    rows.append(f"| 3 us or better a posture | {middle:.2f} us (least {least:.2f}) | {met} |")
    for name in ("back to back", "after 32 MB of other work"):
        met = "met" if medians[name] < 15 else "not met"
        rows.append(
            f"| one posture under 15 us, {name} | {medians[name]:.1f} us (median) | {met} |"
        )
    return rows


def report(found: dict[str, Any], tables: dict[str, tuple[str, list[str]]], need: list[str]) -> str:
    """The Markdown document."""
    times = found["times"]
    kernel = times["kernel, N = 4096"]
    lines = ["# What a posture costs", "", "Written by `python benchmarks/speed.py`.", ""]
    lines += [machine(), ""]
    lines += ["| required | measured | |", "|---|---|---|", *need, ""]
    lines += ["## One posture of the iCub, CPU time, on one core, in turns", ""]
    lines += ["| how | us per posture | least | ratio | of the least | differs by |"]
    lines += ["|---|---|---|---|---|---|"]
    for name, each in times.items():
        ratio = statistics.median(each) / statistics.median(kernel), min(each) / min(kernel)
        lines.append(
            f"| {name} | {scaling.microseconds(each)} | {ratio[0]:.1f} | {ratio[1]:.1f} "
            f"| {found['wrong'][name]:.0e} |"
        )
    lines += [f"| {n} | – | – | – | – | {t} |" for n, t in found["notes"].items() if n not in times]
    lines += ["", *[f"{n}: {t}." for n, t in found["notes"].items() if n in times]]
    for title, (header, rows) in tables.items():
        rule = "|" + "---|" * (header.count("|") - 1)
        lines += ["", f"## {title}", "", header, rule, *rows]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--peers", action="store_true", help="CasADi and JAX with adam too")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--output", type=Path, default=HERE / "speed.md")
    options = parser.parse_args()

    def progress(text: str) -> None:
        print(f"\r{text:60}", end="", file=sys.stderr, flush=True)

    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    threadpool_limits(1)
    found = compare(options, progress)
    alone, facts = scaling.single(progress)
    tables = {
        "One call of `BatchKernel.one`, by the clock [us], on a machine that others use": (
            "| calls | number | least | p50 | p90 | p99 | p99.9 | most |",
            alone,
        ),
        "Joints and contacts, N = 4096": (
            "| robot | joints | contacts | us per posture | least | ratio |",
            scaling.sizes(options.rounds, progress),
        ),
        "Number of postures, in chunks of 4096 into the same memory": (
            "| N | us per posture | least | peak memory [MB] | before the first [MB] |",
            scaling.counts(options.rounds, progress),
        ),
        "Threads, by the clock": (
            "| N | threads | us per posture | least | speed-up | of the least | load average |",
            scaling.threads(options.rounds, progress, cores),
        ),
    }
    text = report(found, tables, requirements(found, facts))
    text += (
        f"\n{facts['calls']:.0f} calls of `one` left {facts['kept']:.0f} blocks of memory behind; "
        f"the compiled code took {facts['compiled'] / facts['calls']:.0f} headers of the arrays "
        f"handed to it a call, and at most {facts['passing']:.0f} bytes lived while one ran.\n"
    )
    print(file=sys.stderr)
    print(text)
    options.output.write_text(text)


if __name__ == "__main__":
    main()
