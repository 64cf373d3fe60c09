"""A plan becomes one table: the same in any number of processes, and however often stopped."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support.narrow import C1, C2, LEAN, REST, ROBOT, STRAIGHT, one, plan

import copsense
from copsense.comparison import (
    Breaking,
    Case,
    Conditions,
    ControllerChoice,
    Falls,
    Lean,
    PostureChoice,
    PushToTip,
    Rest,
    RobotChoice,
    Sway,
    load_benchmark,
    make_plan,
    run_benchmark,
    run_case,
)
from copsense.comparison.table import scores_of
from copsense.errors import InvalidInputError, OutputError
from copsense.limits import Limits
from copsense.simulation import Motors

SOURCE = Path(copsense.__file__).parents[1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The table of the plan, in one process and one go."""
    path = tmp_path_factory.mktemp("whole") / "table.csv"
    table = run_benchmark(plan(), path)
    return path, table


@pytest.fixture
def replayed(whole, monkeypatch):
    """Cases of the plan give the scores of `whole` at once: here only the table matters."""
    known = scores_of(whole[1])

    def replay(case, progress=None):
        if progress:
            progress(case.trial.seconds)
        return known[case.key]

    monkeypatch.setattr("copsense.comparison.benchmark_run.run_case", replay)


def test_a_lean_is_a_row_beside_its_prediction(whole):
    _, table = whole
    row = table[(table["controller"] == C1.name) & (table["score"] == "tip_excursion")].iloc[0]
    assert row["status"] == "measured"
    assert row["value"] == pytest.approx(row["predicted"], abs=1.5e-3)
    assert row["value"] == pytest.approx(row["first_order"], abs=1.5e-3)
    assert row["contact"] == row["predicted_contact"] == "r_sole"
    assert "tipped" in row["reason"]


def test_the_table_is_read_back_exactly(whole):
    path, table = whole
    assert load_benchmark(path).equals(table)
    assert list(table["key"].unique()) == [case.key for case in plan()]


def test_processes_change_nothing(whole, tmp_path):
    path, _ = whole
    shares = []
    run_benchmark(plan(), tmp_path / "two.csv", jobs=2, progress=shares.append)
    assert (tmp_path / "two.csv").read_bytes() == path.read_bytes()
    assert sum(shares) == pytest.approx(1.0)


def test_a_run_that_was_stopped_is_resumed(whole, replayed, tmp_path):
    path, other = whole[0], tmp_path / "stopped.csv"

    def stop(share, seen=[0.0]):  # noqa: B006  it is to remember
        seen[0] += share
        if seen[0] > 0.6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_benchmark(plan(), other, progress=stop)
    kept = set(load_benchmark(other)["key"])
    assert 0 < len(kept) < len(plan())
    before = other.read_text().splitlines()
    run_benchmark(plan(), other)
    assert other.read_bytes() == path.read_bytes()
    assert set(before) <= set(other.read_text().splitlines())


def test_a_finished_table_is_not_run_again(whole, monkeypatch):
    path, table = whole
    monkeypatch.setattr(
        "copsense.comparison.benchmark_run.run_case", lambda *_: pytest.fail("it ran")
    )
    assert run_benchmark(plan(), path).equals(table)


def test_a_killed_command_is_resumed(whole, replayed, tmp_path):
    file, table = tmp_path / "plan.toml", tmp_path / "table.csv"
    file.write_text(
        '[robots.narrow]\nsource = "icub"\n'
        "soles = { l_sole = [-0.05, 0.1, -0.01, 0.03], r_sole = [-0.05, 0.1, -0.03, 0.01] }\n"
        "[postures.straight]\nknees_deg = 0\n"
        '[controllers.minimum-wrench]\ncriterion = "minimum-wrench"\n'
        '[controllers.minimum-torque]\ncriterion = "minimum-torque"\n'
        "[trials.lean]\nreach = 0.015\nspeed = 0.02\n[trials.rest]\nduration = 0.1\n"
    )
    command = [
        sys.executable, "-c", "from copsense.cli import main\nif __name__ == '__main__': main()",
        "benchmark", "--plan", str(file), "--output", str(table), "--jobs", "2",
    ]  # fmt: skip
    environment = os.environ | {"PYTHONPATH": str(SOURCE)}
    for how, code in ((signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)):
        at_first = table.read_text().count("\n") if table.exists() else 0
        process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        while process.poll() is None:
            if table.exists() and table.read_text().count("\n") > at_first:
                break
            time.sleep(0.01)
        process.send_signal(how)
        _, said = process.communicate(timeout=60)
        assert process.returncode == code, said
        assert 0 < load_benchmark(table)["key"].nunique() < len(plan())
        if how == signal.SIGINT:
            assert "the same command runs the others" in said
            assert "Traceback" not in said
    run_benchmark(plan(), table)
    assert table.read_bytes() == whole[0].read_bytes()


def test_a_table_of_other_parameters_is_rejected(whole, tmp_path):
    path, _ = whole
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"trial\.speed was 0\.02, is now 0\.03"):
        run_benchmark(plan([Lean(0.015, 0.03), Rest(0.1)]), path)
    with pytest.raises(OutputError, match="minimum-torque / ideal / lean, which is not asked for"):
        run_benchmark(plan(controllers=[C1]), path)
    assert path.read_bytes() == before


def test_a_table_may_be_added_to(whole, replayed, tmp_path):
    path, table = whole
    other = tmp_path / "table.csv"
    run_benchmark(plan(controllers=[C1]), other)
    assert run_benchmark(plan(), other).equals(table)
    assert other.read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("case", "says"),
    [
        (Case(RobotChoice("icub", soles={"wing": (0, 1, 0, 1)}), STRAIGHT, C1, LEAN), "wing"),
        (Case(ROBOT, PostureChoice("wide", width=9.0), C1, LEAN), ""),
        (one(Lean(3.0)), "farther than the CoM"),
        (one(LEAN, ControllerChoice(source="not_there:make")), "not_there"),
    ],
)
def test_a_run_that_fails_is_a_row_with_its_reason(case, says):
    (score,) = run_case(case)
    assert score.status == "failed"
    assert np.isnan(score.value)
    assert score.reason
    assert says in score.reason


TRIALS = (
    LEAN,
    PushToTip(largest=1.0, resolution=0.5),
    Breaking("delay", mild=0.0, severe=0.02, step=0.01, amplitude=2e-3),
    Falls(repeats=1),
    Rest(0.1),
    Sway(2e-3, 1.0),
)


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: type(trial).__name__)
def test_a_controller_that_fails_on_the_way_has_measured_nothing(trial, tmp_path, monkeypatch):
    (tmp_path / "late_controllers.py").write_text(LATE)
    monkeypatch.chdir(tmp_path)
    limits = Limits(friction=0.5) if isinstance(trial, Falls) else None
    late = ControllerChoice("minimum-wrench", source="late_controllers:Late", limits=limits)
    scores = run_case(one(trial, late))
    assert [s.status for s in scores] == ["failed"] * len(trial.scores)
    assert all("no idea at 0.05" in s.reason for s in scores)


LATE = """
from copsense.controllers import BalancingController
from copsense.criterion import minimum_wrench

class Late(BalancingController):
    def __init__(self, stance):
        super().__init__(stance, minimum_wrench(1.0))

    def __call__(self, observation):
        if observation.time > 0.0495:
            raise RuntimeError(f"no idea at {observation.time:.2f}")
        return super().__call__(observation)
"""

OWN = """
import os
from copsense.controllers import BalancingController
from copsense.criterion import minimum_wrench

def good(stance):
    return BalancingController(stance, minimum_wrench(1.0))

def bad(stance):
    def torques(observation):
        raise RuntimeError("no idea")
    return torques

def deadly(stance):
    os._exit(3)
"""


def test_own_controllers_run_and_one_that_dies_takes_only_its_case(tmp_path, monkeypatch, capfd):
    said = "import warnings\n\nwarnings.warn('mind the gap', FutureWarning)\n"
    (tmp_path / "own_controllers.py").write_text(said + OWN)
    monkeypatch.chdir(tmp_path)
    controllers = [
        ControllerChoice("minimum-wrench", source=f"own_controllers:{name}", name=name)
        for name in ("deadly", "good", "bad")
    ]
    with pytest.warns(FutureWarning, match="mind the gap") as warned:
        table = run_benchmark(plan([REST], controllers), jobs=2)
    assert len(warned) == 1  # of two processes and more
    assert "mind the gap" not in capfd.readouterr().err  # not raw from a process
    table = table[table["score"] == "wrench_error"].set_index("controller")
    assert table.loc["deadly", "reason"] == "the process ended with exit code 3"
    assert "no idea" in table.loc["bad", "reason"]
    assert list(table["status"]) == ["failed", "measured", "failed"]
    assert table.loc["good", "value"] == run_case(one(REST))[0].value


FORGETFUL = (
    OWN
    + """
class Tired:
    \"\"\"Balances for two hundred calls, and then no more.\"\"\"

    def __init__(self, stance):
        self.inner, self.calls, self.n = good(stance), 0, len(stance.robot.torque_names)

    def __call__(self, observation):
        self.calls += 1
        return self.inner(observation) if self.calls < 210 else [0.0] * self.n
"""
)


def test_a_controller_that_has_memory_is_made_for_each_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tired_controllers.py").write_text(FORGETFUL)
    # Runs of 200 calls each: a controller of all of them would be tired in the second.
    sway = Breaking("delay", 0.0, 0.03, 0.01, amplitude=2e-3, frequency=5.0)
    tired = ControllerChoice("minimum-wrench", source="tired_controllers:Tired")
    (found,), (usual,) = (run_case(one(sway, choice)) for choice in (tired, C1))
    assert (found.low, found.high) == (usual.low, usual.high)
    assert found.runs > 2


def test_new_code_of_a_controller_is_another_parameter(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module, table = tmp_path / "changing_controllers.py", tmp_path / "table.csv"
    mine = ControllerChoice("minimum-wrench", source="changing_controllers:good", name="mine")
    module.write_text(OWN)
    with monkeypatch.context() as patched:
        patched.setattr("copsense.comparison.benchmark_run.score_trial", lambda bench: 1 / 0)
        run_benchmark(plan([REST], [mine, C2]), table)
    # What failed is run again, and its code may be another by now.
    module.write_text(OWN + "\n# fixed")
    first = run_benchmark(plan([REST], [mine, C2]), table)
    assert list(first["status"]) == ["measured"] * 4
    module.write_text(OWN + "\n# changed")
    with pytest.raises(OutputError, match=r"controller\.content was"):
        run_benchmark(plan([REST], [mine, C2]), table)


def test_a_case_of_which_rows_are_missing_is_run_again(whole, replayed, tmp_path):
    path = tmp_path / "table.csv"
    lines = whole[0].read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if ",cop_error," not in line))
    run_benchmark(plan(), path)
    assert path.read_text() == whole[0].read_text()


@pytest.mark.parametrize("jobs", [None, 1])
def test_a_controller_that_leaves_is_a_row_too(jobs, tmp_path, monkeypatch):
    (tmp_path / "leaving_controllers.py").write_text(
        "def leave(stance):\n    raise SystemExit(0)\n"
    )
    monkeypatch.chdir(tmp_path)
    leaving = ControllerChoice("minimum-wrench", source="leaving_controllers:leave", name="leave")
    table = run_benchmark(plan([REST], [leaving, C2]), jobs=jobs)
    assert list(table["status"]) == ["failed"] * 2 + ["measured"] * 2
    assert "SystemExit" in table["reason"][0]


def test_conditions_are_those_of_a_scenario():
    slow = Conditions("slow", {"motors": Motors(delay=0.004)})
    (ideal, _), (late, _) = (run_case(one(REST, conditions=[c])) for c in (Conditions(), slow))
    assert ideal.status == late.status == "measured"
    assert ideal.value != late.value
    assert one(LEAN).key != one(LEAN, conditions=[slow]).key
    with pytest.raises(copsense.CopsenseError, match="wind"):
        Conditions("stormy", {"wind": 3.0})


def test_a_key_is_that_of_the_parameters(monkeypatch):
    again = one(Lean(0.015, 0.02))
    assert again.key == one(LEAN).key
    assert one(Lean(0.015, 0.021)).key != again.key
    assert one(LEAN, C2).key != again.key
    monkeypatch.setattr("copsense.comparison.case.versions", lambda packages: {"mujoco": "9.9"})
    assert one(LEAN).key != again.key


def test_plans_that_mean_nothing_are_rejected(tmp_path):
    with pytest.raises(InvalidInputError, match="no case"):
        run_benchmark([])
    with pytest.raises(InvalidInputError, match="twice"):
        run_benchmark([one(LEAN), one(LEAN)])
    with pytest.raises(InvalidInputError, match="two meanings"):
        run_benchmark([one(LEAN), one(Lean(0.01))])
    with pytest.raises(InvalidInputError, match="processes"):
        run_benchmark(plan(), jobs=0)
    junk = tmp_path / "junk.csv"
    junk.write_text("a,b\n1,2\n")
    with pytest.raises(InvalidInputError, match="not the table of a benchmark"):
        run_benchmark(plan(), junk)
    assert len(make_plan([ROBOT], [STRAIGHT], [C1, C2], [LEAN])) == 2
