"""Section V in closed loop, and where feet tip: writes benchmarks/balancing.csv and .md.

    python benchmarks/balancing.py [--force] [--jobs N] [--plot FILE]

Runs the cases of balancing.toml that the table lacks (all: about ten minutes on two cores); with
--force it runs all of them again. The page lists each requirement, and the exit code is 1 if one
does not hold.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy loads its BLAS

import mujoco
import numpy as np
import pandas as pd
import pinocchio as pin
from tqdm import tqdm

import copsense
from copsense.comparison import (
    CAVEAT,
    agreement,
    rank_controllers,
    read_plan,
    run_benchmark,
)
from copsense.comparison.case_runner import CaseRunner
from copsense.controllers import BalancingController, Hold, Observation, Sine
from copsense.plots import plot_benchmark, save_figure
from copsense.simulation import MujocoSimulator

HERE = Path(__file__)
WITHIN = " within limits"


def lines_of(table: pd.DataFrame, columns: dict[str, Callable[[pd.Series], str]]) -> list[str]:
    """A Markdown table, a line per row."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for _, row in table.iterrows():
        lines.append("| " + " | ".join(write(row) for write in columns.values()) + " |")
    return lines


def number(name: str, digits: int, factor: float = 1.0) -> Callable[[pd.Series], str]:
    """A column of numbers; empty for NaN and infinity."""

    def write(row: pd.Series) -> str:
        value = float(row[name]) * factor
        return f"{value:.{digits}f}" if np.isfinite(value) else ""

    return write


def value(digits: int, factor: float = 1.0) -> Callable[[pd.Series], str]:
    """A column of values with their resolution, or of bounds."""

    def write(row: pd.Series) -> str:
        low, high = row["low"] * factor, row["high"] * factor
        if row["status"] == "measured":
            return f"{row['value'] * factor:.{digits}f} ± {(high - low) / 2:.{digits}f}"
        if row["status"] in ("failed", "tipped"):
            return "none"
        return f"≥ {low:.{digits}f}" if np.isfinite(low) else f"≤ {high:.{digits}f}"

    return write


def word(name: str) -> Callable[[pd.Series], str]:
    """A column of text."""
    return lambda row: str(row[name]).replace("|", "/")


def scores(table: pd.DataFrame, score: str, trial: str | None = None) -> pd.DataFrame:
    """The rows of a score."""
    rows = table[table["score"] == score]
    return rows if trial is None else rows[rows["trial"] == trial]


def checks(table: pd.DataFrame) -> list[tuple[str, str, bool]]:
    """Requirements, what was measured, and whether each holds."""
    leans = scores(table, "tip_excursion")
    off = (leans["value"] - leans["predicted"]).abs() * 1e3
    found = [
        (
            f"tip excursion within 1.5 mm of the static prediction, {len(leans)} configurations",
            f"{off.max():.2f} mm at most, {off.mean():.2f} mm on average",
            bool((off < 1.5).all()),
        )
    ]
    for trial in ("sway 39 mm", "sway -39 mm"):
        errors = scores(table, "com_error", trial).set_index("controller")
        margins = scores(table, "smallest_margin", trial).set_index("controller")
        rms = float(errors.loc["minimum-torque", "value"]) * 1e3
        found += [
            (
                f"{trial}, 0.05 Hz: completes under minimum torque, CoM y error below 0.1 mm rms",
                f"{margins.loc['minimum-torque', 'reason']}, {rms:.4f} mm rms",
                margins.loc["minimum-torque", "status"] == "measured" and rms < 0.1,
            ),
            (
                f"{trial}, 0.05 Hz: ends in a tip under minimum wrench",
                str(margins.loc["minimum-wrench", "reason"]),
                margins.loc["minimum-wrench", "contact"] != "",
            ),
        ]
    for row in scores(table, "smallest_margin", "sway 70 mm").itertuples():
        found.append(
            (
                f"±70 mm completes, {row.controller}",
                f"{row.reason}, smallest margin {row.value * 1e3:.2f} mm",
                row.status == "measured",
            )
        )
    cop, wrench = scores(table, "cop_error")["value"], scores(table, "wrench_error")["value"]
    found += [
        (
            "measured CoP equals commanded CoP within 0.1 mm in steady state",
            f"{cop.max() * 1e3:.1e} mm at most, {len(cop)} cases",
            bool((cop < 1e-4).all()),
        ),
        (
            "wrenches at rest equal the static ones within 0.2 % of m g",
            f"{wrench.max() * 100:.4f} % at most, {len(wrench)} cases",
            bool((wrench < 2e-3).all()),
        ),
    ]
    return found


def page(table: pd.DataFrame) -> list[str]:
    """The page's sections."""
    who = {"posture": word("posture"), "controller": word("controller")}
    both = {"robot": word("robot")} | who
    static = {"static path": number("predicted", 2), "first order": number("first_order", 2)}
    in_mm = {
        "static path": number("predicted", 1, 1e3),
        "first order": number("first_order", 1, 1e3),
    }
    sways = table[table["trial"].str.startswith("sway")]
    first = {"trial": word("trial"), "controller": word("controller")}
    breaking = table[table["score"].str.startswith("breaking")]
    found = agreement(table)
    ranking = rank_controllers(table)
    return [
        "## Requirements",
        "",
        "| requirement | measured | holds |",
        "|---|---|---|",
        *(f"| {what} | {got} | {'yes' if ok else '**no**'} |" for what, got, ok in checks(table)),
        "",
        "## Slow leans (5 mm/s) to the first tip [mm]",
        "",
        *lines_of(
            scores(table, "tip_excursion"),
            both
            | {"simulated": value(2, 1e3)}
            | in_mm
            | {"contact (predicted)": lambda row: f"{row['contact']} ({row['predicted_contact']})"},
        ),
        "",
        "A tip is a sole turned by 0.5 degrees: a little after its CoP reaches the edge of a "
        "rectangular sole, a little before it on a sole with round edges (talos), whose outermost "
        "vertices are soft springs: contact_compliance.py shows what the contacts' softness does.",
        "",
        "## The first push that tips a foot (50 ms, to the left, on the base) [N s]",
        "",
        *lines_of(
            scores(table, "tip_impulse"),
            both
            | {"simulated": value(2)}
            | static
            | {"contact": word("contact"), "rollouts": word("runs")},
        ),
        "",
        "## The sway of [Romano2016] Section V, 0.05 Hz: smallest margin [mm]",
        "",
        *lines_of(
            scores(sways, "smallest_margin"),
            first | {"simulated": value(2, 1e3)} | in_mm | {"end": word("reason")},
        ),
        "",
        "The same sways: torques [N m], where they were completed.",
        "",
        *lines_of(
            sways[
                sways["score"].isin(["torque_norm", "torque_peak"])
                & (sways["status"] == "measured")
            ],
            first | {"score": word("score"), "simulated": value(2)} | static,
        ),
        "",
        "## At rest",
        "",
        *lines_of(
            scores(table, "wrench_error"),
            who | {"wrench off the static one [% of m g]": number("value", 4, 100.0)},
        ),
        "",
        "## Where a sway of 20 mm at 0.2 Hz breaks",
        "",
        "The largest disturbance that is survived, and the next one tried, with which a contact "
        "tips within the period. The torque limit is that of the legs; beside it stands their "
        "largest static torque on the way.",
        "",
        *lines_of(
            breaking,
            {"what": lambda row: str(row["trial"]).replace("_", " ")}
            | who
            | {
                "survived": lambda row: f"{row['low' if _larger(row) else 'high']:.4g}",
                "failed": lambda row: f"{row['high' if _larger(row) else 'low']:.4g}",
                "unit": word("unit"),
                "static": number("predicted", 2),
                "contact": word("contact"),
                "rollouts": word("runs"),
            },
        ),
        "",
        "## Falls after perturbed pushes, within limits",
        "",
        *lines_of(
            scores(table, "fall_rate"),
            who
            | {
                "rate": number("value", 2),
                "95 % interval (Wilson)": lambda row: f"{row['low']:.2f} to {row['high']:.2f}",
                "repeats": word("runs"),
                "ends": word("reason"),
            },
        ),
        "",
        "The static analysis does not predict falls.",
        "",
        "## Prediction against simulation",
        "",
        *lines_of(
            found,
            {
                "score": lambda row: str(row["score"]).replace("_", " "),
                "prediction": word("prediction"),
                "cases": word("cases"),
                "mean error": lambda row: f"{row['mean_error']:.2g} {row['unit']}",
                "largest error": lambda row: f"{row['largest_error']:.2g} {row['unit']}",
                "r": number("correlation", 4),
                "95 % interval": lambda row: (
                    f"{row['low']:.4f} to {row['high']:.4f}" if np.isfinite(row["low"]) else ""
                ),
            },
        ),
        "",
        CAVEAT + " The cases are few and similar, so the interval holds for these cases.",
        "",
        "## Ranking",
        "",
        "1 plus the number of controllers that are better by more than the resolution, averaged "
        "over the settings in which all were tried.",
        "",
        *lines_of(
            ranking,
            {
                "trial": word("trial"),
                "score": lambda row: str(row["score"]).replace("_", " "),
                "controller": word("controller"),
                "mean rank": number("mean_rank", 2),
                "settings": word("settings"),
            },
        ),
    ]


def _larger(row: pd.Series) -> bool:
    from copsense.comparison import SCORES

    return SCORES[row["score"]].larger


def speed() -> list[str]:
    """Time of a controller's step, of a step of physics, and of a loop of both."""
    lines = ["| what | median [us] | least [us] |", "|---|---|---|"]
    plan = read_plan(HERE.with_suffix(".toml"))
    case = next(c for c in plan if c.label[:3] == ("icub", "straight", "minimum-wrench"))
    limited = next(c for c in plan if c.controller.name == "minimum-torque" + WITHIN)
    runner = CaseRunner(case)
    stance = runner.stance
    target = runner.reference(Hold()).at(0.0)
    seen = Observation(0.0, stance.q, np.zeros(stance.robot.model.nv), target, np.zeros((2, 6)))
    criterion = copsense.minimum_torque()
    for what, controller in (
        ("controller, minimum wrench", runner.make_controller()),
        ("controller, minimum torque", BalancingController(stance, criterion)),
        (
            "controller, minimum torque, limits",
            BalancingController(stance, criterion, limits=limited.controller.limits),
        ),
    ):
        lines.append(_timed(what, lambda controller=controller: controller(seen)))
    simulator = MujocoSimulator(stance)
    torques = copsense.solve_equilibrium(stance, criterion).torques
    lines.append(_timed("physics, 8 points of contact", lambda: simulator.step(torques), 300))
    reference = runner.reference(Sine(0.02, 0.2))
    start = time.perf_counter()
    runner.run(reference, 5.0)
    factor = 5.0 / (time.perf_counter() - start)
    return [*lines, "", f"A closed loop of 5 s at 1 kHz ran at {factor:.2f} times real time."]


def _timed(what: str, run: Callable[[], object], count: int = 2000) -> str:
    times = []
    for _ in range(count):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return f"| {what} | {np.median(times) * 1e6:.0f} | {min(times) * 1e6:.0f} |"


def main() -> int:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--force", action="store_true", help="run every case again")
    parser.add_argument("--jobs", type=int, default=min(os.cpu_count() or 1, 8))
    parser.add_argument("--plot", metavar="FILE", help="also draw the table: .png, .svg or .pdf")
    options = parser.parse_args()
    shape = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
    with tqdm(total=1.0, desc="balancing", bar_format=shape, disable=None) as bar:
        table = run_benchmark(
            read_plan(HERE.with_suffix(".toml")),
            HERE.with_suffix(".csv"),
            jobs=options.jobs,
            overwrite=options.force,
            progress=lambda share: bar.update(min(share, 1.0 - bar.n)),
        )
    if options.plot:
        save_figure(plot_benchmark(table), options.plot, overwrite=True)
    text = [
        "# Balancing in closed loop",
        "",
        f"Written by `python benchmarks/balancing.py`: copsense {copsense.__version__}, MuJoCo "
        f"{mujoco.__version__}, Pinocchio {pin.__version__}, {platform.machine()}. The cases are "
        "those of [balancing.toml](balancing.toml), the table is [balancing.csv](balancing.csv). "
        "iCub on soles of 160 x 72 mm, 1 kHz, ideal motors and sensors unless said, gains `STIFF`.",
        "",
        *page(table),
        "",
        "## Speed (one core, shared machine)",
        "",
        *speed(),
    ]
    HERE.with_suffix(".md").write_text("\n".join(text) + "\n", encoding="utf-8")
    print(HERE.with_suffix(".md"))
    wrong = [what for what, _, ok in checks(table) if not ok]
    for what in wrong:
        print(f"does not hold: {what}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
