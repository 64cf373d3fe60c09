"""What a table says: ranks as far as the scores can tell, and agreement with its interval."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from copsense.comparison import agreement, rank_controllers, rank_scores
from copsense.comparison.score_kinds import SCORES
from copsense.comparison.table import COLUMNS


def row(controller, value, half=0.0, *, score="tip_excursion", status="measured", **more):
    empty = dict.fromkeys(COLUMNS, "")
    numbers = {"predicted": np.nan, "first_order": np.nan, "runs": 1}
    given = {"key": f"{controller}{more}", "controller": controller, "score": score}
    known = {"value": value, "low": value - half, "high": value + half, "status": status}
    return empty | {"unit": SCORES[score].unit} | numbers | given | known | more


def ranks(*rows):
    table = rank_scores(pd.DataFrame(rows))
    return dict(zip(table["controller"], table["rank"], strict=True))


def test_the_farther_lean_and_the_smaller_torque_are_the_better():
    assert ranks(row("a", 0.03), row("b", 0.04), row("c", 0.05)) == {"a": 3, "b": 2, "c": 1}
    torque = [row(n, v, score="torque_norm") for n, v in (("a", 3.0), ("b", 4.0), ("c", 5.0))]
    assert ranks(*torque) == {"a": 1, "b": 2, "c": 3}


def test_within_their_resolution_controllers_share_a_rank():
    assert ranks(row("a", 1.0, 0.2), row("b", 1.3, 0.2), row("c", 2.0, 0.2)) == {
        "a": 2,
        "b": 2,
        "c": 1,
    }


def test_a_bound_counts_as_far_as_it_goes_and_a_failure_comes_last():
    open_end = row("a", np.nan, status="bound") | {"low": 0.07, "high": np.inf}
    found = ranks(open_end, row("b", 0.05), row("c", 0.08), row("d", np.nan, status="failed"))
    assert found == {"a": 1, "b": 3, "c": 1, "d": 4}


def test_where_everything_failed_no_controller_is_ranked():
    rows = [row(name, np.nan, status="failed", posture="p") for name in "ab"]
    rows += [row(name, np.nan, status="none", posture="q") for name in "ab"]
    assert rank_controllers(pd.DataFrame(rows)).empty
    rows += [row("a", 1.0, posture="r"), row("b", np.nan, status="tipped", posture="r")]
    found = rank_controllers(pd.DataFrame(rows)).set_index("controller")
    assert found["wins"].to_dict() == {"a": 1, "b": 0}
    assert found["failures"].to_dict() == {"a": 0, "b": 1}
    assert found["settings"].to_dict() == {"a": 1, "b": 1}


def test_ranks_are_taken_in_each_setting_and_averaged():
    rows = [
        row(name, value, posture=posture)
        for posture, values in (("p", (1.0, 2.0)), ("q", (3.0, 3.0)))
        for name, value in zip("ab", values, strict=True)
    ]
    found = rank_controllers(pd.DataFrame(rows)).set_index("controller")
    assert found["mean_rank"].to_dict() == {"b": 1.0, "a": 1.5}
    assert found["wins"].to_dict() == {"b": 2, "a": 1}
    assert list(found.index) == ["b", "a"]  # the best first
    # A setting in which a controller was not tried compares no one.
    alone = [*rows, row("b", 9.0, posture="r")]
    assert rank_controllers(pd.DataFrame(alone)).set_index("controller")["settings"]["b"] == 2


def test_agreement_is_that_of_another_implementation():
    random = np.random.default_rng(5)
    predicted = random.uniform(0.03, 0.06, 12)
    value = predicted + 1e-3 * random.standard_normal(12)
    rows = [
        row("a", v, predicted=p, first_order=2 * p, posture=str(i))
        for i, (v, p) in enumerate(zip(value, predicted, strict=True))
    ]
    rows += [row("a", np.nan, predicted=0.05, status="failed"), row("b", 0.04)]
    found = agreement(pd.DataFrame(rows)).set_index("prediction").loc["path"]
    expected = stats.pearsonr(value, predicted)
    interval = expected.confidence_interval(0.95)
    assert found["cases"] == 12
    assert found["mean_error"] == pytest.approx(np.abs(value - predicted).mean())
    assert found["largest_error"] == pytest.approx(np.abs(value - predicted).max())
    assert found["correlation"] == pytest.approx(expected.statistic)
    assert (found["low"], found["high"]) == pytest.approx(tuple(interval))


@pytest.mark.parametrize("count", [4, 11, 60])
def test_a_correlation_has_fishers_interval(count):
    random = np.random.default_rng(3)
    x = random.standard_normal(count)
    y = 0.8 * x + random.standard_normal(count)
    rows = [
        row("a", b, predicted=a, posture=str(i)) for i, (a, b) in enumerate(zip(x, y, strict=True))
    ]
    found = agreement(pd.DataFrame(rows)).iloc[0]
    # Fisher 1915: the half width of atanh(r) is 1.96 / sqrt(n - 3).
    z = np.arctanh(found["correlation"])
    half = 1.959963984540054 / np.sqrt(count - 3)
    assert (found["low"], found["high"]) == pytest.approx((np.tanh(z - half), np.tanh(z + half)))


def test_a_perfect_correlation_and_one_of_three_cases_are_said_to_be_so():
    rows = [row("a", float(i), predicted=float(i)) for i in range(5)]
    found = agreement(pd.DataFrame(rows)).iloc[0]
    assert (found["correlation"], found["low"], found["high"]) == pytest.approx((1.0, 1.0, 1.0))
    three = agreement(pd.DataFrame(rows[:3])).iloc[0]
    assert three["correlation"] == pytest.approx(1.0)
    assert np.isnan(three["low"])
    assert np.isnan(three["high"])


def test_values_that_differ_by_rounding_have_no_correlation():
    rows = [row("a", 1.0 + i * 1e-15, predicted=float(i)) for i in range(5)]
    assert np.isnan(agreement(pd.DataFrame(rows)).iloc[0]["correlation"])


def test_a_controller_of_ones_own_follows_a_law_of_its_own():
    rows = [row("a", float(i), predicted=float(i)) for i in range(4)]
    own = json.dumps({"controller": {"source": "mine:make"}})
    rows.append(row("mine", 9.0, predicted=1.0, parameters=own))
    found = agreement(pd.DataFrame(rows)).iloc[0]
    assert (found["cases"], found["largest_error"]) == (4, 0.0)


def test_few_cases_have_no_correlation():
    rows = [row("a", 0.03, predicted=0.03), row("b", 0.04, predicted=0.041)]
    found = agreement(pd.DataFrame(rows)).iloc[0]
    assert found["cases"] == 2
    assert np.isnan(found["correlation"])
    assert agreement(pd.DataFrame([row("a", 0.03)])).empty
