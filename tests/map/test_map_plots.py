"""The picture of a map: marginals that are the worst or the middle, and what is drawn of them."""

import numpy as np
import pytest

import copsense
from copsense.maps import load_map, marginal, skeleton
from copsense.plots import plot_map


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
    assert len(here.edges[0]) == 49
    lowest = np.nanmin(here.values, axis=(1, 2))
    rows = whole[1].criteria.values()
    assert lowest == pytest.approx([row.worst_travel[0].value for row in rows])
    figure = plot_map([here], {"minimum-torque": [skeleton(icub)]})
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert "minimum-torque less minimum-wrench" in titles
    assert "minimum-torque: worst CoM travel" in titles


def test_a_skeleton_ends_on_the_contacts(icub):
    lines = skeleton(icub)
    places = [p.translation for p in icub.placements]
    assert np.allclose(lines[-2:, 1], places)
    assert len(lines) == len(icub.robot.joint_names) + 2


def test_what_cannot_be_drawn_is_refused(whole):
    dataset = load_map(whole[0])
    with pytest.raises(copsense.CopsenseError, match="Valid: com_y, com_z, roll"):
        marginal(dataset, ("com_y", "yaw"))
    with pytest.raises(copsense.CopsenseError, match="two coordinates"):
        marginal(dataset, ("com_y", "com_y"))
    with pytest.raises(copsense.CopsenseError, match="least_com_travel"):
        marginal(dataset, None, "travel")
    with pytest.raises(copsense.CopsenseError, match="needs marginals"):
        plot_map([])
