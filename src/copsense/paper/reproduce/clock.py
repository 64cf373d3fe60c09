"""Clock: the stages of a long computation, how far each is and how long it took."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str, int, int], object]


class Clock:
    """Stages: how long each took, and how far it is."""

    def __init__(self, progress: Progress | None) -> None:
        """Start with no stage."""
        self.progress = progress
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str, total: int = 1) -> Iterator[Callable[[int], None]]:
        """A stage of `total` parts; what it gives is called with the parts done since."""
        started, done = time.perf_counter(), 0

        def advance(count: int) -> None:
            nonlocal done
            done += count
            if self.progress:
                self.progress(name, done, total)

        advance(0)
        yield advance
        advance(total - done)
        self.seconds[name] = time.perf_counter() - started
