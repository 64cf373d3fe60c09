from __future__ import annotations

import math

import numpy as np
import pytest

from copsense.errors import InvalidInputError, UnknownNameError
from copsense.paper.closed_form import (
    FourBar,
    Sampling,
    figure_3a,
    figure_3b,
    figure_4,
    figure_5,
    solve_four_bar,
)

FIGURES = [figure_3a, figure_3b, figure_4, figure_5]
POLE = math.asin(0.14 / 0.375)


def joined(curve):
    """Angles and values of a curve in one piece."""
    return (
        np.concatenate([segment.delta_xi for segment in curve.segments]),
        np.concatenate([segment.values for segment in curve.segments]),
    )


@pytest.mark.parametrize("figure", FIGURES)
def test_figure_has_no_nan_and_no_infinity(figure):
    # a grid with the poles in it
    for half_range in (math.radians(25), POLE, 2 * POLE):
        for curve in figure(FourBar(), Sampling(half_range=half_range, count=101)).curves:
            assert curve.segments
            for segment in curve.segments:
                assert np.all(np.isfinite(segment.values))
                assert np.all(np.diff(segment.delta_xi) > 0)


def test_segments_are_the_closed_forms():
    curves = {
        "left CoP": lambda found: found.cop[0],
        "right CoP": lambda found: found.cop[1],
        "CoM": lambda found: found.com[0] - 0.07,
    }
    for figure, criterion in ((figure_3a, "minimum-wrench"), (figure_3b, "minimum-torque")):
        for label, value in curves.items():
            angles, values = joined(figure(FourBar(), Sampling(count=11)).curve(label))
            for angle, given in zip(angles, values, strict=True):
                found = solve_four_bar(FourBar(), math.pi / 2 - angle, criterion)
                assert given == pytest.approx(value(found))


def test_each_cop_of_criterion_2_breaks_at_its_own_pole_only():
    figure = figure_3b(FourBar())
    for label, side in (("left CoP", 1), ("right CoP", -1)):
        first, second = figure.curve(label).segments
        assert first.delta_xi[-1] < side * POLE < second.delta_xi[0]
        assert second.delta_xi[0] - first.delta_xi[-1] < math.radians(2)
        # one branch each: never across the asymptote
        assert np.all(np.diff(first.values) > 0)
        assert np.all(np.diff(second.values) > 0)
    assert len(figure.curve("CoM").segments) == 1


def test_a_coarse_grid_does_not_jump_the_asymptote():
    # 5 samples: none is near enough to the pole to be left out
    figure = figure_3b(FourBar(), Sampling(half_range=math.radians(60), count=5, least_load=1e-3))
    for label, side in (("left CoP", 1), ("right CoP", -1)):
        before, after = figure.curve(label).segments
        assert before.delta_xi.size + after.delta_xi.size == 5
        assert before.delta_xi[-1] < side * POLE < after.delta_xi[0]


def test_no_curve_breaks_short_of_the_pole_or_under_criterion_1():
    short = Sampling(half_range=math.radians(20))
    for curve in (*figure_3b(FourBar(), short).curves, *figure_3a(FourBar()).curves):
        assert len(curve.segments) == 1


def test_figure_3a_cops_follow_the_com():
    figure = figure_3a(FourBar())
    _, com = joined(figure.curve("CoM"))
    for label in ("left CoP", "right CoP"):
        np.testing.assert_allclose(joined(figure.curve(label))[1], com, rtol=0.03, atol=1e-12)


def test_figure_4_loads_the_right_foot_as_delta_xi_rises():
    over_right_foot = math.asin(0.07 / 0.375)
    figure = figure_4(FourBar(), Sampling(half_range=over_right_foot, count=3))
    np.testing.assert_allclose(joined(figure.curve("minimum-torque"))[1], [0.25, 0.5, 0.75])
    a = 0.14**2 / (0.14**2 + 4)
    np.testing.assert_allclose(
        joined(figure.curve("minimum-wrench"))[1], [0.5 - a / 2, 0.5, 0.5 + a / 2]
    )


def test_figure_4_passes_through_zero_without_a_break():
    (segment,) = figure_4(FourBar()).curve("minimum-torque").segments
    assert segment.values[0] < 0 < segment.values[-1]


def test_figure_5_criterion_2_is_below_at_the_centre_and_falls_towards_the_right_foot():
    figure = figure_5(FourBar(), Sampling(half_range=math.radians(14), count=29))
    angles, torque = joined(figure.curve("minimum-torque"))
    _, wrench = joined(figure.curve("minimum-wrench"))
    assert torque[14] / wrench[14] == pytest.approx((0.14**2 + 4) / 8)
    assert np.all(np.diff(torque[angles >= 0]) < 0)


def test_an_unknown_curve_lists_the_valid_ones():
    with pytest.raises(UnknownNameError, match="left CoP"):
        figure_3a(FourBar()).curve("left cop of foot")


@pytest.mark.parametrize(
    "wrong",
    [
        {"half_range": 0.0},
        {"half_range": 25.0},
        {"half_range": math.nan},
        {"count": 1},
        {"least_load": 0.0},
        {"least_load": 0.5},
    ],
)
def test_a_sampling_of_nothing_is_rejected(wrong):
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        Sampling(**wrong)
