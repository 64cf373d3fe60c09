"""A result shows itself in 3-D: in a notebook, in a browser, with its own criteria and limits."""

import html
import re

import pytest
from support.browser import chromium, colour_at, offline, scene_of
from support.commands import copsense as command
from support.results import small_log

import copsense
from copsense.controllers.target import Sine
from copsense.errors import InvalidInputError, OutputError
from copsense.explore import Model, ShownPage, show
from copsense.explore.drawing import NAMED
from copsense.logs import compare_log
from copsense.optimisation import optimise
from copsense.posture_run import PostureRun
from copsense.simulation import Scenario

pytest.importorskip("viser", reason="the extra explore is not installed")

OWN = copsense.Criterion("own-torque", (copsense.TorqueTerm(1.0),))


def words(page):
    """What a page says, without its 3-D view and that one's licences."""
    shown = re.sub(r"<details>.*?</details>", "", page.html, flags=re.DOTALL)
    return html.unescape(re.sub(r'srcdoc="[^"]*"', "", shown))


def test_a_notebook_draws_a_stance_in_a_cell(icub, tmp_path):
    shown = icub.show()
    assert shown.height == 840
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><body>{shown._repr_html_()}</body>", encoding="utf-8")
    place = Model(icub).view(Model(icub).start)["minimum-wrench"].cop_world[0]
    with chromium() as browser, offline(browser, notebook, height=800) as page:
        page.wait_for_function("document.querySelector('iframe')")
        page.wait_for_timeout(300)
        scene = scene_of(page, number=2)  # a frame in the cell's frame
        seen, right = colour_at(scene, place, NAMED["minimum-wrench"])
        assert right, seen
        assert page.failed == []
        assert not [u for u in page.requested if u.startswith("http")]


def test_nothing_but_the_picture_lands_in_a_notebook(icub, monkeypatch, capsys):
    said = []
    monkeypatch.setattr("rich.print", lambda *words, **_: said.append(words))
    icub.show()
    assert said == []  # in a notebook rich displays; it writes to no standard output
    assert capsys.readouterr().out == ""


def test_an_analysis_shows_its_own_criteria_and_posture(icub):
    limits = copsense.Limits(friction=0.5)
    analysis = copsense.analyse(icub, [OWN], limits, com_y=0.02)
    said = words(analysis.show())
    assert said.count("own-torque") == 2 + len(icub.contacts)  # the verdict, the scale, the table
    margin = analysis.to_dict()["criteria"]["own-torque"]["contacts"]["r_sole"]["margin"]
    assert f"{1e3 * margin:.1f} to +y" in said
    assert "<code>" not in said  # no command makes this posture


def test_runs_show_as_films(icub):
    path = copsense.lateral_sweep(icub, -0.01, 0.01, 3)
    swept = copsense.sweep(path, [copsense.minimum_torque()])
    assert "com_y from -0.01 to 0.01 m" in words(swept.show(icub))
    assert "com_y from" in words(show(PostureRun.of_stances(path.stances, path.values, "com_y")))
    scenario = Scenario(0.1, reference=Sine(0.01, 1.0))
    recording = copsense.balance(icub, copsense.minimum_torque(), scenario)
    assert "minimum-torque, in motion" in words(recording.show(icub))
    better = optimise(icub, objective="torque", over={"com_z": 0.02}, starts=1, iterations=3)
    said = words(better.show())
    assert "2 postures, before (0), after (1)" in said
    assert "minimum-wrench" not in said  # the criterion that it was optimised under
    comparison = compare_log(small_log(icub), icub, skip=0.0)
    assert f"made up: {len(comparison.times)} postures" in words(show(comparison, rate=2.0))


def test_a_page_is_saved_whole_and_not_over_another(icub, tmp_path):
    shown = show(icub)
    path = shown.save(tmp_path / "icub.html")
    assert path.read_text(encoding="utf-8") == shown.html
    with pytest.raises(OutputError, match="exists already"):
        shown.save(path)
    assert repr(shown).startswith("ShownPage(")
    assert len(repr(shown)) < 200


def test_the_same_result_is_the_same_page(stance_of):
    stance = stance_of("four_bar")
    assert show(stance).html == show(stance).html


def test_what_cannot_be_shown_is_said(icub):
    swept = copsense.sweep(copsense.lateral_sweep(icub, 0, 0, 1), [copsense.minimum_torque()])
    with pytest.raises(InvalidInputError, match=r"give it, show\(sweep, stance\)"):
        show(swept)
    with pytest.raises(InvalidInputError, match="holds its stance"):
        show(icub, icub)

    def policy(q):
        here = icub.at(q, check=False)
        return copsense.solve_equilibrium(here, copsense.minimum_torque()).wrenches

    with pytest.raises(InvalidInputError, match="a policy of the analysis"):
        copsense.analyse(icub, [policy]).show()


def test_a_balanced_run_is_exported_with_the_criterion_that_was_applied(tmp_path):
    path = tmp_path / "run.html"
    run = ["balance", "icub", "--duration", "0.05s", "--criterion", "weighted-torque:hip=2"]
    done = command(*run, "--export", path)
    assert done.code == 0, done.err
    assert f"written: {path}" in done.out
    said = words(ShownPage(path.read_text(encoding="utf-8"), 0))
    for name in ("weighted-torque:hip=2", "minimum-wrench", "minimum-torque"):
        assert f"{name}, at rest" in said
    assert "exists already" in command(*run, "--export", path).err
