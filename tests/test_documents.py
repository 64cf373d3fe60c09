"""Code shown is code run: here or when the documentation is built."""

import ast
import json
import pkgutil
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.commands import copsense
from support.fences import blocks, commands

from copsense.batch.machine_code import COMPILING_TAKES

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_every_class_says_what_it_is():
    bare = [
        f"{path.name}: {node.name}"
        for path in (ROOT / "src").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.ClassDef) and not ast.get_docstring(node)
    ]
    assert not bare


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_asserts_a_number_and_draws(example):
    # `make docs` runs each, and fails where an assertion does: once is enough.
    code = ast.parse(example.read_text("utf-8"))
    assert any(isinstance(node, ast.Assert) for node in code.body)
    drawn = [name.id for node in code.body for name in ast.walk(node) if isinstance(name, ast.Name)]
    assert "figure" in drawn or "show" in example.read_text("utf-8")


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_asserts_a_number_and_holds_no_outputs(notebook):
    # `make docs` runs each, and fails where a cell does. Jupyter: Edit, Clear Outputs of All Cells.
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert any("assert " in "".join(cell["source"]) for cell in code)
    index = (notebook.parent / "index.md").read_text("utf-8")
    assert index.count(notebook.name) == 3, "the notebook stands in the list of index.md"


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/adding.md",
        "docs/balancing.md",
        "docs/explore.md",
        "docs/hardware.md",
        "docs/learning.md",
        "docs/logs.md",
        "docs/maps.md",
        "docs/optimise.md",
        "docs/postures.md",
        "docs/uncertainty.md",
    ],
)
def test_snippets_of_a_page_run_from_top_to_bottom(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    snippets = blocks(ROOT / page, "python")
    assert snippets
    exec(compile("\n".join(snippets), page, "exec"), {"__name__": "snippet"})
    if page == "README.md":
        shown, drawn = (
            np.asarray(Image.open(at / "icub.png").convert("RGB"), dtype=float)
            for at in (ROOT / "docs" / "images", tmp_path)
        )
        assert np.abs(shown - drawn).mean() < 0.1  # of 255: the picture is what the lines make


def test_commands_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [
        line for line in commands(ROOT / "README.md", "console") if line.startswith("copsense")
    ]
    assert lines
    for command in lines:
        done = copsense(*shlex.split(command)[1:])
        assert done.code == 0, f"{command}\n{done.err}"


def new_names():
    """Dotted names of today in the table of names that changed."""
    rows = (ROOT / "docs" / "names.md").read_text("utf-8").splitlines()
    cells = [row.strip("|").split("|") for row in rows if row.startswith("| ")]
    assert all(len(pair) == 2 for pair in cells)
    return sorted({name for pair in cells for name in re.findall(r"copsense(?:\.\w+)+", pair[1])})


def test_names_that_changed_lead_to_names_of_today():
    names = new_names()
    assert len(names) > 100
    missing = []
    for name in names:
        try:
            pkgutil.resolve_name(name)
        except (ImportError, AttributeError):
            missing.append(name)
    assert not missing


def test_tables_of_the_paper_give_what_the_benchmarks_pages_give():
    paper = (ROOT / "paper" / "paper.md").read_text("utf-8")
    tables = re.findall(r"`python benchmarks/(\w+)\.py`:\n\n((?:\|.*\n)+)", paper)
    assert len(tables) == 2
    for name, table in tables:
        page = (ROOT / "benchmarks" / f"{name}.md").read_text("utf-8")
        known = set(re.findall(r"[\d.]*\d", page))
        for number in re.findall(r"[\d.]*\d", table):
            assert number in known, f"paper.md gives {number}, benchmarks/{name}.md does not"


def test_questions_say_how_long_compiling_takes_as_messages_do():
    assert COMPILING_TAKES in " ".join((ROOT / "docs" / "faq.md").read_text("utf-8").split())


def test_the_paper_cites_what_its_bibliography_holds():
    paper = (ROOT / "paper" / "paper.md").read_text("utf-8").partition("\n---\n")[2]
    entries = re.findall(r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(), re.MULTILINE)
    assert set(re.findall(r"@(\w+)", paper)) == set(entries)
