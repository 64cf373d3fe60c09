"""Slow leans of the iCub to the first tip, by the benchmark."""

from __future__ import annotations

import os

import pandas as pd

from copsense.benchmark import (
    ControllerChoice,
    Lean,
    PostureChoice,
    RobotChoice,
    make_plan,
    run_benchmark,
)
from copsense.reproduction.clock import Clock

_JOBS = 4  # processes at most that lean robots


def leans_in_simulation(clock: Clock) -> pd.DataFrame:
    """The iCub leant slowly until a foot tips, in three postures under both criteria."""
    plan = make_plan(
        [RobotChoice("icub")],
        [
            PostureChoice("straight legs"),
            PostureChoice("knees 0.6 rad", knees=0.6),
            PostureChoice("feet 0.20 m apart", width=0.2),
        ],
        [ControllerChoice(name) for name in ("minimum-wrench", "minimum-torque")],
        [Lean()],
    )
    parts, done = 100, 0.0
    with clock.stage("closed loop: leans", parts) as advance:

        def tick(share: float) -> None:
            nonlocal done
            before, done = done, done + share
            advance(int(done * parts) - int(before * parts))

        return run_benchmark(plan, jobs=min(_JOBS, os.cpu_count() or 1), progress=tick)
