from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from support import planar_statics as statics

from copsense.errors import InvalidInputError, UnknownNameError, UnloadedContactError
from copsense.paper import FOUR_BAR_CRITERIA, FourBar, solve_four_bar, solve_four_bar_member

LINKAGES = 40
EXACT = 1e-10


def random_case(seed):
    """A linkage, an angle off its poles, a length and two weights, all of common size."""
    rng = np.random.default_rng(seed)
    four_bar = FourBar(
        leg_length=rng.uniform(0.2, 1.2),
        rod_length=rng.uniform(0.05, 0.8),
        leg_mass=rng.uniform(1, 20),
        body_mass=rng.uniform(1, 40),
        gravity=rng.uniform(1.6, 12),
    )
    reach = four_bar.kappa * four_bar.leg_length
    # up to 0.6 d from the centre: beyond both feet, short of where any criterion's foot unloads
    travel = rng.uniform(-0.6, 0.6) * min(four_bar.rod_length, reach)
    xi = math.acos(travel / reach)
    return four_bar, xi, rng.uniform(0.1, 2), rng.uniform(0.5, 2), rng.uniform(0.5, 2)


def cases(seed):
    """The closed form beside the independent minimum as a function of xi, per criterion."""
    four_bar, xi, L, hip, ankle = random_case(seed)
    wrench, torque = statics.wrench_weights(L), statics.torque_weights()
    weighted = statics.torque_weights(hip, ankle)
    return {
        "minimum-wrench": (
            solve_four_bar(four_bar, xi, "minimum-wrench", characteristic_length=L),
            lambda angle: statics.minimise(four_bar, angle, wrench),
        ),
        "minimum-torque": (
            solve_four_bar(four_bar, xi, "minimum-torque"),
            lambda angle: statics.minimise(four_bar, angle, torque),
        ),
        "weighted-torque": (
            solve_four_bar(four_bar, xi, "weighted-torque", hip_weight=hip, ankle_weight=ankle),
            lambda angle: statics.minimise(four_bar, angle, weighted),
        ),
        "minimum-tangential": (
            solve_four_bar(four_bar, xi, "minimum-tangential", characteristic_length=L),
            lambda angle: statics.minimise(four_bar, angle, wrench, no_tangential=True),
        ),
    }


def assert_close(given, expected, scale=None):
    scale = np.abs(expected).max() if scale is None else scale
    assert np.abs(given - expected).max() < EXACT * scale


def test_every_criterion_has_an_independent_minimum():
    assert set(cases(0)) == set(FOUR_BAR_CRITERIA)


@pytest.mark.parametrize("criterion", FOUR_BAR_CRITERIA)
def test_wrenches_torques_and_cops_are_the_constrained_minimum(criterion):
    for seed in range(LINKAGES):
        found, minimum = cases(seed)[criterion]
        z = minimum(found.xi).real
        assert_close(found.wrenches.ravel(), z[statics.WRENCHES])
        lever = found.four_bar.weight * found.four_bar.leg_length
        assert_close(found.torques, z[statics.TORQUES], lever)
        assert_close(found.cop, statics.cop(z), found.four_bar.rod_length)


@pytest.mark.parametrize("criterion", FOUR_BAR_CRITERIA)
def test_sensitivity_is_the_complex_step_derivative_of_the_independent_cop(criterion):
    step = 1e-30
    for seed in range(LINKAGES):
        found, minimum = cases(seed)[criterion]
        slope = statics.cop(minimum(found.xi + 1j * step)).imag / step
        assert_close(found.sensitivity, slope)
        com_slope = -found.four_bar.kappa * found.four_bar.leg_length * math.sin(found.xi)
        assert_close(found.cop_per_com, slope / com_slope)


def test_sensitivity_is_the_central_difference_of_the_cop():
    four_bar, step = FourBar(), 1e-5
    for criterion in FOUR_BAR_CRITERIA:
        cops = [solve_four_bar(four_bar, 1.5 + h, criterion).cop for h in (-step, step)]
        found = solve_four_bar(four_bar, 1.5, criterion)
        np.testing.assert_allclose(found.sensitivity, (cops[1] - cops[0]) / (2 * step), rtol=1e-8)


@pytest.mark.parametrize("seed", range(10))
def test_any_member_balances_every_body(seed):
    four_bar, xi, *_ = random_case(seed)
    rng = np.random.default_rng(seed)
    found = solve_four_bar_member(four_bar, xi, rng.uniform(-1, 2), rng.normal() * four_bar.weight)
    A, b = statics.balance(four_bar, xi)
    # with the wrenches given, each body in turn gives its joint: 12 unknowns, 15 equations
    known = A[:, statics.WRENCHES] @ found.wrenches.ravel()
    joints, *_ = np.linalg.lstsq(A[:, 6:].real, (b - known).real, rcond=None)
    z = np.concatenate([found.wrenches.ravel(), joints])
    assert np.abs(A @ z - b).max() < EXACT * four_bar.weight
    assert_close(found.torques, z[statics.TORQUES], np.abs(z).max())
    assert found.residual() < 1e-13


def test_residual_sees_a_wrong_torque_and_a_wrong_force():
    found = solve_four_bar(FourBar(), 1.4, "minimum-torque")
    for name in ("torques", "wrenches"):
        for index in range(getattr(found, name).size):
            wrong = np.array(getattr(found, name))
            wrong.flat[index] += 1e-3
            assert replace(found, **{name: wrong}).residual() > 1e-6, (name, index)


def test_torques_do_the_work_of_the_weight():
    # virtual work along xi: tau_hipL - tau_ankL + tau_hipR - tau_ankR = kappa m g l c
    for seed in range(10):
        four_bar, xi, *_ = random_case(seed)
        Q = four_bar.kappa * four_bar.weight * four_bar.leg_length * math.cos(xi)
        for share in (-0.5, 0.0, 0.3, 1.0):
            found = solve_four_bar_member(four_bar, xi, share, 7.0)
            assert found.torques @ [1, -1, 1, -1] == pytest.approx(Q, rel=1e-12, abs=1e-9)


def test_torques_of_the_three_criteria_are_the_table_of_closed_forms():
    four_bar, xi = FourBar(), 1.45
    l, d, c = four_bar.leg_length, four_bar.rod_length, math.cos(xi)
    Q = four_bar.kappa * four_bar.weight * l * c
    a = d**2 / (d**2 + 4)
    first = [a * Q * (1 / 2 - l * c / d), -(1 - a) * Q / 2, a * Q * (1 / 2 + l * c / d)]
    np.testing.assert_allclose(
        solve_four_bar(four_bar, xi, "minimum-wrench").torques, [*first, -(1 - a) * Q / 2]
    )
    np.testing.assert_allclose(
        solve_four_bar(four_bar, xi, "minimum-torque").torques, np.array([1, -1, 1, -1]) * Q / 4
    )
    weighted = solve_four_bar(four_bar, xi, "weighted-torque", hip_weight=3.0, ankle_weight=1.0)
    np.testing.assert_allclose(weighted.torques, np.array([1, -3, 1, -3]) * Q / 8)


@pytest.mark.parametrize("criterion", FOUR_BAR_CRITERIA)
def test_mirroring_the_linkage_swaps_the_feet(criterion):
    four_bar = FourBar()
    found = solve_four_bar(four_bar, 1.3, criterion)
    mirrored = solve_four_bar(four_bar, math.pi - 1.3, criterion)
    np.testing.assert_allclose(mirrored.cop, -found.cop[::-1])
    np.testing.assert_allclose(mirrored.sensitivity, found.sensitivity[::-1])
    np.testing.assert_allclose(mirrored.wrenches, found.wrenches[::-1] * [-1, 1, -1], atol=1e-9)
    np.testing.assert_allclose(mirrored.torques, -found.torques[[2, 3, 0, 1]], rtol=1e-9)


@pytest.mark.parametrize("criterion", FOUR_BAR_CRITERIA)
def test_mass_and_gravity_scale_the_wrenches_and_move_no_cop(criterion):
    light = FourBar()
    heavy = replace(light, leg_mass=3 * light.leg_mass, body_mass=3 * light.body_mass, gravity=1.62)
    one, other = (solve_four_bar(body, 1.4, criterion) for body in (light, heavy))
    factor = 3 * 1.62 / 9.81
    np.testing.assert_allclose(other.wrenches, factor * one.wrenches, rtol=1e-12)
    np.testing.assert_allclose(other.torques, factor * one.torques, rtol=1e-12)
    np.testing.assert_allclose(other.cop, one.cop, rtol=1e-12)
    np.testing.assert_allclose(other.sensitivity, one.sensitivity, rtol=1e-12)


def test_cops_of_both_feet_average_to_the_com_and_so_do_their_rates():
    for seed in range(LINKAGES):
        for found, _ in cases(seed).values():
            d, x = found.four_bar.rod_length, np.array([0.0, found.four_bar.rod_length])
            w = found.wrenches[:, 1] / found.four_bar.weight
            assert w @ (x + found.cop) == pytest.approx(found.com[0], abs=1e-12)
            # sum rule: sum w Gamma + (x + p) dw/du = 1, with dw/du = ± a/d
            dw = np.array([-1, 1]) * found.share / d
            assert w @ found.cop_per_com + (x + found.cop) @ dw == pytest.approx(1.0, abs=1e-10)


def test_horizontal_force_moves_no_cop():
    one, other = (solve_four_bar_member(FourBar(), 1.3, 0.4, h) for h in (0.0, 50.0))
    np.testing.assert_array_equal(one.cop, other.cop)
    np.testing.assert_array_equal(other.wrenches[:, 0], [50.0, -50.0])


def test_length_of_half_the_feet_distance_gives_criterion_2s_cops():
    four_bar = FourBar()
    half = four_bar.rod_length / 2
    wrench = solve_four_bar(four_bar, 1.4, "minimum-wrench", characteristic_length=half)
    torque = solve_four_bar(four_bar, 1.4, "minimum-torque")
    np.testing.assert_allclose(wrench.cop, torque.cop)


def test_slope_at_the_centre_is_the_length_squared_over_itself_and_a_quarter_d_squared():
    four_bar, L = FourBar(), 0.3
    found = solve_four_bar(four_bar, math.pi / 2, "minimum-wrench", characteristic_length=L)
    expected = L**2 / (L**2 + four_bar.rod_length**2 / 4)
    np.testing.assert_allclose(found.cop_per_com, expected)


def test_com_over_a_foot_loads_it_with_half_and_half_the_share():
    four_bar = FourBar()
    xi = math.acos(four_bar.rod_length / 2 / (four_bar.kappa * four_bar.leg_length))
    for share in (0.0, 0.2, 0.5, 0.9):
        found = solve_four_bar_member(four_bar, xi, share)
        assert found.com[0] == pytest.approx(four_bar.rod_length)
        assert found.wrenches[1, 1] / four_bar.weight == pytest.approx(0.5 + share / 2)
        # and takes the other foot's CoP half way to it, whatever the share
        assert found.cop[0] == pytest.approx(four_bar.rod_length / 2)


def test_defaults_are_the_robot_of_section_v():
    four_bar = FourBar()
    assert (four_bar.leg_length, four_bar.rod_length) == (0.5, 0.14)
    assert four_bar.body_mass == 2 * four_bar.leg_mass
    assert four_bar.kappa == 0.75
    assert four_bar.mass == 33.0


def test_com_is_the_mean_of_the_masses():
    four_bar, xi = FourBar(leg_mass=3.0, body_mass=10.0), 1.2
    l, d, leg = four_bar.leg_length, four_bar.rod_length, np.array([math.cos(xi), math.sin(xi)])
    points = [l * leg / 2, [d, 0] + l * leg / 2, [d / 2, 0] + l * leg]
    np.testing.assert_allclose(four_bar.com(xi), np.average(points, axis=0, weights=[3, 3, 10]))


@pytest.mark.parametrize("name", ["leg_length", "rod_length", "leg_mass", "body_mass", "gravity"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_linkage_of_no_size_is_rejected(name, value):
    with pytest.raises(InvalidInputError, match=name):
        FourBar(**{name: value})


@pytest.mark.parametrize("xi", [math.nan, math.inf])
def test_an_angle_that_is_not_finite_is_rejected(xi):
    with pytest.raises(InvalidInputError, match="xi"):
        solve_four_bar(FourBar(), xi, "minimum-torque")


@pytest.mark.parametrize("value", ["1", None, True, np.ones(2)])
def test_what_is_no_number_is_rejected(value):
    # TypeError: with run-time type checks on, they get there first
    with pytest.raises((InvalidInputError, TypeError), match="leg_length"):
        FourBar(leg_length=value)
    with pytest.raises((InvalidInputError, TypeError), match="xi"):
        solve_four_bar(FourBar(), value, "minimum-torque")


@pytest.mark.parametrize("criterion", FOUR_BAR_CRITERIA)
@pytest.mark.parametrize("xi", [0.0, math.pi, -math.pi, 2 * math.pi])
def test_a_collapsed_linkage_is_rejected(criterion, xi):
    with pytest.raises(InvalidInputError, match="collapsed"):
        solve_four_bar(FourBar(), xi, criterion)


@pytest.mark.parametrize(
    ("criterion", "parameter"),
    [
        (name, parameter)
        for name, criterion in FOUR_BAR_CRITERIA.items()
        for parameter in criterion.defaults
    ],
)
@pytest.mark.parametrize("value", [0.0, -2.0, math.nan, math.inf])
def test_a_parameter_that_is_not_positive_is_rejected(criterion, parameter, value):
    with pytest.raises(InvalidInputError, match=parameter):
        solve_four_bar(FourBar(), 1.4, criterion, **{parameter: value})


def test_unknown_names_list_the_valid_ones():
    with pytest.raises(UnknownNameError, match="minimum-torque"):
        solve_four_bar(FourBar(), 1.4, "minimum-torques")
    with pytest.raises(UnknownNameError, match="characteristic_length"):
        solve_four_bar(FourBar(), 1.4, "minimum-wrench", hip_weight=1.0)


@pytest.mark.parametrize(("side", "foot"), [(1, "left foot"), (-1, "right foot")])
def test_a_bare_foot_is_rejected_by_name(side, foot):
    four_bar = FourBar()
    # a u = d/2
    xi = math.acos(side * four_bar.rod_length / (four_bar.kappa * four_bar.leg_length))
    with pytest.raises(UnloadedContactError, match=foot) as caught:
        solve_four_bar(four_bar, xi, "minimum-torque")
    assert caught.value.contacts == (foot,)


def test_magnitudes_that_overflow_are_rejected():
    with pytest.raises(InvalidInputError, match="overflow"):
        solve_four_bar_member(FourBar(), 1.4, 1e308, 0.0)


def test_a_solution_cannot_be_changed():
    found = solve_four_bar(FourBar(), 1.4, "minimum-torque")
    with pytest.raises(ValueError, match="read-only"):
        found.cop[0] = 0.0
    with pytest.raises(FrozenInstanceError):
        found.xi = 1.0
