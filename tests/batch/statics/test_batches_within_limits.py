"""A batch within limits gives what the reference gives within them, posture by posture."""

import importlib.util
import pickle

import numpy as np
import pytest
from scipy.optimize import linprog
from support.grounds import off_centre, with_hand
from support.one_sided import with_vertex
from support.random_cases import Case
from support.raw_qp import raw_problem
from support.stances import CASES, postures, served, tight, weighed

import copsense
from copsense import Limits
from copsense.batch import BatchKernel, PostureChart, evaluate_batch
from copsense.batch.statics.batch_result import arrays_of
from copsense.batch.statics.limit_result import limit_arrays
from copsense.batch.statics.reference import fill_row
from copsense.errors import InfeasibleError, UnloadedContactError
from copsense.margins import limit_margins

RELATIVE = 1e-9
PER_CASE = 6  # times four criteria, ten cases; benchmarks/equality.py has 10 000 postures
WITHIN, PRESSED, INFEASIBLE, UNLOADED = range(4)


def differs(given, expected, floor):
    """Largest difference, relative to the largest entry expected."""
    finite = np.isfinite(expected)
    assert np.array_equal(given[~finite], expected[~finite])
    size = max(float(np.abs(expected[finite]).max(initial=0.0)), floor)
    return float(np.abs(given[finite] - expected[finite]).max(initial=0.0)) / size


def reference_answer(stance, criterion, limits):
    """What the reference says, or the error that it raises."""
    try:
        return copsense.cop_sensitivity(stance, criterion, limits), None
    except copsense.CopsenseError as error:
        return None, error


@pytest.fixture(scope="module")
def answers(case):
    """Of a case: its stance, configurations, limits, and what the kernel answers."""
    made = {}

    def get(name, choose=served):
        if (name, choose) not in made:
            stance = case(name)
            q = postures(stance, PER_CASE, seed=4)
            limits = tight(stance, q)
            kernel = BatchKernel(stance, choose(stance), limits)
            assert not kernel.fallback_reason
            assert not kernel.by_reference
            made[name, choose] = stance, q, limits, kernel.evaluate(q)
        return made[name, choose]

    return get


BOTH = [(name, served) for name in CASES] + [("icub", weighed), ("talos on slopes", weighed)]


@pytest.mark.parametrize(("name", "choose"), BOTH)
def test_the_kernel_equals_the_reference_within_limits(answers, name, choose):
    stance, q, limits, found = answers(name, choose)
    within = found.limits
    seen = np.zeros(4, dtype=int)
    for (i, j), criterion in zip(np.ndindex(len(q), 4), choose(stance) * len(q), strict=True):
        state = within.state[i, j]
        seen[state] += 1
        expected, error = reference_answer(stance.at(q[i]), criterion, limits)
        if isinstance(error, InfeasibleError):
            assert state == INFEASIBLE
            assert within.relaxation[i] == pytest.approx(error.violation, rel=1e-6)
            assert np.isnan(within.change_travel[i, j])
            assert within.nearest_change(i, j) is None
            assert found.reasons[i, j].startswith(str(error)[:60])
            continue
        if isinstance(error, UnloadedContactError):
            assert state == UNLOADED
            assert found.reasons[i, j] == str(error)
            continue
        assert error is None
        equilibrium = expected.equilibrium
        pairs = {
            "wrenches": equilibrium.wrenches,
            "torques": equilibrium.torques,
            "cops": expected.cop,
            "gradient": expected.gradient,
            "com_gain": expected.com_gain,
            "com_travel": expected.com_travel,
            "unloading_travel": expected.unloading_travel,
            "load_share": equilibrium.wrenches[:, 2] / stance.robot.weight,
        }
        for what, value in pairs.items():
            error = differs(getattr(found, what)[i, j], value, floor=1e-3)
            assert error < RELATIVE, (what, i, criterion.name, error)
        assert np.array_equal(found.tipping_edge[i, j], expected.tipping_edge)
        assert state == (PRESSED if len(equilibrium.pressing) else WITHIN)
        pressing = within.pressing[i, j]
        assert set(pressing[pressing >= 0]) == set(equilibrium.pressing)
        multipliers = np.zeros(len(within.names))
        multipliers[pressing[pressing >= 0]] = within.multipliers[i, j][pressing >= 0]
        assert differs(multipliers, equilibrium.row_multipliers, floor=1e-6) < RELATIVE
        named = [(a.name, a.kind) for a in within.active(i, j)]
        assert named == [(a.name, a.kind) for a in equilibrium.active if not a.weak]
        assert within.touching[i, j] == sum(a.weak for a in equilibrium.active)
        assert 0 <= within.optimality[i, j] < 1e-8
        row, travel = equilibrium.nearest_changing_row(expected.com_motions)
        assert within.change_travel[i, j] == pytest.approx(travel, rel=RELATIVE)
        # Where two sides of a pyramid are as near, rounding says which.
        assert within.kinds[within.change_limit[i, j]] == within.kinds[row]
        change, nearest = within.nearest_change(i, j), expected.nearest_active_set_change()
        for what in ("criterion", "kind", "binds"):
            assert getattr(change, what) == getattr(nearest, what)
        unlimited = copsense.solve_equilibrium(stance.at(q[i]), criterion)
        for margins, of in ((within.margins, equilibrium), (within.own_margins, unlimited)):
            own = limit_margins(of, limits)
            assert [(m.where, m.kind) for m in own] == list(within.margin_names)
            np.testing.assert_allclose(margins[i, j], [m.value for m in own], rtol=0, atol=1e-9)
    assert seen[PRESSED] > 2


@pytest.mark.parametrize("name", ["icub", "talos on slopes", "icub, three surfaces"])
def test_rows_are_infeasible_where_a_linear_program_says_so(case, name):
    # The same limits from raw data of robot and soles, forces and torques as variables.
    stance = case(name)
    q = postures(stance, 25, seed=5)
    limits = tight(stance, q, share=0.35)
    found = BatchKernel(stance, served(stance)[:1], limits, gains=False).evaluate(q).limits
    n, m = len(stance.robot.torque_names), len(stance.component_index)
    agreed = set()
    for i, row in enumerate(q):
        cost = np.eye(n), np.eye(m), np.zeros(m)  # which the linear program does not look at
        raw = raw_problem(Case(stance.at(row), served(stance)[0], limits, *cost))
        free = [(None, None)] * len(raw.c)
        solved = linprog(0 * raw.c, raw.C, raw.d, raw.E, raw.e, free)
        assert solved.status in (0, 2)
        assert (found.state[i, 0] == INFEASIBLE) == (solved.status == 2)
        assert (found.relaxation[i] > 0) == (solved.status == 2)
        agreed.add(solved.status)
    assert name != "icub" or agreed == {0, 2}


def same_bits(a, b):
    arrays = [arrays_of(r) | limit_arrays(r.limits) for r in (a, b)]
    for what, value in arrays[0].items():
        np.testing.assert_array_equal(value, arrays[1][what], err_msg=what)


def test_a_row_does_not_depend_on_the_others(answers, case):
    stance, q, limits, found = answers("icub, three surfaces")
    kernel = BatchKernel(stance, served(stance), limits)
    same_bits(kernel.evaluate(q, threads=2), found)
    back = kernel.evaluate(np.ascontiguousarray(q[::-1]))
    for what, value in (arrays_of(back) | limit_arrays(back.limits)).items():
        expected = (arrays_of(found) | limit_arrays(found.limits))[what]
        np.testing.assert_array_equal(value[::-1], expected, err_msg=what)
    for i in range(len(q)):
        single = kernel.one(q[i])
        expected = kernel.evaluate(q[i : i + 1])
        same_bits(single, expected)
    out = kernel.evaluate(np.ascontiguousarray(q[::-1]))
    same_bits(kernel.evaluate(q, out=out), found)


def test_results_without_limits_are_put_within_them(answers, case):
    from copsense.batch.statics.limited_kernel import limit_postures

    stance, q, limits, found = answers("icub")
    assert (found.limits.state == INFEASIBLE).any()
    free = BatchKernel(stance, served(stance))
    kernel = BatchKernel(stance, served(stance), limits)
    limited = kernel.limited(q, free.evaluate(q))
    same_bits(limited, found)
    assert limited.reasons == found.reasons
    for i in range(len(q)):  # in a loop infeasible postures are said to be so too
        single = kernel.one(q[i])
        assert {(i, j): why for (_, j), why in single.reasons.items()} == {
            (row, j): why for (row, j), why in found.reasons.items() if row == i
        }
    with pytest.raises(copsense.errors.InvalidInputError, match="own is BatchResult"):
        kernel.limited(q[:2], free.evaluate(q))
    with pytest.raises(copsense.errors.InvalidInputError, match="the batch has no limits"):
        free.limited(q, free.evaluate(q))
    with pytest.raises(copsense.errors.InvalidInputError, match=r"other configurations: .* row 0"):
        kernel.limited(q[::-1].copy(), free.evaluate(q))
    with pytest.raises(copsense.errors.InvalidInputError, match="within limits"):
        kernel.limited(q, found)
    again = pickle.loads(pickle.dumps(kernel))
    known = len(limit_postures.signatures)
    same_bits(again.limited(q, free.evaluate(q)), found)
    assert len(limit_postures.signatures) == known  # nothing is compiled once more


def test_both_sides_of_a_change_are_the_references(icub):
    # Between two postures of other pressing limits, by bisection, to where one only touches.
    limits = Limits(friction=0.5, cop_margin=0.02)
    kernel = BatchKernel(icub, [copsense.minimum_torque()], limits)
    chart = PostureChart(icub, ["com_y", "com_z"])
    low, high = chart.values - [0.0, 0.03], np.add(chart.values, [0.04, -0.03])
    for _ in range(60):
        middle = (low + high) / 2
        at = kernel.evaluate(chart.solve([middle]).configurations)
        if at.limits.touching[0, 0]:
            break
        low, high = (middle, high) if at.limits.state[0, 0] == WITHIN else (low, middle)
    assert at.limits.touching[0, 0] == 1
    change = at.limits.nearest_change(0, 0)  # what is only touched is met at once
    assert change.travel == pytest.approx(0.0, abs=1e-8)  # a touch is of 1e-9 weights
    assert change.binds
    q = chart.solve([middle]).configurations
    gains = kernel.one_sided_gains(q, at)
    expected = copsense.cop_sensitivity(icub.at(q[0]), copsense.minimum_torque(), limits)
    for n, side in enumerate((-1, 1)):
        found = expected.one_sided(expected.com_motions[:, 1], side=side)
        np.testing.assert_allclose(gains[0, 0, n, :, :, 1], found, rtol=0, atol=1e-9)
        # The kernel says the same a little before and after.
        near = chart.solve([np.add(middle, [side * 1e-6, 0.0])]).configurations
        beside = kernel.evaluate(near)
        assert beside.limits.touching[0, 0] == 0
        np.testing.assert_array_equal(
            kernel.one_sided_gains(near, beside)[0, 0, 0], beside.com_gain[0, 0]
        )
        np.testing.assert_allclose(beside.com_gain[0, 0, :, :, 1], found, rtol=0, atol=1e-4)
    assert np.abs(gains[0, 0, 0] - gains[0, 0, 1]).max() > 0.1
    with pytest.raises(copsense.errors.InvalidInputError, match="has no gains"):
        kernel.one_sided_gains(np.vstack([q, q]), at)


def test_an_edge_nearly_in_line_with_one_that_presses_is_not_touched(icub):
    com, criterion = tuple(np.add(icub.com, [0.0, 0.05, 0.0])), copsense.minimum_torque()
    q = copsense.solve_posture(with_vertex(icub, 0.0, 0.0), com=com).stance.q
    x = BatchKernel(with_vertex(icub, 0.0, 0.0), [criterion], Limits()).evaluate(q[None]).cops
    for beside in (2e-5, -2e-5):
        stance = with_vertex(icub, x[0, 0, 1, 0] + beside, 2e-6)
        found = BatchKernel(stance, [criterion], Limits()).evaluate(q[None]).limits
        (pressing,) = found.active(0, 0)
        assert pressing.kind == "cop"
        assert found.touching[0, 0] == 0
        expected = copsense.solve_equilibrium(stance.at(q), criterion, Limits())
        assert [a.name for a in expected.active] == [pressing.name]


def test_a_hand_that_would_have_to_pull_is_left_without_load(icub):
    # The wall is on the wrong side of the hand: all that limits leave it is nothing.
    stance = with_hand(off_centre(icub), "l_hand", (1, -0.2, -0.1))
    friction = dict.fromkeys(stance.contact_names[:2], 0.6) | {"hand": 0.05}
    limits = Limits(friction=friction, cop_margin=None)
    q = postures(stance, 4, seed=1, size=0.05)
    criteria = served(stance)
    found = evaluate_batch(stance, q, criteria, limits)
    alone, states = BatchKernel(stance, criteria, limits).empty(len(q)), set()
    for i, j in np.ndindex(len(q), 4):
        states.add(int(found.limits.state[i, j]))
        _, error = reference_answer(stance.at(q[i]), criteria[j], limits)
        assert isinstance(error, UnloadedContactError | None)
        assert found.reasons.get((i, j), "") == str(error or "")
        assert (found.limits.state[i, j] == UNLOADED) == (error is not None)
        assert np.isnan(found.wrenches[i, j]).all() == (error is not None)
        assert np.isnan(found.limits.change_travel[i, j]) == (error is not None)
        fill_row(stance, q[i], criteria[j], alone, i, j)
        assert np.isnan(alone.limits.change_travel[i, j]) == (error is not None)
    assert UNLOADED in states


def test_loads_that_the_balance_alone_fixes_are_within_limits_or_not(case):
    # Three points on level ground: their rows answer to no choice, and rounding must not be one.
    flat = copsense.load_stance("solo12")
    stance, rng = flat.with_contacts(flat.contacts[1:]), np.random.default_rng(8)
    chart = PostureChart(stance, ["com_x", "com_y"])
    batch = chart.solve(chart.values + rng.uniform(-0.03, 0.03, (300, 2)))
    q = batch.configurations[batch.converged]
    criteria = [copsense.minimum_wrench(1.0), copsense.minimum_torque()]
    least = BatchKernel(stance, criteria[:1]).evaluate(q).load_share[:, 0].min(axis=-1)
    for share in (0.05, 0.1, 0.15):
        limits = Limits(friction=None, normal_force=share * stance.robot.weight)
        found = BatchKernel(stance, criteria, limits).evaluate(q).limits
        expected = np.where(least < share, INFEASIBLE, WITHIN)
        np.testing.assert_array_equal(found.state, np.column_stack([expected] * 2))
        assert set(expected) == {WITHIN, INFEASIBLE}


def test_a_torque_held_at_nothing_does_not_let_go(icub):
    # Whichever of its two rows presses, the joint bears no torque, and nothing changes.
    q = postures(icub, 10, seed=3)
    limits = Limits(friction=None, cop_margin=None, normal_force=None, torque={"l_knee": 0.0})
    found = BatchKernel(icub, served(icub), limits).evaluate(q).limits
    assert (found.state == PRESSED).all()
    assert np.isinf(found.change_travel).all()
    for i, j in np.ndindex(10, 4):
        expected = copsense.cop_sensitivity(icub.at(q[i]), served(icub)[j], limits)
        assert expected.nearest_active_set_change() is None
        for way in (-1, 1):
            assert expected.next_active_set_change(way * expected.com_motions[:, 1]) is None


def test_without_numba_the_reference_answers_within_limits_too(answers, monkeypatch):
    stance, q, limits, found = answers("icub")
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "numba" else find(name)
    )
    kernel = BatchKernel(stance, served(stance), limits)
    assert "copsense[fast]" in kernel.fallback_reason
    alone = kernel.evaluate(q)
    np.testing.assert_array_equal(alone.limits.state, found.limits.state)
    np.testing.assert_allclose(alone.torques, found.torques, rtol=0, atol=1e-9)
    np.testing.assert_allclose(alone.limits.margins, found.limits.margins, rtol=0, atol=1e-9)
    np.testing.assert_allclose(alone.limits.relaxation, found.limits.relaxation, rtol=1e-6, atol=0)
    travels = alone.limits.change_travel, found.limits.change_travel
    np.testing.assert_allclose(*travels, rtol=RELATIVE, atol=0)
    kinds = np.array([*found.limits.kinds, ""])
    np.testing.assert_array_equal(
        kinds[alone.limits.change_limit], kinds[found.limits.change_limit]
    )
    assert alone.reasons.keys() == found.reasons.keys()
    for i, j in np.ndindex(alone.limits.state.shape):
        assert set(alone.limits.pressing[i, j]) == set(found.limits.pressing[i, j])


def test_policies_take_no_limits(case):
    stance = case("icub")

    def own(q):
        return copsense.solve_equilibrium(stance.at(q), copsense.minimum_torque()).wrenches

    with pytest.raises(copsense.errors.InvalidInputError, match="policy 'own'"):
        BatchKernel(stance, [own], Limits(friction=0.5))


def test_results_to_overwrite_have_to_be_within_the_same_limits(case):
    stance = case("icub")
    kernel = BatchKernel(stance, served(stance), Limits(friction=0.5))
    other = BatchKernel(stance, served(stance), Limits(friction=0.4))
    free = BatchKernel(stance, served(stance))
    for out, words in ((other.empty(1), r"out\.limits"), (free.empty(1), "with limits")):
        with pytest.raises(copsense.errors.InvalidInputError, match=words):
            kernel.evaluate(stance.q[None], out=out)
