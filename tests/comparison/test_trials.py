"""Trials measure what they say; short versions of what benchmarks/balancing.py runs."""

import dataclasses
import math

import numpy as np
import pytest
from support.narrow import C1, C2, FULL, LEAN, STRAIGHT, one

import copsense
from copsense.comparison import (
    Breaking,
    Falls,
    Lean,
    PostureChoice,
    PushToTip,
    Rest,
    RobotChoice,
    Sway,
    make_plan,
    predict_impulse,
    run_case,
)
from copsense.comparison.case_runner import CaseRunner
from copsense.comparison.score_kinds import SCORES
from copsense.comparison.trials import trial_named
from copsense.controllers import Ramp, lateral_reference
from copsense.limits import Limits
from copsense.path import lateral_sweep
from copsense.sensitivity import cop_sensitivity
from copsense.simulation.prediction import predict

LIMITS = Limits(normal_force=10.0, friction=1.0, cop_margin=1e-3, torsion=None)
WITHIN = dataclasses.replace(C2, limits=LIMITS, name="")


@pytest.fixture(scope="module")
def stance():
    return FULL.stance(STRAIGHT)


_RUN = {}


def scores(trial, controller=C1, **options):
    """The scores of a case by their names; each case is run once, it gives the same again."""
    case = one(trial, controller, **options)
    if case.key not in _RUN:
        _RUN[case.key] = {score.score: score for score in run_case(case)}
    return _RUN[case.key]


def test_the_paper_s_sway_tells_the_criteria_apart(monkeypatch):
    # 39 mm up to the first peak; benchmarks/ runs the whole period at 0.05 Hz.
    for amplitude, contact in ((0.039, "r_sole"), (-0.039, "l_sole")):
        found, _, torque, _ = run_case(one(Sway(amplitude, 0.1, 0.26), robot=FULL))
        assert (found.status, found.contact, found.high) == ("bound", contact, 0.0)
        assert found.predicted < 0
        assert torque.status == "tipped"
    run, recorded = CaseRunner.run, []
    spied = lambda *a, **k: recorded.append(run(*a, **k)) or recorded[-1]  # noqa: E731
    monkeypatch.setattr(CaseRunner, "run", spied)
    found = scores(Sway(0.039, 0.05, 0.26), C2, robot=FULL)
    assert found["smallest_margin"].status == "measured"
    assert found["smallest_margin"].value == pytest.approx(
        found["smallest_margin"].predicted, abs=5e-4
    )
    assert found["com_error"].value < 1e-4
    (whole,) = recorded
    assert whole["time"].values[-1] == pytest.approx(5.2, abs=0.01)
    run = whole.sel(time=slice(0.1, None))
    error = (run["com"] - run["com_target"]).sel(com_axis="y").values
    assert found["com_error"].value == np.sqrt(np.mean(error**2))
    for name in ("torque_norm", "torque_peak"):
        assert found[name].value == pytest.approx(found[name].predicted, rel=0.05)


def test_limits_carry_the_com_over_the_foot():
    found = scores(Sway(0.07, 0.1, 0.26), WITHIN, robot=FULL)
    assert found["smallest_margin"].status == "measured", found["smallest_margin"].reason
    assert found["com_error"].value < 1e-3


def test_at_rest_physics_measures_the_statics():
    found = scores(Rest(0.5), C2, robot=FULL)
    assert found["wrench_error"].value < 2e-3
    assert found["cop_error"].value < 1e-4


def test_a_lean_that_ends_standing_is_a_bound():
    found = scores(Lean(0.004, 0.02))["tip_excursion"]
    assert (found.status, found.low, found.high) == ("bound", 0.004, math.inf)
    assert "nothing tipped" in found.reason
    assert math.isnan(found.predicted)


def test_a_lean_without_reach_goes_as_far_as_it_needs():
    found = scores(Lean(speed=0.02))["tip_excursion"]
    assert found.value == pytest.approx(scores(LEAN)["tip_excursion"].value, abs=1e-3)


def test_sides_are_mirror_images():
    found = [scores(Lean(0.015, 0.02, side))["tip_excursion"] for side in ("left", "right")]
    assert found[0].value == pytest.approx(found[1].value, abs=2e-4)
    assert [f.contact for f in found] == ["r_sole", "l_sole"]


def test_the_first_tip_impulse_has_its_resolution():
    found = scores(PushToTip(resolution=0.15, largest=1.2))["tip_impulse"]
    assert found.status == "measured"
    assert found.high - found.low == pytest.approx(0.3)
    assert found.low <= found.value <= found.high
    assert 0.7 < found.value / found.predicted < 1.4
    none = scores(PushToTip(resolution=0.01, largest=0.02))["tip_impulse"]
    assert (none.status, none.low, none.high) == ("bound", 0.02, math.inf)


def test_a_breaking_point_lies_between_survival_and_failure():
    delay = Breaking("delay", 0.0, 0.06, 0.03, 0.002, 1.0)
    found = scores(delay)["breaking_delay"]
    assert found.status == "measured", found.reason
    assert found.high - found.low == pytest.approx(0.03)
    assert found.contact
    # The static peak of the legs' torques is what a limit must leave.
    limit = Breaking("torque_limit", 10.0, 0.1, 4.95, 0.002, 1.0)
    found = scores(limit)["breaking_torque_limit"]
    assert found.status == "measured", found.reason
    assert found.low < found.predicted < found.high
    assert found.predicted == pytest.approx(found.first_order, rel=0.1)


class _Ended:
    def __init__(self, kind="completed"):
        self.attrs = {"end_kind": kind}


@pytest.mark.parametrize(("fell", "repeats"), [(0, 5), (1, 7), (10, 20), (19, 20), (20, 20)])
def test_a_rate_has_wilsons_interval(fell, repeats, monkeypatch):
    ends = iter(["fall"] * fell + ["completed"] * (repeats - fell))
    monkeypatch.setattr(CaseRunner, "run", lambda *a, **k: _Ended(next(ends)))
    (found,) = run_case(one(Falls(repeats=repeats), WITHIN, FULL))
    # Wilson 1927, doi:10.2307/2276774, as the roots p of (p - rate)^2 = z^2 p (1 - p) / n.
    z2, rate = 1.959963984540054**2 / repeats, fell / repeats
    roots = np.sort(np.roots([1 + z2, -2 * rate - z2, rate**2]).real)
    assert (found.low, found.high) == pytest.approx(tuple(roots), abs=1e-9)
    assert found.value == rate
    assert 0.0 <= found.low <= rate <= found.high <= 1.0


def test_falls_are_a_seeded_rate_with_its_interval(monkeypatch):
    gentle = Falls(0.02, 1, watch=0.1)
    (once,), (again,) = (run_case(one(gentle, WITHIN, FULL)) for _ in range(2))
    assert once == again
    assert (once.value, once.low) == (0.0, 0.0)
    assert once.runs == 1
    draws = []
    with monkeypatch.context() as patched:
        patched.setattr(CaseRunner, "run", lambda *a, **k: draws.append(k) or _Ended())
        for seed in (0, 0, 1):
            run_case(one(Falls(0.02, 2, seed=seed), WITHIN, FULL))
    first, second, again, _, other, _ = [(d["push"], d["seed"]) for d in draws]
    assert first == again
    assert len({str(draw) for draw in (first, second, other)}) == 3
    hard = run_case(one(Falls(1.5, 1, watch=1.5), WITHIN, FULL))[0]
    assert hard.value == 1.0
    with pytest.raises(copsense.CopsenseError, match="limits"):
        one(gentle, C2)


def test_a_robot_without_soles_has_no_margin():
    (case,) = make_plan([RobotChoice("solo12")], [PostureChoice()], [C2], [Sway(0.002, 2.0)])
    margin, *others = run_case(case)
    assert (margin.status, margin.reason) == ("none", "no contact has a sole's edge")
    assert [score.status for score in others] == ["measured"] * 3


def test_the_knees_of_a_quadruped_are_not_known():
    found = scores(Sway(0.002, 2.0), C2, robot=RobotChoice("solo12"))
    assert "knees" in found["smallest_margin"].reason


@pytest.mark.parametrize(("choice", "how"), [(C1, "left the ground"), (C2, "slipped")])
def test_a_point_lifts_or_slips_where_the_statics_say(choice, how):
    stance = copsense.load_stance("solo12")
    found = predict(lateral_reference(stance, Ramp(0.15)), choice.build_criterion())
    forces = []
    for there in lateral_sweep(stance, 0.0, 0.99 * found.excursion, 3).stances:
        wrenches = copsense.solve_equilibrium(there, choice.build_criterion()).wrenches
        mu = there.contacts[0].friction or 1.0
        tangential = np.hypot(wrenches[:, 0], wrenches[:, 1])
        forces.append([wrenches[:, 2], mu * wrenches[:, 2] - tangential])
    assert np.all(np.array(forces) > 0)
    assert (found.excursion < 0.12) == (how == "slipped")
    (case,) = make_plan([RobotChoice("solo12")], [PostureChoice()], [choice], [Lean(speed=0.03)])
    (run,) = run_case(case)
    assert how in run.reason
    assert run.how == {"left the ground": "lifts", "slipped": "slips"}[how]
    # A slip is seen when it is 20 mm, a lift when it is 2 mm.
    assert -1e-3 < run.value - found.excursion < 1e-2
    assert run.predicted == pytest.approx(found.excursion, rel=1e-4)  # on another path's grid


def test_the_first_order_of_a_slip_is_that_of_the_path():
    own = copsense.load_stance("go2").contacts
    free = [dataclasses.replace(contact, friction=None) for contact in own]
    stance = copsense.load_stance("go2", contacts=free)
    reference = lateral_reference(stance, Ramp(0.13))
    found = predict(reference, C2.build_criterion(), None, 0.7)

    def gaps(y):
        """What friction and load leave each foot with the CoM at y from the start."""
        there, _ = reference.path.at(y)
        forces = copsense.solve_equilibrium(there, C2.build_criterion()).wrenches
        return np.append(0.7 * forces[:, 2] - np.hypot(*forces[:, :2].T), forces[:, 2])

    # By differences over a tenth of a millimetre, from the start alone.
    closing = (gaps(-1e-4) - gaps(1e-4)) / 2e-4
    first = np.where(closing > 1e-9, gaps(0.0) / closing, np.inf)
    assert found.first_order == pytest.approx(first.min(), rel=1e-5)
    there = gaps(found.excursion)
    assert there.min() == pytest.approx(0.0, abs=1e-6 * stance.robot.weight)
    assert found.contact == stance.contact_names[int(np.argmin(there)) % len(own)]
    bare = predict(reference, C2.build_criterion(), None, 1e9)
    assert bare.excursion > found.excursion


def test_a_sway_that_is_cut_short_is_predicted_as_far_as_it_goes():
    # A tenth of a period: the CoM ends at 0.59 of the amplitude.
    short = scores(Sway(0.01, 0.05, 0.1), robot=FULL)["smallest_margin"]
    whole = scores(Sway(0.01 * math.sin(0.2 * math.pi), 0.2, 0.25), robot=FULL)["smallest_margin"]
    assert short.predicted == pytest.approx(whole.predicted, rel=1e-6)
    assert short.value == pytest.approx(short.predicted, abs=5e-4)


def test_the_first_order_is_the_sensitivity_s(stance):
    reference = lateral_reference(stance, Ramp(0.05))
    for choice in (C1, C2):
        found = predict(reference, choice.build_criterion())
        there, tangent = reference.path.at(0.0)
        here = cop_sensitivity(there, choice.build_criterion())
        slope = (here.gradient @ tangent)[1, 1]
        # By hand: the inner edge of the right sole, contact y = 31 mm; its slack f_z (b - a p).
        fz, left = here.equilibrium.wrenches[1, 2], 0.031 - here.cop[1, 1]
        load_rate = here.wrench_derivative[1, 2] @ here.basis.T @ tangent
        by_hand = fz * left / (fz * slope - left * load_rate)
        assert found.first_order == pytest.approx(by_hand, rel=1e-9)
        rate = np.gradient(found.torques, found.values, axis=0)
        near = int(np.argmin(np.abs(found.values)))
        assert np.abs(found.start.torque_rates - rate[near]).max() < 0.02 * np.abs(rate[near]).max()
        still = np.zeros(2)
        norm = np.linalg.norm(found.start.torques)
        assert found.torque_norm(still) == pytest.approx((norm, norm), rel=1e-6)
        margin = 0.031 - cop_sensitivity(stance, choice.build_criterion()).cop[1, 1]
        assert found.smallest_margin(0.0, 0.0) == pytest.approx((margin, margin), rel=1e-3)


def test_a_longer_push_needs_more_impulse(stance):
    impulses = [predict_impulse(stance, 0.03, duration) for duration in (0.02, 0.1, 0.4)]
    assert impulses == sorted(impulses)
    assert predict_impulse(stance, 0.06, 0.1) == pytest.approx(2 * impulses[1])


def test_the_legs_are_between_the_base_and_the_contacts():
    joints = CaseRunner(one(LEAN)).leg_joints
    assert len(joints) == 12
    assert all(joint[:6] in ("l_hip_", "r_hip_", "l_knee", "r_knee", "l_ankl", "r_ankl")
               for joint in joints)  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "options", "says"),
    [
        ("dance", {}, "dance"),
        ("lean", {"depth": 1}, "depth"),
        ("lean", {"speed": 0}, "speed"),
        ("lean", {"side": "up"}, "up"),
        ("lean", {"parameter": "delay"}, "parameter"),
        ("push", {"resolution": -1}, "resolution"),
        ("delay", {"mild": 0.05, "severe": 0.0}, "does not get worse"),
        ("delay", {"mild": -1.0}, "0 or more"),
        ("bandwidth", {"severe": -5.0}, "over 0"),
        ("bandwidth", {"severe": 60.0}, "severe under mild"),
        ("falls", {"repeats": 0}, "repeats"),
        ("delay", {"step": 0}, "step"),
    ],
)
def test_trials_that_mean_nothing_are_rejected(kind, options, says):
    with pytest.raises(copsense.CopsenseError, match=says):
        trial_named(kind, **options)


def test_every_score_is_explained():
    for kind in ("lean", "push", "sway", "rest", "falls", "delay", "bandwidth", "velocity_noise"):
        assert set(trial_named(kind).scores) <= set(SCORES)
