"""Formulas of the built pages: MathML that a browser sets as it was meant."""

import html
import re
import runpy
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Element -> how many parts it has; with another number a browser shows an error or nothing.
PARTS = {"mfrac": 2, "msub": 2, "msup": 2, "munder": 2, "mover": 2, "mroot": 2}
PARTS |= {"msubsup": 3, "munderover": 3}


def formulas(page):
    """The formulas of a page, as trees without their namespace."""
    for text in re.findall(r"<math\b.*?</math>", page.read_text("utf-8"), re.DOTALL):
        text = re.sub(r'\sxmlns="[^"]*"', "", text)
        text = re.sub(r"&(?!amp;|lt;|gt;)\w+;", lambda entity: html.unescape(entity[0]), text)
        yield ElementTree.fromstring(text)


def flaws(formula):
    """What is wrong with a formula."""
    for element in formula.iter():
        wanted = PARTS.get(element.tag, len(element))
        if len(element) != wanted:
            yield f"{element.tag} of {len(element)} parts, not {wanted}"
        if element.tag == "merror" or "\\" in (element.text or ""):
            yield f"a macro that is not read: {''.join(element.itertext())}"


def test_formulas_of_every_page_are_whole(built):
    seen = 0
    for page in built.rglob("*.html"):
        for formula in formulas(page):
            seen += 1
            assert not list(flaws(formula)), (page.name, "".join(formula.itertext()))
    assert seen > 200


def test_the_quadratic_programme_has_a_half_and_not_twelve(built):
    shown = [f for f in formulas(built / "theory.html") if "f⊤Hf" in bare(f)]
    assert shown
    halves = [[bare(part) for part in fraction] for f in shown for fraction in f.iter("mfrac")]
    assert halves == [["1", "2"]] * len(shown)


def bare(element):
    """What a formula shows, without spaces."""
    return "".join("".join(element.itertext()).split())


@pytest.mark.parametrize(
    ("tex", "clear"),
    [
        (r"\tfrac12 f", False),
        (r"\frac 12", False),
        (r"x^10", False),
        (r"\sqrt 20", False),
        (r"\nosuchmacro x", False),
        (r"\tfrac{1}{2} f^{10} + x_2^2 \sqrt2", True),
    ],
)
def test_what_tex_and_docutils_read_differently_is_a_warning(tex, clear, monkeypatch):
    pytest.importorskip("sphinx")
    from docutils import nodes

    conf = runpy.run_path(str(ROOT / "docs" / "conf.py"))
    said = []
    monkeypatch.setattr(conf["logger"], "warning", lambda text, *args, **_: said.append(text))
    conf["as_mathml"](nodes.math(tex, tex), as_block=False)
    assert (not said) == clear
