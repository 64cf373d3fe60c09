"""``copsense hardware`` answers, and what it writes is what it found."""

import csv

import pytest
from support.commands import copsense


def test_the_answer_is_the_table_the_json_the_picture_and_the_file(tmp_path):
    picture, table = tmp_path / "bars.svg", tmp_path / "effects.csv"
    written = ("--plot", picture, "--output", table)
    found = copsense("hardware", "four_bar", "--json", *written).json
    (name, row), *_ = found["parameters"].items()
    assert (name, row["rank"], row["changes"]) == ("hip_width", 1, ["l_hip", "r_hip"])
    assert row["per_unit_more"]["smallest"] == pytest.approx(1.16195, abs=1e-5)
    assert row["checks"][0]["smallest"] == pytest.approx(found["smallest"] - 0.01494, abs=1e-5)
    assert row["checks"][1]["smallest"] is None  # no limit is met within reach: infinity
    assert found["idle"] == ["ankle_height", "length@hip", "mass@root_joint", "mass@hip"]
    assert picture.stat().st_size > 10_000
    with table.open() as lines:
        (line,) = csv.DictReader(lines)
    assert float(line["slope_more_smallest"]) == row["per_unit_more"]["smallest"]
    text = copsense("hardware", "four_bar", "--no-check").out
    assert "best of lengths: hip_width, +1.162 mm of travel for 1 mm more (l_hip, r_hip)" in text


def test_a_range_is_swept_and_says_where_the_robot_cannot_stand(tmp_path):
    picture = tmp_path / "sweep.svg"
    answer = copsense("hardware", "four_bar", "--change", "hip_width=0.12:1.4:2", "--plot", picture)
    assert answer.code == 0, answer.err
    assert "1400.0 mm  cannot stand: no posture of 'four_bar'" in answer.out
    assert "best of these: 120.0 mm" in answer.out
    assert picture.stat().st_size > 10_000
    asked = ("--change", "hip_width=+-20mm:3", "--json")
    (sweep,) = copsense("hardware", "four_bar", *asked).json["sweeps"]
    assert [point["value"] for point in sweep["points"]] == pytest.approx([0.12, 0.14, 0.16])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--change", "hip_widht=0.1:0.2"), "Did you mean hip_width"),
        (("--change", "hip_width=-0.1:0.2"), "Give more than 0"),
        (("--change", "hip_width=a:b"), "'a' is not understood"),
        (("--change", "hip_width=0.1:0.2:0"), "Give a count from 1"),
        (("--change", "hip_width"), "Give NAME=LOW:HIGH"),
        (("--change", "sole_width=0.1:0.2"), "has no sole_width"),
        (("--change", "mass@hip=7:9"), "mass@hip moves nothing of 'four_bar'"),
        (("--step", "much"), "Give per cent"),
        (("--step", "nan"), "Give a positive finite number"),
        (("--output", "effects.txt"), ".nc"),
        (("--change", "mass@hip=7:9", "--change", "hip_width=+-1mm", "--output", "x.nc"), "one"),
    ],
)
def test_bad_input_is_one_line(arguments, message):
    assert message in copsense("hardware", "four_bar", *arguments).error


def test_a_wrench_cone_says_that_soles_are_left_out():
    sole = ("--sole=-0.06:0.13:-0.045:0.045", "--limits", "friction=0.4,torsion=cone")
    asked = ("hardware", "icub", *sole, "--no-check", "--rows", "1")
    assert "left out under an exact wrench cone: sole_length, sole_width" in copsense(*asked).out
    found = copsense(*asked, "--json").json
    assert "sole_inner" in found["left_out"]
    assert "sole_inner" not in found["parameters"]
