"""Equilibria within limits are the optima that independent solvers find, on thousands of problems.

clarabel solves each problem from raw data (raw_qp.py); an interior point is only good to the root
of its gap, so it is polished onto its own active set and held against the optimality conditions.
Where clarabel's does not stand, piqp's has to; where both give up, a linear program says whether
there is anything to find.
"""

from collections import Counter

import numpy as np
import pytest
from scipy.optimize import linprog
from support.random_cases import random_case, random_stance
from support.raw_qp import joint_bounds, kkt_error, polish, raw_problem, solve_clarabel, solve_piqp

import copsense
from copsense.errors import InfeasibleError
from copsense.limits import limit_rows

ROBOTS = ("icub", "talos", "romeo", "g1", "solo12", "four_bar")
POSTURES, PROBLEMS = 35, 10  # a robot: 2100 problems in all
SAME = 1e-9  # of the weight


def solved(stance, seed, postures):
    """Random problems at a robot's random postures, each beside copsense's answer or refusal."""
    rng = np.random.default_rng(seed)
    for _ in range(postures):
        here = random_stance(stance, rng)
        for _ in range(PROBLEMS):
            case = random_case(here, rng)
            try:
                yield case, copsense.solve_equilibrium(here, case.criterion, case.limits)
            except InfeasibleError as error:
                yield case, error


def independent(raw):
    """A certified optimum and the solver's name; ("infeasible", None); or what went wrong."""
    said = []
    for name, solver in (("clarabel", solve_clarabel), ("piqp", solve_piqp)):
        status, x, z = solver(raw)
        said.append(f"{name}: {status}")
        if "Infeasible" in status or "INFEASIBLE" in status:
            return "infeasible", None
        x, error = polish(raw, x, z)
        if error < 1e-10:
            return name, x
    return ("infeasible", None) if least_violation(raw) > 1e-7 else ("; ".join(said), None)


def least_violation(raw):
    """By how much the inequality rows, each of length one, have to be relaxed at least."""
    size = len(raw.c)
    cost = np.append(np.zeros(size), 1.0)
    C = np.hstack([raw.C, -np.ones((len(raw.d), 1))])
    E = np.hstack([raw.E, np.zeros((len(raw.e), 1))])
    found = linprog(cost, C, raw.d, E, raw.e, [(None, None)] * size + [(0, None)])
    assert found.status == 0
    return found.fun


@pytest.mark.parametrize("robot", ROBOTS)
def test_wrenches_are_an_independent_solvers(stance_of, robot):
    who, active = Counter(), Counter()
    for case, found in solved(stance_of(robot), ROBOTS.index(robot), POSTURES):
        raw = raw_problem(case)
        solver, x = independent(raw)
        what = f"{case.criterion.name} within {case.limits}"
        who[solver] += 1
        if isinstance(found, InfeasibleError):
            assert solver == "infeasible", f"{what}: {found} But {solver} found an optimum."
            continue
        assert solver in ("clarabel", "piqp"), f"{what}: {solver}"
        assert np.abs(found.forces / raw.weight - x[: raw.m]).max() < SAME, what
        assert np.abs(found.torques / raw.weight - x[raw.m :]).max() < SAME, what
        assert found.optimality() < 1e-8, what
        assert found.residual() < 1e-9 * raw.weight, what
        # Not only near somebody's answer: optimal by the raw problem's own conditions.
        mine = np.concatenate([found.forces, found.torques]) / raw.weight
        touched = np.flatnonzero(raw.d - raw.C @ mine < SAME)
        assert kkt_error(raw, mine, touched) < 1e-9, what
        active[len([a for a in found.active if not a.weak])] += 1
    # The problems are worth solving: many press limits, some exclude each other.
    assert sum(who.values()) == POSTURES * PROBLEMS
    assert sum(n for count, n in active.items() if count) > 0.25 * sum(active.values())
    assert max(active) >= 3
    assert who["infeasible"] >= 3


@pytest.mark.parametrize("robot", ROBOTS)
def test_infeasible_by_as_much_as_said(stance_of, robot):
    # With every limit relaxed by the violation there is a wrench; by a little less there is none.
    seen = 0
    for case, found in solved(stance_of(robot), 100 + ROBOTS.index(robot), 30):
        if not isinstance(found, InfeasibleError):
            continue
        seen += 1
        assert found.violation > 0
        assert found.demands
        assert relaxed(case, 1.001 * found.violation + 1e-6)
        assert not relaxed(case, 0.9 * found.violation)
        assert set(found.demands) <= names_of(case)
        # The limits named are the conflict: nothing else is needed for it.
        assert not relaxed(case, 0.9 * found.violation, among=found.demands)
        assert found.demands[0] in str(found)
        if seen == 6:
            break
    assert seen >= 3


def relaxed(case, amount, among=None):
    """Whether forces and torques exist that exceed no limit by more than an amount [N, Nm].

    No limit among those named, or of all.
    """
    stance, raw = case.stance, raw_problem(case)
    among = names_of(case) if among is None else among
    rows = limit_rows(stance, case.limits)
    keep = [name in among for name in rows.names]
    n, m = len(stance.robot.torque_names), raw.m
    C = np.hstack([rows.matrix[keep], np.zeros((sum(keep), n))])
    d = rows.bound[keep] + amount
    bound = joint_bounds(stance, case.limits.torque) + amount
    for i, name in enumerate(stance.robot.torque_names):
        if np.isfinite(bound[i]) and f"torque of {name}" in among:
            row = np.eye(m + n)[m + i]
            C, d = np.vstack([C, row, -row]), np.concatenate([d, [bound[i], bound[i]]])
    free = [(None, None)] * (m + n)
    scale = raw.weight
    status = linprog(np.zeros(m + n), C, d / scale, raw.E, raw.e, free).status
    assert status in (0, 2)
    return status == 0


def names_of(case):
    joints = {f"torque of {name}" for name in case.stance.robot.torque_names}
    return joints | set(limit_rows(case.stance, case.limits).names)
