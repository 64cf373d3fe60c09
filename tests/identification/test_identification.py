"""Identification finds the weights behind measured loads, and says what it cannot see."""

import json

import numpy as np
import pytest

import copsense
from copsense import minimum_torque, weighted_torque
from copsense.controllers import Sine
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.identification import Measurements, fit_family, identify
from copsense.identification.families import built, identifiable, weight_changes
from copsense.identification.fitting import evaluate, predict
from copsense.statics.kkt import Kkt
from copsense.timed_path import TimedPath

SHARE = ("load share of l_sole",)


@pytest.fixture(scope="module")
def rows(icub):
    """A sway of 28 mm at 0.2 Hz, 12 s, in motion."""
    timed = TimedPath(copsense.lateral_sweep(icub, -0.028, 0.028, 29), Sine(0.028, 0.2))
    return tuple(timed.at(float(t)).stance for t in np.arange(0.0, 12.0, 0.25))


@pytest.fixture(scope="module")
def family_of(icub):
    return identifiable(icub)


def wrenches_and_torques(criterion, rows):
    found = [copsense.solve_equilibrium(row, criterion) for row in rows]
    return np.array([e.wrenches for e in found]), np.array([e.torques for e in found])


@pytest.mark.parametrize(
    ("name", "u"),
    [
        ("joints", [0.4, -0.3]),
        ("stiffness", [0.4, -0.3]),
        ("length", [-2.0]),
        ("mix", [-1.0, -3.0]),
    ],
)
def test_derivatives_by_the_weights_are_those_of_the_equilibria(rows, family_of, name, u):
    family, stance, step = family_of[name], rows[5], 1e-4
    criterion = built(family, u)
    system = Kkt(stance, criterion)
    f, _, nu = system.share(system.problem)
    for i, change in enumerate(weight_changes(family, u, stance)):
        df, dtau = system.weight_derivative(f, nu, change)
        both = [
            copsense.solve_equilibrium(stance, built(family, u + s * step * np.eye(len(u))[i]))
            for s in (1, -1)
        ]
        for exact, what in ((df, "forces"), (dtau, "torques")):
            numeric = (getattr(both[0], what) - getattr(both[1], what)) / (2 * step)
            assert np.abs(exact - numeric).max() < 1e-6 * max(1.0, np.abs(numeric).max())
        assert np.abs(df).max() > 1e-3


def test_a_common_scale_is_never_visible(rows, icub):
    names = icub.robot.torque_names
    criterion = weighted_torque(dict.fromkeys(names, 2.0))
    system = Kkt(rows[3], criterion)
    f, _, nu = system.share(system.problem)
    change = criterion.at(rows[3])  # d W / d log scale = W
    df, dtau = system.weight_derivative(f, nu, change)
    assert np.abs(df).max() < 1e-9
    assert np.abs(dtau).max() < 1e-9


def test_whole_wrenches_and_torques_tell_hip_from_knee(rows, family_of):
    truth = (1.7, 0.6)
    measured = Measurements.of(rows, *wrenches_and_torques(family_of["joints"].build(truth), rows))
    fit = fit_family(family_of["joints"], measured)
    assert [e.value for e in fit.estimates.values()] == pytest.approx(truth, rel=1e-6)
    assert fit.converged
    assert fit.unseen == ()
    stiff = fit_family(family_of["stiffness"], measured)
    inverse = [1 / value for value in truth]
    assert [e.value for e in stiff.estimates.values()] == pytest.approx(inverse, rel=1e-6)


def noisy(rng, values, size, memory=0.5):
    noise = rng.standard_normal(values.shape)
    for i in range(1, len(noise)):
        noise[i] = memory * noise[i - 1] + np.sqrt(1 - memory**2) * noise[i]
    return values + size * noise


def test_normal_forces_alone_see_the_hip_and_not_the_knee(rows, family_of):
    wrenches, _ = wrenches_and_torques(family_of["joints"].build((1.5, 1.0)), rows)
    wrenches[:, :, [0, 1, 3, 4, 5]] = np.nan
    off = noisy(np.random.default_rng(1), np.full(len(rows), 6.0), 1.0)
    wrenches[:, 0, 2] += off
    wrenches[:, 1, 2] -= off
    measured = Measurements.of(rows, wrenches)
    assert measured.names == SHARE
    fit = fit_family(family_of["joints"], measured)
    hip, knee = fit.estimates.values()
    assert hip.state == "identified"
    assert hip.low < 1.5 < hip.high
    assert hip.high / hip.low < 1.5
    assert knee.state == "not identified"
    assert np.isnan(knee.low)
    assert len(fit.unseen_text) == 1
    assert fit.unseen_text[0].endswith("knee_weight^+1.00")
    assert fit.singular_values[1] < 0.01 * fit.singular_values[0]
    # A weight's interval is the stiffness' turned over.
    stiff = fit_family(family_of["stiffness"], measured).estimates["hip_stiffness"]
    assert (1 / stiff.high, 1 / stiff.low) == pytest.approx((hip.low, hip.high), rel=1e-2)
    # The offset of the sensor is found, and is no error.
    assert fit.offsets[0] == pytest.approx(6.0 / 324.3, abs=3e-3)


def test_a_length_is_found_from_where_nothing_is_seen(rows, family_of):
    family = family_of["length"]
    blank = Measurements(rows, SHARE, np.zeros((len(rows), 1)))
    exact, slopes = evaluate(family, np.log([0.12]), blank)
    assert np.abs(slopes).max() > 1e-2
    rng = np.random.default_rng(3)
    fit = fit_family(family, Measurements(rows, SHARE, noisy(rng, exact, 0.01)))
    assert fit.estimates["characteristic_length"].value == pytest.approx(0.12, rel=0.1)


def test_a_mix_that_is_all_torque_has_no_wrench_in_it(rows, family_of):
    values, _ = predict(minimum_torque(), Measurements(rows, SHARE, np.zeros((len(rows), 1))))
    rng = np.random.default_rng(4)
    measured = Measurements(rows, SHARE, noisy(rng, values, 0.003))
    fit = fit_family(family_of["mix"], measured, (0.5, 1e-3))
    share = fit.estimates["wrench_share"]
    assert share.state in ("none", "not identified")
    assert "none" not in str(share) or np.isnan(share.value)


def test_intervals_cover_the_truth_with_coloured_noise_and_offsets(rows, family_of):
    # The long form is benchmarks/identification.py.
    family, truth, inside, runs = family_of["length"], (0.12,), 0, 40
    exact, _ = predict(family.build(truth), Measurements(rows, SHARE, np.zeros((len(rows), 1))))
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        values = noisy(rng, exact, 0.01) + rng.uniform(-0.05, 0.05)
        fit = fit_family(family, Measurements(rows, SHARE, values), truth)
        found = fit.estimates["characteristic_length"]
        inside += found.low <= truth[0] <= found.high
    assert 35 <= inside <= 40


def test_the_best_family_stands_before_the_papers_two(rows, family_of):
    exact, _ = predict(
        family_of["joints"].build((3.0, 1.0)), Measurements(rows, SHARE, np.zeros((len(rows), 1)))
    )
    measured = Measurements(rows, SHARE, noisy(np.random.default_rng(5), exact, 0.002))
    found = identify(measured, ["joints"])
    assert next(iter(found.errors)) == "joints"
    assert found.best == ("joints",)
    assert found.errors["joints"] < 0.3 * found.errors["minimum-torque"]
    assert found.errors["minimum-wrench"] > 0.9
    assert found.inertia
    json.dumps(found.to_dict())
    assert "hip_weight: 3" in str(found) or "hip_weight: 2.9" in str(found)


def test_questions_without_an_answer_are_rejected(rows, icub):
    wrenches = np.ones((len(rows), 2, 6))
    with pytest.raises(InvalidInputError, match="too few"):
        Measurements.of(rows[:5], wrenches[:5])
    with pytest.raises(InvalidInputError, match="nothing was measured that moves"):
        Measurements.of(rows, wrenches)
    with pytest.raises(InvalidInputError, match="nothing was measured that moves"):
        Measurements.of(rows, np.full((len(rows), 2, 6), np.nan))
    with pytest.raises(InvalidInputError, match="shape"):
        Measurements.of(rows, np.zeros((len(rows), 3, 6)))
    values = np.random.default_rng(0).standard_normal((len(rows), 1))
    with pytest.raises(UnknownNameError, match="weights"):
        identify(Measurements(rows, SHARE, values), ["weights"])
