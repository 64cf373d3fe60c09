"""``copsense analyse`` answers: JSON that is JSON, and where limits bind."""

import math
import re

import pytest
from support.commands import copsense

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


def numbers(value):
    if isinstance(value, dict):
        return [n for v in value.values() for n in numbers(v)]
    if isinstance(value, list):
        return [n for v in value for n in numbers(v)]
    return [value] if isinstance(value, float) else []


def test_analyse_answers_in_json():
    answer = copsense("analyse", "icub", "--along", "l_hip_roll", "--check", "--json").json
    assert list(answer["criteria"]) == ["minimum-wrench", "minimum-torque"]
    assert answer["checked"] is True
    row = answer["criteria"]["minimum-torque"]
    assert len(row["torques"]) == 23
    assert row["residual"] < 1e-9
    contact = row["contacts"]["l_sole"]
    assert len(contact["wrench"]) == 6
    assert contact["cop_slope"][1] == pytest.approx(0.506, abs=1e-3)
    assert contact["cop_per_l_hip_roll"][1] == pytest.approx(-0.196, abs=1e-3)
    assert all(map(math.isfinite, numbers(answer)))


def test_json_has_null_for_what_is_infinite():
    answer = copsense("analyse", "solo12", "--criterion", "minimum-wrench", "--json").json
    contact = answer["criteria"]["minimum-wrench"]["contacts"]["FL_FOOT"]
    assert contact["com_travel"] is None  # a point contact never tips


def test_analyse_says_which_limit_is_met_first_and_how_good_the_prediction_is():
    answer = copsense("analyse", "icub", "--limits", LIMITS, "--json").json
    first = {name: row["limit_travel"]["+y"][0] for name, row in answer["criteria"].items()}
    assert first["minimum-wrench"]["exact"] == pytest.approx(0.03838, abs=1e-5)
    assert first["minimum-torque"]["exact"] == pytest.approx(0.04585, abs=1e-5)
    # To first order of the slack, which is exact for the minimum wrench along its path.
    wrench = first["minimum-wrench"]
    assert wrench["first_order"] == pytest.approx(wrench["exact"], abs=1e-9)
    assert first["minimum-torque"]["first_order"] == pytest.approx(0.04916, abs=1e-5)
    assert re.fullmatch(r"r_sole: CoP at edge \d+, \+y \(left\)", first["minimum-torque"]["name"])
    assert any("placeholder" in note and "torso_pitch" in note for note in answer["notes"])


def test_analyse_names_the_active_limits_where_they_press():
    answer = copsense(
        "analyse", "icub", "--com-y", "0.06", "--limits", LIMITS, "--check", "--json"
    ).json
    row = answer["criteria"]["minimum-torque"]
    assert [limit["kind"] for limit in row["active_limits"]] == ["cop"]
    assert row["optimality"] < 1e-8
    assert row["contacts"]["r_sole"]["margin"] == pytest.approx(0.0, abs=1e-9)


def test_analyse_tells_the_next_change_of_the_active_limits_on_either_side():
    arguments = ("analyse", "icub", "--com-y", "0.041", "--limits", LIMITS)
    answer = copsense(*arguments, "--criterion", "minimum-wrench", "--json").json
    change = answer["criteria"]["minimum-wrench"]["next_change"]
    name = change["-y"]["exact"]["name"]
    assert re.fullmatch(r"r_sole: CoP at edge \d+, \+y \(left\)", name)
    assert not change["-y"]["exact"]["binds"]
    assert change["-y"]["exact"]["travel"] == pytest.approx(0.041 - 0.03838, abs=2e-5)
    assert change["+y"]["exact"]["binds"]
    for side in change.values():
        assert side["first_order"]["travel"] == pytest.approx(side["exact"]["travel"], rel=0.02)
    text = copsense(*arguments).out
    assert "lets go (first order:" in text


def test_analyse_draws_the_regions_that_limits_leave(tmp_path):
    picture = tmp_path / "regions.png"
    arguments = ("analyse", "icub", "--limits", LIMITS, "--regions", picture)
    answer = copsense(*arguments, "--json").json["regions"]
    areas = [row["area"] for row in answer["of"].values()]
    assert list(answer["of"])[:2] == ["friction and soles", "and torque limits"]
    assert areas == sorted(areas, reverse=True)
    assert picture.stat().st_size > 10_000
    assert "cm2, the CoM" in copsense(*arguments, "--force").out
    assert "exists already" in copsense(*arguments).error
    without = copsense("analyse", "icub", "--regions", tmp_path / "x.png")
    assert "Give --limits too" in without.error


def test_a_quadruped_whose_foot_unloads_is_analysed_all_the_same(tmp_path):
    answer = copsense("analyse", "solo12", "--limits", "friction=0.5,torque=model", "--json").json
    change = answer["criteria"]["minimum-torque"]["next_change"]["+y"]["exact"]
    assert change["binds"]


def test_two_pictures_need_two_files(tmp_path):
    same = ("--plot", tmp_path / "a.png", "--regions", tmp_path / "a.png")
    assert "Give each its own" in copsense("analyse", "icub", "--limits", LIMITS, *same).error


def test_clipped_wrenches_have_no_travel_of_their_own():
    text = copsense("analyse", "icub", "--com-y", "0.041", "--limits", "friction=0").out
    wrench, _ = text.split("minimum-torque: torque norm")
    assert len(re.findall(r"clipped +- +clipped", wrench)) == 2
    assert "as the limits clip them" in wrench
    # Without any tangential force every side of both pyramids is touched: told in two words.
    assert "l_sole: slips 8 ways (touched); r_sole: slips 8 ways (touched)" in wrench
    free = copsense("analyse", "icub", "--limits", "friction=0.33").out
    assert "clipped" not in free
    assert "to first order; along y, see below" in free


def test_regions_without_end_are_said_to_be_so(tmp_path):
    picture = tmp_path / "regions.svg"
    answer = copsense("analyse", "four_bar", "--limits", "friction=0.5", "--regions", picture)
    assert answer.code == 0
    assert "without end" in answer.out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--at", "com_y=0.01", "--com-y", "0.01"), "at alone"),
        (("--at", "com_q=0.01"), "Did you mean com_"),
        (("--at", "com_y"), "COORDINATE=VALUE"),
        (("--at", "com_y=2deg"), "Give a length"),
        (("--at", "com_y=1", "--at", "com_y=2"), "Name each of them once"),
        (("--at", "com_y=0.5"), "no posture of 'icub' at com_y = 0.5"),
        (("--criterion", "weighted-torque:hip=-1"), "not positive"),
        (("--criterion", "weighted:hip=1"), "Did you mean weighted-torque"),
    ],
)
def test_coordinates_and_weights_that_cannot_be_meant_are_rejected(
    options, words, icub, monkeypatch
):
    monkeypatch.setattr("copsense.robots.load_stance", lambda *_, **__: icub)
    assert words in copsense("analyse", "icub", *options).error


def test_coordinates_hold_the_base_where_com_y_alone_lets_it_go(icub, monkeypatch):
    monkeypatch.setattr("copsense.robots.load_stance", lambda *_, **__: icub)
    asked = ("--com-y", "10mm", "--com-z", "0.52")
    held = ("--at", "com_y=10mm", "--at", "com_z=0.52")
    one, other = (copsense("analyse", "icub", *options, "--json").json for options in (asked, held))
    for answer in (one, other):
        assert answer["com"][1:] == pytest.approx([0.01, 0.52], abs=1e-11)
    torques = [each["criteria"]["minimum-torque"]["torque_norm"] for each in (one, other)]
    assert abs(torques[0] - torques[1]) > 1e-3
