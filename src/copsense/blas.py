"""one_blas_thread: keep NumPy's linear algebra on one thread while small matrices are worked on."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

_limiting = threading.Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Around what evaluates many postures or steps, also as a decorator.

    A posture's matrices have some tens of rows: more threads only cost, many times the wall time
    where another process wants the processors too, and change the order of sums. The number is the
    whole process's: who finds it limited leaves it alone, and who limited it restores it.
    """
    if not _limiting.acquire(blocking=False):
        yield
        return
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield
    finally:
        _limiting.release()
