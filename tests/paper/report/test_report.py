"""The report is one page that needs nothing else, whole or not there, the same for the same."""

import csv
import json
import re
import shlex

import pytest
from click.testing import CliRunner
from support.pages import Page
from support.reproductions import blank_pictures

import copsense
from copsense.cli import copsense as command_line
from copsense.errors import OutputError
from copsense.paper.claims import Verdict
from copsense.paper.report import (
    render_page,
    report_figures,
    report_files,
    write_report,
)
from copsense.paper.report.report_scenes import report_scenes
from copsense.paper.report.words import commands, summary
from copsense.paper.reproduce.real_robot import PUBLIC_PLACE, RECORDED
from copsense.plots import render_figure
from copsense.reports import check_report_folder, read_number
from copsense.reports.typesetting import typeset


@pytest.fixture(scope="module")
def text(folder):
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


@pytest.fixture
def quick(monkeypatch):
    """Reports are written without their pictures."""
    blank_pictures(monkeypatch)


def read_table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


# --- the page -----------------------------------------------------------------------------------


def test_the_page_is_well_formed_and_has_one_title(page):
    assert page.open == []
    assert len(page.all("h1")) == 1
    assert len(page.all("title")) == 1
    assert page.all("html") == [{"lang": "en"}]


def test_the_page_needs_nothing_from_elsewhere(page, text):
    assert page.all("script") == []
    assert all(link["href"].startswith("data:") for link in page.all("link"))
    assert all(img["src"].startswith("data:image/svg+xml;base64,") for img in page.all("img"))
    assert "@import" not in text
    assert "url(" not in re.sub(r"data:[^\"]*", "", text)
    outside = [a["href"] for a in page.all("a") if not a["href"].startswith("#")]
    assert outside == ["https://arxiv.org/abs/1610.01495", PUBLIC_PLACE]


def test_the_robot_stands_in_the_page_in_3_d_or_how_to_have_it_does(page, text, reproduction):
    (frame,) = page.all("iframe")
    assert frame["sandbox"] == "allow-scripts"  # it reaches nothing of the page
    assert "viser contributors" in "".join(page.text["pre"])  # whoever gets it reads whose it is
    assert len(text) < 3e6
    figures = report_figures(reproduction)
    without = render_page(reproduction, {f.name: b"" for f in figures}, figures, command="c")
    assert "<iframe" not in without
    assert "copsense[explore]" in without


def test_links_within_the_page_lead_somewhere(page):
    names = {attributes.get("id") for _, attributes in page.tags}
    for a in page.all("a"):
        if a["href"].startswith("#"):
            assert a["href"][1:] in names


def test_every_figure_has_a_picture_a_caption_and_words_for_it(page, reproduction):
    figures, shown = report_figures(reproduction), page.all("figure")
    drawn = [f["id"] for f in shown if "scene" not in f["class"]]
    assert drawn == [f.name for f in figures]
    assert len(page.all("img")) == len(figures)
    assert len(page.all("figcaption")) == len(shown)
    assert all(len(img["alt"]) > 30 for img in page.all("img"))
    for number_ in ("3a", "3b", "4", "5", "6a", "6b", "7a", "7b", "8", "9a", "9b"):
        assert f"figure_{number_}" in {f.name for f in figures}


def test_every_claim_is_on_the_page_with_its_verdict(text, reproduction):
    for claim in reproduction.claims:
        (row,) = re.findall(
            rf'<tr id="claim-{claim.claim.identifier}">(.*?)</tr>', text, flags=re.DOTALL
        )
        (badge,) = re.findall(r'<span class="badge [a-z]+">.*?</span> ([a-z ]+)</span>', row)
        assert badge == claim.verdict.value
        assert ("Condition:" in row) <= (claim.verdict is Verdict.HOLDS_IF)


def test_without_a_simulation_the_page_has_no_closed_loop(text, reproduction):
    assert reproduction.sway is None
    assert 'id="closed-loop"' not in text


def test_the_summary_has_the_numbers(reproduction):
    first, second, third = summary(reproduction)
    assert "0.506 against 0.995" in first
    assert "0.07 m instead of 1 m" in second
    counts = [int(n) for n in re.findall(r"\d+", third)]
    assert counts[0] == len(reproduction.claims) == sum(counts[1:4])


def test_every_erratum_reference_value_and_version_is_on_the_page(
    page, text, reproduction, command
):
    words = " ".join("".join(page.text["body"]).split())
    assert len(page.all("table")) == 6
    cells = sum(tag == "tr" for tag, _ in page.tags)
    bindings = reproduction.within_limits.bindings
    rows = (reproduction.claims, reproduction.errata, reproduction.references, bindings, RECORDED)
    assert cells == 6 + sum(len(r) for r in rows)
    for name, version in reproduction.versions.items():
        assert f"<dt>{name}</dt><dd>{version}</dd>" in text
    assert "amplitude" in words
    assert command in words


def test_the_same_reproduction_gives_the_same_page(reproduction, text, command):
    figures = report_figures(reproduction)
    pictures = {f.name: render_figure(f.draw(), ".svg") for f in figures}
    scenes = report_scenes(reproduction)
    assert render_page(reproduction, pictures, figures, scenes, command=command) == text


def test_what_the_user_typed_is_shown_and_not_interpreted(reproduction):
    figures = report_figures(reproduction)
    found = render_page(
        reproduction, {f.name: b"" for f in figures}, figures, command="copsense <img src=x> & 'a'"
    )
    assert "copsense &lt;img src=x&gt; &amp; &#39;a&#39;" in found


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.0458157, "m", "45.82 mm"),
        (1.5, "m", "1.5 m"),
        (0.5, "1", "0.5"),
        (-0.385774, "m/rad", "-0.3858 m/rad"),
        (5.5e-7, "m g", "5.5e-07 m g"),
        (9.9e-17, "1", "1e-16"),
        (0.0, "1", "0"),
    ],
)
def test_numbers_are_written_to_be_read(value, unit, shown):
    assert read_number(value, unit) == shown


@pytest.mark.parametrize(
    ("plain", "shown"),
    [
        ("Delta xi = 0", "Δξ = 0"),
        ("eta_R and f_z", "η<sub>R</sub> and f<sub>z</sub>"),
        ("l_hip_roll, l_sole", "l_hip_roll, l_sole"),
        ("M^-1 and A^+ A", "M<sup>−1</sup> and A<sup>+</sup> A"),
        ("1e-09, 2.5e+05", "10<sup>−9</sup>, 2.5·10<sup>5</sup>"),
        ("a < b & d << 2 L", "a &lt; b &amp; d ≪ 2 L"),
        ("maximum beta dxi", "maximum beta dξ"),
        ("<script>", "&lt;script&gt;"),
    ],
)
def test_plain_text_is_typeset_and_escaped(plain, shown):
    assert str(typeset(plain)) == shown


# --- what lies beside it ------------------------------------------------------------------------


def test_each_figure_lies_beside_as_png_and_svg(folder, reproduction):
    names = {f.name for f in report_figures(reproduction)}
    found = {path.name for path in (folder / "figures").iterdir()}
    assert found == {f"{name}.{kind}" for name in names for kind in ("png", "svg")}
    assert all((folder / "figures" / f"{n}.png").read_bytes()[:4] == b"\x89PNG" for n in names)


def test_the_data_lie_beside_and_read_back(folder, reproduction):
    data = folder / "data"
    assert copsense.Sweep.load(data / "icub_lateral.nc") == reproduction.lateral
    assert copsense.Sweep.load(data / "icub_lateral_at_sole.nc") == reproduction.lateral_at_sole
    claims = json.loads((data / "claims.json").read_text(encoding="utf-8"))
    assert [(c["identifier"], c["verdict"], c["number"]) for c in claims] == [
        (c.claim.identifier, c.verdict.value, c.number) for c in reproduction.claims
    ]
    assert len(json.loads((data / "errata.json").read_text())) == len(reproduction.errata)
    assert all(row["agrees"] for row in json.loads((data / "reference.json").read_text())[:16])
    assert "seconds" in json.loads((data / "setting.json").read_text())
    assert {row["figure"] for row in read_table(data / "four_bar.csv")} == {"3a", "3b", "4", "5"}
    assert len(read_table(data / "icub_lateral.csv")) == reproduction.postures * 3 * 2


def test_the_commands_shown_run(reproduction, command, tmp_path, monkeypatch):
    """Each as the page shows it, with fewer postures and a coarser search."""
    monkeypatch.chdir(tmp_path)
    shown = commands(reproduction, command)
    assert shown.pop("all") == (command,)
    for line in [line for lines in shown.values() for line in lines]:
        program, *arguments = shlex.split(line.replace(":21 ", ":5 "))
        assert program == "copsense"
        if arguments[0] == "design":
            arguments += ["--grid", "2", "--com-y", "-0.08:0.08:9"]
        result = CliRunner().invoke(command_line, arguments)
        assert result.exit_code == 0, (line, result.output)


def test_without_a_log_the_page_states_what_a_public_one_says(page):
    cells = "".join(page.text["td"])
    for found in RECORDED:
        assert any(found.name in text for text in page.text["th"])
        assert found.place in cells
    assert "No log was given to this run." in "".join(page.text["p"])
    assert "--log com-sinusoid.mat --log-robot model.urdf" in "".join(page.text["code"])


# --- writing ------------------------------------------------------------------------------------


def test_a_report_is_not_overwritten_unasked(folder, reproduction, quick):
    before = (folder / "report.html").read_bytes()
    with pytest.raises(OutputError, match=r"report\.html, figures, data already"):
        write_report(reproduction, folder)
    assert (folder / "report.html").read_bytes() == before


def test_overwriting_replaces_the_report_and_leaves_other_files(reproduction, tmp_path, quick):
    folder = tmp_path / "report"
    write_report(reproduction, folder)
    (folder / "notes.txt").write_text("mine")
    (folder / "data" / "more.csv").write_text("mine")
    (folder / "report.html").write_text("old")
    write_report(reproduction, folder, overwrite=True)
    assert (folder / "report.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    assert (
        (folder / "notes.txt").read_text() == (folder / "data" / "more.csv").read_text() == "mine"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_an_empty_folder_is_filled(reproduction, tmp_path, quick):
    (tmp_path / "report").mkdir()
    assert write_report(reproduction, tmp_path / "report").is_file()


@pytest.mark.parametrize("there", [False, True])
def test_a_report_that_fails_leaves_nothing_half_written(
    reproduction, tmp_path, monkeypatch, quick, there
):
    folder = tmp_path / "report"
    if there:
        write_report(reproduction, folder)
        (folder / "report.html").write_text("old")

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(report_files, "render_page", fail)
    with pytest.raises(OutputError, match="disk full"):
        write_report(reproduction, folder, overwrite=there)
    assert [path.name for path in tmp_path.iterdir()] == (["report"] if there else [])
    if there:
        assert (folder / "report.html").read_text() == "old"


def test_a_report_that_is_stopped_leaves_nothing(reproduction, tmp_path, monkeypatch, quick):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(report_files, "render_page", stop)
    with pytest.raises(KeyboardInterrupt):
        write_report(reproduction, tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_is_rejected_before_the_work(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(OutputError, match="is a file"):
        check_report_folder(file)
    for absent in (file / "report", tmp_path / "a" / "b"):
        with pytest.raises(OutputError, match="Create it first"):
            check_report_folder(absent)
    with pytest.raises(OutputError, match="cannot be written"):
        check_report_folder("/proc/report")
    assert check_report_folder(tmp_path / "a") == tmp_path / "a"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
