from __future__ import annotations

import math

import pytest

from copsense.errors import InvalidInputError
from copsense.paper import (
    FOUR_BAR_CLAIMS,
    CheckedClaim,
    Claim,
    Finding,
    FourBar,
    Verdict,
    evaluate_claims,
    evaluate_four_bar_claims,
    judge,
)

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
    "eq-29": (HOLDS_IF, None),
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
    "diverges-at-14-deg": (DOES_NOT_HOLD, math.degrees(math.asin(0.14 / 0.375))),
    "divergence-is-unloading": (HOLDS, None),
    "divergent-foot": (HOLDS, 1.0),
    "cops-follow-com": (HOLDS_IF, None),
    # (1/2) / (4 / (d² + 4))
    "flat-at-centre": (HOLDS_IF, (0.14**2 + 4) / 8),
    "flat-on-support": (HOLDS_IF, None),
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
    identifiers = [row.claim.identifier for row in FOUR_BAR_CLAIMS]
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
        if row.verdict is HOLDS_IF:
            assert "Condition: " in row.explanation or "; at kappa = 3/5" in row.explanation


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


def test_divergence_at_14_degrees_holds_on_a_linkage_narrow_enough():
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


def test_claims_on_a_linkage_that_cannot_unload_a_foot_are_refused():
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
def test_a_number_that_decides_nothing_is_refused(number):
    with pytest.raises(InvalidInputError, match="finite"):
        Finding(HOLDS, number, "1", "")


def test_a_table_of_claims_takes_any_subject():
    claim = Claim("short", "here", "It is short.")
    table = [
        CheckedClaim(claim, lambda text: Finding(judge(len(text) < 3), float(len(text)), "1", ""))
    ]
    (row,) = evaluate_claims(table, "long enough")
    assert (row.claim, row.verdict, row.number) == (claim, DOES_NOT_HOLD, 11.0)
