"""Statics and controllers share the same load in the same way."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from statics.test_tie_break_within_limits import TIED, cases, corners
from support.grounds import off_centre
from support.loads import CRITERIA, criteria
from support.walkers import BIPED, NO_ANKLE_ROLL, bent, walker

import copsense
from copsense.controllers import (
    BalancingController,
    Hold,
    Observation,
    ShareByCriterion,
    lateral_reference,
)
from copsense.controllers.limited import ShareWithinLimits
from copsense.errors import InvalidInputError
from copsense.limits import Limits, limit_rows
from copsense.load_problem import LoadProblem
from copsense.statics import share_load

__all__ = ["corners"]  # a fixture


@pytest.fixture(scope="module")
def posture(lateral_path):
    return off_centre(lateral_path.stances[10])


def load(stance, moved):
    """The load of a stance, or one with the weight through another point."""
    own = LoadProblem.of(stance)
    twist = np.zeros(6) if not moved else np.array([3.0, -2.0, 5.0, 1.0, 2.0, 0.5])
    return replace(own, base_wrench=own.base_wrench + twist)


@pytest.mark.parametrize("moved", [False, True], ids=["at rest", "another load"])
@pytest.mark.parametrize("name", CRITERIA)
def test_a_controllers_quick_share_is_the_statics(posture, name, moved):
    criterion, problem = criteria(posture)[name], load(posture, moved)
    forces, torques = share_load(posture, criterion, problem)
    quick = ShareByCriterion(posture, criterion)(problem)
    weight = posture.robot.weight
    assert np.abs(quick - forces).max() < 1e-8 * weight
    np.testing.assert_allclose(torques, problem.torques(forces), rtol=0, atol=1e-12 * weight)
    assert problem.imbalance(forces) < 1e-12 * weight
    if not moved:
        own = copsense.solve_equilibrium(posture, criterion)
        np.testing.assert_array_equal(own.forces, forces)


@pytest.mark.parametrize(
    "limits",
    [Limits(), Limits(cop_margin=0.02), Limits(friction=0.02, cop_margin=0.01)],
    ids=["loose", "CoP", "friction"],
)
@pytest.mark.parametrize("criterion", [copsense.minimum_wrench(1.0), copsense.minimum_torque()])
def test_a_controllers_share_within_limits_is_the_statics(posture, criterion, limits):
    exact = copsense.solve_equilibrium(posture, criterion, limits)
    quick = ShareWithinLimits(posture, criterion, limits)(LoadProblem.of(posture))
    assert np.abs(quick - exact.forces).max() < 1e-6 * posture.robot.weight


def test_a_controllers_share_within_limits_breaks_ties_as_the_statics_do(corners, icub):
    pressed = 0
    for stance, criterion, limits, exact in cases(corners, icub, 24, seed=5):
        quick = ShareWithinLimits(stance, criterion, limits)(LoadProblem.of(stance))
        assert np.abs(quick - exact.forces).max() < 1e-6 * stance.robot.weight
        pressed += bool(exact.active)
    assert pressed > 10


@pytest.mark.parametrize(
    "limits", [None, Limits(friction=0.6, cop_margin=0.025)], ids=["", "within"]
)
def test_feet_that_lean_a_little_change_a_controllers_command_a_little(limits):
    # Motors of legs without ankle roll feel their internal forces as soon as a foot leans.
    limbs = {"l": (0, 0.1), "r": (0, -0.1), "left_arm": (0, 0.3), "right_arm": (0, -0.3)}
    stance = copsense.load_stance(
        walker(NO_ANKLE_ROLL, legs=limbs), contacts=BIPED, contact_at="sole", posture=bent()
    )
    controller = BalancingController(stance, TIED, limits=limits)
    target, model = lateral_reference(stance, Hold()).at(0.0), stance.robot.model
    rng = np.random.default_rng(2)
    lean, v, still = rng.standard_normal(model.nv), np.zeros(model.nv), np.zeros((2, 6))

    hurried = replace(target, com_acceleration=np.array([0.2, 0.3, 0.1]))

    def command(size, target=hurried):
        q = pin.integrate(model, stance.q, size * lean)
        return controller(Observation(0.0, q, v, target, still))

    weight, hurry = stance.robot.weight, command(0.0)
    statics = copsense.solve_equilibrium(stance, TIED, limits)
    assert np.abs(command(0.0, target).wrenches - statics.wrenches).max() < 1e-6 * weight
    for size in (1e-7, 1e-6, 1e-5, 1e-4, 1e-3):
        moved = command(size)
        assert np.abs(moved.wrenches - hurry.wrenches).max() < 100 * size * weight
        assert np.abs(moved.torques - hurry.torques).max() < 100 * size * weight


@pytest.mark.parametrize("criterion", [copsense.minimum_wrench(1.0), copsense.minimum_torque()])
def test_the_same_holds_where_a_torque_is_at_its_limit(posture, criterion):
    free = np.abs(copsense.solve_equilibrium(posture, criterion).torques)
    joint = posture.robot.torque_names.index("l_hip_roll")
    limits = Limits(torque={"l_hip_roll": 0.95 * float(free[joint])})
    exact = copsense.solve_equilibrium(posture, criterion, limits)
    assert [limit.name for limit in exact.active] == ["torque of l_hip_roll"]
    quick = ShareWithinLimits(posture, criterion, limits)(LoadProblem.of(posture))
    assert np.abs(quick - exact.forces).max() < 1e-6 * posture.robot.weight


@pytest.mark.parametrize(
    "limits",
    [Limits(), Limits(torque="model"), Limits(normal_force=None, cop_margin=None, torque=5.0)],
    ids=["contacts", "both", "torques"],
)
def test_the_excess_is_that_of_the_row_exceeded_most(posture, limits):
    rng, problem = np.random.default_rng(4), load(posture, moved=True)
    rows = limit_rows(posture, limits)
    A, b = rows.over_forces(problem)
    for f in 100.0 * rng.standard_normal((30, A.shape[1])):
        assert rows.excess(problem, f) == pytest.approx(np.max(A @ f - b), abs=1e-9)


def test_the_cost_over_the_forces_is_the_criterions(posture):
    rng, problem = np.random.default_rng(3), LoadProblem.of(posture)
    for name, criterion in criteria(posture).items():
        quadratic = criterion.at(posture)
        H, g = quadratic.over_forces(problem)
        W = quadratic.torque_weight(problem)

        def cost(f, W=W, quadratic=quadratic):
            tau = problem.torques(f)
            return tau @ W @ tau / 2 + f @ (quadratic.wrench @ f / 2 - quadratic.pull)

        a, b = rng.standard_normal((2, len(g))) * 10
        change = (a @ H @ a - b @ H @ b) / 2 - g @ (a - b)
        assert change == pytest.approx(cost(a) - cost(b), rel=1e-9, abs=1e-9), name
        np.testing.assert_allclose(H, H.T, rtol=0, atol=1e-9 * np.abs(H).max())


def test_a_weight_that_follows_no_inertia_is_rejected_for_control(posture):
    problem = LoadProblem.of(posture)
    massless = np.array(problem.joint_inertia)
    massless[3] = massless[:, 3] = 0.0
    share = ShareByCriterion(posture, copsense.weighted_torque("inverse inertia"))
    with pytest.raises(InvalidInputError, match="every joint to move some mass"):
        share(replace(problem, joint_inertia=massless))
