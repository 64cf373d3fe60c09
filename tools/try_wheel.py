"""Try the wheel as a stranger would: a new environment, an empty folder, the pages' own commands.

Builds sdist and wheel into dist/, and stops at the first thing that does not hold: the metadata, a
link of the package page that leads nowhere, an import with a warning, a command without extras, and
every command and Python block of the pages.

Run: .venv/bin/python tools/try_wheel.py [--python PYTHON] [--wheel FILE] [PAGE ...]
     (PAGE: of the repository; the README, the cheat sheet and the tutorials if none is given)
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import zipfile
from email.parser import HeaderParser
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from support.public_log import PLACES  # noqa: E402
from support.sessions import difference, steps  # noqa: E402
from support.tiny import urdf  # noqa: E402

# What a page shows and this cannot run -> why.
NOT_HERE = {
    r"^make ": "needs the checkout",
    r"^pip install (-e |\"?\.)": "needs the checkout",
    r"^dask |\bHOST\b|\.\.\.": "stands for something else",
    r"^copsense explore (?!.*--export)": "waits for a browser",
}
PAGES = ("README.md", "docs/index.md", "docs/cheat_sheet.md", "docs/tutorials/*.md")
FILE = re.compile(r"(?:^|\s)([\w/-]+\.(?:urdf|mat|toml|nc))(?:\s|$)")


def build(python: str) -> Path:
    """Build sdist and wheel into an empty dist/, check them with twine; the wheel."""
    dist = ROOT / "dist"
    for old in dist.glob("copsense-*"):
        old.unlink()
    run([python, "-m", "build", "--outdir", str(dist), str(ROOT)], ROOT)
    built = sorted(map(str, dist.glob("copsense-*")))
    run([python, "-m", "twine", "check", "--strict", *built], ROOT)
    return next(dist.glob("*.whl"))


def run(command: list[str], folder: Path, expected: int = 0, **variables: str) -> str:
    """Run a command to its end; what it printed. Another exit code ends the trial with that."""
    # Nothing of the checkout, and no settings of the one who tries.
    ours = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    environment = {key: value for key, value in os.environ.items() if key not in ours} | variables
    start = time.monotonic()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    shown = " ".join(word if len(word) < 70 else word[:60] + " ..." for word in command)
    print(f"{time.monotonic() - start:6.1f} s  {shown.replace(str(ROOT), '.')}", flush=True)
    if done.returncode != expected:
        sys.exit(f"ended with {done.returncode}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout + done.stderr


def check_page(wheel: Path) -> None:
    """Stop unless every link and picture of the package page is a whole address."""
    with zipfile.ZipFile(wheel) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        page = HeaderParser().parsestr(archive.read(name).decode()).get_payload()
    dead = re.findall(r"\]\((?!https?://|#)[^)]*\)", page)
    if dead:
        sys.exit(f"on the package page these lead nowhere: {', '.join(dead)}")


def make_environment(python: str, folder: Path, wheel: str) -> Path:
    """A new environment with the wheel in it; its folder of programs."""
    run([python, "-m", "venv", str(folder)], folder.parent)
    programs = folder / "bin"
    run([str(programs / "python"), "-m", "pip", "install", "--quiet", wheel], folder.parent)
    run([str(programs / "python"), "-m", "pip", "check"], folder.parent)
    return programs


def try_bare(programs: Path, folder: Path) -> None:
    """Without extras: an import without a warning, and a URDF analysed in both ways."""
    (folder / "my_robot.urdf").write_text(my_robot())
    python, copsense = str(programs / "python"), str(programs / "copsense")
    run([python, "-W", "error", "-c", "import copsense; copsense.analyse"], folder)
    run([python, "-m", "copsense", "--version"], folder)
    contacts = ["--contact", "l_foot", "--contact", "r_foot", "--contact-at", "sole"]
    said = run([copsense, "analyse", "my_robot.urdf", *contacts], folder)
    if "CoP x, y" not in said:
        sys.exit(said)
    run([copsense, "inspect", "my_robot.urdf"], folder)


def my_robot() -> str:
    """A URDF with the names that the pages give to the reader's own robot."""
    return urdf().replace('"left"', '"l_foot"').replace('"right"', '"r_foot"')


def provide(folder: Path) -> None:
    """Lay out what the pages take for granted: a robot, a workspace, and the public log if here."""
    (folder / "my_robot.urdf").write_text(my_robot())
    (folder / "ws" / "share").mkdir(parents=True)
    for place in PLACES:
        if (place / "com-sinusoid.mat").is_file():
            (folder / "com-sinusoid.mat").symlink_to(place / "com-sinusoid.mat")
            (folder / "model.urdf").symlink_to(place / "icub-genova04-2021.urdf")
            return


def why_not(line: str, folder: Path) -> str:
    """Why a line cannot be run here; empty where it can."""
    for pattern, reason in NOT_HERE.items():
        if re.search(pattern, line):
            return reason
    made = {
        name for name in FILE.findall(line) if re.search(rf"--(?:output|save-\w+) {name}", line)
    }
    given = [name for name in FILE.findall(line) if name not in made]
    missing = [name for name in given if not (folder / name).exists()]
    return f"needs {', '.join(missing)}" if missing else ""


def try_page(page: Path, programs: Path, folder: Path) -> None:
    """Do what a page says: commands with the output that it shows, files, and its Python.

    The Python is one program; it runs again, from the top, before the next command that may need
    what it writes.
    """
    folder.mkdir()
    provide(folder)
    home = {"HOME": str(folder), "PATH": f"{programs}:{os.environ['PATH']}", "MPLBACKEND": "agg"}
    program, left = "", False
    for step in steps(page):
        if step.kind == "python":
            program, left = program + step.text, True
            continue
        if left:
            run_program(program, programs, folder, home)
            left = False
        if step.kind == "file":
            (folder / step.name).write_text(step.text)
            continue
        reason = why_not(step.text, folder)
        if reason:
            print(f"not run   {step.text} ({reason})")
            continue
        said = run(["sh", "-c", f"{{ {step.text}; }} 2>&1"], folder, step.code, **home)
        other = difference(step.shown, said) if step.shown else ""
        if other:
            sys.exit(f"{page.name}: {step.text}\n{other}")
    if left:
        run_program(program, programs, folder, home)


def run_program(program: str, programs: Path, folder: Path, home: dict[str, str]) -> None:
    """Run a page's Python as one program in its folder."""
    (folder / "page.py").write_text(program)
    run([str(programs / "python"), "page.py"], folder, **home)


def main() -> None:
    """Read the arguments and try everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    pages = [
        path.relative_to(ROOT).as_posix() for name in PAGES for path in sorted(ROOT.glob(name))
    ]
    parser.add_argument("pages", nargs="*", default=pages, metavar="PAGE")
    parser.add_argument("--python", default=sys.executable, help="the interpreter to try it with")
    parser.add_argument("--wheel", type=Path, help="a wheel that is there already")
    options = parser.parse_args()
    wheel = (options.wheel or build(sys.executable)).resolve()
    check_page(wheel)
    print(run([options.python, "--version"], ROOT).strip(), shlex.quote(wheel.name))
    with tempfile.TemporaryDirectory(prefix="copsense-") as name:
        folder = Path(name)
        for part in ("bare", "empty"):
            (folder / part).mkdir()
        bare = make_environment(options.python, folder / "bare" / "env", str(wheel))
        try_bare(bare, folder / "empty")
        whole = make_environment(options.python, folder / "all", f"{wheel}[all]")
        for page in options.pages:
            try_page(ROOT / page, whole, folder / page.replace("/", "-"))
    print("everything ran")


if __name__ == "__main__":
    main()
