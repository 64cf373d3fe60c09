"""Laws of a polygon: its hull, margins, edges and cuts."""

import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from copsense.errors import InvalidInputError
from copsense.polygon import Polygon, padded, unpadded

# The checks of annotations sample what they check.
pytestmark = pytest.mark.filterwarnings("ignore:Do not use the .random. module")

# Millimetres, so that points are equal or clearly apart.
NUMBER = st.integers(-200, 200).map(lambda mm: mm / 1000)
POINT = st.tuples(NUMBER, NUMBER).map(np.array)
POINTS = st.lists(POINT, min_size=1, max_size=12).map(np.array)


def law(*strategies):
    return lambda test: settings(max_examples=50, deadline=None)(given(*strategies)(test))


@st.composite
def figures(draw):
    """A polygon with an inside, and the points that it is the hull of."""
    points = draw(st.lists(POINT, min_size=3, max_size=12).map(np.array))
    polygon = Polygon.hull(points)
    assume(polygon.area > 1e-5)
    return polygon, points


@law(POINTS)
def test_a_hull_goes_round_its_points_counter_clockwise_and_is_its_own_hull(points):
    polygon = Polygon.hull(points)
    known = {tuple(p) for p in points}
    assert {tuple(v) for v in polygon.vertices} <= known
    assert polygon.area >= 0
    assert Polygon.hull(polygon.vertices) == polygon
    assert Polygon.hull(points[::-1]) == polygon
    if polygon.area > 1e-5:
        assert polygon.margins(points).min() >= -1e-12
        assert polygon.area == pytest.approx(ConvexHull(points).volume)
    assert not polygon.vertices.flags.writeable


@law(figures(), POINT)
def test_a_margin_is_positive_exactly_inside(figure, point):
    polygon, _ = figure
    margin = polygon.margin(point)
    assert margin.distance == polygon.distances(point).min() == polygon.margins(point)
    assert margin.side == polygon.side(margin.edge)
    to = polygon.vertices - point
    cross = to[:, 0] * np.roll(to[:, 1], -1) - to[:, 1] * np.roll(to[:, 0], -1)
    if abs(margin.distance) > 1e-9:
        assert (margin.distance > 0) == bool(np.all(cross > 0))
    if margin.distance > 0:  # the nearest edge's line is met on the edge
        assert polygon.boundary_distance(point) == pytest.approx(margin.distance, abs=1e-12)
    else:  # outside no line is farther than the boundary
        assert polygon.boundary_distance(point) >= -margin.distance - 1e-12


@law(st.integers(3, 400), st.integers(0, 99))
def test_what_hardly_stands_out_of_a_hull_is_left_out_once_and_for_all(count, seed):
    detail, rng = 1e-6, np.random.default_rng(seed)
    angles = rng.uniform(0, 2 * np.pi, count)
    points = np.column_stack([0.1 * np.cos(angles), 0.05 * np.sin(angles)])
    polygon = Polygon.hull(points, detail=detail)
    assert Polygon.hull(polygon.vertices, detail=detail) == polygon
    assert -polygon.margins(points).min() < 2 * detail
    if len(polygon) > 2:
        for i, vertex in enumerate(polygon.vertices):
            without = Polygon(np.delete(polygon.vertices, i, axis=0))
            assert without.boundary_distance(vertex) > detail


@law(figures(), st.floats(0, 2 * np.pi), NUMBER)
def test_a_cut_divides_the_area(figure, angle, offset):
    polygon, _ = figure
    normal = np.array([np.cos(angle), np.sin(angle)])
    below, above = polygon.clip(normal, offset), polygon.clip(-normal, -offset)
    assert below.area + above.area == pytest.approx(polygon.area, abs=1e-12)
    if len(below):
        assert (below.vertices @ normal).max() <= offset + 1e-11
        assert polygon.margins(below.vertices).min() >= -1e-11
    again = below.clip(normal, offset)
    assert again.area == pytest.approx(below.area, abs=1e-14)


def test_a_cut_along_an_edge_leaves_the_edge():
    """Where 0.008 + (-0.001 - 0.008) is not -0.001: a vertex met twice, within rounding."""
    triangle = Polygon(np.array([[-0.001, 0.0], [0.008, 0.0], [-0.001, 0.003]]))
    left = triangle.clip(np.array([1.0, 0.0]), -0.001)
    np.testing.assert_allclose(np.sort(left.vertices[:, 1]), [0.0, 0.003], rtol=0, atol=1e-15)


@law(figures(), NUMBER, st.sampled_from("xy"))
def test_a_section_ends_on_the_boundary(figure, at, axis):
    polygon, _ = figure
    across = polygon.vertices[:, 1 - "xy".index(axis)]
    ends = polygon.section(axis, at)
    assert (ends is None) == (not across.min() <= at <= across.max())
    if ends:
        for end in ends:
            point = np.array([end, at] if axis == "x" else [at, end])
            assert polygon.boundary_distance(point) == pytest.approx(0.0, abs=1e-12)
        assert ends[0] <= ends[1]


@law(figures())
def test_the_room_is_the_margin_of_the_innermost_point(figure):
    polygon, _ = figure
    low, high = polygon.vertices.min(axis=0), polygon.vertices.max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 41).T), axis=-1)
    room = polygon.room()
    assert polygon.margins(grid).max() <= room + 1e-9
    assert room - polygon.margins(grid).max() <= np.linalg.norm((high - low) / 40)
    middle = float(grid[0, 20, 0])
    assert polygon.room(middle) <= room + 1e-9


@law(POINT, POINT, POINT)
def test_a_segment_has_its_two_ends_and_two_sides(a, b, point):
    assume(np.linalg.norm(b - a) > 1e-3)
    segment = Polygon.hull([a, (a + b) / 2, b])
    assert len(segment) == len(segment.normals) == 2
    assert segment.area == 0
    low, high = segment.vertices
    along = (high - low) / np.linalg.norm(high - low)
    expected = [along @ (point - low), along @ (high - point)]
    np.testing.assert_allclose(segment.distances(point), expected, atol=1e-12)
    sides, beside = segment.sides
    np.testing.assert_allclose(sides @ low, beside, atol=1e-12)
    np.testing.assert_allclose(sides @ along, 0.0, atol=1e-12)
    np.testing.assert_allclose(sides.sum(axis=0), 0.0, atol=1e-12)
    clipped = segment.clip(along, float(along @ low) - 1.0)
    assert len(clipped) == 0
    half = segment.clip(along, float(along @ (low + high) / 2))
    assert np.linalg.norm(half.vertices[-1] - half.vertices[0]) == pytest.approx(
        np.linalg.norm(high - low) / 2
    )


def test_a_point_and_nothing_have_no_edge():
    for vertices in (np.zeros((0, 2)), np.array([[0.1, 0.2]])):
        polygon = Polygon(vertices)
        assert len(polygon.normals) == len(polygon.offsets) == polygon.area == 0
        assert polygon.distances(np.zeros((3, 2))).shape == (3, 0)
        with pytest.raises(InvalidInputError, match="no edge"):
            polygon.margin((0.0, 0.0))
    assert polygon.boundary_distance(np.zeros(2)) == pytest.approx(np.hypot(0.1, 0.2))


@law(figures())
def test_polygons_are_equal_by_their_vertices(figure):
    polygon, _ = figure
    same = pickle.loads(pickle.dumps(polygon))
    assert same == polygon
    assert hash(same) == hash(polygon)
    assert polygon != Polygon(polygon.vertices + 1.0)
    assert polygon != polygon.vertices.tolist()
    assert len({polygon, same}) == 1


@law(st.lists(st.none() | figures().map(lambda f: f[0]), min_size=1, max_size=4))
def test_a_table_of_polygons_gives_them_back(polygons):
    assert [unpadded(row) for row in padded(polygons)] == polygons


@law(figures())
def test_merging_vertices_on_an_edge_gives_the_polygon_back(figure):
    polygon, _ = figure
    middles = (polygon.vertices + np.roll(polygon.vertices, -1, axis=0)) / 2
    twice = np.stack([polygon.vertices, middles], axis=1).reshape(-1, 2)
    assert Polygon.merged(twice, 1e-8) == polygon
    assert Polygon.merged(np.repeat(twice, 2, axis=0), 1e-8) == polygon


@law(figures())
def test_every_edge_has_a_name_of_its_own(figure):
    polygon, _ = figure
    names = polygon.edge_names
    assert len(set(names)) == len(names) == len(polygon)
    for i, name in enumerate(names):
        assert polygon.side(i) in name
        assert name.startswith(f"edge {i}, ") or name == f"the {polygon.side(i)} edge"
