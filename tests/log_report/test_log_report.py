"""The report on a log is one page that needs nothing else, with the comparison's own numbers."""

import csv
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.commands import copsense as command
from support.pages import Page
from support.results import small_log

import copsense
from copsense import log_report
from copsense.errors import OutputError
from copsense.identification import identify_log
from copsense.log_report import draw_log_figures, slope_rows, write_log_report
from copsense.logs import compare_log
from copsense.logs.sway_fit import SlopeEstimate
from copsense.paper.report.real_section import real_figures, real_rows, real_words
from copsense.paper.reproduce import RECORDED, RealRobot
from copsense.reports import report_folder


@pytest.fixture(scope="module")
def comparison(icub):
    criteria = [copsense.minimum_torque(), copsense.minimum_wrench(1.0)]
    return compare_log(small_log(icub), icub, criteria, skip=0.0)


@pytest.fixture(scope="module")
def quick():
    """Reports are written without their pictures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            log_report.log_page,
            "draw_log_figures",
            lambda c: [replace(f, draw=SimpleNamespace) for f in draw_log_figures(c)],
        )
        patch.setattr(report_folder, "lay_out", lambda figure: None)
        patch.setattr(report_folder, "render_figure", lambda figure, suffix: b"<svg/>")
        yield


@pytest.fixture(scope="module")
def folder(comparison, quick, tmp_path_factory):
    made = tmp_path_factory.mktemp("log") / "report"
    write_log_report(comparison, made, command="copsense log x.csv --robot icub --report report")
    return made


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_the_page_is_well_formed_and_needs_nothing_from_elsewhere(page, comparison):
    assert page.open == []
    assert len(page.all("h1")) == len(page.all("title")) == 1
    assert page.all("script") == []
    assert all(img["src"].startswith("data:image/svg+xml;base64,") for img in page.all("img"))
    names = {attributes.get("id") for _, attributes in page.tags}
    assert all(a["href"][1:] in names for a in page.all("a"))
    figures = [f.name for f in draw_log_figures(comparison)]
    assert [f["id"] for f in page.all("figure")] == [*figures, "log_film"]
    assert [f["sandbox"] for f in page.all("iframe")] == ["allow-scripts"]


def test_the_page_has_the_numbers_and_what_the_audit_found(page, comparison):
    text = "".join(text for texts in page.text.values() for text in texts)
    for slope in comparison.slopes["load"].values():
        assert f"[{slope.low:.3f}, {slope.high:.3f}]" in text
    assert comparison.findings
    for finding in comparison.findings:
        assert finding.message in text
    for note in comparison.notes:
        assert note in text
    assert "Normal forces alone" not in text  # zero moments were measured


def test_the_data_beside_the_page_are_the_comparison(folder, comparison):
    assert json.loads((folder / "data" / "comparison.json").read_text()) == comparison.to_dict()
    with (folder / "data" / "rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(comparison.times)
    shares = [float(row["minimum-torque, at rest: share of r_sole"]) for row in rows]
    found = comparison.of("minimum-torque", inertia=False).shares[:, 1]
    np.testing.assert_allclose(shares, found)


def test_each_figure_draws_with_its_axes_named(comparison):
    for figure in draw_log_figures(comparison):
        (ax,) = figure.draw().axes
        assert ax.get_xlabel(), figure.name
        assert ax.get_ylabel() or figure.name == "log_intervals"
        assert ax.lines, figure.name


@pytest.mark.parametrize(
    ("value", "half", "place"),
    [(0.5, 0.01, "inside"), (0.65, 0.1, "on the edge"), (0.65, 0.01, "outside")],
)
def test_where_a_slope_lies_against_an_interval(value, half, place):
    measured = SlopeEstimate(0.5, 0.4, 0.6, 0.0, 0.0, 100, 10.0)
    other = SlopeEstimate(value, value - half, value + half, 0.0, 0.0, 100, 10.0)
    assert measured.place_of(other) == place


def test_every_criterion_is_held_against_the_measured_interval(comparison):
    rows = {row["source"]: row for row in slope_rows(comparison, "load")}
    measured = comparison.slopes["load"]["measured"]
    assert rows.pop("measured")["verdict"] == ""
    for source, row in rows.items():
        assert row["verdict"] == measured.place_of(comparison.slopes["load"][source])


def test_a_report_is_not_overwritten_and_rejected_before_the_work(folder, comparison, tmp_path):
    with pytest.raises(OutputError, match="already"):
        write_log_report(comparison, folder)
    options = ("--robot", "icub", "--report", folder)
    assert "already" in command("log", tmp_path / "no.csv", *options).error
    both = command("reproduce", "--log", tmp_path / "no.csv", "--output", tmp_path / "report")
    assert "--log-robot" in both.error
    assert list(tmp_path.iterdir()) == []


def test_the_reproduction_takes_a_log_of_its_own(comparison, icub):
    found = identify_log(
        comparison.log, icub, ["joints", "length"], skip=0.0, postures=20, inertia=False
    )
    # What was found of the log, and what the intervals have in them, comes with the parameters.
    assert set(found.findings) <= set(comparison.findings)
    assert found.notes[-1] == comparison.notes[-1]
    assert "not in them" in found.notes[-1]
    assert found.to_dict()["notes"] == list(found.notes)
    real = RealRobot(comparison, found, found)
    rows = real_rows(real)
    load = comparison.slopes["load"]
    assert [row["value"] for row in rows[: len(load)]] == [f"{s.value:.3f}" for s in load.values()]
    assert [row["name"] for row in rows[len(load) :]] == [f.name for f in RECORDED[-3:]]
    assert rows[-1]["value"].endswith(" mm")
    assert comparison.heading in real_words(real)[0]
    assert {f.section for f in real_figures(real)} == {"real"}
    assert real_figures(None) == ()
