"""A bisection brackets where something breaks, in few steps."""

import math

import numpy as np
import pytest

from copsense.comparison.bisection import bisect
from copsense.errors import InvalidInputError


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
