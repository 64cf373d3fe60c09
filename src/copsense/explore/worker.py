"""Worker: the latest state wins; its view is published at once, what takes longer when it rests."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Sequence

from copsense.explore.model import Model, Stage
from copsense.explore.state import State
from copsense.explore.view import View

Publish = Callable[[View], object]


class Worker:
    """A thread that answers states, one at a time.

    A state that comes while another is worked on waits, and only the latest of those that wait is
    answered. The quick view of a state is published even where a newer one waits (on a slow machine
    nothing would move else); its stages are not: they are given up as soon as a newer state is
    there, and the clock of their rest begins again.

    Attributes:
        model: what answers.
        view: what was published last; None before the first.
        error: the traceback of what no state should have caused, and empty without.
    """

    model: Model
    view: View | None
    error: str

    def __init__(
        self,
        model: Model,
        publish: Publish,
        *,
        stages: Sequence[tuple[float, Stage]] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Lay it out; `start` starts the thread.

        Args:
            model: what answers.
            publish: called with every view, in the worker's thread.
            stages: seconds of rest and what is then done; default the model's.
            clock: seconds, for the rest before a stage.
        """
        self.model, self._publish, self._clock = model, publish, clock
        self.view, self.error = None, ""
        self._stages = tuple(model.stages if stages is None else stages)
        self._news = threading.Condition()
        self._latest: State | None = None
        self._asked = self._answered = 0
        self._since = 0.0  # when the latest state came
        self._done = 0  # stages of the latest state that are done
        self._stopping = False
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the thread."""
        self._thread = threading.Thread(target=self._run, name="copsense explore", daemon=True)
        self._thread.start()

    def submit(self, state: State) -> int:
        """Ask for a state; the revision that its view will have."""
        with self._news:
            self._latest, self._since = state, self._clock()
            self._asked += 1
            self._news.notify_all()
            return self._asked

    @property
    def idle(self) -> bool:
        """Whether the latest state has its view."""
        return self._asked == self._answered

    def again(self) -> None:
        """Answer the latest state once more, as when the model has changed."""
        with self._news:
            if self._latest is not None:
                self._asked += 1
                self._news.notify_all()

    def stop(self, timeout: float = 5.0) -> None:
        """Stop after what is worked on now; no view is published from then on."""
        with self._news:
            self._stopping = True
            self._news.notify_all()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout)

    def step(self) -> float | None:
        """Do what is due: a view, or a stage of it.

        Returns:
            Seconds until more is due, 0 for at once; None until there is news.
        """
        with self._news:
            state, number, since = self._latest, self._asked, self._since
        if state is None or self._stopping:
            return None
        if number != self._answered:
            self._show(self.model.view(state, number, self.view))
            self._answered, self._done = number, 0
            return 0.0
        if self._done == len(self._stages) or self.view is None:
            return None
        rest, stage = self._stages[self._done]
        wait = since + rest - self._clock()
        if wait > 0:
            return wait

        def stale() -> bool:
            return self._stopping or self._asked != number

        view = stage(self.view, stale)
        if not stale():
            self._done += 1
            if view is not self.view:
                self._show(view)
        return 0.0

    def _show(self, view: View) -> None:
        if not self._stopping:
            self.view = view
            self._publish(view)

    def _run(self) -> None:
        while not self._stopping:
            try:
                wait = self.step()
            except Exception:  # a fault of ours must not end the window in silence
                self.error = traceback.format_exc()
                self._answered, self._done = self._asked, len(self._stages)
                wait = None
            with self._news:
                if wait != 0.0 and self._asked == self._answered and not self._stopping:
                    self._news.wait(wait)
