"""Laws of any closed loop: still if undisturbed, mirrored by a mirror, worse when pushed more."""

import numpy as np
import pytest
from support.standing import C1, C2, icub, second_at_rest, simulator

from copsense.controllers import BalancingController, Ramp, public_gains
from copsense.simulation import (
    FrictionChange,
    ModelError,
    MujocoSimulator,
    Noise,
    Push,
    Scenario,
    rollout,
)

# Of a wrench (fx, fy, fz, mx, my, mz), in the mirror y -> -y.
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


def run(criterion, duration, *arguments, gains=None, wrenches=None, **options):
    controller = BalancingController(icub(), criterion, *([gains] if gains else []))
    engine = MujocoSimulator(icub(), wrenches=wrenches) if wrenches else simulator()
    return rollout(engine, controller, Scenario(duration, *arguments, **options))


STILL = {
    "plain": {},
    "soft": {"gains": public_gains(icub().robot), "control_period": 0.01},
    "sensors": {"wrenches": "sensors"},
    "odometry": {"odometry": "l_sole"},
}


@pytest.mark.parametrize("condition", STILL)
def test_nothing_disturbs_and_nothing_moves(condition):
    plain = condition == "plain"
    recording = second_at_rest(C2) if plain else run(C2, 1.0, **STILL[condition])
    assert recording.attrs["end_kind"] == "completed"
    drift = np.abs(recording["com"] - icub().com).max("time").values
    # The feet sink by 0.02 mm, which is all that moves the CoM. Odometry does not know of that: a
    # foot of 70 mm that sinks on one side alone is a CoM, 0.55 m up, that is 0.3 mm off.
    assert drift[:2].max() < (3e-4 if condition == "odometry" else 1e-5)
    assert drift[2] < 1e-4
    speed = np.abs(recording["joint_velocity"]).max("joint").values
    assert speed[-1] < 1e-3


@pytest.mark.parametrize(
    "world",
    [
        {},
        {"model_error": ModelError(0.05, {"root_joint": 2.0}), "wrenches": "sensors"},
        {"friction": (FrictionChange(0.02, 0.12),)},
    ],
    ids=["plain", "heavier, by sensors", "slippery"],
)
def test_the_mirrored_scenario_has_the_mirrored_result(world):
    left, right = (
        run(
            C2,
            0.4,
            Ramp(side * 0.01, 0.05),
            (Push((3.0, side * 6.0, 0.0), start=0.1, duration=0.1),),
            **world,
        )
        for side in (1, -1)
    )
    assert left.attrs["end_kind"] == right.attrs["end_kind"]
    assert left.attrs["end_time"] == pytest.approx(right.attrs["end_time"], abs=2e-3)
    n = min(left.sizes["time"], right.sizes["time"])
    flipped = right["com"].values[:n] * [1.0, -1.0, 1.0]
    assert np.abs(left["com"].values[:n] - flipped).max() < 2e-5
    assert np.ptp(left["com"].values[:n, 1]) > 1e-3  # it did move
    # iCub's inertias are not quite mirror images of each other.
    wrench = right["wrench"].values[1:n, ::-1] * MIRROR
    off = np.abs(left["wrench"].values[1:n] - wrench)[4:].max()
    assert off < 5e-3 * icub().robot.weight


@pytest.mark.parametrize(
    ("criterion", "direction"), [(C1, (0, 1)), (C2, (0, -1)), (C2, (-0.6, 0.8))]
)
def test_a_heavier_push_never_leaves_a_larger_smallest_margin(criterion, direction):
    forces = np.sort(np.random.default_rng(7).uniform(0.0, 60.0, 3))
    margins = []
    for force in (0.0, *forces):
        x, y = force * np.array(direction)
        push = Push((float(x), float(y), 0.0), start=0.05, duration=0.05)
        recording = run(criterion, 0.3, pushes=(push,))
        tip = recording.attrs["tip_time"]
        standing = recording.sel(time=slice(0.02, tip if np.isfinite(tip) else None))
        margins.append(float(standing["margin"].min()))
    # Of those that tip, the smallest margin is nought: to 0.1 mm.
    assert np.diff(margins).max() < 1e-4
    assert margins[0] - margins[-1] > 1e-3


def test_noise_of_the_same_seed_is_the_same_whatever_else_is_noisy():
    joints = run(C2, 0.05, noise=Noise(1e-4, 1e-3), seed=5)
    all_ = run(C2, 0.05, noise=Noise(1e-4, 1e-3, 1.0, 0.1), seed=5)
    assert np.array_equal(joints["torque"], all_["torque"])
    assert not np.array_equal(joints["wrench"], all_["wrench"])
