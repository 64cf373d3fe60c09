"""``copsense map``: what it prints, writes and refuses."""

import signal
from unittest.mock import patch

import numpy as np
import pytest
from commands import copsense as run

import copsense
from copsense.maps import load_map, mapping

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
