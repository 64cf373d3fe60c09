"""A robot that sways tips where the static analysis says, and not before."""

from functools import cache

import numpy as np
import pytest
from support.standing import C1, C2, icub, simulator

import copsense
from copsense.controllers import (
    BalancingController,
    Hold,
    Ramp,
    Sine,
    lateral_reference,
    public_gains,
)
from copsense.simulation import Motors, MujocoSimulator, Push, Scenario, rollout
from copsense.simulation.prediction import predict, predict_lean


def ramp(criterion, distance, *, stance=None, engine=None, **options):
    stance = stance or icub()
    signal = Ramp(distance, 0.01)
    return rollout(
        engine or simulator(),
        BalancingController(stance, criterion),
        Scenario(signal.duration + 0.3, signal),
        **options,
    )


@cache
def lean(criterion, distance):
    """A lean to the first tip, shared by tests."""
    return ramp(criterion, distance)


# Criterion 2's limit depends on the posture cost along the path; criterion 1's does not.
@pytest.mark.parametrize(("criterion", "near"), [(C1, 31.1e-3), (C2, 40e-3)], ids=["C1", "C2"])
def test_the_first_tip_is_where_the_static_analysis_says(criterion, near):
    prediction = predict_lean(icub(), criterion, 0.05)
    assert prediction.excursion == pytest.approx(near, abs=1e-3)
    assert prediction.contact == "r_sole"  # the unloaded foot, at its inner edge
    recording = lean(criterion, 0.05)
    assert recording.attrs["end_kind"] == "tip"
    assert recording.attrs["tip_contact"] == prediction.contact
    excursion = float(recording["tip_com"].sel(com_axis="y")) - float(icub().com[1])
    assert excursion == pytest.approx(prediction.excursion, abs=1.5e-3)
    # Until then the measured CoPs are the commanded ones and the static ones.
    early = recording.isel(time=slice(150, None))  # after the start's acceleration
    y = early["com"].sel(com_axis="y", drop=True)
    early, y = (part.sel(time=y < 0.9 * prediction.excursion) for part in (early, y))
    assert np.abs(early["cop"] - early["cop_command"]).max() < 1e-4
    static = [np.interp(y, prediction.values, prediction.cops[:, k, 1]) for k in range(2)]
    assert np.abs(early["cop"].sel(axis="y").values.T - static).max() < 1.5e-4


def test_the_mirrored_motion_is_the_mirror_image():
    left, right = (lean(C1, side * 0.05) for side in (1, -1))
    assert left.attrs["tip_time"] == pytest.approx(right.attrs["tip_time"], abs=2e-3)
    assert {left.attrs["tip_contact"], right.attrs["tip_contact"]} == {"l_sole", "r_sole"}
    n = min(left.sizes["time"], right.sizes["time"]) - 2
    flipped = right["cop"].values[:n, ::-1] * [1.0, -1.0]
    assert np.nanmax(np.abs(left["cop"].values[1:n] - flipped[1:])) < 2e-4
    com = right["com"].values[:n] * [1.0, -1.0, 1.0]
    assert np.abs(left["com"].values[:n] - com).max() < 1e-5


def test_a_slow_sine_is_tracked():
    # A short stand-in for the 39 mm at 0.05 Hz of Section V, which benchmarks/ runs.
    scenario = Scenario(2.0, Sine(0.01, 0.5))
    recording = rollout(simulator(), BalancingController(icub(), C2), scenario)
    assert recording.attrs["end_kind"] == "completed"
    error = (recording["com"] - recording["com_target"]).sel(com_axis="y").values[200:]
    assert np.sqrt(np.mean(error**2)) < 1e-4


def test_limits_carry_the_com_past_the_tip():
    from copsense.limits import Limits

    limits = Limits(normal_force=10.0, friction=1.0, cop_margin=1e-3, torsion=None)
    controller = BalancingController(icub(), C1, limits=limits)
    signal = Ramp(0.04, 0.02)
    recording = rollout(simulator(), controller, Scenario(signal.duration + 0.3, signal))
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    assert float(recording["com"].sel(com_axis="y")[-1]) == pytest.approx(0.04, abs=5e-4)
    assert float(recording["margin"].min()) > 0.5e-3


def test_limits_that_do_not_bind_change_nothing():
    from copsense.limits import Limits

    pair = [
        rollout(simulator(), BalancingController(icub(), C2, limits=limits), Scenario(0.1))
        for limits in (None, Limits(normal_force=1.0, friction=1.0, torsion=None, torque="model"))
    ]
    assert pair[0].equals(pair[1])


def test_a_heavier_push_leaves_a_smaller_margin():
    margins = []
    for force in (0.0, 5.0, 10.0):
        push = Push((0.0, force, 0.0), start=0.1, duration=0.1)
        scenario = Scenario(0.5, pushes=(push,))
        recording = rollout(simulator(), BalancingController(icub(), C2), scenario)
        assert recording.attrs["end_kind"] == "completed"
        margins.append(float(recording["margin"].isel(time=slice(10, None)).min()))
    assert margins == sorted(margins, reverse=True)
    assert margins[0] - margins[2] > 1e-3


def test_a_push_is_an_impulse():
    push = Push((0.0, 20.0, 0.0), start=0.05, duration=0.01)
    scenario = Scenario(0.0601, pushes=(push,))
    recording = rollout(simulator(), BalancingController(icub(), C2), scenario, record_period=1e-3)
    velocity = float(recording["com_velocity"].sel(com_axis="y")[-1])
    assert velocity == pytest.approx(push.impulse / icub().robot.mass, rel=0.15)


class Stepwise:
    """A simulator that can only step, with the steps counted."""

    def __init__(self, inner):
        self.inner, self.stance, self.time_step, self.steps = (
            inner, inner.stance, inner.time_step, 0,
        )  # fmt: skip
        self.reset = inner.reset

    def step(self, torques, external=None):
        self.steps += 1
        return self.inner.step(torques, external)


class Repeating(Stepwise):
    """A simulator that repeats, its single steps counted."""

    def repeat(self, torques, steps):
        return self.inner.repeat(torques, steps)


@pytest.mark.parametrize(
    ("changes", "single"),
    [
        ({}, 0),
        # The push acts in 13 periods of four steps, in the first and the last in part.
        ({"pushes": (Push((0.0, 30.0, 0.0), start=0.0513, duration=0.045),)}, 52),
        ({"motors": Motors(delay=1e-3)}, 200),
    ],
    ids=["undisturbed", "pushed", "delayed"],
)
def test_steps_at_once_are_the_same_steps(changes, single):
    scenario = Scenario(0.2, Sine(0.01, 0.5), control_period=4e-3, **changes)
    one, many = Stepwise(simulator()), Repeating(simulator())
    runs = [rollout(s, BalancingController(icub(), C2), scenario) for s in (one, many)]
    assert runs[0].to_xarray().equals(runs[1].to_xarray())
    assert (one.steps, many.steps) == (200, single)


def test_the_public_gains_stand_too():
    controller = BalancingController(icub(), C2, public_gains(icub().robot))
    recording = rollout(simulator(), controller, Scenario(1.0, control_period=0.01))
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]


def test_a_reference_lies_on_the_path():
    reference = lateral_reference(icub(), Ramp(0.03, 0.01))
    h = 1e-4
    for time in (0.2, 1.0, 2.313):
        here, before, after = (reference.at(t) for t in (time, time - h, time + h))
        stance = icub().at(here.posture, check=False)
        for place, home in zip(stance.placements, icub().placements, strict=True):
            assert np.abs(place.homogeneous - home.homogeneous).max() < 1e-8
        assert np.abs(stance.com - here.com).max() < 1e-8
        assert np.abs((after.com - before.com) / (2 * h) - here.com_velocity).max() < 1e-6
        acceleration = (after.com_velocity - before.com_velocity) / (2 * h)
        assert np.abs(acceleration - here.com_acceleration).max() < 1e-5
        assert np.abs(stance.jacobian @ here.velocity).max() < 1e-6


def test_a_ramp_arrives_without_a_jump():
    for signal in (Ramp(0.03, 0.01), Ramp(-0.001, 0.01), Ramp(0.0)):
        times = np.linspace(0.0, signal.duration + 0.5, 2001)
        value, rate, _ = np.array([signal.at(t) for t in times]).T
        assert value[0] == 0
        assert value[-1] == pytest.approx(signal.distance)
        assert np.abs(np.diff(value)).max() <= 1.001 * signal.speed * times[1] + 1e-12
        assert np.abs(np.diff(rate)).max() <= 1.001 * signal.speed / signal.rounding * times[1]


def test_the_prediction_says_both_orders():
    prediction = predict_lean(icub(), C1, -0.05)
    assert prediction.contact == "l_sole"
    # Criterion 1 is affine in the CoM: its first order is exact, criterion 2's is not.
    assert prediction.first_order == pytest.approx(prediction.excursion, abs=1e-9)
    other = predict_lean(icub(), C2, 0.05)
    assert 1.04 * other.excursion < other.first_order < 1.1 * other.excursion
    # A sine goes as far to either side, and to one of them first.
    for amplitude, contact in ((0.05, "r_sole"), (-0.05, "l_sole")):
        sine = predict(lateral_reference(icub(), Sine(amplitude, 0.1)), C1)
        assert (sine.contact, sine.how) == (contact, "tips")
    still = predict(lateral_reference(icub(), Hold()), C1)
    assert still.excursion == np.inf


def test_a_talos_leans():
    stance = copsense.load_stance("talos")
    engine = MujocoSimulator(stance)
    recording = ramp(C2, 0.01, stance=stance, engine=engine)
    assert recording.attrs["end_kind"] == "completed", recording.attrs["end_reason"]
    error = (recording["com"] - recording["com_target"]).sel(com_axis="y").values[-20:]
    assert np.abs(error).max() < 1e-4
