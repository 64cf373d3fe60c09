"""Margins to a sole's edge and first-order travel to it, against brute force."""

import numpy as np
import pytest
from support.grounds import off_centre

import copsense

SOLE = copsense.rectangle((-0.07, 0.12), (-0.045, 0.05))


def random_polygon(rng):
    # The hull that a contact makes of points thrown anyhow.
    return copsense.Contact("any", polygon=rng.uniform(-0.1, 0.1, (12, 2))).polygon


def winds_around(polygon, point):
    """Whether a polygon turns once around a point: inside, by angles alone."""
    to = polygon - point
    angles = np.arctan2(to[:, 1], to[:, 0])
    steps = np.diff(np.append(angles, angles[0]))
    return abs(np.sum((steps + np.pi) % (2 * np.pi) - np.pi)) > np.pi


def nearest_line(polygon, point):
    """Least distance to an edge's line, counting outside as negative, edge by edge."""
    found = []
    for i, (x1, y1) in enumerate(polygon):
        x2, y2 = polygon[(i + 1) % len(polygon)]
        cross = (x2 - x1) * (point[1] - y1) - (y2 - y1) * (point[0] - x1)
        found.append(cross / np.hypot(x2 - x1, y2 - y1))
    return min(found), int(np.argmin(found))


def test_margin_is_the_distance_to_the_nearest_edge_and_positive_inside():
    rng = np.random.default_rng(1)
    for _ in range(30):
        polygon = random_polygon(rng)
        for point in rng.uniform(-0.15, 0.15, (40, 2)):
            margin = copsense.polygon.Polygon(polygon).margin(point)
            distance, edge = nearest_line(polygon, point)
            assert margin.distance == pytest.approx(distance, abs=1e-15)
            assert margin.edge == edge
            assert (margin.distance > 0) == winds_around(polygon, point)
            if margin.distance > 0:  # going out by the margin along the normal meets the edge
                on = copsense.polygon.Polygon(polygon).margin(
                    point + margin.distance * margin.normal
                )
                assert on.distance == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(
    ("point", "distance", "side", "normal"),
    [
        ((0.11, 0.0), 0.01, "+x (front)", (1, 0)),
        ((0.0, 0.045), 0.005, "+y (left)", (0, 1)),
        ((-0.068, 0.0), 0.002, "-x (back)", (-1, 0)),
        ((0.0, -0.044), 0.001, "-y (right)", (0, -1)),
        ((0.13, 0.0), -0.01, "+x (front)", (1, 0)),
        ((0.0, -0.065), -0.02, "-y (right)", (0, -1)),
    ],
)
def test_margin_names_the_side(point, distance, side, normal):
    margin = copsense.polygon.Polygon(SOLE).margin(point)
    assert margin.distance == pytest.approx(distance, abs=1e-15)
    assert margin.side == side
    np.testing.assert_allclose(margin.normal, normal, atol=1e-15)


def test_a_sole_of_two_points_has_its_two_ends():
    line = copsense.rectangle((0.0, 0.0), (-0.03, 0.05))
    line = copsense.Contact("any", polygon=line).polygon
    assert len(line) == 2
    near, outside = (copsense.polygon.Polygon(line).margin((0.0, y)) for y in (0.04, -0.05))
    assert near.distance == pytest.approx(0.01)
    assert near.side == "+y (left)"
    assert outside.distance == pytest.approx(-0.02)
    assert outside.side == "-y (right)"


def travel_by_search(polygon, cop, gain, share, load_gain):
    """Shortest straight CoM travel that uses up an edge's slack share (b - a cop)."""
    angles = np.linspace(0, 2 * np.pi, 20001)
    towards = np.array([np.cos(angles), np.sin(angles)])
    shortest = np.inf
    for i, a in enumerate(polygon):
        along = polygon[(i + 1) % len(polygon)] - a
        normal = np.array([along[1], -along[0]]) / np.hypot(*along)
        distance = normal @ (a - cop)
        closing = share * (normal @ gain @ towards) - distance * (load_gain @ towards)
        forwards = closing > 1e-9
        if forwards.any():
            shortest = min(shortest, np.min(share * distance / closing[forwards]))
    return shortest


@pytest.mark.parametrize("row", [3, 7, 10])
def test_com_travel_is_the_shortest_that_brings_the_cop_to_an_edge(lateral_path, row):
    stance = off_centre(lateral_path.stances[row])
    found = copsense.cop_sensitivity(stance, copsense.minimum_torque())
    for k, contact in enumerate(stance.contacts):
        share = found.equilibrium.wrenches[k, 2] / stance.robot.weight
        shortest = travel_by_search(
            contact.polygon, found.cop[k], found.com_gain[k], share, found.load_gain[k]
        )
        assert found.com_travel[k] > 0
        assert found.com_travel[k] == pytest.approx(shortest, rel=1e-6)


def test_com_travel_is_negative_where_the_cop_is_off_the_sole(lateral_path):
    found = copsense.cop_sensitivity(lateral_path.stances[0], copsense.minimum_wrench(1.0))
    for k, contact in enumerate(found.equilibrium.stance.contacts):
        assert copsense.polygon.Polygon(contact.polygon).margin(found.cop[k]).distance < 0
        assert found.com_travel[k] < 0


def test_unloading_travel_is_the_load_over_its_steepest_descent(lateral_path):
    stance = lateral_path.stances[4]
    found = copsense.cop_sensitivity(stance, copsense.minimum_torque())
    share = found.equilibrium.wrenches[:, 2] / stance.robot.weight
    for k in range(2):
        directions = np.linspace(0, 2 * np.pi, 20001)
        descent = found.load_gain[k] @ [np.cos(directions), np.sin(directions)]
        assert found.unloading_travel[k] == pytest.approx(share[k] / -descent.min(), rel=1e-6)
