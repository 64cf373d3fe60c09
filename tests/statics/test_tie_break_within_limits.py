"""Within limits, a tie-break chooses among a criterion's optima: proved optimal twice over.

Of a convex program a point is optimal if its gradient is a non-negative combination of the rows it
touches; non-negative least squares finds it or leaves a residual. Here that is done for the
criterion, and for the tie-break over what the criterion leaves free.
"""

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import nnls

import copsense
from copsense import Contact, Limits, TorqueTerm, minimum_torque, minimum_wrench
from copsense.analysis.asked import determined_criteria
from copsense.criterion import Criterion
from copsense.errors import (
    InfeasibleError,
    InvalidInputError,
    UndeterminedWrenchError,
)
from copsense.limits import limit_rows
from copsense.load_problem import LoadProblem
from copsense.scan import PathScan
from copsense.statics import with_tie_break

CORNERS = [(-0.05, -0.03), (0.1, -0.03), (0.1, 0.03), (-0.05, 0.03)]
TIED = minimum_torque(tie_break=minimum_wrench(1.0))
LEVEL = copsense.minimum_tangential(minimum_wrench(0.5))  # zero on level ground: rounding is left


@pytest.fixture(scope="module")
def corners(icub):
    """The iCub on the four corners of each foot: heel and toe push against each other freely."""
    points = [
        Contact(
            foot.frame,
            kind="point",
            name=f"{foot.name} {i}",
            offset=tuple(np.array(foot.offset) + foot.rotation @ [x, y, 0.0]),
        )
        for foot in icub.contacts
        for i, (x, y) in enumerate(CORNERS)
    ]
    return copsense.Stance(icub.robot, icub.q, points)


def idle_ankles(robot):
    """A criterion to which some torques cost nothing, so that motors feel what it leaves free."""
    names = robot.torque_names
    weights = {n: 0.0 if "ankle" in n or "hip_roll" in n else 1.0 for n in names}
    return Criterion("idle ankles", (TorqueTerm(weights),), tie_break=minimum_wrench(0.3))


def few_joints(robot):
    """A criterion to which most torques cost nothing: what is free turns with the posture."""
    weighed = ("l_knee", "r_knee", "l_hip_pitch", "r_hip_roll")
    weights = {n: float(n in weighed) for n in robot.torque_names}
    return Criterion("few joints", (TorqueTerm(weights),), tie_break=minimum_wrench(0.3))


def cases(corners, icub, count, seed):
    rng = np.random.default_rng(seed)
    for k in range(count):
        stance = icub if k % 3 == 0 else corners
        criterion = {1: TIED, 3: LEVEL, 4: TIED}.get(k % 6, idle_ankles(icub.robot))
        Z = stance.admissible_motions
        here = copsense.posture.retract(stance, Z @ rng.normal(size=Z.shape[1]) * 0.08)
        torque = None if rng.random() < 0.6 else {"l_knee": rng.uniform(2, 8), "r_ankle_roll": 0.5}
        limits = Limits(
            friction=float(rng.choice([0.02, 0.1, 0.3])),
            normal_force=float(rng.choice([0, 10, 25])),
            torque=torque,
        )
        try:
            yield here, criterion, limits, copsense.solve_equilibrium(here, criterion, limits)
        except InfeasibleError:
            continue


def left_over(rows, gradient):
    """What no non-negative combination of rows removes of a gradient."""
    if not rows.size:
        return float(np.linalg.norm(gradient))
    return nnls(rows.T, -gradient, maxiter=100 * len(rows))[1]


def test_neither_the_criterion_nor_its_tie_break_can_be_had_for_less(corners, icub):
    pressed = 0
    for here, criterion, limits, found in cases(corners, icub, 60, 3):
        problem, f, weight = LoadProblem.of(here), found.forces, here.robot.weight
        A, b = limit_rows(here, limits).over_forces(problem)
        size = np.maximum(np.linalg.norm(A, axis=1), 1e-12)
        assert ((b - A @ f) / size).min() > -1e-9 * weight
        assert found.residual() < 1e-9 * weight
        assert found.optimality() < 1e-8
        touched = (A / size[:, None])[(b - A @ f) / size < 1e-8 * weight]
        E = problem.base_map.T
        N = null_space(E.T)
        H, g = criterion.at(here).over_forces(problem)
        scale = max(np.abs(H @ f - g).max(), 1e-6 * weight * np.abs(H).max())
        assert left_over(touched @ N, N.T @ (H @ f - g)) < 1e-7 * scale
        # The second cost: along F both ways, and along it only as far as the rows let go.
        F = null_space(np.vstack([E.T, H / np.abs(H).max()]), rcond=1e-9)
        H2, g2 = criterion.tie_break.at(here).over_forces(problem)
        pull = F.T @ (H2 @ f - g2)
        held = A[found.row_multipliers > 0] @ F
        both = np.vstack([touched @ F, held, -held])
        assert left_over(both, pull) < 1e-7 * max(np.abs(H2 @ f - g2).max(), 1.0)
        pressed += np.linalg.norm(pull) > 1e-6 * weight
    assert pressed > 5  # the tie-break alone pressed on limits too


def test_where_nothing_presses_it_is_the_answer_without_limits(corners):
    free = copsense.solve_equilibrium(corners, TIED)
    found = copsense.solve_equilibrium(corners, TIED, Limits(friction=0.9))
    assert not found.active
    np.testing.assert_allclose(found.forces, free.forces, rtol=0, atol=1e-9)
    Z = corners.admissible_motions
    for one, two in zip(found.derivative(Z), free.derivative(Z), strict=True):
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-7)


def compared(here, criterion, limits, found, seed):
    """A derivative against differences, if no limit begins or ceases to press between them."""
    step = 2e-4
    Z = here.admissible_motions
    v = Z @ np.random.default_rng(seed).normal(size=Z.shape[1])
    v /= np.linalg.norm(v)
    at = {
        k: copsense.solve_equilibrium(
            copsense.posture.retract(here, k * step * v), criterion, limits
        )
        for k in (-2, -1, 1, 2)
    }
    sets = [(e._problem.strong, e._problem.tied) for e in (found, *at.values())]
    if any(not np.array_equal(one, sets[0]) for one in sets):
        return False
    for name, exact in zip(("forces", "torques"), found.derivative(v[:, None]), strict=True):
        far, near = (getattr(at[k], name) - getattr(at[-k], name) for k in (2, 1))
        numeric = (8 * near - far) / (12 * step)
        size = max(1.0, np.abs(numeric).max())
        np.testing.assert_allclose(exact[:, 0] / size, numeric / size, rtol=0, atol=1e-7)
    return True


def test_derivatives_are_those_of_the_whole_solution(corners, icub):
    count = pressed = 0
    for here, criterion, limits, found in cases(corners, icub, 24, 5):
        problem = found._problem
        soft = problem.program.curvature
        soft = soft[soft > 1e-11 * soft[-1]]
        if soft[0] < 1e-5 * soft[-1]:
            continue  # rounding of the costs themselves is seen
        if compared(here, criterion, limits, found, count):
            count += 1
            pressed += bool(problem.tied.any())
    assert count > 8
    assert pressed > 1


def test_derivatives_where_what_is_free_turns_with_the_posture(icub):
    criterion, rng, count = few_joints(icub.robot), np.random.default_rng(3), 0
    Z = icub.admissible_motions
    for _ in range(60):
        here = copsense.posture.retract(icub, Z @ rng.normal(size=Z.shape[1]) * 0.08)
        limits = Limits(
            friction=float(rng.choice([0.02, 0.1, 0.3])),
            normal_force=float(rng.choice([0, 10, 25])),
        )
        found = copsense.solve_equilibrium(here, criterion, limits)
        problem = found._problem
        if problem.tie._left_free(np.flatnonzero(problem.strong)).shape[1]:
            count += compared(here, criterion, limits, found, count)
    assert count > 0


def test_the_path_is_followed_until_a_limit_binds(corners):
    limits = Limits(friction=None, normal_force=20.0)
    change = PathScan(copsense.path.LateralPath(corners), TIED, limits).next_active_set_change(1)
    assert change.binds
    assert change.kind == "normal force"
    y = corners.com[1] + change.travel
    for side, active in ((-1e-5, False), (1e-5, True)):
        there, _ = copsense.path.lateral_posture(corners, y + side)
        found = copsense.solve_equilibrium(there, TIED, limits)
        assert bool(found.active) == active


def test_a_limit_that_the_tie_break_alone_presses_is_not_followed(corners):
    limits = Limits(friction=None, normal_force=27.0)
    found = copsense.solve_equilibrium(corners, TIED, limits)
    assert found._problem.tied.any()
    assert found.active[0].multiplier == 0.0
    with pytest.raises(InvalidInputError, match="the tie-break alone presses on l_sole"):
        found.next_active_set_change(corners.admissible_motions[:, 0])
    with pytest.raises(InvalidInputError, match=r"the tie-break alone presses on .*Give the crit"):
        found.nearest_active_set_change(corners.com_motions)


def test_a_batch_has_no_nearest_change_where_the_tie_break_alone_presses(icub):
    # On level ground no foot needs a tangential force: the tie-break chooses the rest.
    level, limits = copsense.minimum_tangential(minimum_wrench(1.0)), Limits(cop_margin=0.025)
    ahead = copsense.solve_posture(icub, com=(0.0, 0.03, None)).stance
    q = np.array([icub.q, ahead.q])
    tied = []
    within = copsense.batch.evaluate_batch(icub, q, [level], limits).limits
    for i, row in enumerate(q):
        found = copsense.cop_sensitivity(icub.at(row), level, limits)
        tied.append(bool(found.equilibrium._problem.tied.any()))
        change = within.nearest_change(i, 0)
        if tied[i]:
            assert np.isnan(within.change_travel[i, 0])
            assert change is None
            with pytest.raises(InvalidInputError, match="Give the criterion a small share"):
                found.nearest_active_set_change()
        else:
            nearest = found.nearest_active_set_change()
            assert change.travel == pytest.approx(nearest.travel, rel=1e-9)
            assert change.name == nearest.name
    assert sorted(tied) == [False, True]


def test_without_a_tie_break_it_says_so(corners):
    with pytest.raises(UndeterminedWrenchError, match="tie_break such as minimum_wrench"):
        copsense.solve_equilibrium(corners, minimum_torque(), Limits())
    alike = minimum_torque(tie_break=minimum_torque())
    with pytest.raises(UndeterminedWrenchError, match="leaves wrenches undetermined too"):
        copsense.solve_equilibrium(corners, alike, Limits())
    assert with_tie_break(corners, minimum_torque()).tie_break == minimum_wrench(1.0)


def test_an_analysis_within_limits_takes_the_tie_break_by_itself(corners):
    chosen = {"minimum-torque": minimum_torque()}
    found, notes = determined_criteria(corners, chosen, Limits(friction=0.4))
    assert found["minimum-torque"] == TIED
    assert "of these the least wrench is shown" in notes[0]
