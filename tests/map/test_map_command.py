"""``copsense map``: what it prints, writes and refuses."""

import signal
from unittest.mock import patch

import numpy as np
import pytest
from commands import copsense as run

import copsense
from copsense.maps import load_map, marginal, skeleton
from copsense.plots import plot_map

GRID = ("map", "icub", "--over", "com_y=-0.05:0.05:9", "--over", "roll=-4:4:5", "--over")
COMMAND = (*GRID, "com_z=0.47:0.51:3", "--chunk", "40", "--threads", "2")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("command")
    answer = run(*COMMAND, "--output", folder / "m.zarr", "--plot", folder / "m.png", "--json")
    return folder, answer


def test_the_summary_is_json_and_angles_were_degrees(made):
    folder, answer = made
    assert answer.code in (0, 1), answer.err
    assert answer.json["postures"] == 9 * 5 * 3
    assert answer.json["complete"]
    assert answer.json["coordinates"] == {"com_y": "m", "roll": "rad", "com_z": "m"}
    for row in answer.json["criteria"].values():
        assert sum(row["counts"].values()) == 9 * 5 * 3
        assert row["share"]["evaluated"] == row["counts"]["evaluated"] / (9 * 5 * 3)
        values = [w["value"] for w in row["worst_travel"]]
        assert values == sorted(values)
    roll = load_map(folder / "m.zarr")["roll"].values
    assert roll.max() == pytest.approx(np.radians(4))
    assert (folder / "m.png").stat().st_size > 10_000


def test_the_same_command_again_only_tells_and_draws(made):
    folder, _ = made
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}
    answer = run(*COMMAND, "--output", folder / "m.zarr")
    assert "CoM travel: worst" in answer.out
    assert "deg" in answer.out
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()} == before


def test_other_parameters_are_one_line_with_what_differs(made):
    folder, _ = made
    answer = run(*COMMAND, "--output", folder / "m.zarr", "--seed", "1", "--width", "0.16")
    assert "of other parameters: configuration[" in answer.error


def test_stopping_says_how_to_go_on(tmp_path):
    path = tmp_path / "m.zarr"
    from copsense.maps import mapping

    plain, calls = mapping.write_chunk, []

    def write(*arguments):
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        calls.append(arguments)
        plain(*arguments)

    with patch.object(mapping, "write_chunk", write):
        answer = run(*COMMAND[:-2], "--output", path)
    assert answer.code == 130
    assert "stopped: 80 of 135 postures" in answer.err
    assert "Run the same command again" in answer.err
    assert copsense.map_summary(path).chunks_done == 2


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--over", "com_y"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1:2:3"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1:2.5"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1"), "needs a count"),
        (("--over", "com_y=0:1:3", "--samples", "5"), "takes no count"),
        (("--over", "com_y=0:1", "--samples", "0"), "from 1"),
        (("--over", "elbow=0:1:3"), "Valid: com_x"),
        (("--over", "com_y=0:1:3", "--over", "com_y=0:1:3"), "twice"),
        (("--over", "com_y=0:1:3", "--over", "base_y=0:1:3"), "the one decides the other"),
        (("--over", "com_y=0:1:3", "--plot", "m.png"), "two coordinates"),
        (("--over", "com_y=0:1:3", "--chunk", "0"), "from 1"),
        (("--over", "com_y=0:1:3", "--threads", "0"), "from 1"),
        (("--over", "com_y=0:1:3", "--local", "0"), "from 1"),
    ],
)
def test_what_is_not_understood_is_one_line(arguments, word, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = run("map", "icub", *arguments, "--output", "m.zarr")
    assert word in answer.error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("how", ["worst", "median"])
def test_a_marginal_is_the_worst_or_the_middle_of_what_it_leaves_out(made, how):
    dataset = load_map(made[0] / "m.zarr")
    found = marginal(dataset, ("com_z", "com_y"), "largest_com_gain", how)
    assert found.values.shape == (2, 3, 9)
    cube = dataset["largest_com_gain"].values.reshape(9, 5, 3, 2)  # com_y, roll, com_z
    fill = {"worst": -np.inf, "median": np.nan}[how]
    cube = np.where(dataset["status"].values.reshape(cube.shape) == 0, cube, fill)
    for i, j in np.ndindex(3, 9):
        column = cube[j, :, i]  # roll, criterion
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
