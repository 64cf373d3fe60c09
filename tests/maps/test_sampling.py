"""Which postures a map visits: any stretch without the ones before, and the same for ever."""

import numpy as np
import pytest
from scipy.stats import qmc

from copsense.errors import CopsenseError
from copsense.maps import Axis, Grid, Sample

AXES = (Axis("a", -1.0, 2.0), Axis("b", 0.0, 1e-3), Axis("c", 5.0, 6.0))


@pytest.mark.parametrize("sequence", ["sobol", "halton"])
@pytest.mark.parametrize("stretch", [(0, 1), (0, 77), (1, 2), (511, 513), (1000, 1300)])
def test_a_stretch_is_that_of_the_whole(sequence, stretch):
    sample = Sample(AXES, 1300, seed=2, sequence=sequence)
    assert np.array_equal(sample.values(*stretch), sample.values(0, 1300)[slice(*stretch)])


def test_sobol_points_are_scipys_shifted_modulo_one():
    sample = Sample(AXES, 1024, seed=5)
    unit = (sample.values(0, 1024) - [-1.0, 0.0, 5.0]) / [3.0, 1e-3, 1.0]
    points = qmc.Sobol(3, scramble=False).random(1024)
    shift = np.random.default_rng(5).random(3)
    assert np.abs(unit - (points + shift) % 1.0).max() < 1e-12


def test_a_sample_fills_its_box_more_evenly_than_chance():
    sample = Sample((Axis("a", 0.0, 1.0), Axis("b", 0.0, 1.0)), 1024, seed=1)
    chance = np.random.default_rng(0).random((1024, 2))
    assert qmc.discrepancy(sample.values(0, 1024)) < 0.1 * qmc.discrepancy(chance)


def test_a_longer_sample_begins_with_the_shorter():
    shorter, longer = Sample(AXES, 100, seed=4), Sample(AXES, 5000, seed=4)
    assert np.array_equal(shorter.values(0, 100), longer.values(0, 100))


def test_another_seed_gives_other_postures():
    assert not np.allclose(
        Sample(AXES, 9, seed=0).values(0, 9), Sample(AXES, 9, seed=1).values(0, 9)
    )


def test_a_grid_meets_both_ends_and_runs_its_last_axis_fastest():
    grid = Grid((Axis("a", 0.1, 0.7, 4), Axis("b", -1.0, 1.0, 3)))
    values = grid.values(0, len(grid))
    expected = [[a, b] for a in np.linspace(0.1, 0.7, 4) for b in (-1.0, 0.0, 1.0)]
    assert np.allclose(values, expected, atol=1e-15)
    assert values[0, 0] == 0.1
    assert values[-1, 0] == 0.7
    assert np.array_equal(grid.values(5, 9), values[5:9])


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Axis("a", 0.0, np.nan), "finite"),
        (lambda: Axis("a", 1.0, 0.0), "START < STOP"),
        (lambda: Axis("a", 0.0, 1.0, 1), "both ends are the same"),
        (lambda: Grid(AXES), "needs a count for a"),
        (lambda: Grid(()), "at least one"),
        (lambda: Grid((Axis("a", 0.0, 1.0, 10**6), Axis("b", 0.0, 1.0, 10**9))), "more than"),
        (lambda: Sample((Axis("a", 0.0, 1.0, 3),), 5), "takes no count"),
        (lambda: Sample((AXES[0], AXES[0]), 5), "distinct"),
        (lambda: Sample(AXES, 0), "from 1"),
        (lambda: Sample(AXES, 5, seed=-1), "seed"),
    ],
)
def test_what_is_not_a_sampling_is_rejected(make, word):
    with pytest.raises(CopsenseError, match=word):
        make()
