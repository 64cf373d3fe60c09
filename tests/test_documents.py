"""Code shown is code run: here or when the documentation is built."""

import ast
import json
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.commands import copsense
from support.fences import blocks, commands
from support.sessions import Reader, steps

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
        "docs/adding.md",
        "docs/balancing.md",
        "docs/drives.md",
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


def run(*arguments):
    done = copsense(*arguments, together=True)
    return done.code, done.out


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """The folder of someone who did what the README says, from top to bottom."""
    # What a command or block writes is there for those below it, and in their way.
    folder, page = tmp_path_factory.mktemp("readme"), ROOT / "README.md"
    typed = set(commands(page, "console"))  # an sh block needs files of the reader's own
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        reader = Reader(folder, run)
        for step in steps(page):
            if step.kind == "python" or step.text in typed:
                reader.follow(step)
                typed.discard(step.text)
    assert not typed, "these are commands of the page, and were not typed"
    return folder


def test_the_readme_runs_as_it_stands_in_one_folder(read):
    shown, drawn = (
        np.asarray(Image.open(at / "icub.png").convert("RGB"), dtype=float)
        for at in (ROOT / "docs" / "images", read)
    )
    assert np.abs(shown - drawn).mean() < 0.1  # of 255: the picture is what the lines make


def test_what_the_tutorial_asks_a_map_is_answered_by_the_readmes(read, monkeypatch):
    # The same coordinates and ranges as the tutorial's own map, and there already.
    monkeypatch.chdir(read)
    page = ROOT / "docs" / "tutorials" / "million_postures.md"
    asked = [step.text for step in steps(page) if step.kind == "python"]
    assert len(asked) == 2
    exec(compile("\n".join(asked), page.name, "exec"), {"__name__": "page"})


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
