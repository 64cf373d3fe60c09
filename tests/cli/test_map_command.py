"""``copsense map``: what it prints, writes and rejects."""

import importlib.util
import re
import signal
from unittest.mock import patch

import numpy as np
import pytest
from support.commands import copsense as run

import copsense
from copsense.cli.map_command import read_axes
from copsense.errors import UnreachablePostureError
from copsense.maps import Axis, Grid, load_map, map_summary
from copsense.maps.chunks import ChunkEvaluator

GRID = ("map", "icub", "--over", "com_y=-0.05:0.05:9", "--over", "roll=-4:4:5", "--over")
TWO = ("--over", "com_y=0:1:3", "--over", "com_z=0:1:3")
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


def test_ranges_may_name_their_units(icub):
    length, angle = read_axes(icub, ("com_y=-50mm:5cm:3", "roll=-4:0.1rad"))
    assert (length.start, length.stop, length.count) == (-0.05, 0.05, 3)
    assert (angle.start, angle.stop, angle.count) == (pytest.approx(np.radians(-4)), 0.1, None)


def test_the_same_command_again_only_tells_and_draws(made):
    folder, _ = made
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}
    answer = run(*COMMAND, "--output", folder / "m.zarr")
    travel = load_map(folder / "m.zarr")["least_com_travel"].sel(criterion="minimum-wrench")
    none, known = int((travel < 0).sum()), int(travel.notnull().sum())
    assert 1 < none < known
    assert f"CoM travel: none at {none} postures ({none / known:.1%}), worst at com_y" in answer.out
    assert "_sole off its sole); median" in answer.out
    assert "deg" in answer.out
    assert "CoM gain: worst" in answer.out
    # In Python the summary prints the same, also of a map that lay there.
    assert answer.out == f"{map_summary(folder / 'm.zarr')}\nwritten: {folder / 'm.zarr'}\n"
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()} == before


def test_other_parameters_are_one_line_with_what_differs(made):
    folder, _ = made
    answer = run(*COMMAND, "--output", folder / "m.zarr", "--seed", "1", "--width", "0.16")
    assert "of other parameters: configuration[" in answer.error
    over = ("--over", "roll=-4:4", "--over", "com_y=-50mm:0.05")
    other = run("map", "icub", *over, "--samples", 7, "--output", folder / "m.zarr").error
    assert "it is over com_y=-0.05:0.05" in other
    assert (
        "asked for is roll=-0.06981317008:0.06981317008, com_y=-0.05:0.05, 7 sobol samples" in other
    )
    heavy = run(*COMMAND, "--output", folder / "m.zarr", "--load", "l_hand=0:0:-1").error
    assert "the robot's model, its drives or its loads are others. It was not touched" in heavy


def test_stopping_says_how_to_go_on(tmp_path):
    path = tmp_path / "m.zarr"
    plain, calls = ChunkEvaluator.fill, []

    def write(*arguments):
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        calls.append(arguments)
        plain(*arguments)

    with patch.object(ChunkEvaluator, "fill", write):
        answer = run(*COMMAND[:-2], "--output", path)
    assert answer.code == 130
    assert "stopped: 80 of 135 postures" in answer.err
    assert "Run the same command again" in answer.err
    assert copsense.maps.map_summary(path).chunks_done == 2


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--over", "com_y"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1:2:3"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1:2.5"), "NAME=START:STOP:COUNT"),
        (("--over", "com_y=0:1"), "needs a count"),
        (("--over", "com_y=0:1deg:3"), "'1deg' is not understood"),
        (("--over", "roll=0:1mm:3"), "'1mm' is not understood"),
        (("--over", "com_y=0:1:3", "--samples", "5"), "takes no count"),
        (("--over", "com_y=0:1", "--samples", "0"), "from 1"),
        (("--over", "elbow=0:1:3"), "Valid: com_x"),
        (("--over", "com_y=0:1:3", "--over", "com_y=0:1:3"), "twice"),
        (("--over", "com_y=0:1:3", "--over", "base_y=0:1:3"), "the one decides the other"),
        (("--over", "com_y=0:1:3", "--plot", "m.png"), "two coordinates"),
        ((*TWO, "--plot-over", "com_y,com_z"), "Give --plot FILE too"),
        ((*TWO, "--plot", "m.png", "--plot-over", "com_y,yaw"), "Valid: com_y, com_z"),
        ((*TWO, "--plot", "m.png", "--plot-over", "com_y"), "Give two coordinates"),
        (("--over", f"com_y=0:1:{10**30}"), "more than"),
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


def test_lost_postures_are_reported_with_remedy_and_reason(tmp_path):
    ranges = ("--over", "com_x=-0.06:0.06:5", "--over", "com_y=-0.06:0.06:5")
    answer = run("map", "icub", *ranges, "--output", tmp_path / "m.zarr")
    assert answer.code == 1
    assert "note: of 25 postures tried" in answer.err
    assert "--over com_z=" in answer.err
    assert "unreachable, first at com_x -0.0600 m, com_y -0.0600 m: contact" in answer.out


def test_postures_at_which_limits_leave_a_contact_without_load_are_counted(tmp_path):
    feet = ("--contact", "l_sole", "--contact", "r_sole", "--contact", "l_hand:point")
    wall = ("--plane", "l_hand=-1:0.3:0.05:0.20391059:0.15804044:0.57690426")
    ranges = ("--over", "com_y=-0.02:0.02:3", "--over", "com_z=0.536:0.536:1")
    limits = ("--limits", "friction=0.3,torque=20", "--criterion", "minimum-torque")
    answer = run("map", "icub", *feet, *wall, *limits, *ranges, "--output", tmp_path / "m.zarr")
    assert answer.code == 0, answer.err
    assert "limits: a contact is left without load at 1 posture (33.3%)" in answer.out


def test_of_points_the_travel_is_that_until_the_first_unloads(tmp_path, stance_of):
    ranges = ("--over", "com_x=-0.01:0.01:3", "--over", "com_y=-0.01:0.01:3")
    outputs = ("--output", tmp_path / "m.zarr", "--plot", tmp_path / "m.png")
    answer = run("map", "solo12", *ranges, "--criterion", "minimum-torque", *outputs)
    assert answer.code == 0, answer.err
    words = re.search(
        r"CoM travel: worst \+(.+) mm at com_x (.+) m, com_y (.+) m \((.+) unloads\); median \+.+",
        answer.out,
    )
    distance, x, y = map(float, words.groups()[:3])
    verdict = copsense.analyse(
        stance_of("solo12"), [copsense.minimum_torque()], at={"com_x": x, "com_y": y}
    ).verdict
    assert f"may move {distance:.1f} mm before {words[4]} unloads." in verdict
    assert "inf" not in answer.out
    assert "CoM gain" not in answer.out  # centres of pressure of points stand still


def test_heights_meant_from_the_stances_own_are_rejected(tmp_path, icub):
    outputs = ("--samples", 2, "--output", tmp_path / "m.zarr")
    error = run("map", "icub", "--over", "com_z=-20mm:0mm", *outputs).error
    own = round(icub.com[2] * 1e3)
    assert "com_z is the height over the world's origin, -20 to 0 mm is at the feet" in error
    assert f"the stance has {own} mm. Give heights, such as" in error
    assert f"--over com_z={own - 20}mm:{own}mm." in error
    assert not (tmp_path / "m.zarr").exists()
    down = Grid((Axis("base_z", -0.02, 0.02, 2),))
    with pytest.raises(UnreachablePostureError, match="base_z is the height"):
        copsense.map_postures(icub, down, [copsense.minimum_torque()], tmp_path / "m.zarr")


def test_a_map_of_which_nothing_was_reached_says_what_the_stance_has(tmp_path, icub):
    path = tmp_path / "m.zarr"
    answer = run("map", "icub", "--over", "l_elbow=170:171:2", "--output", path)
    assert answer.code == 1
    assert "joint l_elbow over its limit by 64 deg" in answer.out  # of 106
    assert "and the stance has l_elbow +45.00 deg. " in answer.err
    assert answer.err.endswith(f"The store holds nothing else: rm -r {path}\n")


def test_the_command_says_that_it_compiles_first(tmp_path, monkeypatch):
    monkeypatch.setattr("copsense.batch.compiler.is_compiled", lambda _: False)
    answer = run("map", "icub", "--over", "com_y=0:0.01:2", "--output", tmp_path / "m.zarr")
    assert answer.code == 0
    for what in ("the search for postures", "the statics of many postures"):
        assert f"note: compiling {what}, once on a machine" in answer.err
        assert f"note: compiled {what} in 0 s" in answer.err  # from disk


def test_without_numba_the_command_says_that_it_will_take_long(tmp_path, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "numba" else find(name, *a)
    )
    answer = run("map", "icub", "--over", "com_y=0:0.01:2", "--output", tmp_path / "m.zarr")
    assert answer.code == 0
    assert (
        'one at a time, milliseconds each: Numba is not installed (pip install "cop' in answer.err
    )
