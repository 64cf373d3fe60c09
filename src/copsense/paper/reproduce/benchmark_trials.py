"""The iCub leant, pushed and swayed under both criteria, by the benchmark."""

from __future__ import annotations

import os

import pandas as pd

from copsense.comparison import (
    Conditions,
    ControllerChoice,
    Lean,
    PostureChoice,
    PushToTip,
    RobotChoice,
    Sway,
    make_plan,
    run_benchmark,
)
from copsense.paper.reproduce.clock import Clock
from copsense.paper.reproduce.closed_loop import CONTROL_PERIOD

_JOBS = 4  # processes at most that simulate


def benchmark_in_simulation(clock: Clock) -> pd.DataFrame:
    """Both criteria: leans in three postures; pushes and a sway with straight legs."""
    robots = [RobotChoice("icub")]
    straight = PostureChoice("straight legs")
    others = (
        PostureChoice("knees 0.6 rad", knees=0.6),
        PostureChoice("feet 0.20 m apart", width=0.2),
    )
    controllers = [ControllerChoice(name) for name in ("minimum-wrench", "minimum-torque")]
    ideal = [Conditions(values={"control_period": CONTROL_PERIOD})]
    plan = make_plan(robots, [straight, *others], controllers, [Lean()], ideal)
    plan += make_plan(robots, [straight], controllers, [PushToTip(), Sway()], ideal)
    parts, done = 100, 0.0
    with clock.stage("closed loop: benchmark", parts) as advance:

        def tick(share: float) -> None:
            nonlocal done
            before, done = done, done + share
            advance(int(done * parts) - int(before * parts))

        return run_benchmark(plan, jobs=min(_JOBS, os.cpu_count() or 1), progress=tick)
