"""Mapping: evaluate the chunks of a plan, here or on a cluster; resume what was stopped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import nullcontext
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from copsense.arrays import whole_number
from copsense.blas import one_blas_thread
from copsense.criterion import Criterion
from copsense.limits import Limits
from copsense.maps.chunks import ChunkEvaluator
from copsense.maps.cluster import connect, evaluate_on_workers
from copsense.maps.map_plan import MapPlan
from copsense.maps.map_statistics import MapSummary, summarise
from copsense.maps.sampling import Sampling
from copsense.maps.store import MapStore, check_store, create_map, open_map
from copsense.stance import Stance
from copsense.uncertainty import Uncertainty

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[int], object]


@one_blas_thread()
def map_postures(
    stance: Stance,
    sampling: Sampling,
    criteria: Sequence[Criterion],
    path: str | Path,
    limits: Limits | None = None,
    *,
    chunk: int | None = None,
    configurations: bool = False,
    threads: int = 1,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    uncertainty: Uncertainty | Literal["default"] | None = None,
) -> MapSummary:
    """Evaluate criteria over a space of postures, into a Zarr store at `path`.

    The store grows chunk by chunk, and memory does not grow with the number of postures. Called
    again with the same arguments it resumes where it was stopped; the numbers are the same bits,
    however often it was stopped and wherever the chunks were evaluated. A posture that cannot be
    reached, or whose wrenches break the limits, is a row with its status and its reason.

    Args:
        stance: robot, contacts, and what the coordinates not named keep.
        sampling: a `Grid` or a `Sample` over coordinates of `copsense.batch.PostureChart`.
        criteria: of distinct names.
        path: of the store, ending in ``.zarr``; its folder must exist.
        limits: wrenches within them are solved for at every posture, and CoPs and gains within them
            are columns of their own; the others remain those of the criterion's own wrenches.
        chunk: postures that are evaluated, written and resumed as one; default 4096, in large maps
            16384.
        configurations: store the configurations too.
        threads: chunks that are evaluated at a time.
        scheduler: address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers
            see `path`; `threads` is then theirs to choose.
        workers: start this many Dask workers on this machine instead.
        progress: called with the number of postures that each finished chunk has, and at first
            with those that were there already.
        uncertainty: how far the model may be off (`copsense.uncertainty`): the columns
            ``likely_com_travel`` and ``robust_com_travel`` then hold what that leaves of the
            first-order travel, which takes tens of milliseconds a posture.

    Returns:
        The reductions over all postures.

    Raises:
        InvalidInputError: coordinates, criteria or limits that do not fit the stance.
        UnknownNameError: a coordinate or a joint that does not exist.
        OutputError: `path` holds something else, a map of other parameters (the message says what
            differs), or cannot be written.
        SchedulerError: the scheduler or its workers cannot be reached, or failed.
        MissingExtraError: Zarr or Dask is not installed.
    """
    store = fill_map(
        MapPlan(stance, criteria, sampling, limits, chunk, configurations, uncertainty),
        path,
        threads=threads,
        scheduler=scheduler,
        workers=workers,
        progress=progress,
    )
    return summarise(store)


def fill_map(
    plan: MapPlan,
    path: str | Path,
    *,
    threads: int = 1,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> MapStore:
    """Evaluate the chunks of a plan that are missing in its store; see `map_postures`."""
    threads = whole_number(threads, "threads")
    where = check_store(path)
    evaluator = ChunkEvaluator(plan)
    report: Progress = progress or (lambda _: None)
    if scheduler is None and workers is None:
        store = create_map(where, plan)
        _evaluate_here(evaluator, store, _pending(plan, store, report), threads, report)
    else:
        with connect(scheduler, workers) as client:
            store = create_map(where, plan)
            evaluate_on_workers(client, plan, store, _pending(plan, store, report), report)
    store.remove_leftovers()
    return store


def map_summary(path: str | Path, progress: Progress | None = None) -> MapSummary:
    """Summarise the map at a path, as far as it is done.

    Args:
        path: of the store.
        progress: called with the number of postures read since; each is read twice.

    Raises:
        OutputError: nothing is at the path, or it is not a map of copsense.
    """
    return summarise(open_map(path), progress)


def load_map(path: str | Path) -> xr.Dataset:
    """Open a map as a dataset whose arrays are read when they are asked for.

    A grid's postures stand in one row, ``posture``; ``dataset.set_index(posture=[...]).unstack()``
    with the coordinates' names gives each its own dimension.

    Raises:
        OutputError: nothing is at the path, or it is not a map of copsense.
    """
    import xarray as xr

    open_map(path)  # checks what is there
    return xr.open_zarr(Path(path), chunks=None)


def _pending(plan: MapPlan, store: MapStore, report: Progress) -> list[int]:
    done = store.done()
    before = sum(_size(plan, int(i)) for i in np.flatnonzero(done))
    if before:
        report(before)
    return [int(i) for i in np.flatnonzero(~done)]


def _evaluate_here(
    evaluator: ChunkEvaluator, store: MapStore, pending: list[int], threads: int, report: Progress
) -> None:
    """Chunks side by side in threads: one computes while another writes."""
    plan, remaining = evaluator.plan, iter(pending)

    def run(index: int) -> int:
        evaluator.fill(store, index)
        return _size(plan, index)

    with ThreadPoolExecutor(threads) if threads > 1 else nullcontext() as pool:
        if pool is None:
            for index in remaining:
                report(run(index))
            return
        running = {pool.submit(run, i) for i in islice(remaining, threads)}
        try:
            while running:
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    report(future.result())
                running |= {pool.submit(run, i) for i in islice(remaining, len(finished))}
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _size(plan: MapPlan, index: int) -> int:
    start, stop = plan.bounds(index)
    return stop - start
