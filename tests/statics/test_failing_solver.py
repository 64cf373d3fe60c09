"""A solver that fails or names the wrong rows never gives a wrong answer."""

from types import SimpleNamespace

import daqp
import numpy as np
import pytest
import scipy.optimize
from support.random_cases import random_case, random_stance

import copsense
from copsense import qp as program
from copsense.errors import InfeasibleError, UnsolvedError
from copsense.limits import Limits


def spoiled(how):
    """daqp with an answer spoiled: its status, or its multipliers and so its active rows."""

    def solve(H, f, A, b, *rest, **settings):
        x, value, flag, info = daqp.solve(H, f, A, b, *rest, **settings)
        flag, multipliers = how(flag, np.array(info["lam"]))
        return x, value, flag, {"lam": multipliers}

    return SimpleNamespace(solve=solve)


def nothing_active(flag, multipliers):
    return flag, np.zeros_like(multipliers)


def all_active(flag, multipliers):
    return flag, np.ones_like(multipliers)


def one_more(flag, multipliers):
    multipliers[np.flatnonzero(multipliers == 0)[0]] = 1.0
    return flag, multipliers


def one_less(flag, multipliers):
    multipliers[np.flatnonzero(multipliers)[0]] = 0.0
    return flag, multipliers


def iteration_limit(flag, multipliers):
    return -4, multipliers


def infeasible(flag, multipliers):
    return -1, multipliers


SPOILS = (nothing_active, all_active, one_more, one_less, iteration_limit, infeasible)


@pytest.fixture(scope="module")
def pressed(stance_of):
    """Problems in which at least one limit presses."""
    found, rng = [], np.random.default_rng(11)
    while len(found) < 24:
        stance = random_stance(stance_of(("icub", "talos", "solo12")[len(found) % 3]), rng)
        for _ in range(4):
            case = random_case(stance, rng)
            try:
                right = copsense.solve_equilibrium(stance, case.criterion, case.limits)
            except InfeasibleError:
                continue
            if any(not limit.weak for limit in right.active):
                found.append((case, right))
    return found


@pytest.mark.parametrize("how", SPOILS)
def test_wrong_rows_are_found_out(pressed, monkeypatch, how):
    monkeypatch.setattr(program, "daqp", spoiled(how))
    for case, right in pressed:
        found = copsense.solve_equilibrium(case.stance, case.criterion, case.limits)
        off = np.abs(found.forces - right.forces).max() / case.stance.robot.weight
        assert off < 1e-9, f"{case.criterion.name} within {case.limits}"
        assert found.optimality() < 1e-8
        assert {a.name for a in found.active} == {a.name for a in right.active}


def test_no_solver_left_to_ask_is_an_error_and_no_answer(pressed, monkeypatch):
    def gives_up(*arguments, **settings):
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr(program, "daqp", spoiled(nothing_active))
    monkeypatch.setattr(scipy.optimize, "nnls", gives_up)
    for case, _ in pressed:
        with pytest.raises(UnsolvedError, match="optimality condition remains") as caught:
            copsense.solve_equilibrium(case.stance, case.criterion, case.limits)
        assert caught.value.error > 1e-8


def test_infeasible_limits_stay_infeasible_whoever_is_asked(icub, monkeypatch):
    limits = Limits(friction=None, normal_force=0.6 * icub.robot.weight)
    for how in SPOILS[:2] + SPOILS[4:]:
        monkeypatch.setattr(program, "daqp", spoiled(how))
        with pytest.raises(InfeasibleError):
            copsense.solve_equilibrium(icub, copsense.minimum_torque(), limits)
