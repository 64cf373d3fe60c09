"""Do two commits give the same numbers? Every command's answers and files, value by value.

    python benchmarks/same_numbers.py record CHECKOUT FOLDER     run the commands of a checkout
    python benchmarks/same_numbers.py compare OLD_FOLDER NEW_FOLDER

`record` runs every command below with the sources of CHECKOUT (a git worktree of another commit,
say) and this interpreter's packages, and keeps what it prints and writes. `compare` reads two such
folders: it prints, for each command, how many numbers were compared and the largest difference,
then each kind of value that differs, is missing or is new, and ends with exit code 1 where a
difference is not in EXPECTED, the list of those that are meant, with their reasons.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TOLERANCE = 1e-8  # relative to the value, absolute under one

LIMITS = "--limits friction=0.33,torque=model"
# Name -> arguments. OUT stands for the folder that the command may write into.
COMMANDS = {
    "robots": "robots --json",
    "four-bar-torque": "four-bar --xi 1.5rad --json",
    "four-bar-wrench": "four-bar --xi 1.4rad --criterion minimum-wrench --json",
    "four-bar-weighted": "four-bar --criterion weighted-torque --hip-weight 2 --xi 1.45rad --json",
    "four-bar-tangential": "four-bar --criterion minimum-tangential --xi 1.5rad --json",
    "analyse-icub": "analyse icub --com-y 0.03 --along l_hip_roll --check --json",
    "analyse-icub-limits": f"analyse icub --com-y 0.02 {LIMITS} --json",
    "analyse-icub-regions": f"analyse icub {LIMITS} --regions OUT/regions.png --json",
    "analyse-icub-sole": "analyse icub --contact-at sole --joint torso_yaw=10 --json",
    "analyse-icub-all": "analyse icub --criterion minimum-tangential "
    "--criterion inertia-weighted-torque --json",
    "analyse-talos": "analyse talos --com-y 0.01 --json",
    "analyse-g1": f"analyse g1 {LIMITS} --json",
    "analyse-romeo": "analyse romeo --json",
    "analyse-solo12": "analyse solo12 --limits friction=0.6 --json",
    "analyse-anymal_c": "analyse anymal_c --json",
    "analyse-go2": "analyse go2 --com-x 0.01 --json",
    "sweep-com": "sweep icub --com-y -0.07:0.07:29 --output OUT/com.csv --json",
    "sweep-joint": "sweep talos --joint leg_left_2_joint=-5:5:11 --output OUT/joint.csv --json",
    "sweep-limits": f"sweep icub --com-y -0.04:0.04:9 {LIMITS} --output OUT/limits.csv --json",
    "map-grid": "map icub --over com_y=-0.04:0.04:9 --over com_z=0.485:0.51:5 "
    "--output OUT/icub.zarr --json",
    "map-sample": "map talos --over com_y=-0.03:0.03 --over pitch=-3:3 --samples 64 "
    "--output OUT/talos.zarr --json",
    "design-joints": f"design icub --family joints --grid 3 {LIMITS} --json",
    "design-length": f"design icub --family length --grid 7 {LIMITS} --json",
    "balance-sine": "balance icub --reference sine:0.02:0.5 --json",
    "balance-push": "balance talos --push 0:30:0:0.5:0.1 --duration 2 --json",
    "benchmark-lean": "benchmark icub --quick --disturbance lean --output OUT/leans.csv --json",
    "reproduce": "reproduce --output OUT/report --quiet",
}

# A closed loop amplifies rounding, by a thousand times and more.
_CLOSED_LOOP, _CLOSED_LOOP_TOLERANCE = re.compile(r"closed_loop\w*\.nc/|claims.json/loop-"), 1e-2
_PERIOD = "the report's closed loops have a control period of 4 ms, once 1 ms"

# What changed on purpose since commit 24fd220: (command, path of the value) as regular expressions,
# and the reason.
EXPECTED: list[tuple[str, str, str]] = [
    ("", "com_travel", "linear in the slack of an edge, not in the centre of pressure"),
    ("", "first_order", "linear in the slack of an edge, not in the centre of pressure"),
    (
        "analyse",
        r"limit_travel/.*/(name|margin|unit)$",
        "limits that are not met within reach are listed by their first order, and ties of left "
        "and right by rounding",
    ),
    ("analyse-solo12", r"exact/name$", "of legs that reach a limit together another is named"),
    ("map", "worst_travel|travel_percentiles", "statistics of com_travel"),
    ("map", "refused", "the status is called rejected"),
    ("design", "best|pareto", "the search goes inwards from bounds, and ends at the optimum"),
    ("benchmark|reproduce", "predicted$", "refined at the exact posture, not straight between two"),
    ("benchmark", "agreement/.*error", "errors of the first order are smaller: see first_order"),
    ("benchmark", "caveat", "wording"),
    ("reproduce", r"claims.json/.*/(explanation|statement|where)", "wording"),
    ("reproduce", r"errata.json/.*/(printed|holds|note)", "the right formula, and wording"),
    ("reproduce", "claims.json/(eq-29|flat-on-support|.*14.*|inverse-mass)/", "see the changelog"),
    ("reproduce", "setting.json/parameters/accuracy", "rounding"),
    (
        "analyse",
        r"contacts/[^/]*/cop_(slope|per_\w+)/",
        "the lateral path through a posture is the one nearest to it, however it was reached",
    ),
    ("reproduce", _CLOSED_LOOP.pattern, _PERIOD),
    ("reproduce", r"benchmark.csv/#/(key|value|low|high|reason|parameters|runs)$", _PERIOD),
]

# Nothing about the mathematics: times, versions, paths.
_IGNORED = re.compile(
    r"(^|/)(timings|versions|seconds|wall|cpu|created|date|output|plot|picture|path|version"
    r"|source|platform|regions/picture)(/|$)|real_time|duration_s"
)


def record(checkout: Path, folder: Path) -> None:
    """Run every command with the sources of a checkout."""
    folder.mkdir(parents=True, exist_ok=True)
    environment = os.environ | {
        "PYTHONPATH": str((checkout / "src").resolve()),
        "OPENBLAS_NUM_THREADS": "1",
    }
    start = "from copsense.cli import main; main()"
    for name, arguments in COMMANDS.items():
        out = folder / name
        if (out / "exit").exists():
            continue
        out.mkdir(exist_ok=True)
        words = shlex.split(_typed(arguments, checkout).replace("OUT", str(out.resolve())))
        began = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", start, *words],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        (out / "answer.json").write_text(done.stdout)
        (out / "errors.txt").write_text(done.stderr)
        (out / "exit").write_text(str(done.returncode))
        print(f"{name}: exit {done.returncode}, {time.perf_counter() - began:.0f} s", flush=True)


def _typed(arguments: str, checkout: Path) -> str:
    """The arguments as a checkout reads them: once ``--xi`` was a bare number of radians."""
    command = checkout / "src/copsense/cli/four_bar_command.py"
    units = command.exists() and "ANGLE" in command.read_text("utf-8")
    return arguments if units else re.sub(r"(--xi \S+?)rad", r"\1", arguments)


def compare(old: Path, new: Path) -> int:
    """Print what differs; 1 if something does that is not expected."""
    unexpected = 0
    for name in COMMANDS:
        before, after = _values(old / name), _values(new / name)
        shared = [key for key in before if key in after]
        worst, kinds = 0.0, {}
        for key in shared:
            difference = _difference(before[key], after[key])
            worst = max(worst, difference if math.isfinite(difference) else 0.0)
            closed = _CLOSED_LOOP.search(key)
            if difference > (_CLOSED_LOOP_TOLERANCE if closed else TOLERANCE):
                kinds.setdefault(_kind(key), []).append((difference, key))
        print(f"{name}: {len(shared)} values, largest difference {worst:.1e}")
        for kind, found in kinds.items():
            size, key = max(found)
            reason = _reason(name, kind)
            unexpected += reason is None
            print(f"  {kind}: {len(found)} differ, by {size:.2e} at {key}")
            print(f"    {before[key]!r} -> {after[key]!r}")
            print(f"    {reason or 'NOT EXPECTED'}")
        for word, keys in (
            ("missing", [k for k in before if k not in after]),
            ("new", [k for k in after if k not in before]),
        ):
            for kind in dict.fromkeys(map(_kind, keys)):
                reason = _reason(name, kind)
                unexpected += reason is None and word == "missing"
                print(
                    f"  {word}: {kind} -- {reason or 'NOT EXPECTED' if word == 'missing' else ''}"
                )
    print(f"{unexpected} unexpected" if unexpected else "the same, but for what is expected")
    return int(unexpected > 0)


def _values(folder: Path) -> dict[str, Any]:
    """Every value that a command gave, by the path to it."""
    found: dict[str, Any] = {}
    exit_code = folder / "exit"
    found["exit"] = float(exit_code.read_text()) if exit_code.exists() else "not run"
    for file in sorted(folder.rglob("*")):
        place = str(file.relative_to(folder))
        if file.suffix == ".json" and "zarr" not in place:
            try:
                found |= dict(_walk(json.loads(file.read_text()), place))
            except json.JSONDecodeError:
                found[place] = "no JSON"
        elif file.suffix == ".csv":
            with file.open(newline="") as opened:
                for i, row in enumerate(csv.DictReader(opened)):
                    labels = [row.get(c) for c in ("posture", "criterion", "contact")]
                    # Rows of a sweep are found by what they are of: their order has changed.
                    label = f"row {' '.join(map(str, labels))}" if all(labels) else str(i)
                    found |= {f"{place}/{label}/{k}": _number(v) for k, v in row.items()}
        elif file.suffix == ".nc":
            found |= _arrays(file, place, "netcdf4")
        elif file.suffix == ".zarr":
            found |= _arrays(file, place, "zarr")
    return {k: v for k, v in found.items() if not _IGNORED.search(k)}


def _arrays(file: Path, place: str, engine: str) -> dict[str, Any]:
    import numpy as np
    import xarray as xr

    found: dict[str, Any] = {}
    options = {"consolidated": False} if engine == "zarr" else {}
    with xr.open_dataset(file, engine=engine, **options) as data:
        for name, variable in data.variables.items():
            values = np.asarray(variable.values)
            if values.size > 20000:
                values = values.ravel()[:: values.size // 20000]
            for i, value in enumerate(values.ravel().tolist()):
                same = _same_names(value) if isinstance(value, str) else value
                found[f"{place}/{name}/{i}"] = same
    return found


def _walk(value: Any, place: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _walk(inner, f"{place}/{key}")
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            label: Any = i
            if isinstance(inner, dict) and "identifier" in inner:
                label = inner["identifier"]
            elif isinstance(inner, dict) and {"name", "mass"} <= set(inner):
                label = inner["name"]  # of a robot: others have come among them
            elif isinstance(inner, dict) and {"where", "kind"} <= set(inner):
                # A list of limits is in the order of their travels, which ties decide by rounding.
                label = f"{inner['where']}: {inner['kind']}"
            yield from _walk(inner, f"{place}/{label}")
    elif isinstance(value, str):
        yield place, _same_names(value)
    else:
        yield place, value


def _same_names(text: str) -> str:
    """Limits on the centre of pressure named as before they carried the index of their edge."""
    return re.sub(r"CoP at edge \d+, ([+-][xy] \(\w+\))", r"CoP at the \1 edge", text)


def _number(text: str | None) -> Any:
    try:
        return float(text or "")
    except ValueError:
        return _same_names(text or "")


def _difference(a: Any, b: Any) -> float:
    if isinstance(a, bool) or isinstance(b, bool) or isinstance(a, str) or isinstance(b, str):
        return 0.0 if a == b else math.inf
    if a is None or b is None:
        return 0.0 if a is b else math.inf
    if not (isinstance(a, int | float) and isinstance(b, int | float)):
        return 0.0 if a == b else math.inf
    if a == b or (math.isnan(a) and math.isnan(b)):
        return 0.0
    if not (math.isfinite(a) and math.isfinite(b)):
        return math.inf
    return abs(a - b) / max(1.0, abs(a))


def _kind(key: str) -> str:
    """The path with its numbers left out, so that one line stands for many values."""
    return re.sub(r"/(row )?(\d+[^/]*)(?=/|$)", "/#", key)


def _reason(command: str, kind: str) -> str | None:
    for where, what, why in EXPECTED:
        if re.search(where, command) and re.search(what, kind):
            return why
    return None


def main() -> int:
    """Record or compare."""
    match sys.argv[1:]:
        case ["record", checkout, folder]:
            record(Path(checkout), Path(folder))
            return 0
        case ["compare", old, new]:
            return compare(Path(old), Path(new))
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main())
