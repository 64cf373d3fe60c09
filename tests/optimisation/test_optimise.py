"""Optimised postures: inside every constraint, where the multipliers say, and beaten by none."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.walkers import BIPED, NO_ANKLE_ROLL, bent, walker

import copsense
from copsense.batch import PostureChart
from copsense.errors import InvalidInputError, UnknownNameError, UnreachablePostureError
from copsense.limits import NO_LIMITS, Limits
from copsense.optimisation import QUANTITIES, optimise, pareto_front
from copsense.optimisation.objectives import Gauge
from copsense.pushes import push_limits
from copsense.robot import Robot
from copsense.scan import limit_travel
from copsense.stance import Stance

TORQUE, LENGTH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
KNEE = np.radians(2.0)
KNEES = {"l_knee": (-2.0, -KNEE), "r_knee": (-2.0, -KNEE)}
COM = {"com_x": 0.06, "com_z": 0.03}


@pytest.fixture(scope="module")
def farthest(icub):
    return optimise(icub, over=COM, reserve={"knee": KNEE}, within=KNEES, starts=1)


@pytest.fixture(scope="module")
def least_torque(icub):
    return optimise(icub, objective="torque", over=COM, within=KNEES, starts=1)


def test_weights_alone_are_what_design_chooses(icub):
    found = optimise(icub, family="length", over={}, objective="sideways", starts=1)
    path = copsense.lateral_sweep(icub, -0.09, 0.09, 19)
    designed = copsense.design_criterion(path, Limits(), "length", grid=5)
    assert np.array_equal(found.stance.q, icub.q)
    assert not found.after.coordinates
    assert found.after.parameters == pytest.approx(designed.score.parameters, rel=1e-4)
    assert found.after.sideways_travel == pytest.approx(designed.score.travel, rel=1e-6)


def positions(stance, names):
    return np.array([stance.robot.joint_position(stance.q, name) for name in names])


def test_quantities_are_those_of_the_other_modules(icub):
    limits = Limits(friction=0.5, torque="model")
    gauge, found = Gauge(icub, limits), copsense.cop_sensitivity(icub, LENGTH)

    def measured(name, gauge=gauge):
        return gauge.measure(QUANTITIES[name], found.equilibrium)

    tipping = Gauge(icub, replace(NO_LIMITS, cop_margin=0.0))
    assert measured("travel", tipping) == pytest.approx(found.com_travel.min(), rel=1e-9)
    assert measured("travel", tipping) <= measured("sideways", tipping)
    assert measured("torque") == pytest.approx(np.linalg.norm(found.equilibrium.torques))
    gains = np.linalg.norm(found.com_gain, 2, axis=(1, 2))
    assert measured("gain") == pytest.approx(gains.max(), rel=1e-9)
    weakest = push_limits(icub, None, [LENGTH], limits).criteria[0].weakest[0]
    assert measured("push") == pytest.approx(weakest, rel=1e-6)
    inside = [
        contact.sole.margin(p).distance / contact.sole.room()
        for contact, p in zip(icub.contacts, found.cop, strict=True)
    ]
    assert measured("margin", tipping) == pytest.approx(min(inside), rel=1e-9)
    assert measured("margin") <= measured("margin", tipping)


def test_rows_at_the_end_of_a_path_are_its_exact_travel(icub):
    limits = Limits()
    gauge, found = Gauge(icub, limits), copsense.solve_equilibrium(icub, TORQUE)
    exact = [limit_travel(icub, TORQUE, limits, side).first.exact for side in (1, -1)]
    gauge.ends = (("com_y", 1, exact[0]), ("com_y", -1, exact[1]))
    along = replace(QUANTITIES["travel"], along=True)
    rows = gauge.rows(along, found)
    assert len(rows) == len(gauge.names(along))
    count = len(gauge.names(QUANTITIES["travel"]))
    ahead = rows[count : 2 * count].min(), rows[2 * count :].min()
    np.testing.assert_allclose(ahead, exact, rtol=1e-7)


def test_an_optimum_keeps_every_constraint_and_says_what_binds(icub, farthest):
    here = farthest.stance
    for before, after in zip(icub.placements, here.placements, strict=True):
        np.testing.assert_allclose(after.homogeneous, before.homogeneous, atol=1e-9)
    ranges = {"com_x": icub.com[0], "com_z": icub.com[2]}
    for name, middle in ranges.items():
        value = here.com["xyz".index(name[-1])]
        assert value == pytest.approx(farthest.after.coordinates[name], abs=1e-8)
        assert abs(value - middle) <= COM[name] + 1e-8
    assert (positions(here, KNEES) <= -KNEE + 1e-7).all()
    low, high = here.robot.position_limits
    assert (here.q[7:] >= low - 1e-7).all()
    assert (here.q[7:] <= high + 1e-7).all()
    kept = [name for name in icub.robot.joint_names if "torso" in name or "shoulder" in name]
    np.testing.assert_allclose(positions(here, kept), positions(icub, kept), atol=1e-8)
    assert farthest.converged
    bounds = [b.name for b in farthest.binding if b.kind == "bound"]
    assert bounds == ["com_x at 60.0 mm, the upper end of its range"]
    assert "CoP at" in next(b.name for b in farthest.binding if b.kind == "objective")


def test_the_travel_is_exact_and_the_same_to_both_sides(icub, farthest):
    exact = [limit_travel(farthest.stance, TORQUE, Limits(), s).first.exact for s in (1, -1)]
    told = {travel.way: travel.distance for travel in farthest.after.travels}
    np.testing.assert_allclose([told["+y"], told["-y"]], exact, rtol=1e-9)
    assert min(exact) == pytest.approx(max(exact), rel=1e-3)
    assert min(exact) > 0.049
    assert farthest.before.smallest_travel == pytest.approx(0.0458, abs=1e-4)
    assert farthest.exact
    assert farthest.after.smallest_travel == pytest.approx(min(exact), rel=1e-6)


def test_no_posture_of_a_sample_goes_farther_to_first_order(icub, farthest):
    names = tuple(COM)
    drawn = np.random.default_rng(3).uniform(-1, 1, (60, 2)) * list(COM.values())
    drawn[:40] *= 0.1
    centre = np.array([farthest.after.coordinates[name] for name in names])
    own = np.array([icub.com[0], icub.com[2]])
    middle = np.where(np.arange(60)[:, None] < 40, centre, own)
    found = PostureChart(icub, names, compiled=False).solve(middle + drawn)
    reached = [icub.at(q) for q in found.configurations[found.converged]]
    kept = [here for here in reached if (positions(here, KNEES) <= -KNEE).all()]
    assert len(kept) > 10
    travels = [copsense.cop_sensitivity(here, TORQUE).com_travel.min() for here in kept]
    assert max(travels) < max(farthest.starts)
    assert max(travels) > 0.95 * max(farthest.starts)


def test_loops_stay_closed_and_no_posture_of_a_sample_is_better(stance_of):
    cassie, aside = stance_of("cassie"), {"com_x": 0.02, "com_z": 0.03}
    found = optimise(cassie, objective="torque", over=aside, starts=1)
    assert np.abs(found.stance.closures.error).max() < 1e-12
    for now, before in zip(found.stance.placements, cassie.placements, strict=True):
        assert np.abs(now.translation - before.translation).max() < 1e-12
    best, first = (v.quantities["torque"] for v in (found.after, found.before))
    assert best < first - 1.0
    grid = np.linspace(-1, 1, 5)
    values = [(cassie.com[0] + 0.02 * a, cassie.com[2] + 0.03 * b) for a in grid for b in grid]
    chart = PostureChart(cassie, list(aside), compiled=False).solve(np.array(values))
    assert chart.converged.sum() > 20
    others = [cassie.at(q) for q in chart.configurations[chart.converged]]
    tied = found.after.criterion
    torques = [np.linalg.norm(copsense.solve_equilibrium(s, tied).torques) for s in others]
    assert best < min(torques) < 1.05 * best


def test_a_price_is_what_a_bound_is_worth(icub):
    low, high, step = 0.5, 0.53, 1e-4
    ends = [{"com_x": 0.06, "com_z": (low, high + more)} for more in (0.0, step)]
    found, more = (optimise(icub, objective="torque", over=over, starts=1) for over in ends)
    gained = found.after.quantities["torque"] - more.after.quantities["torque"]
    (bound,) = [b for b in found.binding if b.kind == "bound"]
    assert bound.name == "com_z at 530.0 mm, the upper end of its range"
    assert gained / step == pytest.approx(bound.price, rel=1e-2)
    assert f"({bound.price / 1e3:.3g} N m per mm)" in str(found)


def test_placements_of_the_feet_stay_in_their_box_and_on_the_ground(icub):
    wide = optimise(
        icub,
        objective="margin",
        over={"com_z": 0.02, "com_y": 0.03, "l_sole:y": 0.03, "r_sole:y": 0.03},
        within=KNEES,
        distance=(0.18, 0.19),
        require={"travel": 0.055},
        starts=1,
    )
    left, right = (place.translation for place in wide.stance.placements)
    assert 0.18 - 1e-7 <= left[1] - right[1] <= 0.19 + 1e-7
    assert max(abs(left[1] - 0.07), abs(right[1] + 0.07)) <= 0.03 + 1e-8
    np.testing.assert_allclose([left[2], right[2]], 0.0, atol=1e-8)
    assert wide.after.quantities["travel"] > 0.055 - 1e-7
    assert wide.after.quantities["margin"] > wide.before.quantities["margin"]


def test_weights_go_with_the_posture(icub):
    asked = {"objective": "torque", "over": {"com_z": 0.01}, "within": KNEES, "starts": 1}
    aside = copsense.posture.move_stance(icub, com_y=0.03)  # in the middle no criterion differs
    alone, both = optimise(aside, LENGTH, **asked), optimise(aside, family="length", **asked)
    assert both.after.quantities["torque"] < 0.99 * alone.after.quantities["torque"]
    (length,) = both.after.parameters.values()
    again = copsense.solve_equilibrium(both.stance, copsense.minimum_wrench(length))
    assert np.linalg.norm(again.torques) == pytest.approx(both.after.quantities["torque"])
    assert both.criterion.name == "designed-wrench"


def test_a_front_falls_from_one_optimum_to_the_other(icub, least_torque):
    front = pareto_front(icub, ("travel", "torque"), over=COM, within=KNEES, points=3, starts=1)
    travel, torque = (
        np.array([p.after.quantities[name] for p in front.points]) for name in front.objectives
    )
    assert len(front.points) == 3
    assert (np.diff(travel) < 0).all()
    assert (np.diff(torque) < 0).all()
    assert torque[-1] == pytest.approx(least_torque.after.quantities["torque"], rel=1e-4)
    assert all(point.converged for point in front.points)


def test_the_middle_of_the_four_bar_is_found(stance_of):
    bar = copsense.posture.move_stance(stance_of("four_bar"), com_y=0.03)
    found = optimise(bar, over={"com_y": (-0.05, 0.05)}, starts=1)
    assert found.after.coordinates["com_y"] == pytest.approx(0.0, abs=1e-6)
    exact = [travel.distance for travel in found.after.travels]
    assert exact == pytest.approx([0.14, 0.14], abs=1e-6)  # to where one foot carries all
    with pytest.raises(InvalidInputError, match="lives in a plane"):
        optimise(bar, objective="push", starts=1)


def test_contacts_that_say_the_same_twice_are_borne(icub):
    toe = copsense.Contact("l_sole", kind="point", name="l_toe", offset=(0.1, 0.0, 0.0))
    heel = copsense.Contact("l_sole", kind="point", name="l_heel", offset=(-0.05, 0.0, 0.0))
    side = copsense.Contact("l_sole", kind="point", name="l_side", offset=(0.0, 0.03, 0.0))
    stance = icub.with_contacts([toe, heel, side, icub.contacts[1]])
    found = optimise(stance, objective="torque", over=COM, within=KNEES, starts=1)
    assert found.converged
    assert found.after.quantities["torque"] < found.before.quantities["torque"]


def test_a_search_that_is_cut_short_says_what_it_reached(icub):
    short = optimise(icub, objective="torque", over=COM, within=KNEES, starts=1, iterations=2)
    assert not short.converged
    (note,) = [note for note in short.notes if "stopped early" in note]
    assert QUANTITIES["torque"].shown(short.after.quantities["torque"]) in note
    assert "--iterations" in note
    assert "not proven" in str(short)
    for before, after in zip(icub.placements, short.stance.placements, strict=True):
        np.testing.assert_allclose(after.homogeneous, before.homogeneous, atol=1e-9)


def test_motions_that_contacts_hold_fast_do_not_hold_the_search_up():
    """Without ankle roll the pelvis' roll is held to second order, which no gradient shows."""
    text = walker(NO_ANKLE_ROLL)
    legs = copsense.load_stance(text, contacts=BIPED, contact_at="sole", posture=bent(0.8))
    found = optimise(legs, objective="gain", over=["com_x"], starts=1)
    assert found.converged
    assert found.iterations < 20
    assert [travel.way for travel in found.after.travels] == ["+x", "-x"]
    assert found.after.exact_travel == pytest.approx(found.before.exact_travel, abs=1e-3)
    assert "over 1 m" in str(found).splitlines()[3]  # sideways the CoM stays
    with pytest.raises(InvalidInputError, match="hold roll fast"):
        optimise(legs, over=["roll"], starts=1)


@pytest.fixture(scope="module")
def without_forearm(icub):
    """The iCub, its left elbow moving nothing that has a mass."""
    model = icub.robot.model.copy()
    model.inertias[model.getJointId("l_elbow")] = pin.Inertia.Zero()
    return Stance(Robot.from_model(model, name="light"), icub.q, icub.contacts)


def test_a_coordinate_that_moves_nothing_is_named(without_forearm):
    with pytest.raises(InvalidInputError, match="l_elbow moves nothing"):
        optimise(without_forearm, objective="torque", over=["l_elbow"], starts=1)
    over = {"com_z": 0.02, "l_elbow": None}
    found = optimise(without_forearm, objective="torque", over=over, within=KNEES, starts=1)
    assert any("l_elbow moves nothing" in note for note in found.notes)


CONTRADICTIONS = {
    "a range beyond another": ({"over": ["com_z"], "within": {"com_z": (0.3, 0.4)}}, "com_z"),
    "a reserve without room": ({"reserve": {"ankle": 1.0}}, "l_ankle_pitch"),
    "a bound on what stays": ({"within": {"torso_yaw": (0.1, 0.2)}}, "torso_yaw does not vary"),
    "a distance upside down": ({"distance": (0.2, 0.1)}, "at least 200.0 mm"),
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_constraints_that_contradict_each_other_are_named(icub, case):
    asked, named = CONTRADICTIONS[case]
    with pytest.raises(InvalidInputError, match="contradictory constraints") as error:
        optimise(icub, **asked)
    assert named in str(error.value)


def test_what_no_posture_keeps_is_named(icub):
    with pytest.raises(UnreachablePostureError) as error:
        optimise(icub, objective="torque", over={"com_z": (0.65, 0.7)}, starts=1)
    for named in ("com_z at 650.0 mm", "contact l_sole along z", "contact r_sole along z"):
        assert named in str(error.value)
    with pytest.raises(UnreachablePostureError, match="distance of l_sole and r_sole at least"):
        optimise(icub, objective="torque", over={"com_z": 0.01}, distance=(0.2, 0.3), starts=1)
    # What is broken by a share of each is broken by no length.
    with pytest.raises(UnreachablePostureError, match="are broken least these contradict"):
        optimise(icub, over={"com_z": None}, require={"gain": 0.1}, starts=1)


def test_bad_questions_are_rejected(icub, stance_of):
    wrong = [
        ({"objective": "speed"}, UnknownNameError, "speed"),
        ({"over": ["elbows"]}, UnknownNameError, "elbows"),
        ({"over": []}, InvalidInputError, "no coordinate"),
        ({"over": {"com_z": (0.5, 0.5)}}, InvalidInputError, "is empty"),
        ({"over": ["feet"]}, InvalidInputError, "Give a range of l_sole:x"),
        ({"over": {"com": (0.1, 0.2)}}, InvalidInputError, "several coordinates"),
        ({"over": {"com": None, "com_x": None}}, InvalidInputError, "named twice"),
        ({"reserve": {"wheel": 0.1}}, UnknownNameError, "wheel"),
        ({"reserve": {"knee": -0.1}}, InvalidInputError, "negative"),
        ({"require": {"travel": 0.1}}, InvalidInputError, "optimised, and required"),
        ({"require": {"gain": -1.0}}, InvalidInputError, "less than zero of it"),
        ({"family": "joints", "criterion": TORQUE}, InvalidInputError, "Give one of them"),
        ({"starts": 0}, InvalidInputError, "starts"),
        ({"limits": NO_LIMITS}, InvalidInputError, "limit nothing"),
    ]
    for asked, kind, text in wrong:
        with pytest.raises(kind, match=text):
            optimise(icub, **asked)
    hanging = copsense.load_stance("icub", passive=["l_elbow"])
    with pytest.raises(InvalidInputError, match="hang"):
        optimise(hanging)
    with pytest.raises(InvalidInputError, match="two quantities"):
        pareto_front(icub, ("travel", "travel"))
