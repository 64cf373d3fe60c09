"""Section V in closed loop, and where feet tip: writes benchmarks/balancing.md.

    python benchmarks/balancing.py [--quick]

Takes about six minutes on one core; --quick leaves the long sways out.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import mujoco
import numpy as np
import pinocchio as pin
from tqdm import tqdm

import copsense
from copsense.benchmark import agreement, score_impulse, score_lean, score_table
from copsense.controllers import BalancingController, Hold, Observation, Sine, lateral_reference
from copsense.limits import Limits
from copsense.simulation import MujocoSimulator, Scenario, rollout

C1, C2 = copsense.minimum_wrench(1.0), copsense.minimum_torque()
SHORT = copsense.minimum_wrench(0.07, name="minimum-wrench, L = 0.07 m")
LIMITS = Limits(10.0, 1.0, 8, 1e-3, None, None)


def icub(knee: float = 0.0, width: float = 0.14) -> copsense.Stance:
    """The iCub on soles of 160 x 72 mm, knees bent [rad], feet `width` apart [m]."""
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
    return copsense.load_stance("icub", contacts=contacts, posture=posture, width=width)


POSTURES = {
    "straight": (0.0, 0.14),
    "knees 0.6 rad": (0.6, 0.14),
    "knees 1.0 rad": (1.0, 0.14),
    "feet 0.20 m apart": (0.0, 0.20),
}


def leans() -> list[str]:
    """Slow leans to the first tip."""
    cases = [(p, c) for p in POSTURES for c in (C1, C2)] + [("straight", SHORT)]
    scores = []
    for posture, criterion in tqdm(cases, desc="leans", disable=None):
        stance = icub(*POSTURES[posture])
        reach = 0.08 if "0.20" in posture else 0.055
        scores.append(score_lean(stance, criterion, reach, posture=posture))
    stance = copsense.load_stance("talos")
    scores += [score_lean(stance, criterion, 0.13, posture="talos") for criterion in (C1, C2)]
    table = score_table(scores)
    lines = [
        "| posture | criterion | tip, simulated [mm] | static path [mm] | first order [mm] | "
        "contact (predicted) | torque norm [Nm] |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row.posture} | {row.controller} | {row.excursion * 1e3:.1f} | "
        f"{row.predicted * 1e3:.1f} | {row.first_order * 1e3:.1f} | {row.contact} "
        f"({row.predicted_contact}) | {row.torque_norm:.1f} |"
        for row in table.itertuples()
    ]
    found = agreement(table)
    lines += [
        "",
        f"{found['cases']:.0f} cases: mean error {found['mean_error'] * 1e3:.2f} mm, largest "
        f"{found['largest_error'] * 1e3:.2f} mm; r = {found['correlation']:.4f} (95 % interval "
        f"{found['low']:.4f} to {found['high']:.4f}). Prediction and controller share the law that "
        "shares the load: this holds the theory against physics. A tip is a sole turned by 0.5 "
        "degrees, which comes a little after its CoP reaches the edge.",
    ]
    return lines


def sways(quick: bool) -> list[str]:
    """The paper's sinusoidal motion, without and with limits."""
    cases = [(C1, 0.039, None), (C1, -0.039, None)]
    if not quick:
        cases += [(C2, 0.039, None), (C1, 0.07, LIMITS), (C2, 0.07, LIMITS)]
    stance = icub()
    simulator = MujocoSimulator(stance)
    lines = [
        "| criterion | amplitude [mm] | limits | end | first tip at CoM y [mm] | CoM y error after "
        "1 s [mm rms] | f_z of a foot [% of m g] | smallest margin [mm] | real time factor |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for criterion, amplitude, limits in tqdm(cases, desc="sways", disable=None):
        controller = BalancingController(stance, criterion, limits=limits)
        reference = lateral_reference(stance, Sine(amplitude, 0.05))
        start = time.perf_counter()
        run = rollout(simulator, controller, Scenario(20.0, reference), until="fall")
        took = time.perf_counter() - start
        tip = float(run.attrs["tip_time"])
        standing = run.sel(time=slice(0.05, tip if np.isfinite(tip) else None))
        late = standing.sel(time=slice(1.0, None))
        error = (late["com"] - late["com_target"]).sel(com_axis="y").values
        share = standing["wrench"].sel(component="fz") / run.attrs["weight"] * 100
        end = run.attrs["end_kind"]
        lines.append(
            f"| {criterion.name} | {amplitude * 1e3:+.0f} | {'yes' if limits else 'no'} | "
            f"{end if end == 'completed' else run.attrs['tip_contact'] + ' tips, then ' + end}, "
            f"{run.attrs['end_time']:.2f} s | "
            + (f"{float(run['tip_com'][1]) * 1e3:+.1f}" if np.isfinite(tip) else "none")
            + f" | {np.sqrt(np.mean(error**2)) * 1e3:.4f} | {float(share.min()):.0f} to "
            f"{float(share.max()):.0f} | {float(standing['margin'].min()) * 1e3:.2f} | "
            f"{run.attrs['end_time'] / took:.2f} |"
        )
    return lines


def pushes() -> list[str]:
    """The least lateral push that tips a foot."""
    lines = [
        "| posture | criterion | first-tip impulse [N s] | predicted [N s] | ratio | contact |",
        "|---|---|---|---|---|---|",
    ]
    stance = icub()
    for criterion in tqdm((C1, C2), desc="pushes", disable=None):
        score = score_impulse(stance, criterion, posture="straight", largest=4, resolution=0.03)
        lines.append(
            f"| straight | {criterion.name} | {score.impulse:.2f} ± {score.resolution:.2f} | "
            f"{score.predicted:.2f} | {score.impulse / score.predicted:.2f} | {score.contact} |"
        )
    return lines


def speed() -> list[str]:
    """Time of one controller step and of one physics step."""
    lines = ["| what | median [us] | least [us] |", "|---|---|---|"]
    stance = icub()
    target = lateral_reference(stance, Hold()).at(0.0)
    v = np.zeros(stance.robot.model.nv)
    seen = Observation(0.0, stance.q, v, target, np.zeros((2, 6)))
    for what, controller in (
        ("controller, minimum wrench", BalancingController(stance, C1)),
        ("controller, minimum torque", BalancingController(stance, C2)),
        ("controller, minimum torque, limits", BalancingController(stance, C2, limits=LIMITS)),
    ):
        lines.append(_timed(what, lambda controller=controller: controller(seen)))
    simulator = MujocoSimulator(stance)
    torques = copsense.solve_equilibrium(stance, C2).torques
    lines.append(_timed("physics, 8 points of contact", lambda: simulator.step(torques), 300))
    return lines


def _timed(what: str, run: object, count: int = 2000) -> str:
    times = []
    for _ in range(count):
        start = time.perf_counter()
        run()  # type: ignore[operator]
        times.append(time.perf_counter() - start)
    return f"| {what} | {np.median(times) * 1e6:.0f} | {min(times) * 1e6:.0f} |"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    text = [
        "# Balancing in closed loop",
        "",
        "Written by `python benchmarks/balancing.py`"
        + (" --quick" if quick else "")
        + f": copsense {copsense.__version__}, MuJoCo {mujoco.__version__}, Pinocchio "
        f"{pin.__version__}, {platform.machine()}. iCub on soles of 160 x 72 mm, 1 kHz, ideal "
        "motors and sensors, gains `STIFF`.",
        "",
        "## Slow leans (5 mm/s) to the first tip",
        "",
        *leans(),
        "",
        "## The sway of [Romano2016] Section V, 0.05 Hz",
        "",
        *sways(quick),
        "",
        "## The first push that tips a foot (50 ms, to the left, on the base)",
        "",
        *pushes(),
        "",
        "## Speed (one core, shared machine)",
        "",
        *speed(),
    ]
    page = Path(__file__).with_suffix(".md")
    page.write_text("\n".join(text) + "\n", encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
