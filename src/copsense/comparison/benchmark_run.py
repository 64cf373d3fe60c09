"""run_benchmark: a plan over processes into one table, which a stopped run leaves resumable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from copsense.comparison.case import Case
from copsense.comparison.case_runner import CaseRunner
from copsense.comparison.score import Score, failed
from copsense.comparison.scoring import score_trial
from copsense.comparison.table import (
    differences,
    load_benchmark,
    make_table,
    scores_of,
    write_table,
)
from copsense.comparison.workers import run_here, run_in_processes
from copsense.errors import CopsenseError, InvalidInputError, OutputError
from copsense.files import check_output


def run_case(case: Case, progress: Callable[[float], object] | None = None) -> list[Score]:
    """The scores of one case; what goes wrong is a failed score with its reason.

    Args:
        case: what to run.
        progress: called with the simulated time since the last call [s].
    """
    try:
        return score_trial(CaseRunner(case, progress))
    except CopsenseError as error:
        return failed(case.trial.scores, str(error))
    except (Exception, SystemExit) as error:  # a user's controller or a library: its row says so
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

    With an output, the table is written anew, whole, after each case. If it is there already, its
    rows are kept and only what is missing or failed is run; an interrupted run is so resumed. The
    table is the same, bit for bit, whatever the number of processes and however often it was
    interrupted.

    Args:
        plan: the cases, with distinct names.
        output: the table, ``.csv``; None keeps it in memory.
        jobs: how many processes, each with one BLAS thread; a controller or a library that
            crashes then costs its own case alone. They need a main module that can be imported,
            as `multiprocessing` has it. None runs the cases here, in turn.
        overwrite: start a table anew that is there already.
        progress: called with the share of the plan done since the last call, out of 1.

    Returns:
        The table of `copsense.comparison.load_benchmark`, in the plan's order.

    Raises:
        InvalidInputError: an empty plan, or two cases of one name.
        OutputError: the table there was made by other parameters (the message says which), or
            cannot be written.
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
        # How long a trial takes is a guess: it never gives more than its share.
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
    """Refuse a plan without cases, or whose cases cannot be told apart.

    Raises:
        InvalidInputError: the message names two that share a name.
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

    A case that failed is run again: its controller may be mended, or the memory be there now. So is
    one of which rows are missing.

    Raises:
        OutputError: it was made by other parameters; the message says what differs.
    """
    table = load_benchmark(path)
    lost = table.loc[table["status"] == "failed", "key"]
    table = table[~table["key"].isin(lost)]
    if unlike := differences(table, plan):
        shown = "; ".join(unlike[:6]) + ("; ..." if len(unlike) > 6 else "")
        raise OutputError(
            f"{path} was made by other parameters: {shown}. Give another path, or --force "
            "(overwrite=True) to start it anew."
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
