"""Timed paths: velocity and acceleration of the very path, and what a sway does to the outputs."""

import math

import numpy as np
import pinocchio as pin
import pytest
from support.driven_robots import rod_biped_model, rod_drives, standing
from support.engines import MujocoRobot

import copsense
from copsense import Limits, Robot, minimum_torque, minimum_wrench, mixed, solve_equilibrium
from copsense.controllers import Hold, Sine
from copsense.cop import contact_cops, total_center_of_pressure, zero_moment_point
from copsense.errors import InvalidInputError, UnreachablePostureError
from copsense.margins import limit_margins
from copsense.path import LateralPath
from copsense.sway_levers import net_lever, sway_levers
from copsense.timed_path import Sway, TimedPath, instant

TORQUE, WRENCH = minimum_torque(), minimum_wrench(1.0)
BOTH = mixed((TORQUE, 1.0), (minimum_wrench(0.1), 0.2))
LIMITS = Limits(cop_margin=0.02, torque=60.0)
PERIOD = 1.6


@pytest.fixture(scope="module")
def path(icub):
    return copsense.lateral_sweep(icub, -0.02, 0.02, 21)


@pytest.fixture(scope="module")
def sway(path):
    return Sway(path, PERIOD)


def fourth_order(at, step):
    return (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step)


@pytest.mark.parametrize("value", [0.0, 0.0132])
def test_velocity_and_acceleration_are_the_paths_own_in_time(icub, sway, value):
    timed = TimedPath(sway.path, sway.signal)
    time = math.asin(value / 0.02) * PERIOD / (2 * math.pi)
    here, model = timed.at(time), icub.robot.model
    assert here.value == pytest.approx(value, abs=1e-12)

    def moved(by):
        return pin.difference(model, here.stance.q, timed.at(time + by).stance.q)

    def speed(by):
        return timed.at(time + by).stance.motion.velocity

    motion = here.stance.motion
    np.testing.assert_allclose(motion.velocity, fourth_order(moved, 1e-2), rtol=0, atol=1e-6)
    np.testing.assert_allclose(motion.acceleration, fourth_order(speed, 1e-2), rtol=0, atol=1e-5)
    # The feet do not move: J a + d(J v)/dt = 0.
    drift = here.stance.motion_derivative(motion.velocity) @ motion.velocity
    assert np.abs(drift).max() > 1e-4 or value == 0.0
    assert np.abs(here.stance.jacobian @ motion.acceleration + drift).max() < 1e-12


def test_a_path_bends_alike_by_its_own_postures_and_by_new_ones(icub, path):
    own = instant(path, float(path.values[12]), 0.1, 0.2)
    coarse = copsense.lateral_sweep(icub, -0.02, 0.02, 6)
    new = instant(coarse, float(path.values[12]), 0.1, 0.2)
    scale = np.abs(new.bend).max()
    np.testing.assert_allclose(own.bend, new.bend, rtol=0, atol=1e-7 * scale)
    scale = np.abs(new.bend_rate).max()
    np.testing.assert_allclose(own.bend_rate, new.bend_rate, rtol=0, atol=1e-3 * scale)


@pytest.mark.parametrize("limits", [None, LIMITS], ids=["free", "within limits"])
@pytest.mark.parametrize("value", [0.0, 0.008, -0.016])
def test_derivative_along_the_path_at_fixed_rate_and_second_derivative(path, limits, value):
    def forces(by, of="forces"):
        here = instant(path, value + by, 0.05, -0.3)
        return getattr(solve_equilibrium(here.stance, BOTH, limits), of)

    here = instant(path, value, 0.05, -0.3)
    df, dtau = here.rates(solve_equilibrium(here.stance, BOTH, limits))
    numeric = fourth_order(forces, 5e-4)
    np.testing.assert_allclose(df, numeric, rtol=0, atol=2e-6 * np.abs(numeric).max())
    numeric = fourth_order(lambda by: forces(by, "torques"), 5e-4)
    np.testing.assert_allclose(dtau, numeric, rtol=0, atol=2e-6 * np.abs(numeric).max())


def test_derivative_along_a_sway_counts_its_slowing(sway):
    value = 0.008
    here = sway.at(value)
    df, _ = sway.rates(here, solve_equilibrium(here.stance, TORQUE))
    numeric = fourth_order(
        lambda by: solve_equilibrium(sway.at(value + by).stance, TORQUE).forces, 5e-4
    )
    np.testing.assert_allclose(df, numeric, rtol=0, atol=2e-6 * np.abs(numeric).max())
    fixed, _ = here.rates(solve_equilibrium(here.stance, TORQUE))
    assert np.abs(fixed - df).max() > 1.0


def test_load_is_linear_in_second_derivative_and_squared_rate(path):
    still = instant(path, 0.008, 0.0, 0.0)
    here = instant(path, 0.008, 0.3, -0.7)
    expected = (
        still.stance.balance + here.load_by_second * -0.7 + here.load_by_squared_rate * 0.3**2
    )
    np.testing.assert_allclose(here.stance.balance, expected, rtol=0, atol=1e-10)
    assert np.abs(here.load_by_squared_rate).max() > 1.0


@pytest.mark.parametrize("limits", [None, LIMITS], ids=["free", "within limits"])
def test_timed_wrenches_are_mujocos_inverse_dynamics(icub, sway, limits):
    engine = MujocoRobot(icub.robot)
    for value in (-0.02, 0.0, 0.011):
        found = solve_equilibrium(sway.at(value).stance, TORQUE, limits)
        assert np.abs(engine.imbalance(found)).max() < 1e-9
        if limits is not None:
            assert min(m.value for m in limit_margins(found, limits)) > -1e-9


def test_net_centre_of_pressure_of_a_sway_is_its_zero_moment_point(sway):
    here = sway.at(0.011).stance
    expected = zero_moment_point(here, here.motion.velocity, here.motion.acceleration)
    found = total_center_of_pressure(solve_equilibrium(here, TORQUE))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


# Theory: h = 0.546 m, and these levers [m] and frequencies [Hz] of this robot.
LEVERS = {
    "minimum-torque": {
        "net CoP": (0.646, 0.139),
        "load of l_sole": (0.741, 0.129),
        "CoP of l_sole": (0.553, 0.150),
    },
    "minimum-wrench": {
        "net CoP": (0.646, 0.139),
        "load of l_sole": (0.646, 0.139),
        "CoP of l_sole": (0.646, 0.139),
    },
}


@pytest.mark.parametrize("criterion", [TORQUE, WRENCH], ids=lambda c: c.name)
def test_levers_are_those_of_the_theory_and_of_slow_small_sways(icub, path, criterion):
    stance, tangent = path.at(0.0)
    levers = {x.output: x for x in sway_levers(solve_equilibrium(stance, criterion), tangent)}
    for output, (lever, frequency) in LEVERS[criterion.name].items():
        assert levers[output].lever == pytest.approx(lever, abs=1.1e-3)
        assert levers[output].frequency == pytest.approx(frequency, abs=6e-4)
    # The slopes of the sway itself, through the middle.
    small = Sway(path, PERIOD, amplitude=1e-3)

    def outputs(place):
        found = solve_equilibrium(place(), criterion)
        whole = total_center_of_pressure(found)[1]
        return np.array([whole, found.wrenches[0, 2], contact_cops(found)[0, 1]])

    moved = fourth_order(lambda by: outputs(lambda: small.at(by).stance), 2e-4)
    at_rest = fourth_order(lambda by: outputs(lambda: path.at(by)[0]), 2e-4)
    factors = [levers[name].factor(PERIOD) for name in LEVERS[criterion.name]]
    np.testing.assert_allclose(moved / at_rest, factors, rtol=1e-4)
    assert levers["net CoP"].lever == pytest.approx(net_lever(stance, tangent)[0], rel=1e-9)


def test_statics_are_five_per_cent_off_at_the_frequency_that_is_told(path):
    stance, tangent = path.at(0.0)
    for lever in sway_levers(solve_equilibrium(stance, TORQUE), tangent):
        assert lever.factor(1.0 / lever.frequency) == pytest.approx(1.05)


def test_a_sweep_of_a_sway_is_the_sway_and_its_own_slope(icub, path, sway):
    found = copsense.sweep(path, [TORQUE, WRENCH], period=PERIOD)
    assert not found.failed_rows
    assert (found.period, found.attrs["sway_amplitude"]) == (PERIOD, pytest.approx(0.02))
    expected = contact_cops(solve_equilibrium(sway.at(float(path.values[14])).stance, TORQUE))
    cops = found["cop"].sel(criterion="minimum-torque").values
    np.testing.assert_allclose(cops[14], expected, rtol=0, atol=1e-12)
    slope = found["cop_slope"].sel(criterion="minimum-torque").values
    step = path.values[1] - path.values[0]
    numeric = (8 * (cops[11] - cops[9]) - (cops[12] - cops[8])) / (12 * step)
    np.testing.assert_allclose(slope[10], numeric, rtol=0, atol=1e-5)
    at_rest = copsense.sweep(path, [TORQUE])
    assert at_rest.period is None
    assert at_rest.static_frequencies == {}
    frequencies = found.static_frequencies["minimum-torque"]
    assert frequencies["load of l_sole"] == pytest.approx(0.129, abs=6e-4)
    faster = 1 + (2 * math.pi / PERIOD) ** 2 * 0.553 / 9.81
    ratio = slope[10, 0, 1] / at_rest["cop_slope"].values[10, 0, 0, 1]
    assert ratio == pytest.approx(faster, rel=2e-3)


def test_a_sway_within_limits_presses_limits_that_statics_do_not(path):
    moving = copsense.sweep(path, [TORQUE], LIMITS, period=1.2)
    at_rest = copsense.sweep(path, [TORQUE], LIMITS)
    assert at_rest.free.all()
    assert not moving.failed_rows
    assert not moving.free.all()
    margins = moving["limit_margin"].values
    assert np.nanmin(margins) > -1e-8  # m: limits hold to 1e-9 of the weight


def test_rods_springs_and_loads_sway_too():
    robot = Robot.from_model(rod_biped_model(), drives=rod_drives("ball"))
    stance = standing(robot, 0.01).with_loads([copsense.Load("hand", (5.0, 0.0, -10.0))])
    y = float(stance.com[1])
    path = copsense.lateral_sweep(stance, y - 0.01, y + 0.01, 5, com_x=float(stance.com[0]))
    here = Sway(path, 1.0).at(float(path.values[3]))
    found = solve_equilibrium(here.stance, TORQUE)
    assert found.residual() < 1e-9
    assert np.abs(here.stance.constraints @ here.stance.motion.velocity).max() < 1e-9
    assert here.stance.loads == stance.loads


def test_a_list_of_configurations_is_followed_in_time(icub, path):
    listed = copsense.path_through(icub, [stance.q for stance in path.stances])
    rate = 10.0  # postures a second
    found = TimedPath(listed, Hold(1.0), start=9.0).at(0.0)
    assert found.rate == 0.0
    assert found.value == 10.0
    exact = instant(path, float(path.values[10]), rate * 2e-3, 0.0)
    near = instant(listed, 10.0, rate, 0.0)
    scale = np.abs(exact.stance.motion.acceleration).max()
    error = near.stance.motion.acceleration - exact.stance.motion.acceleration
    assert np.abs(error).max() < 1e-2 * scale
    with pytest.raises(InvalidInputError, match=r"no posture at index = 9\.5"):
        instant(listed, 9.5, rate, 0.0)
    with pytest.raises(InvalidInputError, match="not a curve to sway along"):
        Sway(listed, 1.0)


def test_questions_that_cannot_be_meant_are_rejected(icub, path):
    with pytest.raises(InvalidInputError, match="no amplitude"):
        Sway(copsense.lateral_sweep(icub, 0.0, 0.0, 1), 1.0)
    with pytest.raises(InvalidInputError, match="period of a sway"):
        copsense.sweep(path, [TORQUE], period=-1.0)
    with pytest.raises(InvalidInputError, match=r"does not pass 0\.03"):
        Sway(path, 1.0).at(0.03)
    with pytest.raises(InvalidInputError, match="does not know how the robot moves"):
        copsense.sweep(path, [lambda q: np.zeros((2, 6))], period=1.0)
    with pytest.raises(UnreachablePostureError, match="not known: fewer"):
        instant(copsense.path_through(icub, [icub.q]), 0.0, 1.0, 0.0)
    here = Sway(path, 1.0).at(0.0)
    moving = solve_equilibrium(here.stance, TORQUE)
    with pytest.raises(InvalidInputError, match="at rest"):
        sway_levers(moving, here.tangent)


def test_an_analysis_says_what_a_sway_does(icub):
    found = copsense.analyse(icub, period=2.0)
    outputs = found.to_dict()["criteria"]["minimum-torque"]["sway"]["outputs"]
    assert outputs["load of l_sole"]["static_frequency"] == pytest.approx(0.129, abs=6e-4)
    assert outputs["load of l_sole"]["factor"] == pytest.approx(1.746, abs=2e-3)
    assert "load of l_sole: 1.746 (statics within 5 % up to 0.129 Hz)" in str(found)
    assert "sway" not in copsense.analyse(icub).to_dict()["criteria"]["minimum-torque"]


def test_a_path_for_a_search_sways_as_a_sweep_does(icub, path):
    one = Sway(LateralPath(icub, 0.02, 10), PERIOD).at(0.011)
    other = Sway(path, PERIOD).at(0.011)
    a, b = one.stance.motion, other.stance.motion
    np.testing.assert_allclose(a.acceleration, b.acceleration, rtol=0, atol=1e-6)
    assert Sine(0.02, 1 / PERIOD) == Sway(path, PERIOD).signal
