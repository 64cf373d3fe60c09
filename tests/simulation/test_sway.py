"""Section V in closed loop: the claims hold on a shorter sway, and fail where they should."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from support.reproductions import blank_pictures, small_reproduction

import copsense
from copsense.paper.claims import Verdict, evaluate_sway_claims, stretch
from copsense.paper.report import report_figures, write_report
from copsense.paper.report.closed_loop_section import score_rows, sway_rates, sway_runs
from copsense.paper.reproduce import LIMITS, sway_in_simulation
from copsense.plots import render_figure

WRENCH, TORQUE = copsense.minimum_wrench(1.0), copsense.minimum_torque()


@pytest.fixture(scope="module")
def sway():
    stance = copsense.load_stance("icub")
    within = replace(LIMITS, cop_margin=3e-3)
    return sway_in_simulation(
        stance,
        WRENCH,
        TORQUE,
        within,
        amplitude=0.041,
        limited_amplitude=0.05,
        frequency=0.1,
        periods=0.5,
    )


def verdicts(sway):
    return {c.claim.identifier: c.verdict for c in evaluate_sway_claims(sway)}


def test_every_claim_of_section_v_holds_in_closed_loop(sway):
    # At twice the speed of the report's sway the CoP runs ahead of the static one.
    found = verdicts(sway)
    assert {name for name, v in found.items() if v is not Verdict.HOLDS} <= {"loop-quasi-static"}


def test_minimum_wrench_tips_on_either_side_near_the_static_prediction(sway):
    for run, side in ((sway.left, 1), (sway.right, -1)):
        predicted = float(run.attrs["static_excursion"])
        assert np.sign(predicted) == side
        assert abs(run.tip_travel - predicted) < 2.5e-3
    assert sway.left.tip_travel == pytest.approx(-sway.right.tip_travel, abs=2e-4)


def test_measured_cops_are_the_static_ones_but_for_the_acceleration(sway):
    # An accelerated CoM moves the ZMP by -h/g a, and the CoPs with it.
    found = stretch(sway.torque)
    w = 2 * np.pi * sway.frequency
    lead = 0.6 / 9.8 * w**2 * sway.amplitude
    assert np.abs(found.cop - found.static_cop).max() < 2.5 * lead


def test_the_report_says_how_often_torques_are_commanded(sway):
    assert sway_rates(sway) == {"control": "250", "physics": "1000"}


def test_claims_fail_on_other_recordings(sway):
    swapped = replace(sway, left=sway.torque, torque=sway.left)
    found = verdicts(swapped)
    assert found["loop-half-weight"] is Verdict.DOES_NOT_HOLD
    assert found["loop-full-period"] is Verdict.DOES_NOT_HOLD
    assert found["loop-parallel"] is Verdict.DOES_NOT_HOLD
    tipping = replace(sway, limited={"minimum-wrench": sway.left})
    assert verdicts(tipping)["loop-limits"] is Verdict.DOES_NOT_HOLD


def test_the_report_shows_the_closed_loop(sway, tmp_path, monkeypatch):
    claims = evaluate_sway_claims(sway)
    table = pd.DataFrame(
        [
            {"robot": "icub", "conditions": "ideal", "parameters": "", "reason": "", "key": name}
            | {"trial": "lean", "score": "tip_excursion", "unit": "m", "status": "measured"}
            | {"posture": "own", "controller": name, "contact": "r_sole", "value": value}
            | {
                "low": value - 1e-5,
                "high": value + 1e-5,
                "predicted": 0.0321,
                "first_order": 0.0322,
            }
            for name, value in (("minimum-wrench", 0.0311), ("minimum-torque", 0.0411))
        ]
    )
    reproduction = replace(small_reproduction(), sway=sway, sway_claims=claims, benchmark=table)
    figures = {f.name: f for f in report_figures(reproduction)}
    loop = {"loop_6a", "loop_6b", "loop_7a", "loop_7b", "loop_8", "loop_9b"}
    assert loop <= figures.keys()
    drawn = {name: render_figure(f.draw(), ".svg") for name, f in figures.items() if name in loop}
    assert len(set(drawn.values())) == len(loop)
    blank_pictures(monkeypatch)
    page = write_report(reproduction, tmp_path / "report").read_text(encoding="utf-8")
    assert 'id="closed-loop"' in page
    assert 'href="#closed-loop"' in page
    assert "r_sole tips at" in page
    for told in ("31.1 mm", "41.1 mm", "32.1 mm", "32.2 mm", "Slow leans", "A real iCub"):
        assert told in page, told
    assert [row["rank"] for row in score_rows(table)] == ["2", "1"]
    rows = {row["name"]: row for row in sway_runs(sway)}
    stood = stretch(sway.torque)
    assert rows["minimum torque"]["margin"] == f"{stood.margin.min() * 1e3:.2f} mm"
    error = (sway.torque["com"] - sway.torque["com_target"]).sel(com_axis="y").values
    assert rows["minimum torque"]["error"] == f"{np.sqrt(np.mean(error**2)) * 1e3:.4f} mm"
    assert "--limits" in page.partition("minimum-torque_within.nc")[0].rpartition("copsense")[2]
    assert "copsense balance icub --criterion minimum-wrench --reference sine:0.041:0.1" in page
    recorded = sorted(p.name for p in (tmp_path / "report" / "data").glob("closed_loop_*.nc"))
    assert len(recorded) == 5
