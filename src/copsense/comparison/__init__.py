"""Comparison of balancing controllers: how far a robot leans, or is pushed, before a foot tips.

A plan is a set of cases: robot, posture, controller, conditions and trial, each a value. A case
gives scores, a score is a row of one table, and a run that fails is a row with its reason. The
static prediction stands beside each score; it assumes the criterion that the controller applies, so
it compares theory with physics. Falls are scored only within limits, as a rate over perturbed
repeats: without limits they depend on chance more than on the criterion.
"""

from copsense.extras import require

require("pandas", "a benchmark")  # before the modules that import it

from copsense.comparison.benchmark_run import run_benchmark, run_case
from copsense.comparison.case import Case, make_plan
from copsense.comparison.choices import Conditions, ControllerChoice, PostureChoice, RobotChoice
from copsense.comparison.plan_file import read_plan
from copsense.comparison.ranking import (
    CAVEAT,
    agreement,
    benchmark_summary,
    rank_controllers,
    rank_scores,
)
from copsense.comparison.score import Score
from copsense.comparison.score_kinds import SCORES, ScoreKind, shown_unit
from copsense.comparison.table import load_benchmark
from copsense.comparison.trials import Breaking, Falls, Lean, PushToTip, Rest, Sway, Trial
from copsense.simulation.prediction import predict_impulse

__all__ = [
    "CAVEAT",
    "SCORES",
    "Breaking",
    "Case",
    "Conditions",
    "ControllerChoice",
    "Falls",
    "Lean",
    "PostureChoice",
    "PushToTip",
    "Rest",
    "RobotChoice",
    "Score",
    "ScoreKind",
    "Sway",
    "Trial",
    "agreement",
    "benchmark_summary",
    "load_benchmark",
    "make_plan",
    "predict_impulse",
    "rank_controllers",
    "rank_scores",
    "read_plan",
    "run_benchmark",
    "run_case",
    "shown_unit",
]
