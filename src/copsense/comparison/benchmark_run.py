"""run_benchmark: run the cases of a plan into one table; a stopped run can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from copsense.comparison.case import Case
from copsense.comparison.case_runner import CaseRunner
from copsense.comparison.score import Score, failed
from copsense.comparison.scoring import score_trial
from copsense.comparison.table import (
    load_benchmark,
    make_table,
    other_parameters,
    scores_of,
    write_table,
)
from copsense.comparison.workers import run_here, run_in_processes
from copsense.errors import CopsenseError, InvalidInputError, OutputError
from copsense.files import check_output


def run_case(case: Case, progress: Callable[[float], object] | None = None) -> list[Score]:
    """The scores of one case; an error becomes failed scores with its message.

    Args:
        case: what to run.
        progress: called with the simulated time since the last call [s].
    """
    try:
        return score_trial(CaseRunner(case, progress))
    except CopsenseError as error:
        return failed(case.trial.scores, str(error))
    except (Exception, SystemExit) as error:  # of a user's controller or a library
        return failed(case.trial.scores, f"{type(error).__name__}: {error}")


def run_benchmark(
    plan: Sequence[Case],
    output: str | Path | None = None,
    *,
    jobs: int | None = None,
    overwrite: bool = False,
    progress: Callable[[float], object] | None = None,
) -> pd.DataFrame:
    """Run every case of a plan into one table.

    With an output, the whole table is written after each case. If the file exists, its rows are
    kept and only missing or failed cases are run: this resumes an interrupted run. The table is the
    same bit for bit, with any number of processes and interruptions.

    Args:
        plan: the cases, with distinct names.
        output: the table, ``.csv``; None keeps it in memory.
        jobs: number of processes, each with one BLAS thread; a controller or a library that crashes
            then fails its own case only. They need a main module that can be imported, as always
            with `multiprocessing`. None runs the cases in this process, in turn.
        overwrite: replace an existing table.
        progress: called with the share of the plan done since the last call, out of 1.

    Returns:
        The table of `copsense.comparison.load_benchmark`, in the plan's order.

    Raises:
        InvalidInputError: the plan is empty, or two cases have the same name.
        OutputError: the existing table was made with other parameters (the message says which),
            or the table cannot be written.
    """
    check_plan(plan)
    if jobs is not None and jobs < 1:
        raise InvalidInputError(f"a benchmark cannot run in {jobs} processes. Give 1 or more.")
    path = None if output is None else check_output(output, suffixes=(".csv",), overwrite=True)
    done: dict[str, list[Score]] = {}
    if path is not None and path.exists() and not overwrite:
        done = finished_scores(path, plan)
    total = sum(case.trial.seconds for case in plan)
    left = {case.key: case.trial.seconds for case in plan}

    def tick(case: Case, seconds: float) -> None:
        # How long a trial takes is an estimate: it never counts for more than its share.
        seconds = min(seconds, left[case.key])
        left[case.key] -= seconds
        if progress and seconds:
            progress(seconds / total)

    missing = []
    for case in plan:
        if case.key in done:
            tick(case, left[case.key])
        else:
            missing.append(case)
    running = (
        run_here(missing, run_case, tick)
        if jobs is None
        else run_in_processes(missing, run_case, min(jobs, len(missing)), tick)
    )
    for case, scores in running:
        done[case.key] = scores
        if path is not None:
            write_table(_finished(plan, done), path)
        tick(case, left[case.key])
    return make_table(_finished(plan, done))


def check_plan(plan: Sequence[Case]) -> None:
    """Reject a plan without cases, or with two cases of the same name.

    Raises:
        InvalidInputError: the message gives that name.
    """
    if not plan:
        raise InvalidInputError("the plan has no case. Give a robot, a controller and a trial.")
    seen: dict[tuple[str, ...], str] = {}
    for case in plan:
        if case.label in seen:
            same = "twice" if seen[case.label] == case.key else "with two meanings"
            raise InvalidInputError(
                f"the plan has {' / '.join(case.label)} {same}. Leave one out, or give each a name."
            )
        seen[case.label] = case.key


def finished_scores(path: Path, plan: Sequence[Case]) -> dict[str, list[Score]]:
    """The scores in a table that a plan need not run again, by the case's key.

    A case that failed is run again: its controller may be fixed, or memory available now. So is a
    case with missing rows.

    Raises:
        OutputError: the table was made with other parameters; the message says what differs.
    """
    table = load_benchmark(path)
    again = table.loc[table["status"] == "failed", "key"]
    table = table[~table["key"].isin(again)]
    if other := other_parameters(table, plan):
        shown = "; ".join(other[:6]) + ("; ..." if len(other) > 6 else "")
        raise OutputError(
            f"{path} was made with other parameters: {shown}. Give another path, or --force "
            "(overwrite=True) to replace it."
        )
    whole = {case.key: list(case.trial.scores) for case in plan}
    return {
        key: scores
        for key, scores in scores_of(table).items()
        if [score.score for score in scores] == whole[key]
    }


def _finished(
    plan: Sequence[Case], done: dict[str, list[Score]]
) -> list[tuple[Case, Sequence[Score]]]:
    return [(case, done[case.key]) for case in plan if case.key in done]
