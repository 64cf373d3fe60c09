"""Every formula that the errata give is evaluated and compared with what it stands for."""

import math
import re

import pytest

from copsense.errors import InvalidInputError
from copsense.paper.closed_form.dimensions import FourBar
from copsense.paper.errata import ERRATA, Formula
from copsense.paper.errata.erratum import FORMULA
from copsense.paper.errata.quantities import letters

LINKAGES = [FourBar(), FourBar(0.9, 0.3, 2.0, 11.0, 3.7), FourBar(0.4, 0.1, 5.0, 1.0)]
ANGLES = [1.3, math.pi / 2 - 1e-3, 1.75]

FORMULAS = [
    pytest.param(erratum.equation, formula, quantity, id=f"{erratum.equation}: {formula.text}")
    for erratum in ERRATA
    for formula, quantity in erratum.formulas
]


@pytest.mark.parametrize(("equation", "formula", "quantity"), FORMULAS)
def test_a_formula_of_the_errata_is_what_it_stands_for(equation, formula, quantity):
    for four_bar in LINKAGES:
        for xi in ANGLES:
            for side in (-1, 1):
                given = formula.evaluate(letters(four_bar, xi), side)
                assert given == pytest.approx(quantity(four_bar, xi, side), rel=1e-9, abs=1e-12)


def test_no_formula_is_left_without_a_quantity():
    """What looks like a formula of lengths and masses stands between dollar signs."""
    looks = re.compile(r"kappa l|\bl [cds]\b|²|/ \(\d")
    for erratum in ERRATA:
        for text in (erratum.printed_text, erratum.holding_text):
            assert not looks.search(FORMULA.sub("", text)), (erratum.equation, text)
    assert len(FORMULAS) >= 19


def test_an_erratum_off_by_a_factor_of_two_is_found():
    """The one that stood here once: Appendix A with 2 kappa l c."""
    (erratum,) = [e for e in ERRATA if e.equation == "Appendix A, SCoP"]
    wrong = Formula("2 kappa l c / (d² + 4 ± 2 kappa l d c)")
    four_bar, xi = FourBar(), 1.3
    (quantity,) = erratum.holding_quantities
    given = wrong.evaluate(letters(four_bar, xi), 1)
    assert given == pytest.approx(quantity(four_bar, xi, 1) / 2)


@pytest.mark.parametrize(
    ("text", "value", "latex"),
    [
        ("2 a b / (a + b)", 2.4, r"\frac{2 a b}{a + b}"),
        ("-a² ± b", 1.0 - 4.0 + 2.0, r"-a^2 \pm b"),
        ("±b ∓ a", 1.0, r"\pm b \mp a"),
        ("(a + 1)²/ b", 3.0, r"\frac{(a + 1)^2}{b}"),
        ("(a + 1) / b", 1.0, r"\frac{a + 1}{b}"),
        ("1.5 kappa c3 m_l", 1.5 * 4 * 5 * 6, r"1.5 \kappa c_{3} m_{l}"),
    ],
)
def test_a_formula_has_its_value_and_its_latex(text, value, latex):
    formula = Formula(text)
    known = {"a": 2.0, "b": 3.0, "kappa": 4.0, "c3": 5.0, "m_l": 6.0}
    assert formula.evaluate(known) == pytest.approx(value)
    assert formula.latex == latex


def test_the_lower_sign_is_the_other_sides():
    assert Formula("1 ± 2").evaluate({}, side=-1) == -1.0
    assert Formula("1 ∓ 2").evaluate({}, side=-1) == 3.0


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a / b c", "in brackets"),
        ("a / b / c", "in brackets"),
        ("(a + b", "not closed"),
        ("a +", "missing"),
        ("a ) b", "left over"),
        ("a * b", "not part"),
        ("z", "'z' is not one of a"),
        ("", "missing"),
    ],
)
def test_what_is_not_a_formula_is_rejected(text, why):
    with pytest.raises(InvalidInputError, match=re.escape(why)):
        Formula(text).evaluate({"a": 1.0, "b": 1.0, "c": 1.0})
