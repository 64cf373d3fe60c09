"""What keeps the house in order: one module that calls solvers, and the words of the field."""

import ast
import re
from pathlib import Path

import pytest

import copsense

ROOT = Path(__file__).parents[1]
SOURCE = Path(copsense.__file__).parent
PAGES = [p for p in [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")] if p.name != "names.md"]

# What solves programs; polynomials, simplex searches and one-dimensional fits are not meant.
SOLVERS = {"linprog", "nnls", "lsq_linear", "milp", "daqp"}
QP = SOURCE / "qp.py"

# A dialect of our own -> what the field says. "There is no file" is plain English; "x is no file"
# is not.
DIALECT = {
    r"refus(?:e|es|ed|al|als|ing)": "reject",
    r"(?:tell|tells|told)\b(?!.{0,60}\b(?:apart|from)\b)": "say, show, report",
    r"(?:mend|mends|mended)": "fix",
    r"anew": "again",
    r"kin": "name them",
    r"(?:whoever|nobody)": "the caller, no one",
    r"(?:gives?|gave|giving) way": "yield",
    r"clear path": "reference",
    r"(?:wrench|control) laws?": "policy",
    r"(?<!there )(?:is|are) no (?!longer|more|less|(?:one|way|need|such|other)\b)[a-z]+": "not a",
}
# Keywords of Python alone that are called as an option is that asks for something else.
OTHER_WORDS = {"frame", "gains", "robot", "within"}
WORDS = re.compile(r"\b(?:" + "|".join(f"({pattern})" for pattern in DIALECT) + r")\b", re.I)


@pytest.fixture(scope="module")
def modules():
    return {path: path.read_text("utf-8") for path in SOURCE.rglob("*.py")}


def strings(source):
    """Docstrings, messages and comments of a module."""
    nodes = (n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Constant))
    return [n.value for n in nodes if isinstance(n.value, str) and " " in n.value] + re.findall(
        r"# (.*)", source
    )


def paragraphs(page):
    """The prose of a page, without its code."""
    plain = re.sub(r"^```.*?^```", "", page, flags=re.DOTALL | re.MULTILINE)
    return [re.sub("`[^`]*`", "", p) for p in re.split(r"\n\s*\n|\n(?=[-|] )", plain)]


def test_one_module_calls_the_solvers(modules):
    for path, source in modules.items():
        called = SOLVERS & set(re.findall(r"\b(?:import |\.)(\w+)", source))
        assert path == QP or not called, path
    assert {"daqp", "linprog", "nnls"} <= set(re.findall(r"\bimport (\w+)", modules[QP]))


def test_source_and_pages_speak_the_words_of_the_field(modules):
    texts = [(path, text) for path, source in modules.items() for text in strings(source)]
    texts += [(path, text) for path in PAGES for text in paragraphs(path.read_text("utf-8"))]
    found = []
    for path, text in texts:
        line = " ".join(text.split())
        for match in WORDS.finditer(line):
            rather = list(DIALECT.values())[match.lastindex - 1]
            around = line[max(match.start() - 40, 0) : match.end() + 40]
            found.append(f"{path.relative_to(ROOT)}: rather {rather}: ... {around} ...")
    assert not found, "\n".join(found)


def messages(source):
    """Texts of a module that are shown, f-strings whole; docstrings left out."""
    nodes = list(ast.walk(ast.parse(source)))
    bodies = [
        n.body[0] for n in nodes if isinstance(n, ast.Module | ast.FunctionDef | ast.ClassDef)
    ]
    apart = {id(n.value) for n in bodies if isinstance(n, ast.Expr)}
    apart |= {id(v) for n in nodes if isinstance(n, ast.JoinedStr) for v in n.values}
    for node in nodes:
        if id(node) not in apart and isinstance(node, ast.JoinedStr | ast.Constant):
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            yield "".join(str(p.value) if isinstance(p, ast.Constant) else "..." for p in parts)


def test_a_remedy_in_python_names_the_option_that_does_the_same(modules):
    cli = [source for path, source in modules.items() if path.parent.name == "cli"]
    options = {o for source in cli for o in re.findall(r'"--([a-z-]+)"', source)}
    one_sided = []
    for path, source in modules.items():
        for text in messages(source):
            for keyword in set(
                re.findall(r"(?<![\w-])([a-z_]+)=(?=[\[('\"{ ,;)]|\.(?!\.)|[A-Z]\w)", text)
            ):
                name = keyword.replace("_", "-")
                same = (
                    options & {name, name.removesuffix("s")} if keyword not in OTHER_WORDS else ()
                )
                if same and not any(f"--{option}" in text for option in same):
                    one_sided.append(f"{path.relative_to(ROOT)}: {keyword}= in {text!r}")
            if "tie_break such" in text and "--criterion" not in text:
                one_sided.append(f"{path.relative_to(ROOT)}: {text!r}")
    assert not one_sided, "\n".join(one_sided)


def test_a_script_reads_its_arguments_before_it_works():
    scripts = [*(ROOT / "tools").glob("*.py"), *(ROOT / "benchmarks").glob("*.py")]
    sources = {path.name: path.read_text("utf-8") for path in scripts}
    assert len(sources) > 10
    deaf = [
        name
        for name, source in sources.items()
        if "\ndef main(" in source and "argparse" not in source and "sys.argv" not in source
    ]
    assert not deaf, "these ignore --help, and write what they write"
