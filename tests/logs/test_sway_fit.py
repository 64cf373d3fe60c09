"""Slopes of a sway, and intervals that cover the truth in records with coloured noise."""

import numpy as np
import pytest

from copsense.errors import InvalidInputError
from copsense.logs.sway_fit import find_sway, fit_sway, inflation


def record(rng, slope=0.6, phase=0.0, seconds=16.0, rate=50.0, colour=0.95, noise=0.02):
    t = np.arange(0.0, seconds, 1 / rate)
    travel = 0.03 * np.sin(2 * np.pi * 0.2 * t)
    drive = 0.03 * np.sin(2 * np.pi * 0.2 * t + phase)
    from scipy.signal import lfilter

    shock = rng.normal(size=len(t) + 500) * np.sqrt(1 - colour**2)
    error = lfilter([1.0], [1.0, -colour], shock)[500:]
    return t, travel, 0.5 + slope / 0.2 * drive + noise * error


def test_slope_and_phase_of_a_clean_sway():
    t, travel, output = record(np.random.default_rng(0), phase=-0.1, noise=0.0)
    sway = find_sway(t, travel)
    found = fit_sway(sway, t, travel, output, 0.2)
    assert sway.method == "fundamental"
    assert sway.frequency == pytest.approx(0.2, rel=1e-5)
    assert found.value == pytest.approx(0.6 * np.cos(0.1), rel=1e-6)
    assert found.phase == pytest.approx(-0.1, abs=1e-6)
    assert found.middle == pytest.approx(0.5, abs=1e-6)


def test_intervals_cover_the_truth_in_95_of_100_records():
    rng = np.random.default_rng(1)
    t, travel, _ = record(rng)
    sway, hits = find_sway(t, travel), 0
    for _ in range(400):
        output = record(rng)[2]
        found = fit_sway(sway, t, travel, output, 0.2)
        hits += found.low <= 0.6 <= found.high
    assert 0.92 <= hits / 400 <= 0.98


def test_a_walk_without_a_frequency_is_fitted_to_the_travel():
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 10.0, 0.02)
    travel = np.cumsum(rng.normal(size=len(t))) * 1e-3
    sway = find_sway(t, travel)
    found = fit_sway(sway, t, travel, 3.0 * travel + 0.1)
    assert sway.method == "regression"
    assert found.value == pytest.approx(3.0)
    assert np.isnan(found.phase)


def test_a_robot_that_stands_still_has_no_slope():
    with pytest.raises(InvalidInputError, match="stands still"):
        find_sway(np.arange(100.0), np.zeros(100))


def test_independent_errors_are_not_inflated():
    assert inflation(np.random.default_rng(3).normal(size=5000)) < 1.2
    assert inflation(np.repeat(np.random.default_rng(4).normal(size=500), 10)) > 7
