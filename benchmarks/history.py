"""Whether a commit is slower than another one: what a posture costs, by asv, as ratios.

    python benchmarks/history.py [BASE] [--factor 1.2]

Both commits are measured on this machine with the benchmarks of this checkout (`ratios/`), the
commit here from `src/`, BASE (default: the commit before) from a copy under build/history. asv
records the ratios there and compares them. What is slower by over 20 % is measured again, both
commits in the other order; what is so twice is named, and ends in exit status 1. A minute, and once
for each version of the kernels a minute or two for their compilation.

`asv publish --config benchmarks/asv.conf.json` draws what was recorded into build/history/html.
"""

from __future__ import annotations

import argparse
import io
import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "history"
CONFIG = ROOT / "benchmarks" / "asv.conf.json"
MACHINE = "here"


def git(*arguments: str) -> bytes:
    """What git prints; ends the program where it fails."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True)
    if done.returncode:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.decode().strip()}")
    return done.stdout


def commit(name: str) -> str:
    """The hash of a commit."""
    return git("rev-parse", "--verify", f"{name}^{{commit}}").decode().strip()


def sources(of: str) -> Path:
    """A copy of src/ of a commit, with the machine code of this checkout's kernels.

    That is of use where the kernels are the same, and left aside by its stamp where they are not.
    """
    folder = BUILD / "sources" / of
    if not folder.exists():
        with tarfile.open(fileobj=io.BytesIO(git("archive", of, "src"))) as archive:
            archive.extractall(folder, filter="data")
    for cache in (ROOT / "src" / "copsense" / "batch").rglob("__pycache__"):
        there = folder / cache.relative_to(ROOT)
        if there.parent.exists() and not there.exists():
            shutil.copytree(cache, there, ignore=shutil.ignore_patterns("*.pyc"))
    return folder / "src"


def asv(*arguments: str, path: Path | None = None, read: bool = False) -> str:
    """Run asv with its settings under build/; its table, where that is to be read."""
    environment = os.environ | {"HOME": str(BUILD)}
    environment |= {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")}
    if path is not None:
        environment["ASV_PYTHONPATH"] = str(path)  # asv takes PYTHONPATH off
    command = [sys.executable, "-m", "asv", *arguments, "--config", str(CONFIG)]
    done = subprocess.run(
        command, env=environment, cwd=ROOT, text=True, stdout=subprocess.PIPE if read else None
    )
    if done.returncode:
        raise SystemExit(f"asv {arguments[0]} failed; what it wrote is above.")
    return done.stdout or ""


def measure(of: str, path: Path) -> None:
    """Have asv record the ratios of a commit."""
    asv(
        "run",
        "--python=same",
        f"--set-commit-hash={of}",
        f"--machine={MACHINE}",
        "--show-stderr",
        path=path,
    )


def slower(base: str, here: str, factor: float) -> set[str]:
    """What asv finds to be slower, or to fail, than it was."""
    table = asv("compare", base, here, f"--factor={factor}", f"--machine={MACHINE}", read=True)
    print(table, flush=True)
    rows = [[cell.strip() for cell in line.split("|")] for line in table.splitlines()]
    return {row[5] for row in rows if len(row) == 7 and row[1] in ("+", "!")}


def main() -> None:
    """Measure both commits, compare, and end in 1 where something is slower."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("base", nargs="?", default="HEAD~1", help="a commit to compare with")
    parser.add_argument("--factor", type=float, default=1.2, help="slower by which a slip is one")
    options = parser.parse_args()
    if git("status", "--porcelain", "--", "src"):
        raise SystemExit("src/ has changes that no commit holds. Commit them: asv records commits.")
    base, here = commit(options.base), commit("HEAD")
    if base == here:
        raise SystemExit(f"{options.base} is the commit here. Name another one.")
    BUILD.mkdir(parents=True, exist_ok=True)
    if not (BUILD / ".asv-machine.json").exists():
        asv("machine", "--yes", f"--machine={MACHINE}")
    measure(here, ROOT / "src")  # first: the kernels that it compiles may serve both
    before = sources(base)
    measure(base, before)
    slips = slower(base, here, options.factor)
    if slips:
        print("Measured again, to be sure:", flush=True)
        measure(base, before)
        measure(here, ROOT / "src")
        slips &= slower(base, here, options.factor)
    for name in sorted(slips):
        print(f"slower by over {options.factor - 1:.0%} than {base[:8]}, twice: {name}")
    sys.exit(1 if slips else 0)


if __name__ == "__main__":
    main()
