"""How far the CoM may go before a foot tips, to first order of the slack w (b - a p)."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from support.grounds import off_centre

import copsense
from copsense.freedom import com_span
from copsense.limits import NO_LIMITS

TORQUE, WRENCH = copsense.minimum_torque(), copsense.minimum_wrench(1.0)
COP_ONLY = replace(NO_LIMITS, cop_margin=0.0)


def half_planes(polygon):
    """Outward normals and offsets, an edge from each vertex to the next."""
    along = np.roll(polygon, -1, axis=0) - polygon
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.sum(normals * polygon, axis=1)


def slacks(found, k):
    """Share of the weight times the distance to each edge of a foot."""
    stance = found.equilibrium.stance
    normals, offsets = half_planes(stance.contacts[k].polygon)
    share = found.equilibrium.wrenches[k, 2] / stance.robot.weight
    return share * (offsets - normals @ found.cop[k])


def at_width(stance, width):
    """The stance with its feet so far apart, the CoM in the middle."""
    places = []
    for place in stance.placements:
        x, y, z = place.translation
        places.append(pin.SE3(place.rotation, np.array([x, np.sign(y) * width / 2, z])))
    return copsense.solve_posture(stance, targets=places, com=(stance.com[0], 0.0, None)).stance


def walked(stance, criterion, direction, distance):
    """The sensitivity with the CoM moved so far along a horizontal direction."""
    x, y = stance.com[:2] + distance * direction
    moved = copsense.solve_posture(stance, com=(float(x), float(y), None)).stance
    return copsense.cop_sensitivity(moved, criterion)


@pytest.mark.parametrize("length", [0.05, 1.0])
def test_it_is_exact_where_the_wrenches_are_affine_in_the_com(icub, length):
    # Of the minimum wrench on flat feet: walked to its end, the slack of that very edge is zero.
    criterion = copsense.minimum_wrench(length)
    stance = off_centre(icub)
    found = copsense.cop_sensitivity(stance, criterion)
    for k, contact in enumerate(stance.contacts):
        edge, travel = found.tipping_edge[k], found.com_travel[k]
        normals, _ = half_planes(contact.polygon)
        w = found.equilibrium.wrenches[k, 2] / stance.robot.weight
        slack = slacks(found, k)[edge]
        rate = slack / w * found.load_gain[k] - w * normals[edge] @ found.com_gain[k]
        assert travel == pytest.approx(slack / np.linalg.norm(rate), rel=1e-12)
        there = walked(stance, criterion, -rate / np.linalg.norm(rate), travel)
        assert abs(slacks(there, k)[edge]) < 1e-9
        assert slacks(there, k).min() > -1e-9  # no edge comes before it


def test_along_the_path_the_prediction_is_exact_for_the_minimum_wrench(icub):
    for side in (1, -1):
        first = copsense.scan.limit_travel(icub, WRENCH, COP_ONLY, side).first
        assert first.first_order == pytest.approx(first.exact, abs=1e-9)


def test_under_minimum_torque_the_icubs_is_48_7_mm(icub):
    # Linear in the distance b - a p it was 66 mm, where the foot tips at 45.8 mm.
    found = copsense.cop_sensitivity(icub, TORQUE)
    assert found.com_travel == pytest.approx([0.0487, 0.0487], abs=1e-4)


def test_it_grows_with_the_width_of_the_stance(icub):
    # Along y: 49.2, 57.3, 65.4 mm predicted, 45.9, 52.4, 58.8 mm walked. Linear in the distance it
    # was 66 mm at each.
    shortest, predicted, exact = [], [], []
    for width in (0.14, 0.17, 0.20):
        stance = at_width(icub, width)
        shortest.append(copsense.cop_sensitivity(stance, TORQUE).com_travel.min())
        first = copsense.scan.limit_travel(stance, TORQUE, COP_ONLY).first
        predicted.append(first.first_order)
        exact.append(first.exact)
    assert exact == pytest.approx([0.0459, 0.0524, 0.0588], abs=1e-4)
    assert predicted == pytest.approx([0.0492, 0.0573, 0.0654], abs=1e-4)
    assert shortest == pytest.approx([0.0487, 0.0571, 0.0601], abs=1e-4)


def with_soles(icub, polygon):
    """The iCub on other soles."""
    return icub.with_contacts([replace(c, polygon=polygon) for c in icub.contacts])


def test_it_is_negative_where_the_cop_is_off_its_sole(icub):
    found = copsense.cop_sensitivity(
        with_soles(icub, copsense.rectangle((-0.05, 0.1), (-0.05, -0.03))), WRENCH
    )
    assert np.all(found.cop[:, 1] > -0.03)
    assert np.all(found.com_travel < 0)


def test_it_is_negative_where_the_contact_pulls(icub):
    # With the CoM far beyond the left foot the right one pulls, and its CoP is in the middle of a
    # wide sole: the distance to the edges is positive, the slack is not.
    far = copsense.lateral_sweep(icub, 0.0, 0.12, 5).stances[-1]
    wide = with_soles(far, copsense.rectangle((-2.0, 2.0), (-2.0, 2.0)))
    found = copsense.cop_sensitivity(wide, copsense.minimum_wrench(0.02))
    assert found.equilibrium.pulling == ("r_sole",)
    margin = wide.contacts[1].sole.margin(found.cop[1])
    assert margin.distance > 0
    assert found.com_travel[1] < 0 < found.com_travel[0]


def test_a_point_or_a_contact_without_a_sole_never_tips(icub, stance_of):
    bare = icub.with_contacts([replace(c, polygon=None) for c in icub.contacts])
    for stance in (bare, stance_of("solo12")):
        found = copsense.cop_sensitivity(stance, WRENCH)
        assert np.all(np.isposinf(found.com_travel))
        assert np.all(found.tipping_edge == -1)


def test_a_sole_that_is_a_line_tips_over_its_ends(stance_of):
    half = 0.03
    ends = np.array([[0.0, -half], [0.0, half]])
    stance = stance_of("four_bar")
    stance = stance.with_contacts([replace(c, polygon=ends) for c in stance.contacts])
    found = copsense.cop_sensitivity(stance, TORQUE)
    # Both weights alike: alpha = 1/2, and the closed form of the four-bar, affine in the CoM.
    first = [copsense.scan.limit_travel(stance, TORQUE, COP_ONLY, s).first.exact for s in (1, -1)]
    assert min(found.com_travel) == pytest.approx(min(first), abs=1e-9)
    assert sorted(found.tipping_edge) == [0, 1]


@pytest.mark.parametrize("name", ["icub", "solo12", "four_bar", "talos"])
def test_the_com_goes_no_farther_than_its_span_with_the_contacts_in_place(stance_of, name):
    stance = stance_of(name)
    span = com_span(stance)
    rng = np.random.default_rng(2)
    robot, feet = stance.robot, [place.translation for place in stance.placements]
    model = robot.model
    lower, upper = robot.position_limits
    lower, upper = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    coms = []
    for _ in range(60):  # joints anywhere, one contact in place: more than the robot can do
        q = pin.integrate(
            model,
            np.array(stance.q),
            np.concatenate(
                [np.zeros(robot.base_nv), rng.uniform(lower, upper) - stance.q[-len(lower) :]]
            ),
        )
        here = stance.at(q, check=False)
        coms.append(np.linalg.norm(here.com - here.placements[0].translation))
    assert 2 * max(coms) < span
    assert span < 20 * np.linalg.norm(stance.com - feet[0])  # and it is no empty bound


def test_a_travel_beyond_the_span_is_printed_as_never(icub):
    found = copsense.analyse(icub, [WRENCH])
    travel = found.sensitivities["minimum-wrench"].unloading_travel
    assert np.isfinite(travel).all()
    assert travel.min() > com_span(icub)
    rows = [line for line in str(found).splitlines() if line.strip().startswith(("l_sole", "r_"))]
    assert all(row.endswith("never") for row in rows)
    assert found.to_dict()["com_span"] == com_span(icub)
