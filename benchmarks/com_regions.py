"""Regions of the CoM beside what a user would take today: agreement, precision and time.

    python benchmarks/com_regions.py

makes an environment of its own for the peers under build/, gives every tool the same stance (four
point feet on slopes of their own) and the same limits, takes turns between them, and writes
benchmarks/com_regions.md. The peers need a C compiler and cddlib's headers (on Debian and Ubuntu
the packages libcdd-dev and libgmp-dev); one that cannot be installed is a row with its reason.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import select
import statistics
import subprocess
import time
import venv
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

import copsense
from copsense.limits import Limits, limit_rows
from copsense.regions import ComRegion, balance_at, com_region

HERE = Path(__file__).resolve().parent
BUILD = HERE.parent / "build" / "com_regions"
# Each peer and what it is known to work with; pypoman brings cvxopt and pycddlib.
PEERS = ("numpy<3", "scipy", "matplotlib", "pin<5", "pypoman==2.0.0", "jet-leg==0.4.0")
TORQUE = 0.9  # Nm
ROUNDS = 21
PATIENCE = 60.0  # s, for one run of a peer
OURS = {"copsense to 0.1 mm": 1e-4, "copsense to 3 mm": 3e-3}  # m
REFERENCE = 1e-6  # m, copsense's finest here, that every polygon is compared with


def common_stance(*, level: bool) -> copsense.Stance:
    """Solo 12 on level ground or each foot on a slope, its legs' mass moved to the trunk.

    jet-leg takes legs as weightless, so that these have to be for its problem to be the same.
    """
    flat = copsense.load_stance("solo12")
    model = flat.robot.model.copy()
    data = model.createData()
    pin.forwardKinematics(model, data, flat.q)
    whole = sum(body.mass for body in model.inertias)
    lever = data.oMi[1].actInv(flat.com)
    for i in range(1, model.njoints):
        mass = whole if i == 1 else 0.0
        model.inertias[i] = pin.Inertia(mass, lever if i == 1 else np.zeros(3), np.eye(3) * mass)
    slopes = ((0.7, 0.5), (0.3, -0.8), (-0.6, 0.6), (-0.2, -0.9))
    if level:
        slopes = ((0.0, 0.0),) * 4
    contacts = [
        replace(c, plane=copsense.Plane(tuple(p.translation), (*slope, 1.0)))
        for c, p, slope in zip(flat.contacts, flat.placements, slopes, strict=True)
    ]
    return copsense.Stance(copsense.Robot.from_model(model), flat.q, tuple(contacts))


def matrices(stance: copsense.Stance, limits: Limits) -> dict[str, Any]:
    """The stance's problem for the peers, over the stacked forces x = f in contact axes."""
    rows = limit_rows(stance, limits)
    weight, com = stance.robot.weight, stance.com
    pyramid = limit_rows(stance, replace(limits, normal_force=None, torque=None)).matrix
    # The base's balance: S (c - c0) = J_b' f - G_b(c0) has two rows for c, and four without it.
    S = np.column_stack([balance_at(stance, com[:2] + e) - stance.gravity for e in np.eye(2)])[:6]
    Jb, Gb = stance.jacobian[:, :6].T, stance.gravity[:6]
    u, size, vt = np.linalg.svd(S)
    solve = vt.T @ np.diag(1 / size) @ u[:, :2].T
    A, b = rows.matrix, rows.bound
    if limits.torque is not None:
        Jj, Gj = stance.jacobian[:, 6:].T, stance.gravity[6:]
        A = np.vstack([A, -Jj, Jj])
        b = np.concatenate([b, rows.torque - Gj, rows.torque + Gj])
    feet = [p.translation for p in stance.placements]
    jacobians = [
        (place.rotation @ stance.jacobian[at])[:, 6 + 3 * k : 9 + 3 * k]
        for k, (place, at) in enumerate(zip(stance.placements, stance.rows, strict=True))
    ]
    problem = {
        "E": solve @ Jb,
        "e": com[:2] - solve @ Gb,
        "A": A,
        "b": b,
        "C": u[:, 2:].T @ Jb,
        "d": u[:, 2:].T @ Gb,
        "pyramid": pyramid[: len(pyramid) // 4, :3],
        "feet": feet,
        "normals": [p.rotation[:, 2] for p in stance.placements],
        "jacobians": jacobians,
        "com": com,
    }
    plain = {key: np.asarray(value).tolist() for key, value in problem.items()}
    return plain | {"weight": weight, "torque": limits.torque}


class Peers:
    """The other environment, made if it is not there, and the process in it."""

    def __init__(self, problems: dict[str, Any]) -> None:
        """Install the peers and start them."""
        python = BUILD / "venv" / "bin" / "python"
        if not python.exists():
            venv.create(BUILD / "venv", with_pip=True)
        environment = os.environ | cdd_paths()
        self.failed: list[str] = []
        for peer in PEERS:
            command = [str(python), "-m", "pip", "install", "--quiet", peer]
            done = subprocess.run(command, env=environment, capture_output=True, text=True)
            if done.returncode:
                self.failed.append(f"{peer}: {done.stderr.strip().splitlines()[-1]}")
        self.environment = {k: v for k, v in environment.items() if k != "PYTHONPATH"}
        self.command = [str(python), "-W", "ignore", str(HERE / "com_regions_peers.py")]
        file = BUILD / "problems.json"
        file.write_text(json.dumps(problems))
        self.command.append(str(file))
        hello = self.start()
        self.tools: dict[str, str] = hello["tools"]
        self.ready: list[str] = hello["ready"]
        self.installed: list[str] = hello["installed"]

    def start(self) -> dict[str, Any]:
        """Start the process; what it says first."""
        self.process = subprocess.Popen(
            self.command,
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(BUILD / "peers.log").open("a"),
            text=True,
        )
        hello = self.read(PATIENCE)
        if hello is None:
            raise SystemExit(f"The peers do not start. See {BUILD / 'peers.log'}.")
        return hello

    def read(self, patience: float) -> dict[str, Any] | None:
        """The next answer, or None if none comes."""
        assert self.process.stdout is not None
        ready, _, _ = select.select([self.process.stdout], [], [], patience)
        line = self.process.stdout.readline() if ready else ""
        return json.loads(line) if line else None

    def run(self, tool: str, problem: str) -> dict[str, Any]:
        """One timed run; a process that hangs or dies is started again."""
        assert self.process.stdin is not None
        print(json.dumps({"tool": tool, "problem": problem}), file=self.process.stdin, flush=True)
        answer = self.read(PATIENCE)
        if answer is None:
            ended = self.process.poll() is not None
            self.process.kill()
            self.process.wait()
            self.start()
            return {"error": "it crashed" if ended else f"no answer within {PATIENCE:g} s"}
        return answer


def cdd_paths() -> dict[str, str]:
    """Where a compiler finds cddlib's headers: in a folder of their own on Debian and Ubuntu."""
    return {"CFLAGS": "-I/usr/include/cddlib " + os.environ.get("CFLAGS", "")}


def farthest_apart(a: np.ndarray, b: np.ndarray) -> float:
    """Hausdorff distance [m] of two convex polygons: it is that of a corner of one."""

    def off(corners: np.ndarray, polygon: np.ndarray) -> float:
        region = ComRegion(polygon, 0.0, True)
        return max(max(0.0, -region.margin(corner)) for corner in corners)

    return max(off(a, b), off(b, a))


def counter_clockwise(polygon: list[list[float]]) -> np.ndarray:
    """The corners of a polygon's hull, in the order that copsense has."""
    corners = np.array(polygon)
    return corners[ConvexHull(corners).vertices]


def main() -> None:
    """Run everything; write the page."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    BUILD.mkdir(parents=True, exist_ok=True)
    slopes, level = common_stance(level=False), common_stance(level=True)
    cases = {
        "slopes: friction": (slopes, Limits()),
        f"slopes: friction, torques of {TORQUE:g} Nm": (slopes, Limits(torque=TORQUE)),
        f"level: friction, torques of {TORQUE:g} Nm": (level, Limits(torque=TORQUE)),
    }
    peers = Peers({name: matrices(*case) for name, case in cases.items()})
    lines = [line for name, case in cases.items() for line in compare(name, *case, peers)]
    text = report(lines, peers)
    (HERE / "com_regions.md").write_text(text)
    print(text)


def compare(name: str, stance: copsense.Stance, limits: Limits, peers: Peers) -> list[str]:
    """The rows of the table for one problem; the tools take turns."""
    reference = com_region(stance, limits, tolerance=REFERENCE)
    times: dict[str, list[float]] = {tool: [] for tool in (*OURS, *peers.tools)}
    found: dict[str, Any] = {}
    for _ in range(ROUNDS):
        for tool, tolerance in OURS.items():
            start = time.perf_counter()
            region = com_region(stance, limits, tolerance=tolerance)
            times[tool].append(time.perf_counter() - start)
            found[tool] = region.polygon
        for tool in peers.ready:
            if isinstance(found.get(tool), str):
                continue  # it failed before
            answer = peers.run(tool, name)
            if "error" in answer:
                found[tool] = answer["error"]
            else:
                found[tool] = counter_clockwise(answer["polygon"])
                times[tool].append(answer["seconds"])
    ours = statistics.median(times[next(iter(OURS))])
    rows = [
        f"| {name} | *reference* | {len(reference.polygon)} | {1e3 * reference.gap:.5f} | | | |"
    ]
    for tool in (*OURS, *peers.tools):
        polygon = found.get(tool, "cannot be used: " + peers.tools.get(tool, ""))
        if isinstance(polygon, str):
            rows.append(f"| {name} | {tool} | {polygon} | | | | |")
            continue
        off, median = farthest_apart(polygon, reference.polygon), statistics.median(times[tool])
        rows.append(
            f"| {name} | {tool} | {len(polygon)} | {1e3 * off:.5f} | {1e3 * median:.1f} "
            f"| {1e3 * min(times[tool]):.1f} | {median / ours:.1f} |"
        )
    return rows


def report(lines: list[str], peers: Peers) -> str:
    """The Markdown page."""
    own = [f"{name} {version(name)}" for name in ("copsense", "pin", "numpy", "scipy", "daqp")]
    failed = "".join(f"\nNot installed: {reason}\n" for reason in peers.failed)
    return f"""# Regions of the CoM: copsense and peers

Written by `python benchmarks/com_regions.py`; see its text for what it needs.

The common stance is Solo 12 on four point feet, each on a slope of its own or all on level ground,
with its legs' mass in the trunk (jet-leg takes legs as weightless). Friction is an eight-sided
pyramid, the same for all. "Off" is the Hausdorff distance to copsense's region at a tolerance of
{1e3 * REFERENCE:g} mm, and for that reference itself its own guaranteed gap. The tools took turns,
{ROUNDS} times each; "ratio" is of medians, to the first of copsense. copsense's time
includes making the matrices, which pypoman is given ready made; jet-leg is given this
robot's Jacobians and this pyramid in place of its own.

| stance and limits | tool | vertices | off [mm] | median [ms] | least [ms] | ratio |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(lines)}

* pypoman's iterative projection closes an edge once twice the area beyond it is under 1 cm², and
  leaves out a vertex within 1 cm of the last, whatever the region's size; jet-leg uses it. Neither
  says how far off its polygon is.
* pypoman's double description enumerates every vertex over the forces, in floating point.
* jet-leg, where it is given torque limits, leaves its friction pyramids upright: the contacts'
  normals enter its regions of friction alone.
* Neither draws the region where a criterion's own wrenches stay within the limits
  (`copsense.regions.criterion_region`).

* copsense's environment: Python {platform.python_version()}, {", ".join(own)}
* the peers' environment: {", ".join(peers.installed)}
* machine: {machine()}
{failed}"""


def machine() -> str:
    """The processor, and how many of it."""
    name = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.is_file():
        models = [x.split(":", 1)[1] for x in cpus.read_text().splitlines() if "model name" in x]
        name = models[0].strip() if models else name
    return f"{name}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}"


if __name__ == "__main__":
    main()
