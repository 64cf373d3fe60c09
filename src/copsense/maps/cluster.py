"""Cluster: a plan's chunks on the workers of Dask Distributed.

Workers get the plan once, and after that numbers of chunks; they write into the store themselves,
and only numbers come back. A chunk that is evaluated twice, because its worker died before it could
report it, is written twice with the same bits.
"""

from __future__ import annotations

import asyncio
import logging
import pickle
import socket
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

from copsense.arrays import whole_number
from copsense.errors import CopsenseError, InvalidInputError, SchedulerError
from copsense.extras import require
from copsense.maps.chunks import ChunkEvaluator
from copsense.maps.map_plan import MapPlan
from copsense.maps.store import MapStore, open_map

_TIMEOUT = 5.0  # s for a scheduler to answer
_PATIENCE = 60.0  # s for the first worker to join
# A terminal's Ctrl-C goes to the workers too, which would print tracebacks.
_IGNORE_INTERRUPT = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
_AHEAD = 4  # chunks that are sent out for each thread of the workers


@contextmanager
def connect(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    """A Dask client of the scheduler at an address, or of workers started on this machine.

    Raises:
        InvalidInputError: both are given, or no worker.
        MissingExtraError: Dask Distributed is not installed.
        SchedulerError: nothing answers at the address, or no worker joins.
    """
    if scheduler is not None and workers is not None:
        raise InvalidInputError(
            "both a scheduler and local workers are asked for. Give one of the two."
        )
    require("distributed", "a cluster")
    import distributed

    if scheduler is not None:
        _silence()
        try:
            # A thread of its own, since the caller's may have a loop that runs, as notebooks do.
            with ThreadPoolExecutor(1) as thread:
                thread.submit(asyncio.run, _answer(scheduler)).result()
            client = distributed.Client(scheduler, timeout=_TIMEOUT)
        except Exception as error:  # Dask raises many kinds for a wrong address
            late = f"no answer within {_TIMEOUT:g} s"
            raise SchedulerError(
                f"no Dask scheduler answers at {scheduler} ({str(error) or late}). Start one "
                "with `dask scheduler`, and give the address it prints, such as "
                "tcp://127.0.0.1:8786."
            ) from None
        with client:
            _await_worker(client)
            yield client
        return
    number = whole_number(workers, "the number of local workers")
    with (
        distributed.LocalCluster(
            n_workers=number,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
            preload=_IGNORE_INTERRUPT,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def _await_worker(client: Any) -> None:
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        where = client.scheduler.address
        raise SchedulerError(
            f"no worker has joined {where} within {_PATIENCE:g} s. Start some with "
            f"`dask worker {where} --nthreads 1`, and run the same again."
        ) from None


def _silence() -> None:
    """Only the error is shown; Dask sets the levels of its inner loggers one by one."""
    for name in ["distributed", *logging.root.manager.loggerDict]:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)


async def _answer(scheduler: str) -> None:
    """Ask for the scheduler's identity: without one, a client is slow to fail and logs much."""
    import distributed

    async with distributed.rpc(scheduler) as there:
        who = await asyncio.wait_for(there.identity(), _TIMEOUT)
    if who.get("type") != "Scheduler":
        raise ValueError(f"a {who.get('type')} answered")


def evaluate_on_workers(
    client: Any,
    plan: MapPlan,
    store: MapStore,
    pending: list[int],
    report: Callable[[int], object],
) -> None:
    """Have the workers evaluate these chunks and write them into the store.

    Raises:
        SchedulerError: a worker lacks a package or does not see the store, workers died over the
            same chunk, or the scheduler is gone.
        OutputError: a worker cannot write the store.
    """
    import distributed

    run, remaining = uuid.uuid4().hex, iter(pending)
    # A task of its own: if the worker that holds it dies, another makes it again.
    package = client.submit(
        pickle.loads, pickle.dumps(pickle.dumps(plan)), key=f"copsense-plan-{run}"
    )

    def send() -> Any:
        index = next(remaining, None)
        if index is None:
            return None
        return client.submit(
            evaluate_chunk,
            package,
            str(store.path.resolve()),
            index,
            key=f"copsense-chunk-{run}-{index}",
        )

    ahead = _AHEAD * max(sum(client.nthreads().values()), 1)
    first = [future for future in (send() for _ in range(ahead)) if future is not None]
    results = distributed.as_completed(first)
    try:
        for future in results:
            report(future.result())
            following = send()
            if following is not None:
                results.add(following)
    except CopsenseError:
        raise
    except Exception as error:
        if client.status != "running":
            raise SchedulerError(
                f"the scheduler at {client.scheduler.address} is gone. The chunks that are done "
                "are kept; start it and its workers, and run the same again to resume."
            ) from None
        raise SchedulerError(
            f"the workers failed ({type(error).__name__}: {str(error)[:300]}). They need "
            f"copsense with the same version and extras as here, and the folder {store.path}. The "
            "chunks that are done are kept; run the same again to resume."
        ) from None
    finally:
        client.cancel([*first, package])


def evaluate_chunk(package: bytes, path: str, index: int) -> int:
    """Evaluate one chunk on a worker and write it.

    Returns:
        The number of its postures.
    """
    if not Path(path).exists():
        raise SchedulerError(
            f"the worker on {socket.gethostname()} does not see the store {path}, into which it "
            "writes. Give --output on a file system that all workers share, under the same path."
        )
    evaluator, store = _prepared(package, path)
    evaluator.fill(store, index)
    start, stop = evaluator.plan.bounds(index)
    return stop - start


@lru_cache(maxsize=2)
def _prepared(package: bytes, path: str) -> tuple[ChunkEvaluator, MapStore]:
    return ChunkEvaluator(pickle.loads(package)), open_map(Path(path))
