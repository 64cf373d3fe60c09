"""Rows that start between known postures: what the stance's own search finds, in fewer steps."""

import numpy as np
import pytest

import copsense
from copsense.batch import PostureChart
from copsense.batch.postures.nearby import postures_nearby

SAME = 1e-9  # m, rad
# Coordinates, and how far around the stance's own values.
OVER = {
    "icub": {"com_x": 0.02, "com_y": 0.04, "com_z": 0.02, "yaw": 0.0},
    "talos on slopes": {"base_y": 0.02, "base_z": 0.02, "roll": 0.05, "torso_1_joint": 0.2},
    "anymal_c": {"com_x": 0.04, "com_y": 0.04, "com_z": 0.04, "roll": 0.1, "pitch": 0.1},
    "solo12 on slopes": {"com_z": 0.02},
}


def ends(chart, over):
    size = np.array(list(over.values()))
    return chart.values - size, chart.values + size


def charts(stance, over):
    """A chart, one with known postures nearby, and rows between the ends."""
    plain = PostureChart(stance, list(over))
    low, high = ends(plain, over)
    near = PostureChart(stance, list(over), over=(low, high))
    rows = low + np.random.default_rng(0).random((400, len(low))) * (high - low)
    return plain, near, np.vstack([rows, low, high])


def alike(batch, whole, rows=slice(None)):
    """Whether a batch is these rows of another, to the last bit."""
    return all(
        getattr(batch, name).tobytes() == getattr(whole, name)[rows].tobytes()
        for name in ("configurations", "residuals", "iterations", "converged")
    ) and list(batch.reasons) == list(whole.reasons[rows])


@pytest.mark.parametrize("name", OVER)
def test_the_same_postures_are_found_in_fewer_steps(case, name):
    plain, near, rows = charts(case(name), OVER[name])
    assert not near.fallback_reason
    expected, found = plain.solve(rows), near.solve(rows)
    there = expected.converged
    assert there.mean() > 0.25
    assert np.array_equal(found.converged, there)
    off = found.configurations[there] - expected.configurations[there]
    assert np.abs(off).max() < SAME
    assert (found.residuals[there] < 1e-12).all()
    assert list(found.reasons) == list(expected.reasons)
    between = there & (found.iterations < expected.iterations)
    assert between.sum() > 0.6 * there.sum()
    assert np.median(found.iterations[between]) <= 3


def test_no_row_knows_of_others(case):
    stance = case("icub")
    _, near, rows = charts(stance, OVER["icub"])
    whole = near.solve(rows)
    order = np.random.default_rng(1).permutation(len(rows))
    assert alike(near.solve(rows, threads=3), whole)
    assert alike(near.solve(rows[order]), whole, order)
    other = PostureChart(stance, near.names, over=ends(near, OVER["icub"]))
    assert alike(other.solve(rows[50:61]), whole, slice(50, 61))


def test_rows_beyond_the_ends_start_from_the_stance(case):
    plain, near, rows = charts(case("icub"), OVER["icub"])
    beyond = rows[:40].copy()
    beyond[:, 1] = near.values[1] + 0.045
    assert alike(near.solve(beyond), plain.solve(beyond))
    assert not alike(near.solve(rows), plain.solve(rows))


def test_where_joints_leave_a_choice_the_stance_decides(case):
    over = {"com_x": 0.005, "com_y": 0.005}
    plain, near, rows = charts(case("icub, both hands"), over)
    assert alike(near.solve(rows), plain.solve(rows))


def test_a_start_that_leads_nowhere_is_made_good_by_the_stances(case):
    plain, near, rows = charts(case("icub"), OVER["icub"])
    known = near._known()
    # Knees the other way: what is found from there is beyond the limits, or nothing is.
    near._nearby = known._replace(unknowns=known.unknowns - 1.5, serves=np.ones_like(known.serves))
    expected, found = plain.solve(rows), near.solve(rows)
    assert np.array_equal(found.converged, expected.converged)
    again = found.iterations > expected.iterations
    assert again.mean() > 0.2
    bits = (found.configurations == expected.configurations).all(axis=1)
    assert bits[again & expected.converged].all()
    assert list(found.reasons) == list(expected.reasons)


def test_a_cell_serves_only_where_its_centre_is_the_stances(case):
    _, near, _ = charts(case("icub"), OVER["icub"])
    honest, cell = near._known(), 0

    def solve(x, nearby):
        batch = near._search(x, near.empty(len(x)), 1, nearby)
        if len(nearby.serves):
            batch.configurations[cell] += 1e-6
        return batch

    cell = int(np.flatnonzero(honest.serves)[0])
    found = postures_nearby(near.stance, near._coordinates, near._over, solve)
    assert np.flatnonzero(found.serves != honest.serves).tolist() == [cell]
    assert not found.serves[cell]


@pytest.mark.parametrize(
    ("over", "words"),
    [
        (([0.0], [1.0, 2.0]), "least value of each coordinate has shape"),
        (([0.0, 0.0], [np.nan, 1.0]), "largest value of each coordinate is not finite"),
        (([0.0, 1.0], [0.0, 0.5]), "com_y is to be over 1 to 0.5"),
    ],
)
def test_ends_are_checked(case, over, words):
    with pytest.raises(copsense.CopsenseError, match=words):
        PostureChart(case("icub"), ["com_x", "com_y"], over=over)
