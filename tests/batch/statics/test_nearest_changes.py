"""The nearest change of the pressing limits: moved there and solved again, it is where it says."""

import numpy as np
import pytest
from support.stances import postures, served, tight

import copsense
from copsense.batch import BatchKernel
from copsense.batch.statics.limit_result import CHANGES
from copsense.batch.statics.limit_states import IMPOSSIBLE, LIMIT_STATES, PRESSED, WITHIN

PER_CASE = 30
NEAR = 4e-4  # m: so near that first order is good to a few percent
WAYS = 8  # horizontal directions that are tried beside the worst


def rates_along(found, row, binds):
    """How fast a row's slack, or its multiplier where it presses, changes along CoM x and y."""
    both = [found.equilibrium.rates(motion) for motion in found.com_motions.T]
    return np.array([r.slack[row] if binds else r.multipliers[row] for r in both])


def pressing_after(found, limits, along):
    """Rows of the limits that press once the CoM has moved like this (x, y), contacts in place."""
    moved = copsense.posture.retract(found.equilibrium.stance, found.com_motions @ along)
    there = copsense.solve_equilibrium(moved, found.equilibrium.criterion, limits)
    return set(there.pressing)


@pytest.mark.parametrize("name", ["icub", "icub, both hands", "talos on slopes", "anymal_c", "g1"])
def test_limits_change_at_the_nearest_change_and_nowhere_before(case, name):
    stance = case(name)
    q = postures(stance, PER_CASE, seed=6, size=0.1)
    limits, criteria = tight(stance, q), served(stance)
    within = BatchKernel(stance, criteria, limits).evaluate(q).limits
    near = np.argwhere((within.change_travel > 1e-6) & (within.change_travel < NEAR)).tolist()
    # Limits that bind, and limits that let go.
    binds = [at for at in near if within.nearest_change(*at).binds]
    chosen = [*binds[:2], *[at for at in near if at not in binds][:2]]
    assert len(chosen) > 1
    for i, j in chosen:
        change = within.nearest_change(i, j)
        found = copsense.cop_sensitivity(stance.at(q[i]), criteria[j], limits)
        row, held = within.change_limit[i, j], set(found.equilibrium.pressing)
        assert (row in held) != change.binds
        worst = -rates_along(found, row, change.binds)
        worst *= change.travel / np.linalg.norm(worst)
        angles = 2 * np.pi * np.arange(WAYS) / WAYS
        turned = change.travel * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        for along in (worst, *turned):
            assert pressing_after(found, limits, 0.9 * along) == held
        after = pressing_after(found, limits, 1.1 * worst)
        assert (row in after) == change.binds


@pytest.mark.parametrize("name", ["icub", "icub, hand on a wall"])
def test_no_limit_comes_nearer_unseen_where_nothing_presses(case, name):
    # By the margins of the criterion's own wrenches, whose gradient is found by differences.
    stance, criterion, step = case(name), served(case(name))[1], 1e-5
    q = postures(stance, PER_CASE, seed=7)
    limits = tight(stance, q, share=0.9)
    within = BatchKernel(stance, [criterion], limits).evaluate(q).limits
    i = int(np.flatnonzero((within.state[:, 0] == WITHIN) & (within.change_limit[:, 0] >= 0))[0])
    here = stance.at(q[i])
    slack = copsense.solve_equilibrium(here, criterion, limits).slack
    ends = [
        [
            copsense.solve_equilibrium(
                copsense.posture.retract(here, side * step * motion), criterion, limits
            ).slack
            for side in (1, -1)
        ]
        for motion in here.com_motions.T
    ]
    rates = np.array([(after - before) / (2 * step) for after, before in ends])
    speed = np.linalg.norm(rates, axis=0)
    moves = speed > 1e-6 * stance.robot.weight
    travels = slack[moves] / speed[moves]
    assert within.change_travel[i, 0] == pytest.approx(travels.min(), rel=1e-6)
    assert within.change_limit[i, 0] == np.flatnonzero(moves)[np.argmin(travels)]


def test_without_gains_there_are_no_changes(case):
    stance = case("icub")
    limits = copsense.Limits(friction=0.3, cop_margin=0.01)
    kernel = BatchKernel(stance, served(stance), limits, gains=False)
    found = kernel.evaluate(stance.q[None])
    for one in (found, kernel.one(stance.q)):
        assert {getattr(one.limits, name).shape for name in CHANGES} == {(0, 4)}
        assert one.limits.nearest_change(0, 1) is None
    assert found.limits.state.shape == (1, 4)
    other = BatchKernel(stance, served(stance), limits).empty(1)
    with pytest.raises(copsense.errors.InvalidInputError, match="Make it with BatchKernel"):
        kernel.evaluate(stance.q[None], out=other)


def test_arrays_used_again_keep_no_change_of_before(case):
    stance = case("icub")
    q = postures(stance, 12, seed=4)
    limits, criteria = tight(stance, q, share=0.35), served(stance)
    kernel = BatchKernel(stance, criteria, limits)
    fresh = kernel.evaluate(q)
    states = fresh.limits.state
    assert {WITHIN, PRESSED, IMPOSSIBLE} <= set(states.ravel())
    out = kernel.empty(len(q))
    out.limits.change_travel[...], out.limits.change_limit[...] = 123.0, 7
    kernel.evaluate(q, out=out)
    for name in CHANGES:
        np.testing.assert_array_equal(getattr(out.limits, name), getattr(fresh.limits, name))
    nowhere = states == LIMIT_STATES.index("infeasible")
    assert np.isnan(out.limits.change_travel[nowhere]).all()
    assert (out.limits.change_limit[nowhere] == -1).all()


def test_a_row_by_the_reference_has_its_nearest_change_too(case):
    # A criterion that the kernel leaves, beside one that it answers.
    stance = case("icub")
    own = copsense.minimum_torque(tie_break=copsense.minimum_wrench(1.0), name="tied")
    level = copsense.minimum_tangential(copsense.minimum_wrench(1.0))
    limits = copsense.Limits(friction=0.3, cop_margin=0.001)
    kernel = BatchKernel(stance, [served(stance)[1], level, own], limits)
    assert level.name in kernel.by_reference
    q = postures(stance, 3, seed=8, size=0.05)
    within = kernel.evaluate(q).limits
    known = 0
    for i, j in np.ndindex(within.state.shape):
        if within.change_limit[i, j] < 0:
            assert within.nearest_change(i, j) is None
            continue
        known += 1
        found = copsense.cop_sensitivity(stance.at(q[i]), kernel.criteria[j], limits)
        nearest, change = found.nearest_active_set_change(), within.nearest_change(i, j)
        assert change.travel == pytest.approx(nearest.travel, rel=1e-9)
        assert (change.criterion, change.name) == (nearest.criterion, nearest.name)
    assert known > 6


def test_a_planar_robot_has_nearest_changes(stance_of):
    stance = stance_of("four_bar")
    limits = copsense.Limits(friction=0.4)
    kernel = BatchKernel(stance, [copsense.minimum_torque()], limits)
    q = np.array([s.q for s in copsense.lateral_sweep(stance, -0.02, 0.02, 3).stances])
    within = kernel.evaluate(q).limits
    for i, row in enumerate(q):
        found = copsense.cop_sensitivity(stance.at(row), copsense.minimum_torque(), limits)
        nearest, change = found.nearest_active_set_change(), within.nearest_change(i, 0)
        assert np.isfinite(nearest.travel)
        assert (change.name, change.travel) == (nearest.name, pytest.approx(nearest.travel))


def test_where_no_limit_comes_nearer_the_travel_is_infinite(icub):
    # On one foot the normal force is the weight, whatever the CoM does.
    one_foot = copsense.Stance(icub.robot, icub.q, icub.contacts[:1])
    limits = copsense.Limits(friction=None, cop_margin=None, normal_force=10.0)
    kernel = BatchKernel(one_foot, [copsense.minimum_torque()], limits)
    within = kernel.evaluate(icub.q[None]).limits
    assert np.isposinf(within.change_travel).all()
    assert (within.change_limit == -1).all()
    assert within.nearest_change(0, 0) is None
