"""Logs broken at random: nothing may end in a traceback, be read wrongly or leave a file behind.

A short recording is written in every format by that format's own library, and seeded mutations of
its bytes are read again: cut short, bytes changed, stretches deleted, doubled, zeroed or moved,
more often at the head and the tail, where formats keep their structure. Each must be rejected by an
error of copsense's own, or give a log whose numbers are finite or named as missing. One in eight
goes through ``copsense log --save-map`` instead, which must not leave its file behind an error.

Run: .venv/bin/python benchmarks/log_mutations.py [--count 2000] [--seed 0] [--only log.csv]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from mutations import judged, report
from support import log_files

import copsense
from copsense.controllers import Sine
from copsense.errors import CopsenseError
from copsense.logs import Log, LogMap, read_log
from copsense.logs.log_map import WrenchMap
from copsense.logs.opening import open_log_file
from copsense.logs.recognition import recognise
from copsense.simulation import Scenario

CONTACTS = ("l_sole", "r_sole")
ROWS = 24
EDGE = 1500  # bytes at the head and the tail that are hit more often
SLOW = 90.0  # s: what takes longer has not been rejected in time
# Of all mutations; what is read in a process of its own takes a second.
SHARES = {
    "log.csv": 0.17,
    "log.parquet": 0.17,
    "v5.mat": 0.08,
    "v73.mat": 0.17,
    "ros1.bag": 0.14,
    "ros2.mcap": 0.1,
    "ros2.db3": 0.05,
    "plates.c3d": 0.05,
    "own.nc": 0.07,
}


def whole_files(folder: Path) -> dict[str, bytes]:
    """The bytes of one recording in each format."""
    stance = copsense.load_stance("icub")
    scenario = Scenario(0.15, Sine(0.008, 1.0), control_period=2e-3)
    sway = copsense.balance(stance, copsense.minimum_torque(), scenario)
    data = log_files.first(log_files.of_recording(sway), ROWS)
    sway.save(folder / "own.nc")
    log_files.write_csv(folder / "log.csv", data)
    log_files.write_parquet(folder / "log.parquet", data)
    log_files.write_matlab5(folder / "v5.mat", data)
    log_files.write_matlab73(folder / "v73.mat", data)
    log_files.write_bag(folder / "ros1.bag", data)
    log_files.write_c3d(folder / "plates.c3d", data)
    found = {}
    for suffix in ("mcap", "db3"):
        log_files.write_bag(folder / f"ros2_{suffix}", data)
        (inside,) = (folder / f"ros2_{suffix}").glob(f"*.{suffix}")
        found[f"ros2.{suffix}"] = inside.read_bytes()
    for name in SHARES:
        if name not in found:
            found[name] = (folder / name).read_bytes()
    return found


def mutated(content: bytes, rng: random.Random) -> bytes:
    """One to three changes of a file's bytes."""
    broken = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 3])):
        at, span = _place(len(broken), rng), rng.choice([1, 4, 30, 400])
        part = broken[at : at + span]
        change = rng.randrange(7)
        if change == 0:
            del broken[max(1, at) :]
        elif change == 1:
            for i in range(at, min(at + span, len(broken))):
                broken[i] = rng.randrange(256)
        elif change == 2:
            del broken[at : at + span]
        elif change == 3:
            broken[at:at] = part
        elif change == 4:
            broken[at : at + span] = bytes(len(part))
        elif change == 5:
            other = _place(len(broken), rng)
            broken[other : other + len(part)] = part
        elif at < len(broken):
            broken[at] ^= 1 << rng.randrange(8)
    return bytes(broken)


def _place(size: int, rng: random.Random) -> int:
    where = rng.random()
    if where < 0.35:
        return rng.randrange(max(1, min(EDGE, size)))
    if where < 0.6:
        return max(0, size - 1 - rng.randrange(max(1, min(EDGE, size))))
    return rng.randrange(max(1, size))


def judge(path: Path, robot: copsense.Robot) -> str:
    """Read a log; what is wrong with what was accepted, or nothing."""
    if path.suffix != ".c3d":
        return _of_log(read_log(path, robot=robot, contacts=CONTACTS))
    joints = path.with_name("joints.csv")  # force plates stand beside a log of the joints
    said = recognise(open_log_file(joints), robot, CONTACTS)
    plates = tuple(
        WrenchMap(name, {"wrench": f"plate {k + 1}"}, kind="plate", file=path.name)
        for k, name in enumerate(CONTACTS)
    )
    found = LogMap.from_dict(replace(said, wrenches=plates).to_dict())
    return _of_log(read_log(joints, found, robot=robot, contacts=CONTACTS))


def _of_log(log: Log) -> str:
    if len(log.times) < 2 or not np.all(np.isfinite(log.times)):
        return "times that are not finite"
    if np.any(np.diff(log.times) <= 0):
        return "times that do not grow"
    if not np.all(np.isfinite(log.positions) | np.isnan(log.positions)):
        return "infinite positions"
    said = {finding.kind for finding in log.findings}
    if np.isnan(log.positions).any() and not said:
        return "positions that are missing, without a word"
    return ""


def judge_command(path: Path) -> str:
    """The same by the command, which must leave no mapping behind an error."""
    from click import ClickException
    from click.testing import CliRunner

    from copsense.cli import copsense as command

    kept = path.parent / "kept.toml"
    kept.unlink(missing_ok=True)
    words = ["log", str(path), "--robot", "icub", "--json", "--save-map", str(kept)]
    run = CliRunner().invoke(command, words)
    error = run.exception
    if error is None or (isinstance(error, SystemExit) and not error.code):
        return ""
    if kept.exists():
        return f"a mapping beside the error {error}"
    if isinstance(error, ClickException | SystemExit):
        raise CopsenseError("bad usage")
    raise error


def run(
    name: str, files: dict[str, bytes], count: int, seed: int, robot: copsense.Robot
) -> tuple[Counter[str], list[str]]:
    """Try many mutations of a format.

    Returns:
        How many were accepted and rejected, and what was neither.
    """
    counts: Counter[str] = Counter()
    bad = []
    with tempfile.TemporaryDirectory() as folder:
        path, joints = Path(folder) / name, Path(folder) / "joints.csv"
        joints.write_bytes(files["log.csv"])
        path.write_bytes(files[name])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            wrong = judge(path, robot)  # what is whole is accepted
        if wrong:
            bad.append(f"{name}, whole: {wrong}")
        for i in range(count):
            rng = random.Random(f"{name} {seed} {i}")
            path.write_bytes(mutated(files[name], rng))
            before, begun = {path, joints}, time.monotonic()
            attempt = partial(judge_command, path) if i % 8 == 7 else partial(judge, path, robot)
            with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
                warnings.simplefilter("ignore")
                wrong = judged(attempt, counts)
            (Path(folder) / "kept.toml").unlink(missing_ok=True)
            left = set(Path(folder).iterdir()) - before
            if left:
                wrong = wrong or f"files left behind: {sorted(p.name for p in left)}"
            if time.monotonic() - begun > SLOW:
                wrong = wrong or f"an answer after {time.monotonic() - begun:.0f} s"
            if wrong:
                counts["wrong"] += 1
                bad.append(f"{name} {seed} {i}: {wrong[:300]}")
    return counts, bad


def main() -> int:
    """Run every format and print what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--count", type=int, default=2000, help="mutations in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=tuple(SHARES))
    given = parser.parse_args()
    robot = copsense.load_stance("icub").robot
    with tempfile.TemporaryDirectory() as folder:
        files = whole_files(Path(folder))
    failed = False
    for name in [given.only] if given.only else SHARES:
        share = 1.0 if given.only else SHARES[name]
        counts, bad = run(name, files, round(given.count * share), given.seed, robot)
        failed |= report(name, counts, bad)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
