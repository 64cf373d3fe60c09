"""The wrenches and torques of every criterion hold the robot up, and are the cheapest that do."""

import numpy as np
import pinocchio as pin
import pytest
from support.loads import CRITERIA, criteria

import copsense

IMBALANCE = 1e-10  # of the weight


@pytest.mark.parametrize("name", CRITERIA)
def test_wrenches_and_torques_balance_the_weight_on_every_row_of_a_sweep(lateral_path, name):
    for stance in lateral_path.stances:
        found = copsense.solve_equilibrium(stance, criteria(stance)[name])
        assert found.residual() < IMBALANCE * stance.robot.weight


def test_wrenches_add_up_to_the_weight_under_the_com(lateral_path):
    # Newton and Euler on the whole robot, without a Jacobian: plain sums of forces and moments.
    for stance in lateral_path.stances:
        for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
            wrenches = copsense.solve_equilibrium(stance, criterion).world_wrenches
            arms = np.array([place.translation for place in stance.placements]) - stance.com
            moment = (np.cross(arms, wrenches[:, :3]) + wrenches[:, 3:]).sum(axis=0)
            mass = sum(inertia.mass for inertia in stance.robot.model.inertias)
            expected = [0, 0, 9.81 * mass]
            np.testing.assert_allclose(
                wrenches[:, :3].sum(axis=0), expected, rtol=0, atol=1e-10 * 9.81 * mass
            )
            np.testing.assert_allclose(moment, 0, rtol=0, atol=1e-10 * 9.81 * mass)


def test_torques_are_those_of_the_tree_cut_at_each_joint(icub):
    # The torque at a joint is what the wrenches and weights beyond it do about its axis.
    found = copsense.solve_equilibrium(icub, copsense.minimum_torque())
    model, data = icub.robot.model, icub.robot.model.createData()
    pin.forwardKinematics(model, data, icub.q)
    for joint in range(2, model.njoints):
        at = data.oMi[joint]
        moment = np.zeros(3)
        for body in model.subtrees[joint]:
            where = data.oMi[body].act(model.inertias[body].lever)
            weight = model.inertias[body].mass * np.array([0, 0, -9.81])
            moment += np.cross(where - at.translation, weight)
        for contact, place, wrench in zip(
            icub.contacts, icub.placements, found.world_wrenches, strict=True
        ):
            if icub.robot.frame(contact.frame).parentJoint in model.subtrees[joint]:
                moment += wrench[3:] + np.cross(place.translation - at.translation, wrench[:3])
        axis = at.rotation @ model.joints[joint].createData().S[3:].ravel()
        torque = found.torques[model.joints[joint].idx_v - 6]
        assert torque == pytest.approx(-axis @ moment, abs=1e-10)


def cost(stance, criterion, forces):
    torques = (stance.gravity - stance.jacobian.T @ forces)[stance.robot.base_nv :]
    quadratic = criterion.at(stance)
    W = quadratic.torque
    if quadratic.inertia:
        W = W + quadratic.inertia * np.linalg.inv(stance.mass_matrix[6:, 6:])
    return 0.5 * torques @ W @ torques + forces @ (0.5 * quadratic.wrench @ forces - quadratic.pull)


@pytest.mark.parametrize("name", CRITERIA)
def test_no_other_balanced_wrenches_cost_less(lateral_path, name):
    rng = np.random.default_rng(11)
    stance = lateral_path.stances[3]
    criterion = criteria(stance)[name]
    best = copsense.solve_equilibrium(stance, criterion).forces
    least = cost(stance, criterion, best)
    internal = np.linalg.svd(stance.jacobian[:, :6].T)[2][6:].T
    for _ in range(50):
        other = best + internal @ rng.standard_normal(6) * 10.0 ** rng.uniform(-2, 2)
        assert cost(stance, criterion, other) >= least - 1e-12 * abs(least)


def test_tie_break_takes_its_cheapest_among_the_first_criterions_minimisers(lateral_path):
    stance = lateral_path.stances[3]
    for second in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
        best = copsense.solve_equilibrium(stance, copsense.minimum_tangential(second)).forces
        least = cost(stance, second, best)
        # Moves that keep the balance and the tangential forces.
        tangential = np.isin(stance.component_index, (0, 1))
        kept = np.vstack([stance.jacobian[:, :6].T, np.eye(12)[tangential]])
        _, s, vt = np.linalg.svd(kept)
        free = vt[int(np.sum(s > 1e-10)) :].T
        assert free.shape[1] == 4
        for move in np.hstack([free, -free]).T:
            assert cost(stance, second, best + move) >= least
