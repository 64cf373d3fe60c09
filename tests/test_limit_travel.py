"""How far the CoM may go until a limit binds: first order, exact, both ways, against walking."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_sided import lateral

import copsense
from copsense.cop import contact_cops
from copsense.errors import InvalidInputError
from copsense.limits import NO_LIMITS, Limits
from copsense.margins import limit_margins, margin_table
from copsense.path import lateral_posture
from copsense.scan import limit_travel

D, HALF = 0.14, 0.03
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)
TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)


@pytest.fixture(scope="module")
def four_bar(stance_of):
    """The four-bar with feet that end HALF to either side and rub."""
    stance = stance_of("four_bar")
    ends = np.array([[0.0, -HALF], [0.0, HALF]])
    return stance.with_contacts([replace(c, polygon=ends, friction=0.6) for c in stance.contacts])


@pytest.fixture(scope="module")
def rubbing(icub):
    """The iCub with friction under its feet."""
    return icub.with_contacts(
        [replace(c, friction=0.5, torsional_friction=0.02) for c in icub.contacts]
    )


def family(alpha):
    weights = {"l_hip": 1 - alpha, "r_hip": 1 - alpha, "l_ankle": alpha, "r_ankle": alpha}
    return copsense.weighted_torque(weights)


def known_travel(alpha):
    """Where the unloading foot's CoP is at its edge: (1-alpha) d u = a (d - 2 alpha u)."""
    return HALF * D / ((1 - alpha) * D + 2 * alpha * HALF)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 0.5, 0.7, 0.95])
@pytest.mark.parametrize("direction", [-1, 1])
def test_four_bars_travel_is_the_closed_form(four_bar, alpha, direction):
    travel = limit_travel(four_bar, family(alpha), COP_ONLY, direction)
    first = travel.first
    assert first.exact == pytest.approx(known_travel(alpha), abs=1e-9)
    # Its wrenches are affine in the CoM, so that the slack's first order is exact.
    assert first.first_order == pytest.approx(known_travel(alpha), rel=1e-9)
    assert first.margin.value == pytest.approx(HALF, abs=1e-12)
    unloading = "r_sole" if direction > 0 else "l_sole"
    assert first.margin.where == unloading


def test_four_bars_travel_is_the_same_both_ways(four_bar):
    limits = Limits(normal_force=20.0, torque=6.0)
    other = {"l": "r", "r": "l"}
    for criterion in (TORQUE, WRENCH, family(0.2)):
        left, right = (
            {
                (m.margin.where, m.margin.kind): m
                for m in limit_travel(four_bar, criterion, limits, s).limits
            }
            for s in (1, -1)
        )
        assert any(m.exact for m in left.values())
        for (where, kind), found in left.items():
            mirrored = right[other[where[0]] + where[1:], kind]
            assert found.first_order == pytest.approx(mirrored.first_order, rel=1e-8)
            assert found.margin.value == pytest.approx(mirrored.margin.value, rel=1e-8)
            assert (found.exact is None) == (mirrored.exact is None)
            if found.exact is not None:
                assert found.exact == pytest.approx(mirrored.exact, abs=1e-8)


def test_icubs_travel_is_the_same_both_ways_within_its_asymmetry(icub):
    for criterion, printed in ((WRENCH, 0.0384), (TORQUE, 0.0459)):
        left, right = (limit_travel(icub, criterion, COP_ONLY, s).first for s in (1, -1))
        assert left.exact == pytest.approx(printed, abs=1.5e-4)
        assert left.exact == pytest.approx(right.exact, abs=1e-4)
        assert left.first_order == pytest.approx(right.first_order, rel=1e-2)
        assert {left.margin.where, right.margin.where} == {"l_sole", "r_sole"}


LIMITS = Limits(normal_force=130.0, cop_margin=0.005, torque=10.0, friction_sides=4)


@pytest.mark.parametrize("criterion", [WRENCH, TORQUE], ids=["wrench", "torque"])
@pytest.mark.parametrize("direction", [-1, 1])
def test_margin_is_zero_at_the_exact_travel_and_changes_its_sign_there(
    rubbing, criterion, direction
):
    travel = limit_travel(rubbing, criterion, LIMITS, direction, reach=0.07)
    met = [m for m in travel.limits if m.exact is not None]
    assert len(met) >= 2
    assert [m.exact for m in met] == sorted(m.exact for m in met)
    for found in met[:5]:
        near = [margin_at(rubbing, criterion, LIMITS, direction * s, found)
                for s in (found.exact - 1e-5, found.exact, found.exact + 1e-5)]  # fmt: skip
        size = max(abs(near[0]), abs(near[2])) / 1e-5  # its slope
        assert abs(near[1]) < 2e-9 * max(size, 1.0)
        assert near[0] > 0 > near[2]


def margin_at(stance, criterion, limits, y, found):
    here, _ = lateral(stance, float(stance.com[1]) + y, stance.q)
    equilibrium = copsense.solve_equilibrium(here, criterion)
    (margin,) = [
        m
        for m in limit_margins(equilibrium, limits)
        if (m.where, m.kind) == (found.margin.where, found.margin.kind)
    ]
    return margin.value


@pytest.mark.parametrize("direction", [-1, 1])
def test_first_order_is_the_margin_over_its_rate(rubbing, direction):
    start, tangent = lateral(rubbing, 0.0, rubbing.q)
    found = copsense.cop_sensitivity(start, TORQUE)
    slopes = found.along(tangent) * direction
    cops = contact_cops(found.equilibrium)
    travel = {
        (m.margin.where, m.margin.kind): m
        for m in limit_travel(rubbing, TORQUE, LIMITS, direction).limits
    }
    for k, contact in enumerate(start.contacts):
        # CoP: each edge's slack f_z (b - a p) in turn, over how fast it goes.
        fz = found.equilibrium.wrenches[k, 2]
        lost = -found.wrench_derivative[k, 2] @ found.basis.T @ tangent * direction
        expected = np.inf
        for a, p in zip(contact.polygon, np.roll(contact.polygon, -1, axis=0), strict=True):
            normal = np.array([p[1] - a[1], a[0] - p[0]]) / np.linalg.norm(p - a)
            left = normal @ (a - cops[k]) - 0.005
            closing = fz * normal @ slopes[k] + left * lost
            if closing > 1e-9:
                expected = min(expected, fz * left / closing)
        assert travel[contact.name, "cop"].first_order == pytest.approx(expected, rel=1e-6)
        # Load: what is left over how fast it goes.
        rate = found.wrench_derivative[k, 2] @ found.basis.T @ tangent * direction
        load = found.equilibrium.wrenches[k, 2] - 130.0
        expected = load / -rate if rate < 0 else np.inf
        assert travel[contact.name, "normal force"].first_order == pytest.approx(expected, rel=1e-9)


def test_first_order_becomes_exact_near_the_limit(icub):
    # Starting nearer and nearer, the two agree quadratically.
    errors = []
    exact = limit_travel(icub, TORQUE, COP_ONLY, 1).first.exact
    for before in (4e-3, 2e-3, 1e-3):
        near, _ = lateral(icub, float(icub.com[1]) + exact - before, icub.q)
        found = limit_travel(near, TORQUE, COP_ONLY, 1).first
        errors.append(abs(found.first_order - found.exact))
    assert errors[2] < 2e-5
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3


def test_exact_travel_is_what_walking_in_small_steps_finds(four_bar):
    # Every millimetre: the first step at which any margin of a kind is negative.
    limits = Limits(normal_force=50.0, torque=7.0, cop_margin=0.0)
    for criterion, direction in ((TORQUE, 1), (WRENCH, -1), (family(0.15), 1)):
        travel = limit_travel(four_bar, criterion, limits, direction, reach=0.06)
        step, gone = 1e-3, {}
        for k in range(61):
            here, _ = lateral(four_bar, direction * k * step, four_bar.q)
            equilibrium = copsense.solve_equilibrium(here, criterion)
            for margin in limit_margins(equilibrium, limits):
                if margin.value < 0:
                    gone.setdefault((margin.where, margin.kind), k * step)
        assert gone
        for found in travel.limits:
            where = gone.get((found.margin.where, found.margin.kind))
            if where is None:
                assert found.exact is None or found.exact > 0.06 - step
            else:
                assert where - step - 1e-9 <= found.exact <= where + 1e-9


def test_travel_does_not_depend_on_the_samples(rubbing):
    coarse, fine = (
        limit_travel(rubbing, WRENCH, LIMITS, 1, reach=0.06, samples=n) for n in (4, 25)
    )
    for a, b in zip(coarse.limits, fine.limits, strict=True):
        assert (a.margin.name, a.name) == (b.margin.name, b.name)
        assert (a.exact is None) == (b.exact is None)
        assert a.exact is None or a.exact == pytest.approx(b.exact, abs=1e-8)


def test_limit_already_broken_is_no_travel(rubbing):
    broken = Limits(normal_force=0.9 * rubbing.robot.weight)
    travel = limit_travel(rubbing, TORQUE, broken)
    assert travel.first.exact == 0.0
    assert travel.first.margin.value < 0


def test_limit_out_of_reach_is_none(rubbing):
    travel = limit_travel(rubbing, TORQUE, COP_ONLY, reach=0.01)
    assert travel.first is None
    assert travel.reach == pytest.approx(0.01)
    assert all(m.exact is None for m in travel.limits)


@pytest.mark.parametrize("direction", [0, 2])
def test_other_directions_are_rejected(rubbing, direction):
    with pytest.raises(InvalidInputError, match=r"\+1 or -1"):
        limit_travel(rubbing, TORQUE, COP_ONLY, direction)


@pytest.mark.parametrize("robot", ["icub", "g1"])
def test_the_limit_named_is_the_one_at_its_bound(stance_of, robot):
    stance = stance_of(robot)
    limits = copsense.Limits(friction=0.4, torque="model")
    named = 0
    for criterion in (copsense.minimum_wrench(1.0), copsense.minimum_torque()):
        for side in (1, -1):
            for found in copsense.scan.limit_travel(stance, criterion, limits, side).limits:
                if not found.exact:
                    continue
                y = float(stance.com[1]) + side * found.exact
                here, _ = lateral_posture(stance, y)
                solved = copsense.solve_equilibrium(here, criterion)
                table = margin_table(here, limits)
                values = table.values(solved.forces, solved.torques)
                at = [v for v, name in zip(values, table.names, strict=True) if name == found.name]
                assert np.abs(at).min() < 1e-6
                named += found.name != found.margin.name
    assert named  # the nearest at the start is not always the one that is met


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"reach": np.nan}, "reach"),
        ({"reach": 0.0}, "reach"),
        ({"samples": 0}, "a whole number from 1"),
    ],
)
def test_a_search_of_nothing_is_rejected(icub, options, says):
    for search in (limit_travel, copsense.scan.next_active_set_change):
        with pytest.raises(InvalidInputError, match=says):
            search(icub, copsense.minimum_torque(), Limits(), **options)
