"""The picture of a map: marginals that are the worst or the middle, and what is drawn of them."""

import numpy as np
import pytest
import zarr

import copsense
from copsense.maps import Axis, Grid, Marginal, Sample, load_map, marginal
from copsense.plots import plot_map
from copsense.skeleton import skeleton


@pytest.fixture(scope="module")
def gridded(icub, both, grid, tmp_path_factory):
    """A map over 7 x 5 x 3 postures."""
    path = tmp_path_factory.mktemp("gridded") / "m.zarr"
    copsense.map_postures(icub, grid, both, path, chunk=40)
    return load_map(path)


@pytest.mark.parametrize("how", ["worst", "median"])
def test_a_marginal_is_the_worst_or_the_middle_of_what_it_leaves_out(gridded, grid, how):
    dataset = gridded
    found = marginal(dataset, ("com_z", "com_y"), "largest_com_gain", how)
    assert found.values.shape == (2, 5, 7)
    cube = dataset["largest_com_gain"].values.reshape(*grid.shape, 2)  # com_y, com_z, roll
    fill = {"worst": -np.inf, "median": np.nan}[how]
    cube = np.where(dataset["status"].values.reshape(cube.shape) == 0, cube, fill)
    for i, j in np.ndindex(5, 7):
        column = cube[j, i]  # roll, criterion
        known = [c[np.isfinite(c)] for c in column.T]
        for k, values in enumerate(known):
            if not len(values):
                assert np.isnan(found.values[k, i, j])
            elif how == "worst":
                assert found.values[k, i, j] == values.max()
            else:  # the worse of two middles
                expected = -np.percentile(-values, 50, method="inverted_cdf")
                assert found.values[k, i, j] == pytest.approx(expected)


def test_a_sample_is_drawn_in_bins(whole, icub):
    dataset = load_map(whole[0])
    here = marginal(dataset, ("com_y", "com_z"))
    assert len(here.edges[0]) == 1 + 8  # some four postures in each of 8 x 8 cells
    assert np.isfinite(here.values).mean() > 0.7
    lowest = np.nanmin(here.values, axis=(1, 2))
    rows = whole[1].criteria.values()
    assert lowest == pytest.approx([row.worst_travel[0].value for row in rows])
    figure = plot_map([here], {"minimum-torque": [skeleton(icub)]})
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert "minimum-torque\nless minimum-wrench" in titles
    assert "minimum-torque\nworst CoM travel" in titles


def _marginal(values, quantity="least_com_travel"):
    edges = tuple(np.arange(n + 1.0) for n in values.shape)
    return Marginal(("a", "b"), ("m", "m"), quantity, "worst", edges, ("one",), values[None])


def test_a_contours_label_is_its_level():
    figure = plot_map([_marginal(np.linspace(1.0, 1.17, 60).reshape(10, 6), "largest_com_gain")])
    figure.draw_without_rendering()
    labels = [float(text.get_text()) for text in figure.axes[0].texts]
    assert len(labels) >= 5
    steps = np.diff(sorted(set(labels)))
    assert np.allclose(steps, steps[0], rtol=1e-6)  # 1.025 is not called 1.02


def test_what_nothing_can_be_drawn_of_says_why():
    texts = {}
    for value in (np.nan, np.inf):
        figure = plot_map([_marginal(np.full((3, 4), value))], {"one": []})
        texts[value] = [text.get_text() for ax in figure.axes for text in ax.texts]
        assert (figure._supxlabel is not None) == np.isnan(value)
    assert texts[np.nan] == ["no posture was evaluated", "none"]
    assert texts[np.inf] == ["without end:\nno contact tips or unloads", "none"]


def test_below_zero_there_is_no_travel_and_the_picture_says_so():
    for values, said in ((np.array([[-1e-3, 2e-3]]), True), (np.array([[1e-3, 2e-3]]), False)):
        figure = plot_map([_marginal(values)])
        below = figure._supxlabel is not None
        assert below is said
        assert not below or figure._supxlabel.get_text().startswith("Below zero a CoP is off its")
        assert figure.axes[-1].get_ylabel() == "CoM travel until a contact\ntips or unloads [mm]"


class _StopError(Exception):
    pass


@pytest.mark.parametrize("kind", ["grid", "sample"])
def test_what_is_done_of_a_map_is_drawn(kind, icub, both, box, grid, tmp_path):
    sampling = grid if kind == "grid" else Sample(box, 150)
    path = tmp_path / "m.zarr"

    def stop(_):
        raise _StopError

    with pytest.raises(_StopError):
        copsense.map_postures(icub, sampling, both, path, chunk=41, progress=stop)
    dataset = load_map(path)
    here = marginal(dataset)
    lowest = np.nanmin(dataset["least_com_travel"].values[:41], axis=0)
    assert np.nanmin(here.values, axis=(1, 2)) == pytest.approx(lowest)
    assert (
        len(here.edges[0]) == 1 + 3
    )  # 41 are of three values of com_y, or some four in each of 3 x 3 cells
    plot_map([here]).draw_without_rendering()
    group = zarr.open_group(path, mode="r+")
    group["done"][0] = 0
    with pytest.raises(copsense.CopsenseError, match="no posture of the map is evaluated yet"):
        marginal(load_map(path))


def test_a_coordinate_of_one_value_fills_the_picture(icub, both, tmp_path):
    grid = Grid((Axis("com_y", -0.02, 0.02, 3), Axis("com_z", 0.5, 0.5, 1)))
    copsense.map_postures(icub, grid, both, tmp_path / "m.zarr")
    here = marginal(load_map(tmp_path / "m.zarr"))
    assert here.values.shape == (2, 3, 1)
    assert np.isfinite(here.values).all()
    assert here.edges[1][0] < 0.5 < here.edges[1][1]


def test_a_skeleton_ends_on_the_contacts(icub):
    lines = skeleton(icub)
    places = [p.translation for p in icub.placements]
    assert np.allclose(lines[-2:, 1], places)
    assert len(lines) == len(icub.robot.joint_names) + 2


def test_what_cannot_be_drawn_is_rejected(whole):
    dataset = load_map(whole[0])
    with pytest.raises(copsense.CopsenseError, match="Valid: com_y, com_z, roll"):
        marginal(dataset, ("com_y", "yaw"))
    with pytest.raises(copsense.CopsenseError, match="two coordinates"):
        marginal(dataset, ("com_y", "com_y"))
    with pytest.raises(copsense.CopsenseError, match="least_com_travel"):
        marginal(dataset, None, "travel")
    with pytest.raises(copsense.CopsenseError, match="needs marginals"):
        plot_map([])
