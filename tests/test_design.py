"""Designed criteria: what the score says is so, nothing looked at is better, the known optimum."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import copsense
from copsense.design import (
    LENGTHS,
    Family,
    design_criterion,
    design_size,
    families,
    joint_groups,
    score,
    usual_grid,
)
from copsense.errors import InvalidInputError, UnknownNameError
from copsense.limits import NO_LIMITS, Limits
from copsense.scan import limit_travel

D, HALF = 0.14, 0.03
WITHIN = 3 * 0.0693 / 11  # m: three postures to either side, the last ones included
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)
TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)


@pytest.fixture(scope="module")
def four_bar_path(stance_of):
    stance = stance_of("four_bar")
    ends = np.array([[0.0, -HALF], [0.0, HALF]])
    stance = stance.with_contacts([replace(c, polygon=ends) for c in stance.contacts])
    return copsense.lateral_sweep(stance, -0.0693, 0.0693, 23)


@pytest.fixture(scope="module")
def icub_path(icub):
    return copsense.lateral_sweep(icub, -0.06, 0.06, 13)


def alpha_of(hip, ankle):
    return ankle / (ankle + hip)


def known_travel(alpha):
    """Where the unloading foot's CoP is at its edge: (1-alpha) d u = a (d - 2 alpha u)."""
    return HALF * D / ((1 - alpha) * D + 2 * alpha * HALF)


def known_gain(alpha, u):
    """The unloading foot's, the larger one."""
    return (1 - alpha) * D**2 / (D - 2 * alpha * u) ** 2


def known_torque(alpha, stance):
    """Norm at a posture: hips alpha Q / 2, ankles (1 - alpha) Q / 2, with Q = m g u."""
    Q = stance.robot.weight * (stance.com[1] - 0.0)
    return abs(Q) * np.sqrt(0.5 * (alpha**2 + (1 - alpha) ** 2))


def hip_ankle(hip, ankle):
    return copsense.weighted_torque(
        {"l_hip": hip, "r_hip": hip, "l_ankle": ankle, "r_ankle": ankle}
    )


@pytest.mark.parametrize(("hip", "ankle"), [(10, 1), (3, 1), (1, 1), (1, 4), (1, 30)])
def test_four_bars_score_is_the_closed_form(four_bar_path, hip, ankle):
    alpha = alpha_of(hip, ankle)
    found = score(four_bar_path, COP_ONLY, hip_ankle(hip, ankle), {}, WITHIN)
    # Interpolated between postures 6 mm apart.
    assert found.travel == pytest.approx(known_travel(alpha), abs=1e-6)
    assert "CoP at the" in found.first_limit
    assert found.range == WITHIN
    assert found.worst_gain == pytest.approx(known_gain(alpha, WITHIN), rel=1e-8)
    within = [s for s in four_bar_path.stances if abs(s.com[1]) <= WITHIN + 1e-6]
    assert len(within) == 7
    norms = [known_torque(alpha, s) for s in within]
    assert found.torque_norm == pytest.approx(np.sqrt(np.mean(np.square(norms))), rel=1e-8)


def test_travel_grows_with_the_share_carried_by_load_transfer(four_bar_path):
    weights = np.geomspace(100, 0.01, 9)
    travels = [score(four_bar_path, COP_ONLY, hip_ankle(w, 1.0), {}).travel for w in weights]
    assert np.all(np.diff(travels) > 0)


def test_interpolated_travel_is_the_exact_one_but_for_the_path(icub_path):
    middle = icub_path.stances[len(icub_path) // 2]
    for criterion in (TORQUE, WRENCH):
        exact = min(limit_travel(middle, criterion, COP_ONLY, s).first.exact for s in (1, -1))
        found = score(icub_path, COP_ONLY, criterion, {})
        assert found.travel == pytest.approx(exact, abs=5e-5)


def test_four_bars_best_is_all_the_load_transfer_there_is(four_bar_path):
    # The hips' weight goes to its lowest, alpha to its highest: the optimum is on the bound.
    family = families(four_bar_path.stances[0])["joints"]
    assert family.parameters == ("hip_weight",)
    design = design_criterion(four_bar_path, COP_ONLY, family, grid=9)
    assert design.score.parameters["hip_weight"] == pytest.approx(0.01, rel=1e-6)
    assert design.score.travel == pytest.approx(known_travel(alpha_of(0.01, 1.0)), abs=1e-6)
    check_design(four_bar_path, COP_ONLY, family, design)


def test_four_bars_inner_optimum(four_bar_path):
    # A torque limit at the hips makes too much load transfer as bad as too little: the best alpha
    # meets both limits at once.
    weight = four_bar_path.stances[0].robot.weight
    bound = 0.25 * weight * 0.035 * 0.9
    limits = replace(COP_ONLY, torque={"l_hip": bound, "r_hip": bound})

    def travel(alpha):
        # Hips: alpha m g u / 2 = bound.
        return min(known_travel(alpha), 2 * bound / (alpha * weight))

    alphas = np.linspace(0.01, 0.99, 98001)
    best = max(alphas, key=travel)
    assert 0.05 < best < 0.95
    family = families(four_bar_path.stances[0])["joints"]
    design = design_criterion(four_bar_path, limits, family, grid=9)
    assert design.score.travel == pytest.approx(travel(best), abs=5e-5)
    assert alpha_of(design.score.parameters["hip_weight"], 1.0) == pytest.approx(best, abs=0.02)
    check_design(four_bar_path, limits, family, design)


@pytest.mark.parametrize("objective", ["travel", "gain"])
@pytest.mark.parametrize("name", ["length", "joints", "mix"])
def test_icubs_designs_hold_what_they_say(icub_path, name, objective):
    family = families(icub_path.stances[0])[name]
    grid = 3 if name == "joints" else 4
    design = design_criterion(icub_path, COP_ONLY, family, objective=objective, grid=grid)
    assert design.objective == objective
    assert design.family == name
    assert len(design.candidates) == grid ** len(family.parameters) + 1
    check_design(icub_path, COP_ONLY, family, design)


def cost(design, found):
    return -found.travel if design.objective == "travel" else found.worst_gain


def check_design(path, limits, family, design):
    """What every design must hold."""
    best = design.score
    # The score is the criterion's own, found again from nothing but the criterion.
    again = score(path, limits, design.criterion, best.parameters, best.range)
    assert again == best
    rebuilt = family.build([best.parameters[name] for name in family.parameters])
    assert score(path, limits, rebuilt, best.parameters, best.range) == best
    for value, (low, high) in zip(best.parameters.values(), family.bounds, strict=True):
        assert low * (1 - 1e-12) <= value <= high * (1 + 1e-12)
    # Nothing looked at does better.
    assert cost(design, best) == min(cost(design, s) for s in design.candidates)
    # Nor do the paper's two, where the family holds them.
    wrench, torque = design.baselines
    assert (wrench.criterion, torque.criterion) == ("minimum-wrench", "minimum-torque")
    held = {"joints": torque, "length": wrench}.get(family.name)
    if held:
        assert cost(design, best) <= cost(design, held) + 1e-9
    assert score(path, limits, WRENCH, {}, best.range) == wrench
    assert score(path, limits, TORQUE, {}, best.range) == torque
    assert best.range == pytest.approx(min(s.travel for s in design.baselines), abs=1e-12)
    # Pareto: by rising torque norm the objective gets better; everything else is beaten.
    front = [(s.torque_norm, cost(design, s)) for s in design.pareto]
    assert front == sorted(front)
    assert all(b[1] < a[1] for a, b in pairwise(front))
    for candidate in design.candidates:
        norm, value = candidate.torque_norm, cost(design, candidate)
        beaten = any(n <= norm and c <= value and (n, c) != (norm, value) for n, c in front)
        assert beaten or (norm, value) in front
        assert not beaten or candidate not in design.pareto
    assert set(map(id, design.pareto)) <= set(map(id, design.candidates))


def test_hips_knees_and_ankles_are_told_by_name(icub):
    groups = joint_groups(icub)
    assert list(groups) == ["hip", "knee", "ankle"]
    assert groups["knee"] == ("l_knee", "r_knee")
    assert len(groups["hip"]) == 6
    assert len(groups["ankle"]) == 4


@pytest.mark.parametrize("robot", ["talos", "romeo", "solo12"])
def test_joints_are_grouped_by_place_where_names_say_nothing(stance_of, robot):
    stance = stance_of(robot)
    groups = joint_groups(stance)
    joints = [name for names in groups.values() for name in names]
    assert len(set(joints)) == len(joints)
    assert set(joints) <= set(stance.robot.torque_names)
    for name in groups:
        # One of each leg, or several where the group is a hip or an ankle.
        assert len(groups[name]) % len(stance.contacts) == 0


def test_criteria_that_fail_are_passed_over(icub_path):
    # A family whose lower half cannot be built still has a best.
    def build(values):
        if values[0] < 0.5:
            raise InvalidInputError("too short")
        return copsense.minimum_wrench(values[0])

    family = Family("halved", ("length",), ((0.01, 3.0),), build)
    design = design_criterion(icub_path, COP_ONLY, family, grid=5)
    assert design.score.parameters["length"] >= 0.5
    assert len(design.candidates) < 6
    never = Family("never", ("length",), ((0.01, 0.1),), build)
    with pytest.raises(InvalidInputError, match="'never'"):
        design_criterion(icub_path, COP_ONLY, never, grid=2)


def test_progress_counts_every_criterion_that_is_looked_at(four_bar_path, monkeypatch):
    seen, scored = [], []
    family = families(four_bar_path.stances[0])["joints"]
    monkeypatch.setattr(
        "copsense.design.score", lambda *given: scored.append(given[2]) or score(*given)
    )
    design_criterion(four_bar_path, COP_ONLY, family, grid=3, progress=seen.append)
    assert sum(seen) == design_size(family, 3)
    # The paper's two are scored twice, and nothing else is.
    assert seen.count(1) == len(scored) - 4
    assert design_size(LENGTHS, 3) == 3 + 3 * 40


def test_a_grid_is_coarser_in_more_dimensions(icub):
    family = families(icub)["joints"]

    def of(count):
        names = tuple(f"p{i}" for i in range(count))
        return replace(family, parameters=names, bounds=((0.1, 1.0),) * count)

    assert [usual_grid(of(count)) for count in range(1, 8)] == [7, 7, 7, 4, 3, 2, 2]


def test_what_a_design_rejects(icub_path, icub):
    family = families(icub)["length"]
    with pytest.raises(InvalidInputError, match="grid needs 2"):
        design_criterion(icub_path, COP_ONLY, family, grid=1)
    with pytest.raises(InvalidInputError, match="5 postures"):
        design_criterion(copsense.lateral_sweep(icub, -0.01, 0.01, 3), COP_ONLY, family)
    objective = "speed"
    with pytest.raises((UnknownNameError, TypeError)):
        design_criterion(icub_path, COP_ONLY, family, objective=objective)


def test_travel_of_a_path_that_ends_before_any_limit(icub):
    short = copsense.lateral_sweep(icub, -0.01, 0.01, 5)
    found = score(short, COP_ONLY, TORQUE, {})
    assert found.travel == pytest.approx(0.01)
    assert found.first_limit == "none within the path"


def test_travel_where_a_limit_is_broken_from_the_start(icub_path, icub):
    found = score(icub_path, Limits(normal_force=0.6 * icub.robot.weight), TORQUE, {})
    assert found.travel == 0.0
    assert "normal force" in found.first_limit


@pytest.mark.parametrize("count", [5, 9])
def test_a_coarse_path_has_the_exact_travel(icub, count):
    path = copsense.lateral_sweep(icub, -0.06, 0.06, count)
    for criterion in (TORQUE, WRENCH):
        exact = min(
            t.exact
            for side in (1, -1)
            for t in limit_travel(icub, criterion, COP_ONLY, side).limits
            if t.exact is not None
        )
        found = score(path, COP_ONLY, criterion, {})
        assert found.travel == pytest.approx(exact, abs=1e-6)


README = Limits(friction=0.33, torque="model")


@pytest.mark.parametrize("grid", [3, 7])
def test_a_search_that_begins_on_a_bound_leaves_it(icub, grid):
    # The best of the grid has the least length; the simplex that was clipped to it found 65.3 mm.
    path = copsense.lateral_sweep(icub, -0.09, 0.09, 19)
    design = design_criterion(path, README, families(icub)["mix"], grid=grid)
    assert design.score.travel == pytest.approx(0.0672, abs=1e-4)
    assert design.score.parameters["characteristic_length"] == pytest.approx(0.0161, abs=5e-4)
    assert design.score.parameters["wrench_share"] == 1.0
    assert design.at_bound == ("wrench_share",)
    # One parameter alone goes farther, which is worth knowing.
    (length,) = design.alternatives
    assert length.travel == pytest.approx(0.0689, abs=1e-4)
    assert length.parameters == {"characteristic_length": 0.01}
    alone = design_criterion(path, README, families(icub)["length"], grid=grid)
    assert alone.at_bound == ("characteristic_length",)
    assert alone.alternatives == ()
    assert alone.score == length
