"""What a release gives out agrees with itself: versions, requirements, the package page."""

import json
import re
import runpy
import shutil
import tomllib
from pathlib import Path

import pytest

from copsense import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
RELEASE = runpy.run_path(str(ROOT / "tools" / "release.py"))
# What conda-forge calls the Python part of a package.
CONDA = {"coal": "coal-python", "pin": "pinocchio-python"}
LINK = re.compile(r"!?\[[^\]]*\]\((?!https?://|#)[^)]+\)")


def test_every_place_gives_the_version():
    assert set(RELEASE["found"](ROOT).values()) == {__version__}


def copy_of_places(folder):
    for name in (*RELEASE["PLACES"], "CHANGELOG.md"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder


def test_a_release_dates_the_changelog_and_gives_every_place_its_version(tmp_path):
    root = copy_of_places(tmp_path)
    (root / "CHANGELOG.md").write_text("# Changelog\n\n## [Unreleased]\n\n### Added\n\n- More.\n")
    with pytest.raises(SystemExit, match=r"9\.8\.7\.md is missing"):
        RELEASE["set_version"](root, "9.8.7", "2031-02-03")
    assert set(RELEASE["found"](root).values()) == {__version__}
    (root / "docs" / "releases").mkdir(parents=True)
    (root / "docs" / "releases" / "9.8.7.md").touch()
    RELEASE["set_version"](root, "9.8.7", "2031-02-03")
    RELEASE["check"](root, "9.8.7")
    assert "\n## [Unreleased]\n\n## [9.8.7] - 2031-02-03\n\n### Added\n" in (
        root / "CHANGELOG.md"
    ).read_text("utf-8")
    assert "\ndate-released: 2031-02-03\n" in (root / "CITATION.cff").read_text("utf-8")
    with pytest.raises(SystemExit, match=r"a section 9\.8\.7 already"):
        RELEASE["set_version"](root, "9.8.7", "2031-02-04")
    (root / "CITATION.cff").write_text("version: 9.8.6\n")
    with pytest.raises(SystemExit, match=r"CITATION\.cff says 9\.8\.6, not 9\.8\.7"):
        RELEASE["check"](root, "9.8.7")


def test_the_package_page_has_no_link_to_a_file():
    hook = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    page = (ROOT / "README.md").read_text("utf-8")
    assert LINK.search(page)
    for each in hook["substitutions"]:
        page = re.sub(each["pattern"], each["replacement"], page)
    assert not LINK.findall(page)


def test_the_conda_recipe_requires_what_the_wheel_requires():
    recipe = (ROOT / "recipe" / "recipe.yaml").read_text("utf-8")
    run = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    required = [line.strip("- ").replace(" ", "", 1) for line in run.splitlines()][1:]
    wheel = [re.match(r"[\w-]+", need)[0] for need in PROJECT["project"]["dependencies"]]
    wanted = [
        need.replace(name, CONDA.get(name, name), 1)
        for name, need in zip(wheel, PROJECT["project"]["dependencies"], strict=True)
    ]
    assert required == wanted


def test_citation_zenodo_and_metadata_name_the_same_authors_and_licence():
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    authors = citation.partition("\nauthors:\n")[2].partition("\nreferences:")[0]
    names = re.findall(r"^  - name: (.+)$", authors, re.MULTILINE)
    zenodo = json.loads((ROOT / ".zenodo.json").read_text("utf-8"))
    assert names == [each["name"] for each in zenodo["creators"]]
    assert names == [each["name"] for each in PROJECT["project"]["authors"]]
    assert f"\nlicense: {zenodo['license']}\n" in citation
    assert zenodo["license"] == PROJECT["project"]["license"]
    assert f'title: "{zenodo["title"]}"' in citation
