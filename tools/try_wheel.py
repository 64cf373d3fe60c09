"""Try the wheel as a stranger would: a new environment, an empty folder, the pages' own commands.

Builds sdist and wheel into dist/, and stops at the first thing that does not hold: the metadata, a
link of the package page that leads nowhere, an import with a warning, a command without extras, and
every command and Python block of the pages.

Run: .venv/bin/python tools/try_wheel.py [--python PYTHON] [--wheel FILE] [PAGE ...]
     (PAGE: of the repository, README.md if none is given; some ten minutes on two cores)
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

from support.fences import blocks, commands  # noqa: E402
from support.public_log import PLACES  # noqa: E402
from support.tiny import urdf  # noqa: E402

# What a page shows and this cannot run -> why.
NOT_HERE = {
    r"^make ": "needs the checkout",
    r"^pip install -e ": "needs the checkout",
    r"^dask |\bHOST\b|\.\.\.": "stands for something else",
    r"^copsense explore (?!.*--export)": "waits for a browser",
}
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


def run(command: list[str], folder: Path, **variables: str) -> str:
    """Run a command to its end; what it printed. A failure ends the trial with what it said."""
    # Nothing of the checkout, and no settings of the one who tries.
    ours = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    environment = {key: value for key, value in os.environ.items() if key not in ours} | variables
    start = time.monotonic()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    shown = " ".join(word if len(word) < 70 else word[:60] + " ..." for word in command)
    print(f"{time.monotonic() - start:6.1f} s  {shown.replace(str(ROOT), '.')}", flush=True)
    if done.returncode:
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
    given = [name for name in FILE.findall(line) if f"--output {name}" not in line]
    missing = [name for name in given if not (folder / name).exists()]
    return f"needs {', '.join(missing)}" if missing else ""


def try_page(page: Path, programs: Path, folder: Path) -> None:
    """Run every command of a page, then its Python blocks as one program."""
    folder.mkdir()
    provide(folder)
    home = {"HOME": str(folder), "PATH": f"{programs}:{os.environ['PATH']}"}
    for line in commands(page, "sh", "console"):
        reason = why_not(line, folder)
        if reason:
            print(f"not run   {line} ({reason})")
        else:
            run(["sh", "-c", line], folder, **home)
    code = "\n".join(blocks(page, "python"))
    if code:
        (folder / "page.py").write_text(code)
        run([str(programs / "python"), "page.py"], folder, MPLBACKEND="agg", **home)


def main() -> None:
    """Read the arguments and try everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="*", default=["README.md"], metavar="PAGE")
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
