"""Limits on the command line: where they bind, what is refused, and what a design answers."""

import re

import pytest
import xarray as xr
from support.commands import copsense

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


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


def test_a_plot_takes_limits_the_sweep_knew_nothing_of(tmp_path):
    file, picture = tmp_path / "free.nc", tmp_path / "free.png"
    sweep = ("sweep", "icub", "--com-y", "-0.07:0.07:9", "--output", file)
    assert copsense(*sweep).code == 0
    assert copsense("plot", file).code == 0
    plain = picture.read_bytes()
    answer = copsense("plot", file, "--limits", LIMITS, "--force")
    assert answer.code == 0
    assert picture.read_bytes() != plain
    assert "non-negative" in copsense("plot", file, "--limits", "friction=-1", "--force").error


def test_a_reproduction_takes_limits_and_refuses_impossible_ones_at_once(tmp_path):
    folder = tmp_path / "report"
    arguments = ("reproduce", "--static", "--postures", "21", "--output", folder, "--quiet")
    assert "In conflict" in copsense(*arguments, "--limits", "normal-force=200").error
    assert not folder.exists()
    assert copsense(*arguments, "--limits", "friction=0.2,cop-margin=0.01,torque=30").code == 0
    page = (folder / "report.html").read_text()
    assert "CoP inside the sole by 10 mm, torques of 30 N m at most" in page
    assert "--limits friction=0.2,cop-margin=0.01,torque=30" in page


def test_a_sweep_within_limits_keeps_every_cop_on_its_sole(tmp_path):
    file = tmp_path / "within.nc"
    answer = copsense(
        "sweep", "icub", "--com-y", "-0.07:0.07:9", "--limits", LIMITS, "--output", file, "--json"
    )
    assert answer.code == 0
    with xr.open_dataset(file) as data:
        assert float(data["margin"].min()) > -1e-9
        ends = data["active_limits"].isel(posture=[0, -1]).values
        assert all("CoP at edge" in name for name in ends.ravel())
        assert float(data["limit_margin"].min()) > -1e-6
        assert float(data["limit_margin"].sel(limit="r_sole: cop").isel(posture=-1).max()) < 1e-9
        assert data["active_limits"].isel(posture=4).values.tolist() == ["", ""]


def test_infeasible_limits_are_rows_with_the_limits_in_conflict():
    answer = copsense("sweep", "icub", "--com-y", "-0.02:0.02:3", "--limits", "normal-force=200")
    assert answer.code == 1
    assert "In conflict: l_sole: normal force" in answer.err


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("frction=1", "Did you mean friction"),
        ("friction=lots", "is not a number"),
        ("cop-margin=-1", "non-negative"),
        ("cop-margin=1", "sole"),
        ("sides=2", "3 or more"),
        ("off", "Leave --limits out"),
        ("sides=off", "not a number"),
        ("friction=0.3,friction=0.4", "given twice"),
        ("torsion=cone,friction=off", "wrench cone"),
    ],
)
def test_bad_limits_are_one_error(limits, said):
    assert said in copsense("analyse", "icub", "--limits", limits).error


def test_design_beats_the_papers_two_criteria_and_says_by_how_much(tmp_path):
    arguments = ("--com-y", "-0.08:0.08:17", "--grid", "4", "--limits", LIMITS)
    answer = copsense("design", "icub", "--family", "length", *arguments, "--json").json
    best, baselines = answer["best"], answer["baselines"]
    assert [row["criterion"] for row in baselines] == ["minimum-wrench", "minimum-torque"]
    assert best["travel"] > max(row["travel"] for row in baselines)
    norms = [row["torque_norm"] for row in answer["pareto"]]
    travels = [row["travel"] for row in answer["pareto"]]
    assert norms == sorted(norms)
    assert travels == sorted(travels)
    picture = tmp_path / "design.svg"
    text = copsense("design", "icub", "--family", "length", *arguments, "--plot", picture).out
    assert picture.stat().st_size > 10_000
    assert "over the better of the paper's two" in text


def test_an_unknown_family_is_one_error():
    assert "mix" in copsense("design", "icub", "--family", "lengths").error


def test_a_design_without_travel_says_so():
    answer = copsense("design", "icub", "--family", "length", "--grid", 3, "--limits", "friction=0")
    assert answer.code == 0, answer.err
    assert "beyond a limit in the middle already" in answer.out


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


def test_a_design_that_gains_nothing_or_meets_no_limit_says_so():
    answer = copsense("design", "icub", "--family", "length", "--grid", 2, "--com-y=-0.01:0.01:5")
    assert answer.code == 0
    assert "keep minimum-wrench" in answer.out
    assert "Sweep farther" in answer.err


def test_regions_without_end_are_said_to_be_so(tmp_path):
    picture = tmp_path / "regions.svg"
    answer = copsense("analyse", "four_bar", "--limits", "friction=0.5", "--regions", picture)
    assert answer.code == 0
    assert "without end" in answer.out
