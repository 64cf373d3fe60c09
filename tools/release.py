"""Give the version everywhere it stands, or check that all places say the same.

Run: python tools/release.py set 0.2.0 [--date 2026-11-29]   (the changelog's Unreleased gets it)
     python tools/release.py check 0.2.0
"""

from __future__ import annotations

import argparse
import datetime
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSION, DATE = r"\d+\.\d+\.\d+", r"\d{4}-\d{2}-\d{2}"
# File -> pattern whose group is the version, and what stands in its place.
PLACES = {
    "src/copsense/_version.py": (rf'__version__ = "({VERSION})"', '__version__ = "{version}"'),
    "CITATION.cff": (
        rf"^version: ({VERSION})(?:\ndate-released: {DATE})?$",
        "version: {version}\ndate-released: {date}",
    ),
    "recipe/recipe.yaml": (rf"^  version: ({VERSION})$", "  version: {version}"),
}
HEADING = re.compile(rf"^## \[({VERSION})\] - ({DATE})$", re.MULTILINE)
UNRELEASED = "## [Unreleased]\n"


def found(root: Path) -> dict[str, str]:
    """The version that each file gives.

    Raises:
        SystemExit: a file gives none, or several.
    """
    says = {}
    for name, (pattern, _) in PLACES.items():
        versions = re.findall(pattern, (root / name).read_text("utf-8"), re.MULTILINE)
        if len(versions) != 1:
            raise SystemExit(f"{name} gives {len(versions)} versions, not one")
        says[name] = versions[0]
    return says


def released(root: Path) -> list[tuple[str, str]]:
    """Versions and dates of the changelog's sections, newest first."""
    return HEADING.findall((root / "CHANGELOG.md").read_text("utf-8"))


def notes_of(root: Path, version: str) -> Path:
    """The page that says what is new in a version."""
    return root / "docs" / "releases" / f"{version}.md"


def set_version(root: Path, version: str, date: str) -> None:
    """Write a version and its date everywhere; what is unreleased becomes its section.

    Raises:
        SystemExit: the changelog has that version already or nothing unreleased, or the version
            has no notes. Nothing is written then.
    """
    changelog = root / "CHANGELOG.md"
    text = changelog.read_text("utf-8")
    if any(version == old for old, _ in released(root)):
        raise SystemExit(f"CHANGELOG.md has a section {version} already")
    before, _, after = text.partition(UNRELEASED)
    if not re.match(r"\s*(?!## )\S", after):
        raise SystemExit("CHANGELOG.md has nothing under Unreleased")
    found(root)  # every place is there before the first is written
    if not notes_of(root, version).is_file():
        raise SystemExit(f"{notes_of(Path(), version)} is missing: what is new, in a page")
    for name, (pattern, new) in PLACES.items():
        path = root / name
        given = new.format(version=version, date=date)
        said = re.sub(pattern, given, path.read_text("utf-8"), flags=re.MULTILINE)
        path.write_text(said, "utf-8")
    changelog.write_text(f"{before}{UNRELEASED}\n## [{version}] - {date}\n{after}", "utf-8")


def check(root: Path, version: str) -> None:
    """Stop unless all places give this version, the changelog its date, and its notes are there.

    Raises:
        SystemExit: they do not; all that differ are named.
    """
    wrong = [
        f"{name} says {said}, not {version}"
        for name, said in found(root).items()
        if said != version
    ]
    if version not in dict(released(root)):
        wrong.append(f"CHANGELOG.md has no dated section {version}")
    if not notes_of(root, version).is_file():
        wrong.append(f"{notes_of(Path(), version)} is missing")
    if wrong:
        raise SystemExit("\n".join(wrong))


def main() -> None:
    """Read the arguments and do it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("action", choices=["set", "check"])
    parser.add_argument("version")
    parser.add_argument("--date", default=datetime.date.today().isoformat())
    options = parser.parse_args()
    if not re.fullmatch(VERSION, options.version):
        parser.error(f"{options.version!r} is not a version; write X.Y.Z")
    if not re.fullmatch(DATE, options.date):
        parser.error(f"{options.date!r} is not a date; write YYYY-MM-DD")
    if options.action == "set":
        set_version(ROOT, options.version, options.date)
    check(ROOT, options.version)
    print(f"copsense {options.version}, {dict(released(ROOT))[options.version]}, everywhere")


if __name__ == "__main__":
    main()
