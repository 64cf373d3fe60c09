"""``copsense benchmark`` prints, writes, resumes and rejects."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.commands import copsense

from copsense import Limits
from copsense.comparison import (
    ControllerChoice,
    PostureChoice,
    Rest,
    RobotChoice,
    load_benchmark,
    make_plan,
    read_plan,
)
from copsense.comparison.trials import Breaking, Falls
from copsense.plots import plot_benchmark, render_figure
from copsense.stiffness import stiffness

STIFF = "stiffness:2000"

PLAN = """
[robots.narrow]
source = "icub"
soles = { l_sole = [-0.05, 0.1, -0.01, 0.03], r_sole = [-0.05, 0.1, -0.03, 0.01] }
[postures.straight]
knees_deg = 0
[controllers.one]
criterion = "minimum-wrench"
[controllers.wide]
criterion = "minimum-torque"
limits = { friction = 0.9, torsion = false }
[conditions.slow]
motors = { delay = 0.002 }
pushes = [{ force = [0.0, 0.1, 0.0], start = 0.1 }]
[trials.lean]
reach = 0.015
speed = 0.02
[trials."two falls"]
kind = "falls"
repeats = 2
[trials.delay]
severe = 0.04
[[block]]
trials = "lean"
controllers = ["one"]
[[block]]
trials = ["two falls"]
controllers = "wide"
"""


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return path


def test_a_plan_is_read(plan):
    lean, falls = read_plan(plan)
    assert lean.label == ("narrow", "straight", "one", "slow", "lean")
    assert lean.conditions.values["motors"].delay == 0.002
    assert lean.conditions.values["pushes"][0].force == (0.0, 0.1, 0.0)
    assert lean.trial.speed == 0.02
    assert falls.trial == Falls(repeats=2)
    assert falls.controller.limits.torsion is None
    assert falls.controller.limits.friction == 0.9
    plan.write_text(PLAN.partition("[[block]]")[0].replace('[trials."two falls"]', "[trials.falls]")
                    .replace('kind = "falls"\n', ""))  # fmt: skip
    with pytest.raises(Exception, match="without limits"):
        read_plan(plan)  # the product has falls of the controller without
    plan.write_text(PLAN.replace('trials = "lean"', 'trials = "delay"'))
    assert read_plan(plan)[0].trial == Breaking("delay", severe=0.04)


def test_the_plan_of_the_documentation_is_read(plan):
    page = Path(__file__).parents[2] / "docs" / "benchmark.md"
    plan.write_text(page.read_text("utf-8").partition("```toml\n")[2].partition("```")[0])
    cases = read_plan(plan)
    assert len(cases) == 2 * 3 + 2
    assert cases[0].posture.joints == {"l_knee": np.radians(40), "r_knee": np.radians(40)}
    assert cases[-1].trial == Falls(velocity=0.2, repeats=50)


def test_a_posture_has_its_units_in_its_keys(plan):
    text = PLAN.replace("knees_deg = 0", "knees_deg = 30\njoints_deg = { arm = 90 }")
    plan.write_text(text + "\n[postures.slid]\njoints_m = { slide = 0.2 }\nwidth = 0.1\n")
    found = {case.posture.name: case.posture for case in read_plan(plan)}
    assert found["straight"].knees == pytest.approx(np.pi / 6)
    assert found["straight"].joints == pytest.approx({"arm": np.pi / 2})
    assert found["slid"].joints == {"slide": 0.2}
    assert found["slid"].width == 0.1


def test_a_table_is_printed_written_drawn_and_resumed(plan, tmp_path):
    plan.write_text(PLAN.rpartition("[[block]]")[0])
    table, picture = tmp_path / "table.csv", tmp_path / "table.png"
    answer = copsense("benchmark", "--plan", plan, "--output", table, "--plot", picture)
    assert answer.code == 0, answer.err
    assert "tip excursion [mm]" in answer.out
    assert "statics" in answer.out
    assert "ranking over 1 case" in answer.out
    assert "compares theory with physics" in answer.out
    assert picture.stat().st_size > 10_000
    assert len(load_benchmark(table)) == 1
    again = copsense("benchmark", "--plan", plan, "--output", table, "--plot", picture, "--json")
    assert "1 of 1 cases are in" in again.err
    found = again.json
    assert found["cases"] == 1
    assert found["failed"] == 0
    assert found["scores"][0]["contact"] == "r_sole"
    assert found["agreement"][0]["cases"] == 1
    assert "use the same criterion" in found["caveat"]


def test_a_stance_file_is_benchmarked_with_its_limits_and_criteria(tmp_path):
    stance, table = tmp_path / "leaning.toml", tmp_path / "table.csv"
    copsense("analyse", "icub", "--com-y", "0.01", "--limits", "friction=0.5", "--criterion",
             "minimum-wrench", "--characteristic-length", "0.2",
             "--save-stance", stance)  # fmt: skip
    arguments = ("benchmark", "--stance", stance, "--disturbance", "rest", "--jobs", 1)
    answer = copsense(*arguments, "--output", table)
    assert answer.code == 0, answer.err
    found = load_benchmark(table)
    assert set(found["controller"]) == {"minimum-wrench within limits"}
    assert '"friction": 0.5' in found["parameters"][0]
    choice = RobotChoice(str(stance))
    np.testing.assert_allclose(choice.stance(PostureChoice()).com[1], 0.01, rtol=0, atol=1e-9)
    # A stance file that was changed is another case.
    before = make_plan([choice], [PostureChoice()], [ControllerChoice()], [Rest()])[0].key
    stance.write_text(stance.read_text("utf-8") + "\n# changed\n", encoding="utf-8")
    assert make_plan([choice], [PostureChoice()], [ControllerChoice()], [Rest()])[0].key != before
    for more, said in (
        (("icub",), "Give one of them"),
        (("--posture", "width=0.2"), "--posture own"),
        (("--contact", "l_sole"), "which contacts"),
        (("--plan", "plan.toml"), "leave --stance out"),
    ):
        assert said in copsense("benchmark", "--stance", stance, *more).error


TWO = {
    "careful": 'robot = "icub"\ncriteria = ["weighted-torque:hip=2"]\nlimits.friction = 0.5\n',
    "plain": 'robot = "icub"\n',
}


@pytest.fixture
def two_stances(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in TWO.items():
        Path(f"{name}.toml").write_text(text, encoding="utf-8")


def scored(case):
    """A row of a case that was not run."""
    robot, posture, controller, conditions, trial = case.label
    labels = {"robot": robot, "posture": posture, "conditions": conditions, "trial": trial}
    numbers = dict.fromkeys(("value", "low", "high", "predicted", "first_order"), 0.0)
    names = {"controller": controller, "score": "cop_error", "unit": "m", "status": "measured"}
    rest = dict.fromkeys(("contact", "how", "reason", "parameters"), "") | {"key": case.key}
    return labels | names | numbers | rest


@pytest.mark.usefixtures("two_stances")
def test_several_stance_files_are_benchmarked_each_with_its_limits_and_criteria(monkeypatch):
    plans = []

    def measured(plan, *_, **__):
        plans.append(plan)
        return pd.DataFrame([scored(case) for case in plan])

    monkeypatch.setattr("copsense.comparison.run_benchmark", measured)

    def planned(*options):
        answer = copsense("benchmark", "careful.toml", "plain.toml", "icub", *options)
        assert answer.code == 0, answer.err
        apart = ", each among the controllers of its own setting;" in answer.out
        found = {}
        for case in plans.pop():
            found.setdefault(case.robot.name, []).append(case.controller)
        return answer.err, apart, found

    short = ("--disturbance", "rest", "--posture", "own")
    said, apart, found = planned(*short)
    assert apart
    assert said.count("limits from careful.toml: friction=0.5.") == 1
    both = ["minimum-wrench", "minimum-torque"]
    assert [c.name for c in found["careful"]] == ["weighted-torque:hip=2 within limits"]
    assert [c.name for c in found["plain"]] == [c.name for c in found["icub"]] == both
    assert found["careful"][0].limits == Limits(friction=0.5)
    said, apart, found = planned(*short, "--criterion", STIFF, "--limits", "friction=0.9")
    assert not apart
    assert "limits from" not in said
    for controllers in found.values():
        assert [c.build_criterion() for c in controllers] == [stiffness({"*": 2000.0}, name=STIFF)]
        assert [c.limits for c in controllers] == [Limits(friction=0.9)]


@pytest.mark.usefixtures("two_stances")
def test_a_plan_says_that_limits_and_criteria_of_its_stance_files_are_not_used():
    names = "".join(f'[robots.{name}]\nsource = "{name}.toml"\n' for name in TWO)
    controller = '[controllers.one]\ncriterion = "weighted-torque:knee=3"\n[trials.rest]\n'
    Path("plan.toml").write_text(names + controller, encoding="utf-8")
    answer = copsense("benchmark", "--plan", "plan.toml", "--jobs", 1, "--json")
    assert answer.code == 0, answer.err
    said = [note for note in answer.json["notes"] if "not used" in note]
    assert said == [
        "the limits and criteria of careful.toml are not used: a plan says them under "
        "[controllers]."
    ]


def test_a_failed_run_makes_the_exit_code_one(tmp_path):
    answer = copsense("benchmark", "icub", "--posture", "width=3", "--disturbance", "rest",
                      "--criterion", "minimum-torque", "--jobs", 1)  # fmt: skip
    assert answer.code == 1
    assert "failed: icub / width=3 / minimum-torque / rest:" in answer.err


def test_every_case_runs_at_the_control_period_asked_for(tmp_path):
    rest = ("benchmark", "icub", "--posture", "own", "--criterion", "minimum-torque", "--jobs", 1,
            "--disturbance", "rest:duration=0.1")  # fmt: skip
    table = tmp_path / "table.csv"
    assert copsense(*rest, "--control-period", "2ms", "--output", table).code == 0
    assert '"control_period": 0.002' in load_benchmark(table)["parameters"][0]
    wrong = copsense(*rest, "--control-period", "1.5ms")
    assert wrong.code == 1
    assert "0.0015 s is not a multiple" in wrong.err


def test_a_picture_shows_bounds_failures_and_predictions():
    rows = [
        {
            "key": f"{c}{p}{s}", "robot": "r", "posture": p, "controller": c, "conditions": "ideal",
            "trial": "lean", "score": s, "unit": "m", "status": status, "value": value,
            "low": low, "high": high, "predicted": predicted, "first_order": np.nan,
            "parameters": "",
        }
        for c in ("minimum-wrench", "mine")
        for p, status, value, low, high, predicted in (
            ("a", "measured", 0.03, 0.029, 0.031, 0.03),
            ("b", "bound", np.nan, 0.07, np.inf, np.nan),
            ("c", "failed", np.nan, np.nan, np.nan, np.nan),
        )
        for s in ("tip_excursion", "smallest_margin")
    ]  # fmt: skip
    figure = plot_benchmark(pd.DataFrame(rows))
    assert len(figure.axes) == 4
    assert "use the same criterion" in figure.legends[0].get_title().get_text()
    said = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert " ≥ 70" in said
    assert " × failed" in said
    assert any("2 cases, mean error 0" in text for text in said)
    assert render_figure(figure, ".png")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["icubb"], "icub"),
        (["icub", "--criterion", "best"], "best"),
        (["icub", "--posture", "sitting"], "own, straight, knees=DEG"),
        (["icub", "--posture", "knees=a"], "an angle, such as 20 (degrees)"),
        (["solo12", "--posture", "straight"], "joints in a plan file"),
        (["icub", "--disturbance", "dance"], "dance"),
        (["icub", "--disturbance", "lean:speed"], "TRIAL[:OPTION=VALUE"),
        (["icub", "--disturbance", "lean:depth=3"], "depth"),
        (["icub", "--disturbance", "lean:side=up"], "up"),
        (["icub", "--disturbance", "lean:kind=3"], "no option of the trial 'lean' named 'kind'"),
        (["icub", "--disturbance", "lean:scores=3"], "Valid: reach, speed, side."),
        (["icub", "--disturbance", "lean:side=3"], "expected a text"),
        (["icub", "--disturbance", "delay:parameter=bandwidth"], "named 'parameter'"),
        (["icub", "--disturbance", "delay:step=1e-300"], "finer than any simulation"),
        (["icub", "--contact", "no_sole"], "no_sole"),
        (["icub", "--disturbance", "falls"], "--limits"),
        (["icub", "--limits", "wind=3"], "wind"),
        (["icub", "--repeats", "3"], "falls"),
        (["icub", "--output", "table.txt"], "suffix"),
        (["icub", "--plot", "table.txt"], "suffix"),
        (["icub", "--plan", "plan.toml"], "leave icub out"),
        (["--quick", "--plan", "plan.toml"], "leave --quick out"),
        (["--plan", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_bad_options_are_one_clear_line(options, says):
    assert says in copsense("benchmark", *options).error


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("[robots.narrow]", "[robot.narrow]"), "robots"),
        (("[robots.narrow]", "[robots.narrow"), "not valid TOML"),
        (("knees_deg = 0", 'knees_deg = "bent"'), "postures.straight"),
        (
            ("knees_deg = 0", "knees = 0"),
            "no field of PostureTable named 'knees'. Did you mean knees_deg",
        ),
        (("reach = 0.015", "reach = -1"), "reach"),
        (('kind = "falls"', 'kind = "tumbles"'), "tumbles"),
        (("motors = {", "engines = {"), "engines"),
        (("delay = 0.002", "lag = 0.002"), "lag"),
        (("friction = 0.9", "friction = -1"), "friction"),
        (("friction = 0.9", "friction = 'contct'"), "Did you mean contact? Valid: contact"),
        (("start = 0.1", "strt = 0.1"), "no field of Push named 'strt'. Did you mean start"),
        (("force = [0.0, 0.1, 0.0]", "force = [0.0, 0.1]"), "pushes[0].force is not valid"),
        (('controllers = ["one"]', 'controllers = ["two"]'), "two"),
        (('trials = "lean"', 'moves = "lean"'), "moves"),
        (("[-0.05, 0.1, -0.01, 0.03]", "[0.1, -0.05, -0.01, 0.03]"), "x0 < x1"),
        (("reach = 0.015", "scores = 3"), "named 'scores'"),
        (("reach = 0.015", 'reach = "far"'), "reach is not valid: expected a number"),
        (("knees_deg = 0", 'name = "x"'), "Leave it out"),
        (("knees_deg = 0", "joints_deg = 3"), "joints_deg is not valid: expected a table"),
        (("l_sole = [-0.05, 0.1, -0.01, 0.03]", "l_sole = 3"), "soles"),
        (("soles = {", "contacts = 'l_sole' #"), "contacts is not valid: expected a list"),
        (('source = "icub"', "source = 3"), "source is not valid: expected a text"),
        (('source = "icub"', 'source = "icup"'), "icup"),
        (('criterion = "minimum-wrench"', "source = 3"), "source is not valid: expected a text"),
        (
            ("limits = { friction = 0.9, torsion = false }", "limits = 3"),
            "limits is not valid: expected a table",
        ),
        (("motors = { delay = 0.002 }", "motors = 3"), "motors is not valid: expected a table"),
        (
            ("motors = { delay = 0.002 }", 'seed = "x"'),
            "seed is not valid: expected a whole number",
        ),
        (('[[block]]\ntrials = "lean"', "[[block]]\ntrials = []"), "has no trials"),
        (("[trials.lean]", "[trials]\nlean = 3\n[trials.lean2]"), "trials.lean"),
    ],
)
def test_bad_plans_are_one_clear_line(plan, change, says):
    text = plan.read_text()
    assert change[0] in text
    plan.write_text(text.replace(*change))
    assert says in copsense("benchmark", "--plan", plan).error
