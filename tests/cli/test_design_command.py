"""``copsense design`` answers."""

import pytest
from support.commands import copsense

from copsense import Limits, load_stance
from copsense.design import design_criterion
from copsense.path import com_sweep

LIMITS = "normal-force=10,friction=0.33333,torsion=0.01333,torque=model"


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


def test_a_design_that_gains_nothing_or_meets_no_limit_says_so():
    answer = copsense("design", "icub", "--family", "length", "--grid", 2, "--com-y=-0.01:0.01:5")
    assert answer.code == 0
    assert "keep minimum-wrench" in answer.out
    assert "Sweep farther" in answer.err


def test_a_design_along_another_axis_of_the_com():
    arguments = ("--family", "length", "--grid", 3, "--com-x=-0.1:0.1:9")
    answer = copsense("design", "icub", *arguments, "--json").json
    stance = load_stance("icub")
    path = com_sweep(stance, "com_x", -0.1, 0.1, 9, held={})
    same = design_criterion(path, Limits(), "length", grid=3)
    assert answer["best"]["travel"] == pytest.approx(same.score.travel, abs=1e-9)
    assert 0.02 < same.score.travel < 0.1
    both = ("--com-x=-0.1:0.1:9", "--com-y=-0.1:0.1:9")
    assert "along one axis" in copsense("design", "icub", *both).error
