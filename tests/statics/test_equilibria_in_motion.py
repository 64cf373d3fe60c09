"""Equilibria of a robot in motion: inertia is part of the load, in every kind of statics."""

import numpy as np
import pytest
from support.driven_robots import everything, rod_biped_model, rod_drives, standing
from support.engines import MujocoRobot
from support.grounds import off_centre

import copsense
from copsense import Limits, Load, Robot, cop_sensitivity, minimum_torque, minimum_wrench, mixed
from copsense.batch.layout import why_not_covered
from copsense.cop import total_center_of_pressure, zero_moment_point
from copsense.errors import InvalidInputError, UnbalancedError
from copsense.loads import SpringLoad
from copsense.sensitivity import finite_difference_sensitivity

TORQUE, WRENCH = minimum_torque(), minimum_wrench(0.1)
BOTH = mixed((TORQUE, 1.0), (WRENCH, 0.2))
LIMITS = Limits(friction=0.6, cop_margin=0.005, torque=60.0)


def in_motion(stance, seed, speed=0.5):
    """The stance with a random admissible velocity, and an acceleration that keeps its feet."""
    rng = np.random.default_rng(seed)
    Z, J = stance.admissible_motions, stance.constraints
    v = Z @ rng.uniform(-speed, speed, Z.shape[1])
    # J a + d(J v)/dt = 0
    held = -np.linalg.lstsq(J, stance.motion_derivative(v) @ v, rcond=1e-10)[0]
    return stance.moving(v, held + Z @ rng.uniform(-2 * speed, 2 * speed, Z.shape[1]))


@pytest.fixture(scope="module")
def moving(icub):
    return in_motion(off_centre(icub), seed=1)


@pytest.mark.parametrize("criterion", [TORQUE, WRENCH, BOTH], ids=lambda c: c.name)
@pytest.mark.parametrize("limits", [None, LIMITS], ids=["free", "within limits"])
def test_wrenches_and_torques_are_mujocos_inverse_dynamics(icub, criterion, limits):
    engine = MujocoRobot(icub.robot)
    for seed in range(4):
        moving = in_motion(off_centre(icub), seed, speed=0.2)
        found = copsense.solve_equilibrium(moving, criterion, limits)
        assert np.abs(moving.balance - moving.gravity).max() > 1.0  # the motion is felt
        assert np.abs(engine.imbalance(found)).max() < 1e-9
        assert found.residual() < 1e-9


@pytest.mark.parametrize("criterion", [TORQUE, WRENCH], ids=lambda c: c.name)
def test_net_centre_of_pressure_is_the_zero_moment_point(moving, criterion):
    found = copsense.solve_equilibrium(moving, criterion)
    expected = zero_moment_point(moving, moving.motion.velocity, moving.motion.acceleration)
    np.testing.assert_allclose(total_center_of_pressure(found), expected, rtol=0, atol=1e-12)
    assert np.abs(expected[:2] - moving.com[:2]).max() > 1e-3


@pytest.mark.parametrize("limits", [None, LIMITS], ids=["free", "within limits"])
def test_derivatives_hold_the_numbers_of_velocity_and_acceleration(moving, limits):
    exact = cop_sensitivity(moving, BOTH, limits)
    numeric = finite_difference_sensitivity(moving, BOTH, limits)
    for name in ("matrix", "wrench_derivative", "torque_derivative"):
        a, b = getattr(exact, name), getattr(numeric, name)
        assert np.abs(a - b).max() < 1e-7 * np.abs(b).max(), name
    at_rest = cop_sensitivity(moving.at_rest(), BOTH, limits)
    assert np.abs(exact.matrix - at_rest.matrix).max() > 1e-3


def test_load_follows_velocity_and_acceleration(moving):
    rng = np.random.default_rng(3)
    dv, da = rng.uniform(-1, 1, (2, moving.robot.model.nv))
    v, a, step = moving.motion.velocity, moving.motion.acceleration, 1e-3
    N = {s: moving.moving(v + s * step * dv, a + s * step * da).balance for s in (-1, 1)}
    # The balance is quadratic in them: central differences are exact.
    numeric = (N[1] - N[-1]) / (2 * step)
    np.testing.assert_allclose(moving.motion_load_rate(dv, da), numeric, rtol=0, atol=1e-9)


def test_drives_loads_and_loops_are_carried_in_motion_too():
    loads = (
        Load("hand", (10.0, -5.0, -20.0)),
        SpringLoad("hand", (0.1, 0.2, 0.3), (100.0, 50.0, 20.0)),
    )
    robot = Robot.from_model(rod_biped_model(), drives=rod_drives("ball"))
    stance = standing(robot, 0.01).with_loads(loads)
    moving = in_motion(stance, seed=5, speed=0.3)
    found = copsense.solve_equilibrium(moving, minimum_torque())
    assert found.residual() < 1e-9
    assert np.abs(moving.balance - stance.balance).max() > 1.0
    exact = cop_sensitivity(moving, minimum_torque())
    numeric = finite_difference_sensitivity(moving, minimum_torque())
    error = np.abs(exact.wrench_derivative - numeric.wrench_derivative).max()
    assert error < 1e-7 * np.abs(numeric.wrench_derivative).max()


def test_a_joint_that_hangs_does_not_follow_a_motion_of_its_own():
    moving = in_motion(standing(everything(), 0.01), seed=5, speed=0.3)
    with pytest.raises(UnbalancedError, match=r"lack"):
        copsense.solve_equilibrium(moving, TORQUE)


def test_motion_without_velocity_and_acceleration_is_rest(icub):
    still = np.zeros(icub.robot.model.nv)
    at_rest = copsense.solve_equilibrium(icub, TORQUE)
    found = copsense.solve_equilibrium(icub.moving(still, still), TORQUE)
    np.testing.assert_allclose(found.forces, at_rest.forces, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.torques, at_rest.torques, rtol=0, atol=1e-9)


AT_REST = {
    "analysis": copsense.analyse,
    "posture": copsense.solve_posture,
    "payload": lambda moving: copsense.posture.carry_payload(moving, "chest", 1.0),
    "sweep": lambda moving: copsense.lateral_sweep(moving, -0.01, 0.01, 3),
    "list": lambda moving: copsense.path_through(moving, [moving.q]),
    "regions": lambda moving: copsense.com_regions(moving, [TORQUE], LIMITS),
    "push": lambda moving: copsense.pushes.push_limits(moving, "chest"),
    "balance": copsense.balance,
    "file": lambda moving: copsense.robots.save_stance(moving, "never_written.toml"),
}


@pytest.mark.parametrize("use", AT_REST.values(), ids=AT_REST.keys())
def test_what_is_of_a_robot_at_rest_rejects_one_in_motion(moving, use):
    with pytest.raises(InvalidInputError, match=r"at rest.*at_rest\(\)"):
        use(moving)


def test_the_batch_answers_a_stance_in_motion_by_the_reference(moving):
    assert "moves" in why_not_covered(moving)


def test_a_motion_of_another_size_is_rejected(icub):
    with pytest.raises(InvalidInputError, match="velocity has shape"):
        icub.moving(np.zeros(3), np.zeros(29))
    with pytest.raises(InvalidInputError, match="acceleration is not finite"):
        icub.moving(np.zeros(29), np.full(29, np.nan))
