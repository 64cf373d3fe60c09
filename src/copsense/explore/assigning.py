"""Assigning: whether a control was changed by hand, or by its panel."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Assigning:
    """What the controls of a panel share: assigning a value calls what a change by hand calls.

    It calls it in the thread that assigns, so that each thread has a flag of its own: what is
    changed by hand while another thread assigns is not lost.
    """

    def __init__(self, changed: Callable[[], object]) -> None:
        """Call `changed` for what is changed by hand."""
        self._thread, self._changed = threading.local(), changed

    @property
    def active(self) -> bool:
        """Whether this thread assigns."""
        return bool(getattr(self._thread, "active", False))

    def changed(self, event: object = None) -> None:
        """A control has another value."""
        if not self.active:
            self._changed()

    @contextmanager
    def silently(self) -> Iterator[None]:
        """Assign without asking for a new state."""
        before, self._thread.active = self.active, True
        try:
            yield
        finally:
            self._thread.active = before
