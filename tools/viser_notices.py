"""Write the notices of what viser's client holds: an exported page gives its scripts on.

The client is one file without the notices of the packages in it. Its own list of packages is
installed by npm, with nothing of it run, and what its sources import is followed from there.

Run: .venv/bin/python tools/viser_notices.py   (needs npm and viser; writes
     src/copsense/explore/notices.txt)
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WORK = ROOT / "build" / "viser-client"
NOTICES = ROOT / "src" / "copsense" / "explore" / "notices.txt"
IMPORT = re.compile(r"""(?:from|import)\s*\(?\s*["']((?:@[\w.-]+/)?[a-z][\w.-]*)""")
LICENCE = re.compile(r"^(licen[cs]e|copying|notice)", re.IGNORECASE)
COPYRIGHT = re.compile(r"^[\s*#>-]*(copyright\b.*(?:\d|©|\(c\)).*)$", re.IGNORECASE | re.MULTILINE)
# The licences that are short enough to stand in full, once; each with its package to copy from.
FULL = {"MIT": "react", "ISC": "@msgpack/msgpack", "BSD-3-Clause": "react-transition-group"}


def install() -> Path:
    """Install what the client is made of, as its lock file says; the client's own folder."""
    spec = find_spec("viser")
    assert spec is not None
    assert spec.origin is not None
    client = Path(spec.origin).parent / "client"
    WORK.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(client / name, WORK / name)
    quiet = ["--ignore-scripts", "--omit=dev", "--no-audit", "--no-fund"]
    subprocess.run(["npm", "ci", *quiet], cwd=WORK, check=True)
    return client


def imported(client: Path) -> set[str]:
    """The packages that the client's sources import, tests left out."""
    sources = [*(client / "src").rglob("*.ts"), *(client / "src").rglob("*.tsx")]
    kept = [path for path in sources if not path.name.endswith((".test.ts", ".test.tsx", ".d.ts"))]
    names = {name for path in kept for name in IMPORT.findall(path.read_text("utf-8"))}
    return {name for name in names if (WORK / "node_modules" / name).is_dir()}


def closure(names: set[str]) -> dict[str, dict]:
    """Those packages and all that they need at run time -> their package.json."""
    found: dict[str, dict] = {}
    waiting = sorted(names)
    while waiting:
        name = waiting.pop()
        file = WORK / "node_modules" / name / "package.json"
        if name in found or name.startswith("@types/") or not file.is_file():
            continue
        found[name] = json.loads(file.read_text("utf-8"))
        waiting += found[name].get("dependencies", {})
    return dict(sorted(found.items()))


def licence_text(name: str) -> str:
    """What a package's licence files say; empty if it has none."""
    folder = WORK / "node_modules" / name
    files = sorted(path for path in folder.iterdir() if path.is_file() and LICENCE.match(path.name))
    return "\n".join(path.read_text("utf-8", errors="replace") for path in files)


def author(package: dict) -> str:
    """Who a package names as its author."""
    said = package.get("author", "")
    name = said.get("name", "") if isinstance(said, dict) else said
    return re.sub(r"\s*[<(].*", "", name)


def row(name: str, package: dict) -> str:
    """One package: name, version, licence, and its copyright lines."""
    holders = [" ".join(line.split()) for line in COPYRIGHT.findall(licence_text(name))]
    holders = [line for line in dict.fromkeys(holders) if "[yyyy]" not in line]
    if not holders and author(package):
        holders = [f"by {author(package)}"]
    licence = package.get("license") or "licence not said"
    return f"{name} {package['version']} ({licence})" + "".join(f"\n    {h}" for h in holders)


def conditions(name: str) -> str:
    """A licence's text without its title and copyright line."""
    text = licence_text(FULL[name])
    starts = {"MIT": "Permission is", "ISC": "Permission to", "BSD-3-Clause": "Redistribution and"}
    return text[text.index(starts[name]) :].strip()


def main() -> None:
    """Install, follow, write."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    packages = closure(imported(install()))
    head = (
        f"The 3-D view is viser {version('viser')} (MIT by its metadata, Apache-2.0 by its "
        "licence file;\nCopyright viser contributors). Its client holds parts of these packages:\n"
    )
    rows = [row(name, package) for name, package in packages.items()]
    texts = [f"{name}:\n\n{conditions(name)}" for name in FULL]
    texts.append("Apache-2.0: https://www.apache.org/licenses/LICENSE-2.0")
    NOTICES.write_text("\n\n".join([head + "\n" + "\n".join(rows), *texts]) + "\n", "utf-8")
    print(f"{NOTICES.relative_to(ROOT)}: {len(rows)} packages")


if __name__ == "__main__":
    main()
