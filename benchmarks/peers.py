"""Balancing controllers of other projects as referees: writes benchmarks/peers.md.

    python benchmarks/peers.py [--quick]

Installs placo and tsid, each in an environment of its own under build/peers, and lets them balance
the same robot in the same simulation as copsense's controller, through a pipe (peers_pipe.py). A
peer that cannot be installed or run is a line with its reason. Takes a few minutes; --quick
has one posture and no limits.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import time
import venv
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import mujoco
import numpy as np
import pinocchio as pin
from peers_pipe import PipeController, PipeError, clock
from tqdm import tqdm

import copsense
from copsense.controllers import (
    STIFF,
    BalancingController,
    Controller,
    Observation,
    PathReference,
    Ramp,
    Sine,
    lateral_reference,
)
from copsense.criterion import Criterion
from copsense.errors import CopsenseError
from copsense.limits import Limits
from copsense.simulation import MujocoSimulator, Scenario, rollout
from copsense.simulation.prediction import predict

HERE = Path(__file__).resolve().parent
BUILD = HERE.parent / "build" / "peers"
C1, C2 = copsense.minimum_wrench(1.0), copsense.minimum_torque()
LIMITS = Limits(normal_force=10.0, friction=1.0, cop_margin=1e-3, torsion=None)
KNEES = {"straight": 0.0, "knees 0.6 rad": 0.6, "knees 1.0 rad": 1.0}
LEAN = Ramp(0.055)
SWAY, FAR = Sine(0.039, 0.05), Sine(0.07, 0.05)  # of the paper's Section V, and over either foot
EDGE = 2e-5  # m: a CoP that near has reached it
SETTLED = 0.05  # s: from when on the contacts carry the robot
BLOCK, ROUNDS = 50, 40  # states that one controller answers in a row; how often each has its turn


@dataclass(frozen=True)
class Peer:
    """A controller of another project.

    Attributes:
        name: also of its environment and its script.
        packages: what to install, at the versions that are known to work together.
        criteria: those that it can apply.
    """

    name: str
    packages: tuple[str, ...]
    criteria: tuple[Criterion, ...]

    def command(self) -> list[str]:
        """How to start it, in an environment that is made if it is not there.

        Raises:
            PipeError: it cannot be installed here.
        """
        folder = BUILD / self.name
        python, stamp = folder / "bin" / "python", folder / "installed"
        wanted = "\n".join(self.packages)
        if not stamp.exists() or stamp.read_text() != wanted:
            venv.create(folder, with_pip=True, clear=True)
            install = [str(python), "-m", "pip", "install", "--quiet"]
            install += ["--disable-pip-version-check", "--only-binary", ":all:", *self.packages]
            done = subprocess.run(install, capture_output=True, text=True, env=_clean())
            if done.returncode:
                errors = [s for s in done.stderr.splitlines() if s.startswith("ERROR")]
                reason = errors[-1] if errors else f"pip ended with {done.returncode}"
                raise PipeError(f"{self.name} cannot be installed here: {reason}")
            stamp.write_text(wanted)
        return [str(python), "-W", "ignore", str(HERE / f"peers_{self.name}.py")]

    def controller(
        self, stance: copsense.Stance, criterion: Criterion, limits: Limits | None = None
    ) -> PipeController:
        """It, balancing a stance."""
        setup = describe(stance) | {
            "criterion": criterion.name,
            "gains": {
                "com": (STIFF.com_stiffness[0], STIFF.com_damping[0]),
                "posture": (STIFF.posture_stiffness, STIFF.posture_damping),
            },
            "limits": limits
            and {
                "force": limits.normal_force,
                "friction": limits.friction,
                "margin": limits.cop_margin,
            },
        }
        log = BUILD / f"{self.name}.log"
        return PipeController(self.command(), setup, name=self.name, log=log)


PEERS = (
    Peer("placo", ("placo==0.10.2", "pin==3.8.0"), (C1, C2)),
    Peer("tsid", ("tsid==1.7.1", "pin==3.4.0", "cmeel-urdfdom<5", "cmeel-tinyxml2<11"), (C1,)),
)


def _clean() -> dict[str, str]:
    """This process's environment without what points at its packages."""
    return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}


def icub(knee: float = 0.0) -> copsense.Stance:
    """The iCub on soles of 160 x 72 mm, 0.14 m apart, knees bent [rad]."""
    posture = {}
    for side in "lr":
        posture[f"{side}_hip_pitch"], posture[f"{side}_ankle_pitch"] = knee / 2, -knee / 2
        posture[f"{side}_knee"] = -knee
    contacts = [
        copsense.Contact(
            f"{side}_sole",
            polygon=copsense.rectangle((-0.0535, 0.1065), reach),
            offset=(0.0, 0.0, -0.0105),
        )
        for side, reach in (("l", (-0.031, 0.041)), ("r", (-0.041, 0.031)))
    ]
    return copsense.load_stance("icub", contacts=contacts, posture=posture, width=0.14)


def describe(stance: copsense.Stance) -> dict[str, Any]:
    """A stance for a peer: a URDF with the same joints and with frames at the contacts.

    Raises:
        ValueError: the robot came from no URDF, or a contact is on no link of it.
    """
    robot = stance.robot
    if robot.description is None or robot.description.language != "urdf":
        raise ValueError(f"{robot.name} is not described by a URDF")
    root, kept = ET.fromstring(robot.description.text), set(robot.joint_names)
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
            continue
        for part in list(element):
            if part.tag in ("visual", "collision"):
                element.remove(part)
        if element.tag == "joint" and element.get("name") not in kept:
            element.set("type", "fixed")  # Robot.keeping locks at zero, which is where it is fixed
    links = {link.get("name") for link in root.findall("link")}
    contacts = []
    for k, contact in enumerate(stance.contacts):
        if contact.frame not in links or contact.polygon is None:
            raise ValueError(f"contact {contact.name} is not a sole on a link")
        corners = np.array(contact.polygon)
        middle = np.append((corners.min(axis=0) + corners.max(axis=0)) / 2, 0.0)
        place = pin.SE3(contact.rotation, np.array(contact.offset))
        for name, at in ((f"contact_{k}", place.translation), (f"centre_{k}", place.act(middle))):
            ET.SubElement(root, "link", name=name)
            joint = ET.SubElement(root, "joint", name=f"{name}_joint", type="fixed")
            ET.SubElement(joint, "parent", link=contact.frame)
            ET.SubElement(joint, "child", link=name)
            turn = pin.rpy.matrixToRpy(place.rotation)
            ET.SubElement(joint, "origin", xyz=_numbers(at), rpy=_numbers(turn))
        contacts.append(
            {
                "name": f"contact_{k}",
                "centre": f"centre_{k}",
                "offset": middle.tolist(),
                "size": np.ptp(corners, axis=0).tolist(),
            }
        )
    return {
        "urdf": ET.tostring(root, encoding="unicode"),
        "joints": list(robot.joint_names),
        "mass": robot.mass,
        "com": stance.com.tolist(),
        "start": stance.q.tolist(),
        "contacts": contacts,
    }


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)


def follow(
    stance: copsense.Stance, controller: Controller, reference: PathReference, duration: float
) -> tuple[Any, float]:
    """A rollout until a contact tips, and how much faster than real time it was on one core.

    That is by processor time, which other programs on the machine do not take.
    """
    simulator, began = MujocoSimulator(stance), time.process_time()
    run = rollout(simulator, controller, Scenario(duration, reference))
    spent = time.process_time() - began
    if isinstance(controller, PipeController):
        spent += float(np.sum(controller.seconds, axis=0)[0])
    return run, float(run.attrs["end_time"]) / spent


def edge_reached(run: Any) -> int | None:
    """The first row of a record in which a CoP is at an edge, if any."""
    margins = np.nan_to_num(run["margin"].values, nan=np.inf).min(axis=1)
    at_edge = np.flatnonzero((margins < EDGE) & (run["time"].values > SETTLED))
    return int(at_edge[0]) if len(at_edge) else None


def motions(
    what: str,
    postures: tuple[str, ...],
    signal: Ramp | Sine,
    limits: Limits | None,
    lost: dict[str, str],
) -> list[str]:
    """One motion of everybody until a tip or its end; a peer that fails is noted in `lost`."""
    duration = signal.duration + 0.5 if isinstance(signal, Ramp) else 1.0 / signal.frequency
    lines = [
        "| posture | criterion | controller | CoP at an edge [mm] | first tip [mm] | static path "
        "[mm] | contact (predicted) | CoM y error until the edge [mm rms] | smallest margin "
        "[mm] | torque norm until the edge [Nm] | real time factor |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    cases = [
        (posture, criterion, peer)
        for posture in postures
        for criterion in (C1, C2)
        for peer in (None, *PEERS)
        if peer is None or criterion in peer.criteria
    ]
    for posture, criterion, peer in tqdm(cases, desc=what, disable=None):
        head = f"| {posture} | {criterion.name} | {peer.name if peer else 'copsense'} | "
        if peer and peer.name in lost:
            continue
        stance = icub(KNEES[posture])
        reference = lateral_reference(stance, signal)
        expected = predict(reference, criterion, limits)
        controller: Any = None
        try:
            if peer:
                controller = peer.controller(stance, criterion, limits)
            else:
                controller = BalancingController(stance, criterion, limits=limits)
            run, factor = follow(stance, controller, reference, duration)
        except PipeError as error:
            lost[peer.name if peer else ""] = str(error)
            continue
        except CopsenseError as error:
            lines.append(head + f"failed: {error} | | | | | | | |")
            continue
        finally:
            if isinstance(controller, PipeController):
                controller.close()
        tip = float(run["tip_com"].sel(com_axis="y")) - float(stance.com[1])
        ended = run.attrs["end_kind"]
        if np.isfinite(tip):
            reached = f"{abs(tip) * 1e3:.1f}"
        else:
            reached = "none" if ended == "completed" else str(run.attrs["end_reason"])
        row = edge_reached(run)
        lateral = (run["com"] - stance.com).sel(com_axis="y").values
        edge = "none" if row is None else f"{abs(lateral[row]) * 1e3:.1f}"
        static = f"{expected.excursion * 1e3:.1f}" if expected.contact else "none"
        contact = f"{run.attrs['tip_contact'] or 'none'} ({expected.contact or 'none'})"
        standing = run.isel(time=slice(0, row)).sel(time=slice(SETTLED, None))
        smallest = float(run["margin"].sel(time=slice(SETTLED, None)).min())
        away = (standing["com"] - standing["com_target"]).sel(com_axis="y").values
        effort = float(np.linalg.norm(standing["torque"].values, axis=1).mean())
        lines.append(
            head + f"{edge} | {reached} | {static} | {contact} | "
            f"{np.sqrt(np.mean(away**2)) * 1e3:.3f} | "
            f"{smallest * 1e3:.2f} | {effort:.2f} | {factor:.2f} |"
        )
    return lines


def states(stance: copsense.Stance, count: int) -> list[Observation]:
    """Instants of a lean, with a little error in joints and velocities, seeded."""
    signal = Ramp(0.02)
    reference, random = lateral_reference(stance, signal), np.random.default_rng(0)
    found = []
    for moment in np.linspace(0.0, signal.duration, count):
        target, turn = reference.at(float(moment)), np.zeros(stance.robot.model.nv)
        turn[6:] = 1e-4 * random.standard_normal(len(turn) - 6)
        v = target.velocity + 1e-3 * random.standard_normal(len(turn))
        q = pin.integrate(stance.robot.model, target.posture, turn)
        found.append(Observation(float(moment), q, v, target, np.zeros((len(stance.contacts), 6))))
    return found


def speed(lost: dict[str, str]) -> list[str]:
    """Time of one controller step, everybody in turn."""
    stance = icub()
    runners: list[tuple[str, str, Any]] = []
    for limits in (None, LIMITS):
        for criterion in (C1, C2):
            what = f"{criterion.name}{', limits' if limits else ''}"
            runners.append(
                (what, "copsense", BalancingController(stance, criterion, limits=limits))
            )
            for peer in PEERS:
                if criterion in peer.criteria and peer.name not in lost:
                    try:
                        runners.append(
                            (what, peer.name, peer.controller(stance, criterion, limits))
                        )
                    except PipeError as error:
                        lost[peer.name] = str(error)
    block = states(stance, BLOCK)
    times: list[list[np.ndarray]] = [[] for _ in runners]
    for number in tqdm(range(ROUNDS + 2), desc="speed", disable=None):
        for (_, name, controller), kept in zip(runners, times, strict=True):
            if name in lost:
                continue
            if isinstance(controller, PipeController):
                try:
                    found = controller.times(block)
                except PipeError as error:
                    lost[name] = str(error)
                    continue
            else:
                found = np.empty((BLOCK, 3))
                for i, seen in enumerate(block):
                    began = clock()
                    controller(seen)
                    found[i] = clock() - began
            if number >= 2:  # the first rounds are to warm up
                kept.append(found)
    lines = [
        "| criterion | controller | call, median [us] | 95 % [us] | kinematics and solver, median "
        "[us] | 95 % [us] | solver alone, median [us] | copsense's call / its call | copsense's "
        "call / its kinematics and solver |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    ours: dict[str, list[np.ndarray]] = {}
    for (what, name, controller), kept in zip(runners, times, strict=True):
        if isinstance(controller, PipeController):
            controller.close()
        if name in lost:
            continue
        call, step, solver = np.concatenate(kept).T * 1e6
        ours.setdefault(what, kept)
        line = f"| {what} | {name} | {_spread(call)} | "
        if name == "copsense":
            lines.append(line + "| | | | |")
            continue
        # Round by round, so that what slows the machine down meets both.
        pairs = zip(ours[what], kept, strict=True)
        ratios = [np.median(a[:, 0]) / np.median(b[:, :2], axis=0) for a, b in pairs]
        whole, part = np.median(ratios, axis=0)
        lines.append(
            line + f"{_spread(step)} | {np.median(solver):.0f} | {whole:.2f} | {part:.2f} |"
        )
    return lines


def _spread(times: np.ndarray) -> str:
    return f"{np.median(times):.0f} | {np.percentile(times, 95):.0f}"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    BUILD.mkdir(parents=True, exist_ok=True)
    lost: dict[str, str] = {}
    postures, versions = tuple(KNEES), {}
    for peer in PEERS:
        try:
            controller = peer.controller(icub(), C1)
        except PipeError as error:
            lost[peer.name] = str(error)
        else:
            versions[peer.name] = ", ".join(controller.hello["versions"])
            controller.close()
    tips = motions("leans", postures[:1] if quick else postures, LEAN, None, lost)
    sways = [] if quick else motions("sways", postures[:1], SWAY, None, lost)
    within = [] if quick else motions("within limits", postures[:1], FAR, LIMITS, lost)
    table = speed(lost)
    text = [
        "# Peers as referees",
        "",
        f"Written by `python benchmarks/peers.py{' --quick' if quick else ''}`: copsense "
        f"{copsense.__version__}, MuJoCo {mujoco.__version__}, Pinocchio {pin.__version__}, NumPy "
        f"{np.__version__}, Python {platform.python_version()}, {_machine()}.",
        "",
        *(f"- {name}: {found}" for name, found in versions.items()),
        *(f"- {name} did not run: {reason}" for name, reason in lost.items()),
        "",
        "iCub on soles of 160 x 72 mm, 1 kHz, ideal motors and sensors. All controllers have the "
        "same joints, mass and centre of mass (compared at the start), the same targets and the "
        "same gains on CoM and posture; copsense alone also damps angular momentum. The minimum "
        "wrench takes moments about the contact frames in metres.",
        "",
        "## Slow leans (5 mm/s) to the first tip, no limits",
        "",
        *tips,
        "",
        "tsid's contacts are always unilateral: its soles were made 2 m wide here, so that its "
        "bounds do not matter. It has no torque cost. When a CoP reaches an edge depends on how "
        "the load is shared, how much later the sole has turned by 0.5 degrees on the rest of the "
        "controller. The real-time factor uses processor time and includes the physics, the record "
        "and, for the peers, their calls and this side of the pipe.",
        "",
    ]
    if not quick:
        text += [
            "## The sway of [Romano2016] Section V: 39 mm, 0.05 Hz, one period, no limits",
            "",
            *sways,
            "",
            "## A sway of 70 mm to either side, 0.05 Hz, one period, within limits",
            "",
            *within,
            "",
            "All controllers keep the CoPs 1 mm inside, friction 1; copsense and tsid at least "
            "10 N of normal force, placo none. placo's moments are about the soles' centres here, "
            "as its bounds need.",
            "",
        ]
    text += [
        "## Time of one step",
        "",
        *table,
        "",
        f"From state to torques, each in its own process, without the pipe, one BLAS thread; "
        f"{ROUNDS} rounds in turn of {BLOCK} states of a lean. A call takes state and targets as "
        "arrays and returns torques and wrenches as arrays: for a peer that is handing over its "
        "targets, kinematics, the solver, and reading the results, from Python. A ratio over one "
        "means that copsense is slower; it is the median over the rounds.",
    ]
    page = Path(__file__).with_suffix(".md")
    page.write_text("\n".join(text) + "\n", encoding="utf-8")
    print(page)


def _machine() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(s.partition(":")[2].strip() for s in lines if s.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name}, {os.cpu_count()} cores, shared"


if __name__ == "__main__":
    main()
