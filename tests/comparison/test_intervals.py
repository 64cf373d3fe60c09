"""Intervals and bisection, against closed forms and another implementation."""

import math

import numpy as np
import pytest
from scipy import stats

from copsense.comparison import fisher_interval, wilson_interval
from copsense.comparison.intervals import bisect
from copsense.errors import InvalidInputError


@pytest.mark.parametrize(("hits", "count"), [(0, 5), (1, 7), (10, 20), (19, 20), (20, 20)])
def test_a_rate_has_wilsons_interval(hits, count):
    expected = stats.binomtest(hits, count).proportion_ci(method="wilson")
    assert wilson_interval(hits, count) == pytest.approx(tuple(expected), abs=1e-12)


def test_a_rate_of_nothing_may_be_anything():
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_a_correlation_has_fishers_interval():
    random = np.random.default_rng(3)
    for count in (4, 11, 60):
        x = random.standard_normal(count)
        y = 0.8 * x + random.standard_normal(count)
        expected = stats.pearsonr(x, y)
        interval = expected.confidence_interval(0.95)
        assert fisher_interval(expected.statistic, count) == pytest.approx(tuple(interval))
    assert all(math.isnan(end) for end in fisher_interval(0.9, 3))
    assert fisher_interval(1.0, 5) == (1.0, 1.0)


@pytest.mark.parametrize(("mild", "severe"), [(0.0, 10.0), (10.0, 0.0), (-3.0, 4.05)])
def test_a_bisection_brackets_where_it_breaks(mild, severe):
    step = 0.1
    for threshold in np.random.default_rng(1).uniform(*sorted((mild, severe)), 20):
        asked = []

        def survives(value, threshold=threshold, asked=asked):
            asked.append(value)
            return abs(value - mild) <= abs(threshold - mild)

        found = bisect(survives, mild, severe, step)
        low, high = found.ends
        assert low <= threshold <= high
        assert high - low <= step * 1.0001
        assert found.runs == len(asked) <= 2 + math.ceil(math.log2(abs(severe - mild) / step))
        assert len(set(asked)) == len(asked)


def test_a_bisection_is_no_finer_than_a_millionth():
    with pytest.raises(InvalidInputError, match="finer than any"):
        bisect(lambda value: value < 0.5, 0.0, 1.0, 1e-300)


def test_a_bisection_says_where_nothing_breaks_and_where_everything_does():
    never, always = bisect(lambda _: True, 0.0, 1.0, 0.1), bisect(lambda _: False, 0.0, 1.0, 0.1)
    assert (never.survived, never.runs) == (1.0, 1)
    assert math.isnan(never.failed)
    assert always.failed == 0.0
    assert math.isnan(always.survived)
