"""Limits on the command line: where they bind, what is refused, and what a design answers."""

import pytest
import xarray as xr
from commands import copsense

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


def test_analyse_says_which_limit_is_met_first_and_how_good_the_prediction_is():
    answer = copsense("analyse", "icub", "--limits", LIMITS, "--json").json
    first = {name: row["limit_travel"]["+y"][0] for name, row in answer["criteria"].items()}
    assert first["minimum-wrench"]["exact"] == pytest.approx(0.03838, abs=1e-5)
    assert first["minimum-torque"]["exact"] == pytest.approx(0.04585, abs=1e-5)
    assert first["minimum-torque"]["first_order"] > 1.5 * first["minimum-torque"]["exact"]
    assert "r_sole: CoP at the +y" in first["minimum-torque"]["name"]
    assert any("placeholder" in note and "torso_pitch" in note for note in answer["notes"])


def test_analyse_names_the_active_limits_where_they_press():
    answer = copsense(
        "analyse", "icub", "--com-y", "0.06", "--limits", LIMITS, "--check", "--json"
    ).json
    row = answer["criteria"]["minimum-torque"]
    assert [limit["kind"] for limit in row["active_limits"]] == ["cop"]
    assert row["optimality"] < 1e-8
    assert row["contacts"]["r_sole"]["margin"] == pytest.approx(0.0, abs=1e-9)


def test_a_sweep_within_limits_keeps_every_cop_on_its_sole(tmp_path):
    file = tmp_path / "within.nc"
    answer = copsense(
        "sweep", "icub", "--com-y", "-0.07:0.07:9", "--limits", LIMITS, "--output", file, "--json"
    )
    assert answer.code == 0
    with xr.open_dataset(file) as data:
        assert float(data["margin"].min()) > -1e-9
        ends = data["active_limits"].isel(posture=[0, -1]).values
        assert all("CoP at the" in name for name in ends.ravel())
        assert data["active_limits"].isel(posture=4).values.tolist() == ["", ""]


def test_infeasible_limits_are_rows_with_the_limits_in_conflict():
    answer = copsense("sweep", "icub", "--com-y", "-0.02:0.02:3", "--limits", "normal-force=200")
    assert answer.code == 1
    assert "In conflict: l_sole: normal force" in answer.err


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("frction=1", "Did you mean friction"),
        ("friction=lots", "is no number"),
        ("cop-margin=-1", "non-negative"),
        ("cop-margin=1", "sole"),
        ("sides=2", "3 or more"),
        ("torsion=cone,friction=off", "wrench cone"),
    ],
)
def test_bad_limits_are_one_error(limits, said):
    assert said in copsense("analyse", "icub", "--limits", limits).error


def test_design_beats_the_papers_two_criteria_and_says_by_how_much():
    arguments = ("--com-y", "-0.08:0.08:17", "--grid", "4", "--limits", LIMITS)
    answer = copsense("design", "icub", "--family", "length", *arguments, "--json").json
    best, baselines = answer["best"], answer["baselines"]
    assert [row["criterion"] for row in baselines] == ["minimum-wrench", "minimum-torque"]
    assert best["travel"] > max(row["travel"] for row in baselines)
    norms = [row["torque_norm"] for row in answer["pareto"]]
    travels = [row["travel"] for row in answer["pareto"]]
    assert norms == sorted(norms)
    assert travels == sorted(travels)
    text = copsense("design", "icub", "--family", "length", *arguments).out
    assert "over the better of the paper's two" in text


def test_an_unknown_family_is_one_error():
    assert "mix" in copsense("design", "icub", "--family", "lengths").error
