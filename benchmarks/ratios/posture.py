"""What a posture of the iCub costs, as multiples of what a plain script takes for it.

The script (`speed_contenders.analytic_with_gains`: Pinocchio and NumPy, nothing of copsense) and
everything measured take turns in one process, CPU time; of each the least of many rounds counts.
So the ratios depend little on the machine and on what else it does, and those of two commits can be
compared where both ran on one machine.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[1]))
import speed
import speed_scaling as scaling
from equality import draw
from map import RANGES

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.maps import Axis, Sample
from copsense.maps.chunks import ChunkEvaluator
from copsense.maps.map_plan import MapPlan
from copsense.maps.store import create_map

ROUNDS = 25
SCRIPT = "the script"
WHAT = (
    "kernel",
    "kernel within limits",
    "search for postures",
    "map, search and writing with it",
    "reference path",
    "reference path within limits",
)


def setup_cache() -> dict[str, float]:
    """The ratio of each of `WHAT` to the script."""
    threadpool_limits(1)
    with tempfile.TemporaryDirectory() as folder:
        times = scaling.interleaved(runs(Path(folder)), ROUNDS, lambda _: None)
    least = {name: min(each) for name, each in times.items()}
    return {name: least[name] / least[SCRIPT] for name in WHAT}


setup_cache.timeout = 1800  # s: the first run of a tree compiles its kernels


def track_ratio(found: dict[str, float], what: str) -> float:
    """One of the ratios."""
    return found[what]


track_ratio.params = [list(WHAT)]
track_ratio.param_names = ["what"]
track_ratio.unit = "scripts"


def runs(folder: Path) -> dict[str, Callable[[], float]]:
    """What takes turns: each returns CPU seconds per posture."""
    stance, limits = copsense.load_stance("icub"), copsense.Limits(torque="model")
    narrow = copsense.Limits(friction=0.33, torque="model", cop_margin=0.01)
    q, near = draw(stance, scaling.CHUNK, seed=0), speed.near_standing(stance)
    sample = Sample(tuple(Axis(name, *ends) for name, ends in RANGES.items()), scaling.CHUNK)
    chart = PostureChart(stance, sample.names)
    reached = chart.solve(sample.values(0, len(sample)))
    return {
        SCRIPT: speed.per_posture(speed.script_with_gains(stance), q[:16]),
        "kernel": scaling.batches(BatchKernel(stance, scaling.CRITERIA), q),
        "kernel within limits": scaling.batches(
            BatchKernel(stance, scaling.CRITERIA, narrow), reached.configurations[reached.converged]
        ),
        "search for postures": searched(chart, sample),
        "map, search and writing with it": mapped(
            MapPlan(stance, scaling.CRITERIA, sample), folder / "map.zarr"
        ),
        "reference path": speed.per_posture(partial(speed.with_gains, stance), q[:16]),
        "reference path within limits": speed.per_posture(
            partial(speed.with_gains, stance, limits=limits), near
        ),
    }


def searched(chart: PostureChart, sample: Sample) -> Callable[[], float]:
    """A run: the postures of a sample, from the stance."""
    values, out = sample.values(0, len(sample)), chart.empty(len(sample))

    def run() -> float:
        start = time.thread_time()
        chart.solve(values, out=out)
        return (time.thread_time() - start) / len(values)

    return run


def mapped(plan: MapPlan, path: Path) -> Callable[[], float]:
    """A run: a chunk of a map, from its coordinates to the store."""
    evaluator, store = ChunkEvaluator(plan), create_map(path, plan)

    def run() -> float:
        start = time.process_time()  # Zarr writes in threads of its own
        evaluator.fill(store, 0)
        return (time.process_time() - start) / plan.size

    return run
