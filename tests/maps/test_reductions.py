"""What a map comes to: exact, and the same however its parts were folded."""

from itertools import pairwise

import numpy as np
import pytest

import copsense
from copsense.maps.reduction import WORST, Percentiles, fold, reduce_chunk

LEVELS = (0.0, 1.0, 25.0, 50.0, 99.0, 100.0)


@pytest.mark.parametrize("kind", ["normal", "ties", "signs", "infinite", "one"])
def test_percentiles_are_exact_order_statistics(kind):
    rng = np.random.default_rng(7)
    values = {
        "normal": rng.standard_normal(5000),
        "ties": rng.integers(0, 4, 5000) * 0.1,
        "signs": np.concatenate([-(10.0 ** rng.uniform(-30, 30, 999)), [0.0, -0.0], [1e-40]]),
        "infinite": np.concatenate([rng.standard_normal(99), [np.inf, -np.inf, np.nan]]),
        "one": np.array([3.5]),
    }[kind].astype(np.float32)
    chunks = np.array_split(values, 7)
    found = _percentiles(chunks)
    known = values[~np.isnan(values)]
    assert np.array_equal(found, np.percentile(known, LEVELS, method="inverted_cdf"))


def test_percentiles_of_nothing_are_not_a_number():
    assert np.isnan(_percentiles([np.zeros(0, np.float32)])).all()
    assert np.isnan(_percentiles([])).all()


def _percentiles(chunks):
    """Of one column, beside another that must not disturb it."""
    shares = Percentiles(2, LEVELS)
    for take in (shares.count, shares.refine):
        for values in chunks:
            take(np.stack([values, np.arange(len(values), dtype=np.float32)], axis=1))
    return shares.found()[0]


def _chunk(rng, count):
    status = rng.choice([0, 0, 0, 1, 2], (count, 2)).astype(np.uint8)
    # few values, so that there are ties
    values = {
        name: np.where(status == 0, rng.integers(0, 9, (count, 2)), np.nan).astype(np.float32)
        for name in ("least_com_travel", "largest_com_gain")
    }
    return {"status": status} | values


def test_parts_fold_to_the_whole_in_any_order():
    rng = np.random.default_rng(1)
    whole = _chunk(rng, 400)
    cuts = [0, 3, 120, 121, 300, 400]
    spans = list(pairwise(cuts))
    parts = [reduce_chunk({n: a[i:j] for n, a in whole.items()}, i) for i, j in spans]
    expected = reduce_chunk(whole, 0)
    for order in (range(5), (4, 2, 0, 3, 1)):
        total = fold([fold([parts[i] for i in order[:2]]), *(parts[i] for i in order[2:])])
        for name in ("counts", "worst", "values"):
            assert getattr(total, name).tobytes() == getattr(expected, name).tobytes(), name


def test_the_summary_is_that_of_the_arrays(whole):
    path, summary = whole
    dataset = copsense.load_map(path)
    for j, (name, row) in enumerate(summary.criteria.items()):
        status = dataset["status"].values[:, j]
        assert list(row.counts.values()) == [int((status == code).sum()) for code in range(5)]
        travel = dataset["least_com_travel"].values[:, j]
        gain = dataset["largest_com_gain"].values[:, j]
        order = np.argsort(np.where(status == 0, travel, np.inf), kind="stable")[:WORST]
        assert [w.posture for w in row.worst_travel] == order.tolist()
        most = np.argsort(-np.where(status == 0, gain, -np.inf), kind="stable")[:WORST]
        assert [w.posture for w in row.worst_gain] == most.tolist()
        first = row.worst_travel[0]
        assert first.value == travel[order[0]]
        assert first.coordinates["com_y"] == dataset["com_y"].values[order[0]]
        assert row.without_travel == (travel[status == 0] < 0).sum()
        median = np.percentile(travel[status == 0], 50, method="inverted_cdf")
        assert row.travel_percentiles[50.0] == median, name
