"""Workers: processes that run cases; one that dies fails its own case only."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any

from copsense.blas import one_blas_thread
from copsense.comparison.case import Case
from copsense.comparison.score import Score, failed
from copsense.robot import Robot
from copsense.robots.presets import shared_presets

# The matrices are small: more BLAS threads cost time, and change the order of sums.
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

Run = Callable[[Case, Callable[[float], object] | None], list[Score]]


def run_here(
    cases: Sequence[Case], run: Run, progress: Callable[[Case, float], object]
) -> Iterator[tuple[Case, list[Score]]]:
    """Run cases in this process, in turn."""
    robots: dict[str, Robot] = {}
    with one_blas_thread():
        for case in cases:
            with shared_presets(robots):
                scores = run(case, lambda seconds, case=case: progress(case, seconds))  # type: ignore[misc]
            yield case, scores


def run_in_processes(
    cases: Sequence[Case], run: Run, jobs: int, progress: Callable[[Case, float], object]
) -> Iterator[tuple[Case, list[Score]]]:
    """Run cases in `jobs` processes, and yield each as it is done.

    What they warn of is warned of here, once. The processes end when the iteration ends, also by an
    interrupt. A process that dies, such as in
    a crash of a library, gives its case a failed row and is replaced.
    """
    waiting = list(reversed(cases))
    workers: dict[Connection, _Worker] = {}
    warned: set[str] = set()
    try:
        while waiting or workers:
            while waiting and len(workers) < jobs:
                worker = _Worker(run)
                workers[worker.link] = worker
                worker.give(waiting.pop())
            for link in wait(list(workers)):
                worker = workers[link]  # type: ignore[index]
                try:
                    answer = worker.link.recv()
                except (EOFError, OSError):
                    del workers[worker.link]
                    yield worker.case, failed(worker.case.trial.scores, worker.cause_of_death())
                    continue
                if isinstance(answer, float):
                    progress(worker.case, answer)
                    continue
                if isinstance(answer, Warning):
                    if str(answer) not in warned:
                        warned.add(str(answer))
                        warnings.warn(answer, stacklevel=2)
                    continue
                yield worker.case, answer
                if waiting:
                    worker.give(waiting.pop())
                else:
                    del workers[worker.link]
                    worker.dismiss()
    finally:
        for worker in workers.values():
            worker.process.terminate()
            worker.process.join()


class _Worker:
    """A process, the connection to it, and the case that it runs."""

    case: Case

    def __init__(self, run: Run) -> None:
        # Spawned, not forked: a fork of a process with threads may hang.
        context = multiprocessing.get_context("spawn")
        self.link, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, run), daemon=True)
        with _one_thread():
            self.process.start()
        theirs.close()

    def give(self, case: Case) -> None:
        """Send it a case."""
        self.case = case
        try:
            self.link.send(case)
        except OSError:  # it has died, which reading from it will show
            return

    def dismiss(self) -> None:
        """End it after its last case."""
        self.link.close()
        self.process.join()

    def cause_of_death(self) -> str:
        """Why it died."""
        self.link.close()
        self.process.join()
        code = self.process.exitcode
        if code is not None and code < 0:
            return f"the process was ended by {signal.Signals(-code).name}"
        return f"the process ended with exit code {code}"


def _work(link: Any, run: Run) -> None:
    """Answer cases with their scores until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C

    def send_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        try:
            link.send(message if isinstance(message, Warning) else category(message))
        except (TypeError, AttributeError, pickle.PicklingError):
            link.send(UserWarning(str(message)))  # a category that cannot be sent

    warnings.showwarning = send_warning
    with one_blas_thread(), shared_presets():
        try:
            while True:
                link.send(run(link.recv(), link.send))
        except (EOFError, OSError):
            return


@contextmanager
def _one_thread() -> Iterator[None]:
    """Processes that are started inside use one BLAS thread."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
