"""The next limit to bind or to let go: predicted where one stands, and found along the path."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_sided import lateral

import copsense
from copsense.errors import InfeasibleError, InvalidInputError
from copsense.limits import NO_LIMITS
from copsense.path import lateral_posture

D, HALF = 0.14, 0.03  # m: rod of the four-bar preset, and from a foot's middle to its edges
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)
LIMITS = copsense.Limits(normal_force=10.0, friction=1 / 3, torsion=1 / 75, torque="model")
CRITERIA = (copsense.minimum_wrench(1.0), copsense.minimum_torque())
ALPHA = 0.3  # share of the CoM's moment that the load transfer carries (theory, section 5)
FAMILY = copsense.weighted_torque(
    {"l_hip": 1 - ALPHA, "r_hip": 1 - ALPHA, "l_ankle": ALPHA, "r_ankle": ALPHA}
)
EDGE = HALF * D / ((1 - ALPHA) * D + 2 * ALPHA * HALF)  # CoM y at which the unloaded foot tips


@pytest.fixture(scope="module")
def four_bar(stance_of):
    stance = stance_of("four_bar")
    sole = np.array([[0.0, -HALF], [0.0, HALF]])
    return stance.with_contacts([replace(c, polygon=sole) for c in stance.contacts])


def pressing(stance, criterion, limits):
    found = copsense.solve_equilibrium(stance, criterion, limits)
    return {limit.name for limit in found.active if not limit.weak}


@pytest.mark.parametrize("side", [-1, 1])
def test_four_bars_first_limit_binds_where_the_closed_form_says(four_bar, side):
    found = copsense.scan.next_active_set_change(four_bar, FAMILY, COP_ONLY, side)
    assert found.binds
    assert found.name == (
        "r_sole: CoP at the +y (left) edge" if side > 0 else "l_sole: CoP at the -y (right) edge"
    )
    assert found.value == pytest.approx(side * EDGE, abs=1e-10)
    assert found.travel == pytest.approx(EDGE, abs=1e-10)
    foot = 1 if side > 0 else 0
    assert found.before[foot, 1] == pytest.approx((1 - ALPHA) * D**2 / (D - 2 * ALPHA * EDGE) ** 2)
    assert found.after[foot, 1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("side", [-1, 1])
def test_on_the_way_back_it_lets_go_at_the_same_place(four_bar, side):
    beyond, _ = lateral(four_bar, side * 1.2 * EDGE, four_bar.q)
    found = copsense.scan.next_active_set_change(beyond, FAMILY, COP_ONLY, -side)
    assert not found.binds
    assert found.value == pytest.approx(side * EDGE, abs=1e-10)
    assert found.travel == pytest.approx(0.2 * EDGE, abs=1e-10)
    foot = 1 if side > 0 else 0
    assert found.before[foot, 1] == pytest.approx(0.0, abs=1e-9)
    assert found.after[foot, 1] == pytest.approx((1 - ALPHA) * D**2 / (D - 2 * ALPHA * EDGE) ** 2)


@pytest.mark.parametrize("start", [0.7, 1.2])
def test_the_prediction_errs_as_the_square_of_the_distance(four_bar, start):
    # A limit that comes (from the middle) and one that lets go (from beyond), ever nearer.
    relative = []
    for part in (1.0, 0.1):
        y = EDGE * (1 + (start - 1) * part)
        here, _ = lateral(four_bar, y, four_bar.q)
        found = copsense.scan.next_active_set_change(here, FAMILY, COP_ONLY, 1 if y < EDGE else -1)
        assert found.value == pytest.approx(EDGE, abs=1e-10)
        relative.append(abs(found.first_order - found.travel) / found.travel)
    # Of the four-bar's multiplier the prediction is exact: it is linear in the CoM.
    assert relative[1] < max(0.2 * relative[0], 1e-9)
    assert relative[0] < 0.2


def test_both_sides_are_reported_where_one_stands(four_bar):
    here, tangent = lateral_posture(lateral(four_bar, 0.02, four_bar.q)[0], 0.02)
    found = copsense.cop_sensitivity(here, FAMILY, COP_ONLY)
    back, forth = (found.next_active_set_change(s * tangent) for s in (-1, 1))
    slopes = found.along(tangent)[:, 1]
    load = found.equilibrium.wrenches[:, 2]
    gains = found.wrench_derivative[:, 2] @ found.basis.T @ tangent
    for change, side in ((back, -1), (forth, 1)):
        # Each foot's slack f_z (b - a p) at the edge that its CoP is moving to, over how fast it
        # goes there: the four-bar's wrenches are affine in the CoM, so that this is exact.
        left = HALF - side * found.cop[:, 1]
        travels = load * left / (load * slopes - side * left * gains)
        assert travels.min() == pytest.approx(EDGE - side * 0.02, rel=1e-9)
        assert change.binds
        assert change.travel == pytest.approx(travels.min(), rel=1e-9)
        assert change.name.startswith(four_bar.contact_names[int(np.argmin(travels))])
        assert ("+y" if side > 0 else "-y") in change.name
    # Whatever the coordinate's unit, travel is metres of CoM; and turning round swaps the sides.
    turned = [found.next_active_set_change(s * -7.0 * tangent) for s in (-1, 1)]
    assert [c.name for c in turned] == [forth.name, back.name]
    np.testing.assert_allclose([c.travel for c in turned], [forth.travel, back.travel])


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("start", [0.0, 0.041])
@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_icubs_pressing_limits_change_there_and_not_before(icub, criterion, start, side):
    here, _ = lateral_posture(icub, side * start + float(icub.com[1]))
    for direction in (-1, 1):
        found = copsense.scan.next_active_set_change(here, criterion, LIMITS, direction)
        begin = copsense.solve_equilibrium(here, criterion, LIMITS)
        changed = {found.name}
        held = {limit.name for limit in begin.active if not limit.weak}

        def at(y, here=here):
            return pressing(lateral_posture(here, y)[0], criterion, LIMITS)

        for share in (0.1, 0.5, 0.9, 1 - 1e-5):
            assert at(float(here.com[1]) + direction * share * found.travel) == held
        after = at(found.value + direction * 1e-6)
        if found.binds:
            assert changed <= after
        else:
            assert changed & held
        assert len(after) != len(held) or after != held
        assert not np.allclose(found.before, found.after, rtol=1e-3)


def test_icubs_first_order_prediction_is_near(icub):
    here, tangent = lateral_posture(icub, 0.041)
    for direction in (-1, 1):
        found = copsense.scan.next_active_set_change(here, CRITERIA[0], LIMITS, direction)
        assert found.first_order == pytest.approx(found.travel, rel=0.02)
        there = copsense.cop_sensitivity(here, CRITERIA[0], LIMITS)
        predicted = there.next_active_set_change(direction * tangent)
        assert predicted.travel == pytest.approx(found.first_order)


def test_a_touched_limit_has_taken_its_side(four_bar):
    at_edge, tangent = lateral(four_bar, EDGE, four_bar.q)
    found = copsense.cop_sensitivity(at_edge, FAMILY, COP_ONLY)
    assert [limit.weak for limit in found.equilibrium.active] == [True]
    inward, outward = (found.next_active_set_change(s * tangent) for s in (-1, 1))
    # Inwards the next is the other foot's, at the same distance beyond the middle (its slack is
    # affine in the CoM, so that this is exact); outwards the touched one is held.
    assert (inward.name, inward.binds) == ("l_sole: CoP at the -y (right) edge", True)
    assert inward.travel == pytest.approx(2 * EDGE, rel=1e-9)
    assert outward.binds
    assert outward.name == "l_sole: CoP at the +y (left) edge"
    assert inward.travel > 1e-3
    assert outward.travel > 1e-3
    nearest = found.nearest_active_set_change()  # whichever way: the touched one, at once
    assert nearest.name == found.equilibrium.active[0].name
    assert nearest.travel == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("y", [-0.02, 0.013, -1.05 * EDGE, 1.05 * EDGE])
def test_four_bars_nearest_change_is_where_the_closed_form_says(four_bar, y):
    here, _ = lateral(four_bar, y, four_bar.q)
    nearest = copsense.cop_sensitivity(here, FAMILY, COP_ONLY).nearest_active_set_change()
    assert nearest.criterion == FAMILY.name
    assert nearest.kind == "cop"
    assert nearest.binds == (abs(y) < EDGE)
    assert nearest.travel == pytest.approx(abs(abs(y) - EDGE), rel=1e-9)


@pytest.mark.parametrize("start", [0.0, 0.041])
@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda c: c.name)
def test_the_nearest_change_is_the_least_of_all_directions(icub, criterion, start):
    # Each direction by its own ratio test, which follows one motion.
    here, _ = lateral_posture(icub, start + float(icub.com[1]))
    found = copsense.cop_sensitivity(here, criterion, LIMITS)
    nearest, count = found.nearest_active_set_change(), 60
    ways = [
        found.com_motions @ [np.cos(angle), np.sin(angle)]
        for angle in 2 * np.pi * np.arange(count) / count
    ]
    travels = [found.equilibrium.next_active_set_change(way) for way in ways]
    least = min(travels, key=lambda change: change.travel)
    assert nearest.travel <= least.travel <= nearest.travel / np.cos(np.pi / count)
    assert (least.name, least.kind, least.binds) == (nearest.name, nearest.kind, nearest.binds)


def test_nothing_changes_within_reach(four_bar):
    assert (
        copsense.scan.next_active_set_change(four_bar, FAMILY, COP_ONLY, 1, reach=0.5 * EDGE)
        is None
    )


def test_without_limits_nothing_changes(icub):
    here, tangent = lateral_posture(icub, 0.0)
    found = copsense.cop_sensitivity(here, CRITERIA[0])
    assert found.next_active_set_change(tangent) is None
    assert found.next_active_set_change(-tangent) is None
    assert found.nearest_active_set_change() is None
    # Limits that no CoP, force or torque has either.
    found = copsense.cop_sensitivity(here, CRITERIA[0], NO_LIMITS)
    assert found.nearest_active_set_change() is None


def test_bad_questions_are_rejected(icub):
    with pytest.raises(InvalidInputError, match=r"\+1 or -1"):
        copsense.scan.next_active_set_change(icub, CRITERIA[0], LIMITS, 0)
    with pytest.raises(InvalidInputError, match="no limit is switched on"):
        copsense.scan.next_active_set_change(icub, CRITERIA[0], NO_LIMITS)
    with pytest.raises(InvalidInputError, match="reach"):
        copsense.scan.next_active_set_change(icub, CRITERIA[0], LIMITS, reach=-1.0)
    with pytest.raises(InfeasibleError):
        copsense.scan.next_active_set_change(icub, CRITERIA[0], replace(LIMITS, normal_force=1e4))
    found = copsense.cop_sensitivity(icub, CRITERIA[0], LIMITS)
    still = np.zeros(icub.robot.model.nv)
    with pytest.raises(InvalidInputError, match="stays over one point"):
        found.next_active_set_change(still)
    still[0] = 1.0
    with pytest.raises(InvalidInputError, match="moves a contact"):
        found.next_active_set_change(still)


@pytest.mark.parametrize(("robot", "y"), [("icub", 0.08), ("romeo", 0.06), ("icub", 0.11)])
def test_where_the_limits_leave_no_way_on_the_change_is_told_all_the_same(stance_of, robot, y):
    here, _ = lateral_posture(stance_of(robot), y)
    limits = copsense.Limits(friction=1 / 3)
    found = [
        copsense.scan.next_active_set_change(here, c, limits, side)
        for c in CRITERIA
        for side in (-1, 1)
    ]
    assert any(change is not None for change in found)
