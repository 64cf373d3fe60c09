"""What an optimised posture of the iCub gains, from ten seeds, and whether a map has a better one.

    python benchmarks/optimisation.py [--seeds 10] [--samples 1000000] [--threads 2]
        [--write benchmarks/optimisation.md]

Minimum torque; CoM and orientation of the base vary, the feet are fixed or within 30 mm of where
they are. Knees stay 2 deg from their limits, and 2 deg from straight. Each seed draws other starts.
The sample is that of a map over the same coordinates and ranges, by the batch's chart and kernel;
what breaks the constraints is left out. Prints Markdown.
"""

import argparse
import os
import platform
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy

import copsense
from copsense.batch import BatchKernel, PostureChart
from copsense.design import design_criterion
from copsense.maps.sampling import Axis, Sample
from copsense.optimisation.variables import expand
from copsense.path import LateralPath, com_sweep
from copsense.robots import save_stance

KNEE = np.radians(2.0)
CONSTRAINTS = {
    "reserve": {"knee": KNEE},
    "within": {"l_knee": (-2.0, -KNEE), "r_knee": (-2.0, -KNEE)},
}
SPACES = {
    "feet fixed": {"com": None, "turn": None},
    "feet within 30 mm": {"com": None, "turn": None, "feet": 0.03},
}
TORQUE = copsense.minimum_torque()
LOOKED_AT = 100  # samples whose exact path is followed: those of the largest travel to first order
CHUNK = 20_000


def sideways(valuation):
    """The smaller of the exact travels to both sides [m]."""
    return min(t.distance for t in valuation.travels if t.way in ("+y", "-y"))


def seeds(stance, over, count):
    """Optima of several seeds, with seconds of the wall clock and of the processor."""
    found = []
    for seed in range(count):
        wall, cpu = time.perf_counter(), time.process_time()
        optimum = copsense.optimise(stance, over=over, seed=seed, **CONSTRAINTS)
        found.append((optimum, time.perf_counter() - wall, time.process_time() - cpu))
    return found


def sampled(stance, over, count, threads, around=None):
    """A map's sample: how many keep the constraints, and the best of them.

    Args:
        stance: what does not vary.
        over: coordinates and ranges, as `copsense.optimise` takes them.
        count: how many postures.
        threads: to share them.
        around: an optimum, to look within a tenth of the ranges around it.
    """
    ranges = expand(stance, over)
    if around is not None:
        for name, (low, high) in ranges.items():
            middle, width = around.after.coordinates[name], 0.05 * (high - low)
            ranges[name] = max(low, middle - width), min(high, middle + width)
    sample = Sample(tuple(Axis(name, *ends) for name, ends in ranges.items()), count)
    chart, kernel = PostureChart(stance, sample.names), BatchKernel(stance, [TORQUE])
    robot = stance.robot
    knees = [robot.model.joints[robot.joint_id(k)].idx_q for k in ("l_knee", "r_knee")]
    kept, best = 0, []
    for start in range(0, count, CHUNK):
        solved = chart.solve(sample.values(start, min(start + CHUNK, count)), threads=threads)
        q = solved.configurations[solved.converged]
        q = q[(q[:, knees] <= -KNEE).all(axis=1)]
        kept += len(q)
        if len(q):
            travel = kernel.evaluate(q, threads=threads).com_travel[:, 0].min(axis=1)
            best += [
                (float(travel[i]), q[i]) for i in np.argsort(-np.nan_to_num(travel))[:LOOKED_AT]
            ]
            best = sorted(best, key=lambda pair: -pair[0])[:LOOKED_AT]
    exact = [min(travel, exact_travel(stance.at(q))) for travel, q in best]
    return kept, best[0][0] if best else np.nan, max(exact, default=np.nan)


def exact_travel(stance):
    """To both sides, along the exact path [m]."""
    scan = copsense.PathScan(LateralPath(stance), TORQUE)
    firsts = [scan.travel(copsense.Limits(), side).first for side in (1, -1)]
    return min(np.inf if first is None else first.exact for first in firsts)


def again(optimum):
    """Largest difference of what `analyse` says of the stance written down and read again."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stance.toml"
        save_stance(optimum.stance, path)
        found = copsense.analyse(copsense.load_stance(path), [optimum.criterion])
    (sensitivity,) = found.sensitivities.values()
    return abs(float(sensitivity.com_travel.min()) - optimum.after.quantities["travel"])


def lines(arguments):
    """The page."""
    stance = copsense.load_stance("icub")
    yield "# What an optimised posture gains"
    yield ""
    yield "`python benchmarks/optimisation.py --write benchmarks/optimisation.md`. The iCub preset"
    yield "under minimum torque; CoM and orientation of the base vary (20 deg about each axis), and"
    yield (
        "the feet where said. Knees 2 deg from their limits and from straight. Travels in mm, along"
    )
    yield "exact paths to both sides, the smaller one; seconds of one process."
    yield ""
    yield f"Python {platform.python_version()}, SciPy {scipy.__version__}, {platform.machine()},"
    yield f"{os.cpu_count()} cores (load {os.getloadavg()[0]:.1f} when it began)."
    yield ""
    yield "| | default | least of the seeds | largest | spread | largest KKT residual | CPU s | s |"
    yield "|---|---|---|---|---|---|---|---|"
    optima = {}
    for name, over in SPACES.items():
        found = seeds(stance, over, arguments.seeds)
        travels = np.array([sideways(optimum.after) for optimum, _, _ in found]) * 1e3
        optima[name] = max((optimum for optimum, _, _ in found), key=lambda o: sideways(o.after))
        residual = max(optimum.residual for optimum, _, _ in found)
        wall, cpu = (max(times) for times in zip(*[row[1:] for row in found], strict=True))
        before = sideways(found[0][0].before) * 1e3
        yield (
            f"| {name}, {arguments.seeds} seeds | {before:.2f} | {travels.min():.2f} | "
            f"{travels.max():.2f} | {np.ptp(travels) / travels.max():.2%} | {residual:.1e} | "
            f"{cpu:.0f} | {wall:.0f} |"
        )
    yield ""
    yield "The best of a map's sample, of those that keep the constraints; the second row of each"
    yield (
        "within a tenth of the ranges around the optimum. Smallest travel: to first order any way,"
    )
    yield f"and exact to both sides, of the {LOOKED_AT} best to first order."
    yield ""
    yield "| | samples | kept | first order, best | optimum | smallest travel, best | optimum |"
    yield "|---|---|---|---|---|---|---|"
    for name, over in SPACES.items():
        optimum = optima[name]
        highest = max(optimum.starts)
        for around in (None, optimum):
            kept, first, exact = sampled(stance, over, arguments.samples, arguments.threads, around)
            yield (
                f"| {name}{', near' if around else ''} | {arguments.samples} | {kept} | "
                f"{first * 1e3:.2f} | {highest * 1e3:.2f} | {exact * 1e3:.2f} | "
                f"{optimum.after.smallest_travel * 1e3:.2f} |"
            )
    yield ""
    path = com_sweep(stance, "com_y", -0.09, 0.09, 37)
    design = design_criterion(path, copsense.Limits(), "joints", grid=7)
    asked = {"objective": "sideways", "over": ["com"], **CONSTRAINTS}
    under = copsense.optimise(stance, design.criterion, **asked)
    both = copsense.optimise(stance, family="joints", **asked)
    yield (
        "Under a criterion of its own (family joints, objective sideways, the CoM varies): weights"
    )
    yield f"alone, `copsense design`, {design.score.travel * 1e3:.2f} mm; the posture under that"
    yield f"criterion {sideways(under.after) * 1e3:.2f} mm; posture and weights together"
    yield f"{sideways(both.after) * 1e3:.2f} mm."
    yield ""
    worst = max(again(optimum) for optimum in optima.values())
    yield "Written to a stance file and analysed again, the travels to first order differ by"
    yield f"{worst:.1e} m."


def main():
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--write", type=Path)
    arguments = parser.parse_args()
    page = []
    for line in lines(arguments):
        print(line, flush=True)
        page.append(line)
    if arguments.write:
        arguments.write.write_text("\n".join(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
