"""Where functions known at a few places first fall below zero."""

import numpy as np
import pytest

from copsense.roots import Track, first_zero

PLACES = np.linspace(0.0, 1.0, 6)


def track_of(functions, exact=True, places=PLACES):
    """A track of (function, derivative) pairs, and the places that it asked for."""
    asked = []

    def evaluate(x):
        asked.append(x)
        return np.array([f(x) for f, _ in functions]), np.array([d(x) for _, d in functions])

    track = Track(evaluate if exact else None)
    for x in places:
        track.add(float(x), *evaluate(x))
    asked.clear()
    return track, asked


def wave(root, pole=3.0):
    """Falls through zero at the root, as a centre of pressure over its load does."""
    return (
        lambda x: (root - x) / (pole - x) + (root - x) ** 3,
        lambda x: -1 / (pole - x) + (root - x) / (pole - x) ** 2 - 3 * (root - x) ** 2,
    )


@pytest.mark.parametrize("root", [0.013, 0.4, 0.6123, 0.99])
def test_a_root_is_exact_and_takes_few_evaluations(root):
    track, asked = track_of([wave(root)])
    assert track.first_zero() == (pytest.approx(root, abs=1e-12), 0)
    assert len(asked) <= 3


@pytest.mark.parametrize("root", [0.013, 0.4, 0.6123, 0.99])
def test_without_evaluation_the_cubic_decides(root):
    track, asked = track_of([wave(root)], exact=False)
    assert track.first_zero() == (pytest.approx(root, abs=1e-4), 0)
    cubic = (
        lambda x: (root - x) * (1 + x + x**2),
        lambda x: root * (1 + 2 * x) - 1 - 2 * x - 3 * x**2,
    )
    track, _ = track_of([cubic], exact=False, places=[0.0, 1.0])
    assert track.first_zero() == (pytest.approx(root, abs=1e-12), 0)
    assert not asked


def test_the_first_of_several_is_found_though_its_cubic_promises_less():
    # The second falls off a cliff within one interval: its cubic crosses too late.
    cliff = (
        lambda x: 1.0 - 2 / (1 + np.exp(-400 * (x - 0.61))),
        lambda x: -200 / np.cosh(200 * (x - 0.61)) ** 2,
    )
    track, _ = track_of([wave(0.65), cliff])
    assert track.first_zero() == (pytest.approx(0.61, abs=1e-9), 1)
    assert track.first_zero(np.array([0])) == (pytest.approx(0.65, abs=1e-9), 0)


def test_a_jump_of_the_slope_costs_bisections_and_no_precision():
    def kink(x):
        return 0.5 - x if x < 0.45 else 0.05 - 40 * (x - 0.45)

    functions = [(kink, lambda x: -1.0 if x < 0.45 else -40.0)]
    track, _ = track_of(functions)
    assert track.first_zero() == (pytest.approx(0.45125, abs=1e-9), 0)
    nothing = [(kink, lambda x: np.nan)]  # nor does it need slopes
    track, _ = track_of(nothing)
    assert track.first_zero() == (pytest.approx(0.45125, abs=1e-9), 0)


def test_a_dip_between_two_places_is_seen():
    dip = (lambda x: (x - 0.5) ** 2 - 1e-3, lambda x: 2 * (x - 0.5))
    above = (lambda x: (x - 0.5) ** 2 + 1e-3, lambda x: 2 * (x - 0.5))
    places, root = [0.0, 0.4, 0.6, 1.0], 0.5 - np.sqrt(1e-3)
    for exact in (True, False):
        track, _ = track_of([above, dip], exact, places)
        assert track.first_zero() == (pytest.approx(root, abs=1e-9), 1)
        track, _ = track_of([above], exact, places)
        assert track.first_zero() is None


def test_below_zero_from_the_start_and_never():
    track, _ = track_of([wave(2.0), (lambda x: -x - 0.1, lambda x: -1.0)])
    assert track.first_zero() == (0.0, 1)
    assert track.first_zero(np.array([0])) is None
    assert Track().first_zero() is None


def test_zero_at_the_start_and_falling_is_a_root_there():
    track, _ = track_of([(lambda x: -x, lambda x: -1.0)])
    assert track.first_zero() == (0.0, 0)
    rising = [(lambda x: x, lambda x: 1.0)]
    assert track_of(rising)[0].first_zero() is None


def test_data_with_slopes_and_without():
    x = np.linspace(-1.0, 1.0, 9)
    values, slopes = np.cos(2 * x), -2 * np.sin(2 * x)
    assert first_zero(x, values, slopes) == pytest.approx(np.pi / 4, abs=1e-4)
    assert first_zero(x, values) == pytest.approx(np.pi / 4, abs=1e-2)
    both = np.column_stack([values, np.cos(3 * x)])
    assert first_zero(x, both, np.column_stack([slopes, -3 * np.sin(3 * x)])) == pytest.approx(
        np.pi / 6, abs=1e-3
    )
    assert first_zero(x, 1.0 + 0.0 * x) == 1.0


@pytest.mark.parametrize(
    ("values", "where"),
    [
        ([1.0, 1.0, 0.5, -0.5], 1.5),
        ([1.0, 1.0, 1.0, 1.0], 2.0),
        ([1.0, 0.0, 0.5, -0.5], 0.0),
        ([-1.0, -1.0, 1.0, 1.0], 0.0),
        ([1.0, 2.0, 0.0, 1.0], 1.0),
    ],
)
def test_data_alone_is_straight_between_the_samples(values, where):
    x = np.array([-1.0, 0.0, 1.0, 2.0])
    assert first_zero(x, np.array(values)) == pytest.approx(where, abs=1e-12)
