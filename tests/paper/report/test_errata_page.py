"""The documentation's table of errata is generated: every row, with formulas that can be set."""

import re
from pathlib import Path

import pytest

from copsense.paper.errata import ERRATA
from copsense.paper.report import errata_markdown

ROOT = Path(__file__).parents[3]


def test_the_table_has_a_row_for_each_erratum():
    head, rule, *rows = errata_markdown().splitlines()
    columns = len(re.findall(r"(?<!\\)\|", head))
    assert rule == "|---|---|---|---|"
    assert len(rows) == len(ERRATA)
    assert all(len(re.findall(r"(?<!\\)\|", row)) == columns for row in rows)


def test_the_formulas_of_the_table_can_be_set():
    tex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    formulas = re.findall(r"\$([^$]+)\$", errata_markdown())
    assert len(formulas) == sum(len(erratum.formulas) for erratum in ERRATA)
    for formula in formulas:
        assert tex2mathml(formula).startswith("<math")


def test_the_page_has_one_place_for_what_is_generated():
    page = (ROOT / "docs" / "errata.md").read_text("utf-8")
    for name in ("errata table", "standard of verdicts"):
        assert len(re.findall(rf"^% {name}: ", page, flags=re.MULTILINE)) == 1
    assert r"\tfrac1" not in page  # docutils reads only braces
