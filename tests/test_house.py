"""What keeps the house in order: one home for each idea, and the words of the field."""

import ast
import re
from pathlib import Path

import copsense

ROOT = Path(__file__).parents[1]
SOURCE = Path(copsense.__file__).parent

# What solves programs, and the one module that calls it.
SOLVERS = {"linprog", "nnls", "lsq_linear", "milp", "daqp", "quadprog", "osqp"}
QP = SOURCE / "qp.py"

# A dialect that nobody else speaks -> what the field says. "There is no file" is plain English;
# "x is no file" is not.
DIALECT = {
    r"refus(e|es|ed|al|als|ing)\b": "reject",
    r"(tell|tells|told)\b(?!.{0,60}\b(apart|from)\b)": "say, show, report",
    r"(mend|mends|mended)\b": "fix",
    r"anew\b": "again",
    r"kin\b": "name them",
    r"(whoever|nobody)\b": "the caller, no one",
    r"(gives?|gave|giving) way\b": "yield",
    r"clear path\b": "reference",
    r"(wrench|control) laws?\b": "policy",
    r"(?<!there )(is|are) no (?!longer|more|less|one\b|way\b|need\b|such\b|other\b)[a-z]+": "not a",
}
PAGES = sorted(
    path
    for path in [*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md")]
    if path.name not in ("names.md",)
)


def texts(path):
    """Docstrings, strings and comments of a module, or the paragraphs of a page."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return text.split("\n\n")
    nodes = (n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant))
    found = [n.value for n in nodes if isinstance(n.value, str) and " " in n.value]
    return found + re.findall(r"# (.*)", text)


def test_one_module_calls_the_solvers():
    for path in SOURCE.rglob("*.py"):
        tree = ast.parse(path.read_text("utf-8"))
        names = {
            alias.name for n in ast.walk(tree) if isinstance(n, ast.Import) for alias in n.names
        }
        names |= {
            alias.name
            for n in ast.walk(tree)
            if isinstance(n, ast.ImportFrom)
            for alias in n.names
            if (n.module or "").split(".")[0] in ("scipy", "daqp")
        }
        names |= {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
        assert path == QP or not names & SOLVERS, path


def test_source_and_pages_speak_the_fields_words():
    found = []
    for path in [*SOURCE.rglob("*.py"), *PAGES]:
        for text in (" ".join(each.split()) for each in texts(path)):
            for pattern, rather in DIALECT.items():
                for match in re.finditer(rf"\b{pattern}", text, re.IGNORECASE):
                    around = text[max(match.start() - 40, 0) : match.end() + 40]
                    found.append(f"{path.relative_to(ROOT)}: rather {rather}: ... {around} ...")
    assert not found, "\n".join(found)
