"""Constant errors of encoders: the motion that they would show, and intervals that hold them."""

from dataclasses import replace

import numpy as np
import pytest
from support.commands import copsense as command
from support.results import small_log

import copsense
from copsense.errors import InvalidInputError
from copsense.identification import fit_family, log_measurements
from copsense.identification.families import identifiable
from copsense.logs import compare_log
from copsense.logs.aligned_log import align_log
from copsense.logs.encoder_bias import biased_records, some_rows

BIAS = np.radians(0.5)
LEGS = ("hip", "knee", "ankle")
TORQUE = [copsense.minimum_torque()]


@pytest.fixture(scope="module")
def log(icub):
    """Of the legs alone: the upper body is locked."""
    whole = small_log(icub)
    legs = [i for i, name in enumerate(whole.joint_names) if name.split("_")[1] in LEGS]
    names = tuple(whole.joint_names[i] for i in legs)
    return replace(whole, joint_names=names, positions=whole.positions[:, legs], torques=None)


@pytest.fixture(scope="module")
def aligned(log, icub):
    return align_log(log, icub)


def shifted(log, name, angle):
    positions = np.array(log.positions)
    positions[:, log.joint_names.index(name)] += angle
    return replace(log, positions=positions)


def test_without_an_error_the_motion_is_the_logs_own(log, aligned):
    rows = aligned.rows[5:-5:4]
    ((motion, wrenches),) = biased_records(log, aligned, rows, 0.0)
    np.testing.assert_allclose(
        motion.configurations, aligned.motion.configurations[rows], atol=1e-9
    )
    # Central differences over 0.1 s of a sway of 1 Hz are 2 % off at its fastest.
    for name, share in (("velocities", 0.03), ("accelerations", 0.06)):
        found, own = getattr(motion, name), getattr(aligned.motion, name)[rows]
        assert np.abs(found - own)[:, :6].max() < share * np.abs(own).max()
    np.testing.assert_array_equal(wrenches, aligned.wrenches[rows])


def test_an_error_is_that_of_a_log_read_so(log, aligned, icub):
    """One encoder's error, beside the whole way from a log that has it."""
    joint = icub.robot.joint_names.index("l_hip_roll")
    rows = aligned.rows[some_rows(aligned.rows)]
    name = aligned.robot.joint_names[joint]
    own = align_log(shifted(log, name, BIAS), icub)
    at = aligned.robot.velocity_index(name) - 6
    motion = [m for m, _ in biased_records(log, aligned, rows, BIAS)][at]
    np.testing.assert_allclose(motion.configurations, own.motion.configurations[rows], atol=1e-9)


def test_the_slopes_spread_as_logs_with_errors_do(log, icub):
    plain = compare_log(log, icub, TORQUE, skip=0.0)
    stated = compare_log(log, icub, TORQUE, skip=0.0, encoders=BIAS)
    squares = dict.fromkeys(plain.slopes["load"], 0.0)
    for name in log.joint_names:
        off = compare_log(shifted(log, name, BIAS), icub, TORQUE, skip=0.0)
        for source, slope in off.slopes["load"].items():
            squares[source] += (slope.value - plain.slopes["load"][source].value) ** 2
    for source, slope in stated.slopes["load"].items():
        own = plain.slopes["load"][source]
        assert slope.value == own.value
        # Of fewer rows.
        assert slope.encoders == pytest.approx(np.sqrt(squares[source]), rel=0.1)
        half = np.hypot(own.high - own.value, 1.96 * slope.encoders)
        assert slope.high - slope.value == pytest.approx(half, rel=1e-4)
    assert any("0.5 deg" in note for note in stated.notes)
    assert any("--encoders" in note for note in plain.notes)


def test_a_fitted_weight_spreads_as_fits_to_logs_with_errors_do(log, icub):
    family = identifiable(icub)["length"]

    def fitted(of, encoders=0.0):
        rows = log_measurements(of, icub, skip=0.0, inertia=False, encoders=encoders)
        fit = fit_family(family, rows, (0.1,))
        return fit.estimates["characteristic_length"]

    plain, stated = fitted(log), fitted(log, BIAS)
    assert stated.value == plain.value
    square = sum(
        np.log(fitted(shifted(log, name, BIAS)).value / plain.value) ** 2
        for name in log.joint_names
    )
    assert stated.encoders == pytest.approx(np.sqrt(square), rel=0.15)
    half = np.hypot(np.log(plain.high / plain.value), 1.96 * stated.encoders)
    assert np.log(stated.high / stated.value) == pytest.approx(half, rel=1e-3)


def test_an_accuracy_that_is_none_is_rejected(log, icub):
    for call in (compare_log, log_measurements):
        with pytest.raises(InvalidInputError, match="zero or more"):
            call(log, icub, encoders=-0.1)
    run = ("log", "x.csv", "--robot", "icub", "--encoders", "0.5N")
    assert "0.5N" in command(*run).error
