from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from copsense.errors import InvalidInputError
from copsense.paper import claims
from copsense.paper.claims import (
    FOUR_BAR_CLAIMS,
    Finding,
    Verdict,
    claim,
    evaluate_claims,
    evaluate_four_bar_claims,
    judge,
)
from copsense.paper.closed_form import FourBar, solve_four_bar

HOLDS, HOLDS_IF, DOES_NOT_HOLD = Verdict.HOLDS, Verdict.HOLDS_IF, Verdict.DOES_NOT_HOLD

# With the paper's lengths and masses; the number where theory gives it in closed form.
PUBLISHED = {
    "cop-is-gcom": (HOLDS, 0.0),
    "one-freedom": (HOLDS, 1.0),
    "hyperstatic": (HOLDS, 3.0),
    "full-row-rank": (HOLDS_IF, 5.0),
    "inverse-mass": (HOLDS_IF, 5.0),
    # sin(xi) at 0.95 of the way to a foot
    "chart": (HOLDS, math.sqrt(1 - (0.95 * 0.07 / 0.375) ** 2)),
    "feet-stay": (HOLDS, 0.0),
    "metric": (HOLDS, 2 / (1 + 0.07**2)),
    "column-rank": (HOLDS, 0.0),
    "eq-28": (HOLDS, 0.0),
    "eq-15": (HOLDS_IF, 0.2),
    "eq-16": (HOLDS_IF, None),
    "appendix-a-cop": (HOLDS_IF, None),
    "eq-16-derives": (HOLDS, 0.0),
    "eq-17": (HOLDS, 0.0),
    "eq-18": (DOES_NOT_HOLD, None),
    "one-hand": (DOES_NOT_HOLD, None),
    "eq-29": (DOES_NOT_HOLD, None),
    "eq-31": (HOLDS, 0.0),
    "eq-31-specialises": (HOLDS, 0.0),
    "eq-32": (DOES_NOT_HOLD, None),
    "eq-33": (DOES_NOT_HOLD, None),
    "eq-18-derives": (HOLDS, 0.0),
    "lemma-3": (HOLDS_IF, None),
    # a/2 with a = d²/(d² + 4)
    "constant-force": (HOLDS_IF, 0.14**2 / (0.14**2 + 4) / 2),
    "force-varies": (HOLDS, 0.5),
    "whole-weight": (DOES_NOT_HOLD, 0.75),
    "null-force": (DOES_NOT_HOLD, 0.25),
    "tends-to-zero": (HOLDS_IF, 0.14),
    "diverges-at-14-deg": (HOLDS_IF, math.degrees(math.asin(0.14 / 0.375))),
    "divergence-is-unloading": (HOLDS, None),
    "divergent-foot": (HOLDS, 1.0),
    "cops-follow-com": (HOLDS_IF, None),
    # (1/2) / (4 / (d² + 4))
    "flat-at-centre": (HOLDS_IF, (0.14**2 + 4) / 8),
    # the same: the supremum is at the centre
    "flat-on-support": (HOLDS_IF, (0.14**2 + 4) / 8),
    "sensitivity-decreases": (HOLDS, None),
    "smaller-variation": (HOLDS_IF, None),
    "lower-sensitivity": (HOLDS_IF, 0.293),
}


def evaluated(four_bar):
    return {row.claim.identifier: row for row in evaluate_four_bar_claims(four_bar)}


@pytest.fixture(scope="module")
def published():
    return evaluated(FourBar())


def test_every_claim_is_listed_once(published):
    identifiers = [row.identifier for row in FOUR_BAR_CLAIMS]
    assert len(set(identifiers)) == len(identifiers)
    assert set(identifiers) == set(PUBLISHED)


@pytest.mark.parametrize("identifier", PUBLISHED)
def test_verdict_and_number_on_the_papers_linkage(identifier, published):
    verdict, number = PUBLISHED[identifier]
    row = published[identifier]
    assert row.verdict is verdict, row.explanation
    if number is not None:
        assert row.number == pytest.approx(number, rel=2e-3, abs=1e-8)


def test_every_condition_is_stated(published):
    for row in published.values():
        assert bool(row.condition) == (row.verdict is HOLDS_IF)


@pytest.mark.parametrize("identifier", ["eq-15", "eq-16", "appendix-a-cop"])
def test_a_condition_that_contradicts_the_lemma_says_so(identifier, published):
    condition = published[identifier].condition
    assert condition.startswith("kappa = 3/5")
    assert "contradicts the lemma's own Hypothesis 1-iii, kappa = 3/4" in condition


def test_a_correction_is_not_a_condition(published):
    """Eqs. (29) and (32) come right with another row and another letter: neither holds."""
    for identifier in ("eq-29", "eq-32"):
        assert published[identifier].verdict is DOES_NOT_HOLD


def test_the_14_degrees_hold_for_a_rod_that_is_not_printed(published):
    assert published["diverges-at-14-deg"].condition.startswith("d/l = 0.181")


def test_no_column_rank_follows_from_more_rows(published):
    assert "not because of the rows" in published["column-rank"].explanation


def test_the_largest_ratio_on_the_loaded_foot_is_a_supremum(published):
    """It was the value at the first sample of a grid once, 0.4785."""
    four_bar = FourBar()
    ratios = []
    for u in np.linspace(0.001, 0.5, 100) * four_bar.rod_length:
        xi = four_bar.angle_at(u)
        torque, wrench = (
            solve_four_bar(four_bar, xi, name).cop_per_com[1]
            for name in ("minimum-torque", "minimum-wrench")
        )
        ratios.append(torque / wrench)
    number = published["flat-on-support"].number
    assert max(ratios) < number == pytest.approx(max(ratios), rel=3e-3)


def test_a_statement_stands_once_in_the_source():
    """Claims that share a sentence, on the four-bar and on the iCub, share it by reference."""
    folder = Path(claims.__file__).parent
    source = "".join(path.read_text("utf-8") for path in folder.glob("*.py"))
    statements = re.findall(r'@claim\(\s*"[^"]+",\s*"[^"]+",\s*"([^"]+)"', source)
    assert len(statements) > 20
    assert len(statements) == len(set(statements))


def test_unloaded_foot_turns_more_sensitive_beyond_0_293_d(published):
    # small d: 1 - 1/sqrt(2)
    assert published["lower-sensitivity"].number == pytest.approx(1 - math.sqrt(0.5), rel=2e-3)


def test_lemma_1_holds_as_printed_once_the_rod_weighs_half_a_leg():
    rows = evaluated(FourBar(leg_mass=13.2, body_mass=6.6))
    assert rows["eq-15"].verdict is HOLDS
    assert rows["eq-16"].verdict is HOLDS
    assert rows["eq-17"].verdict is HOLDS_IF  # its numbers are those of kappa = 3/4
    assert rows["eq-18"].verdict is DOES_NOT_HOLD
    assert rows["eq-31"].verdict is HOLDS


def test_divergence_at_14_degrees_holds_outright_on_a_linkage_narrow_enough():
    rows = evaluated(FourBar(rod_length=0.1814 * 0.5))
    assert rows["diverges-at-14-deg"].verdict is HOLDS
    assert rows["diverges-at-14-deg"].number == pytest.approx(14.0, abs=0.01)


def test_criterion_2_is_the_more_sensitive_one_on_feet_further_apart_than_2_m():
    rows = evaluated(FourBar(leg_length=8.0, rod_length=3.0))
    for identifier in ("flat-at-centre", "flat-on-support", "lower-sensitivity"):
        assert rows[identifier].verdict is DOES_NOT_HOLD
    for identifier in ("constant-force", "cops-follow-com", "force-varies"):
        assert rows[identifier].verdict is DOES_NOT_HOLD


def test_at_exactly_2_m_the_two_criteria_are_equally_sensitive():
    rows = evaluated(FourBar(leg_length=8.0, rod_length=2.0))
    assert rows["flat-at-centre"].number == pytest.approx(1.0)
    assert rows["lower-sensitivity"].verdict is DOES_NOT_HOLD


def test_claims_on_a_linkage_that_cannot_unload_a_foot_are_rejected():
    with pytest.raises(InvalidInputError, match="cannot travel"):
        evaluate_four_bar_claims(FourBar(rod_length=0.375))


@pytest.mark.parametrize(
    ("as_stated", "under_condition", "verdict"),
    [
        (True, True, HOLDS),
        (True, False, HOLDS),
        (False, True, HOLDS_IF),
        (False, False, DOES_NOT_HOLD),
    ],
)
def test_judge_is_a_truth_table(as_stated, under_condition, verdict):
    assert judge(as_stated, under_condition) is verdict


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_number_that_decides_nothing_is_rejected(number):
    with pytest.raises(InvalidInputError, match="finite"):
        Finding(HOLDS, number, "1", "")


def test_a_finding_that_holds_under_a_condition_must_name_it():
    with pytest.raises(InvalidInputError, match="must name it"):
        Finding(HOLDS_IF, 1.0, "1", "what it is")


def test_a_table_of_claims_takes_any_subject_and_a_statement_can_be_judged_again():
    @claim("short", "here", "It is short.")
    def short(text):
        return Finding(judge(len(text) < 3), len(text), "1", "its length")

    @short.again("few")
    def few(items):
        return Finding(judge(len(items) < 3), len(items), "1", "their number")

    (row,) = evaluate_claims([short], "long enough")
    assert (row.claim, row.verdict, row.number) == (short, DOES_NOT_HOLD, 11.0)
    assert (few.where, few.statement) == (short.where, short.statement)
    (row,) = evaluate_claims([few], [1])
    assert (row.claim.identifier, row.verdict) == ("few", HOLDS)
