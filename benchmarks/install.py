"""What an installation brings: megabytes of every package, and which command needs which extra.

Each environment is new and holds the wheel with one set of extras. A command starts in the bare one
and is taken where its message sends it, until it runs. The page beside this file is written anew.

Run: .venv/bin/python benchmarks/install.py [--python PYTHON]   (needs uv and the network)
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path(__file__).with_suffix(".md")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
# PyTorch's size depends on where pip takes it from.
LEFT_OUT = ("all", "torch")
EXTRAS = [name for name in PROJECT["optional-dependencies"] if name not in LEFT_OUT] + ["all"]

# What everything needs, and why it is no extra.
REASONS = {
    "click": "the command",
    "coal": "reads soles from collision geometry; Pinocchio brings it in any case",
    "daqp": "the quadratic programs of limits",
    "jaxtyping": "shapes in annotations, which its users' tools read",
    "numpy": "arrays",
    "pin": "Pinocchio: kinematics, dynamics and their derivatives; reads URDF, SDF and MJCF",
    "scipy": "optimisation, splines, hulls",
    "threadpoolctl": "one BLAS thread: the matrices are small",
    "tomli-w": "stance files are TOML, which Python reads and does not write",
    "tqdm": "progress",
}
COMMANDS = (
    "copsense four-bar",
    "copsense robots",
    "copsense inspect icub",
    "copsense analyse icub",
    "copsense push icub",
    "copsense design icub --grid 2",
    "copsense analyse icub --plot stance.png",
    "copsense explore icub --export icub.html",
    "copsense sweep icub --com-y -0.01:0.01:3 --output sweep.csv",
    "copsense sweep icub --com-y -0.01:0.01:3 --output sweep.nc",
    "copsense plot sweep.nc --output sweep.png",
    "copsense map icub --over com_y=-0.01:0.01:2 --output icub.zarr",
    "copsense balance icub --duration 0.05s --output run.nc",
    "copsense balance icub --duration 0.05s --video run.mp4",
)
# Lists what is installed, with the size of its files, as JSON.
LIST = """
import importlib.metadata, json
found = {}
for each in importlib.metadata.distributions():
    size = 0
    for file in each.files or ():
        try:
            size += file.locate().stat().st_size
        except OSError:
            pass
    needs = [need for need in each.requires or () if "extra ==" not in need]
    found[each.metadata["Name"]] = [each.version, size, needs]
print(json.dumps(found))
"""
NAMED = re.compile(r'pip install "?copsense\[([\w,]+)\]')


class Environments:
    """Environments with the wheel, one for each set of extras, made when they are asked for."""

    def __init__(self, folder: Path, python: str) -> None:
        """Build the wheel; environments go into the folder."""
        self.folder, self.python = folder, python
        run(["uv", "build", "--quiet", "--wheel", "--out-dir", str(folder), str(ROOT)])
        self.wheel = next(folder.glob("*.whl"))

    def programs(self, extras: tuple[str, ...]) -> Path:
        """The folder of programs of the environment with these extras."""
        place = self.folder / ("-".join(extras) or "bare")
        if not place.exists():
            run(["uv", "venv", "--quiet", "--python", self.python, str(place)])
            what = f"{self.wheel}[{','.join(extras)}]" if extras else str(self.wheel)
            python = str(place / "bin" / "python")
            run(["uv", "pip", "install", "--quiet", "--python", python, what])
        return place / "bin"

    def installed(self, extras: tuple[str, ...]) -> dict[str, tuple[str, int, list[str]]]:
        """Package -> its version, bytes of its files, and what it needs."""
        return json.loads(run([str(self.programs(extras) / "python"), "-c", LIST]))


def run(command: list[str]) -> str:
    """Run to the end; what it printed. A failure ends this program with what was said."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return done.stdout


def follow(command: str, environments: Environments, folder: Path) -> list[str]:
    """The extras that a command asks for, one after the other, until it runs."""
    extras: list[str] = []
    while True:
        programs = environments.programs(tuple(extras))
        words = [str(programs / "copsense"), *command.split()[1:]]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=600)
        if done.returncode == 0:
            return extras
        errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
        asked = NAMED.findall(errors[0]) if len(errors) == 1 else []
        new = [extra for extra in ",".join(asked).split(",") if extra and extra not in extras]
        if not new:
            sys.exit(f"{command}, with {extras}, ended with {done.returncode}:\n{done.stderr}")
        extras += new


def name_of(need: str) -> str:
    """The package that a requirement names, as normalised."""
    found = re.match(r"[\w.-]+", need)
    assert found is not None
    return re.sub(r"[-_.]+", "-", found[0]).lower()


def megabytes(size: float) -> str:
    """Bytes as MB of a table, one digit under ten."""
    return f"{size / 1e6:.1f}" if size < 9.95e6 else f"{size / 1e6:.0f}"


def needed_by(installed: dict[str, tuple[str, int, list[str]]]) -> dict[str, list[str]]:
    """Package -> the packages that ask for it, by normalised names."""
    askers: dict[str, list[str]] = {}
    for asker, (_, _, needs) in installed.items():
        for need in needs:
            askers.setdefault(name_of(need), []).append(asker)
    return askers


def dependency_table(installed: dict[str, tuple[str, int, list[str]]]) -> list[str]:
    """Rows of the packages that the bare wheel brings, largest first."""
    askers = needed_by(installed)
    rows = ["| package | MB | why |", "|---|---:|---|"]
    for name, (_, size, _) in sorted(installed.items(), key=lambda item: -item[1][1]):
        key = name_of(name)
        if key == "copsense":
            why = "itself"
        elif key in REASONS:
            why = REASONS[key]
        else:
            why = f"for {', '.join(sorted(askers.get(key, ['?'])))}"
        rows.append(f"| {name} | {megabytes(size)} | {why} |")
    return rows


def write_page(
    python: str,
    bare: dict[str, tuple[str, int, list[str]]],
    extras: list[str],
    commands: list[str],
) -> None:
    """Write the page beside this file: what the bare wheel brings, and the rows of two tables."""
    version = run([python, "--version"]).strip()
    parts = [
        f"What `pip install copsense` brings ({version}, {sys.platform}):",
        dependency_table(bare),
        "What each extra adds to it:",
        extras,
        "Which extras the commands ask for, one after the other, in an environment without any:",
        commands,
    ]
    texts = ["\n".join(part) if isinstance(part, list) else part for part in parts]
    head = "<!-- Written by benchmarks/install.py. -->"
    PAGE.write_text("\n\n".join([head, *texts]) + "\n", "utf-8")


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable)
    options = parser.parse_args()
    assert set(REASONS) == {name_of(need) for need in PROJECT["dependencies"]}
    if shutil.which("uv") is None:
        sys.exit("uv is not on PATH; pip install uv")
    with tempfile.TemporaryDirectory(prefix="copsense-") as name:
        environments = Environments(Path(name), options.python)
        bare = environments.installed(())
        total = sum(size for _, size, _ in bare.values())
        extras = ["| extra | packages | MB |", "|---|---:|---:|", f"| none | {len(bare)} | "]
        extras[-1] += f"{megabytes(total)} |"
        for extra in EXTRAS:
            more = environments.installed((extra,))
            size = sum(each[1] for each in more.values()) - total
            extras.append(f"| `{extra}` | +{len(more) - len(bare)} | +{megabytes(size)} |")
            print(extras[-1], flush=True)
        work = Path(name) / "empty"
        work.mkdir()
        commands = ["| command | asks for |", "|---|---|"]
        for command in COMMANDS:
            asked = follow(command, environments, work)
            commands.append(f"| `{command}` | {', '.join(asked) or 'nothing'} |")
            print(commands[-1], flush=True)
        write_page(options.python, bare, extras, commands)
    print(f"written: {PAGE.name}")


if __name__ == "__main__":
    main()
