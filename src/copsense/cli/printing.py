"""What every command prints: JSON, a progress bar, and the files that were written."""

from __future__ import annotations

import json
import logging
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from copsense.json_data import json_data


@contextmanager
def progress_bar(
    total: int | None, what: str, unit: str = "posture"
) -> Iterator[Callable[[int], object]]:
    """A bar with rate and time left on standard error, where someone is there to see it."""
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit=unit, disable=None, leave=False) as bar:
        yield bar.update


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """The time that something without a count takes, ticking where someone is there to see it.

    What is logged meanwhile, such as what is compiled, is said as notes.
    """
    from tqdm import tqdm

    class Notes(logging.Handler):
        """What is logged, as notes."""

        def emit(self, record: logging.LogRecord) -> None:
            """Say one."""
            with bar.external_write_mode(sys.stderr):
                click.echo(f"note: {record.getMessage()}", err=True)

    over = threading.Event()

    def tick() -> None:
        while not over.wait(0.5):
            bar.refresh()

    with tqdm(bar_format=f"{what}: {{elapsed}}", disable=None, leave=False) as bar:
        ticking, notes = threading.Thread(target=tick, daemon=True), Notes()
        logging.getLogger("copsense").addHandler(notes)
        ticking.start()
        try:
            yield
        finally:
            over.set()
            ticking.join()
            logging.getLogger("copsense").removeHandler(notes)


PICTURES = (".png", ".svg", ".pdf")


def echo_json(value: Mapping[str, Any]) -> None:
    """Print JSON; infinities, which JSON lacks, become null."""
    click.echo(json.dumps(json_data(value), indent=2, allow_nan=False))


def echo_notes(notes: Iterable[str]) -> None:
    """Print notes on standard error, where they stay out of what is piped on; each once."""
    context = click.get_current_context(silent=True)
    said: set[str] = set() if context is None else context.meta.setdefault(__name__, set())
    for note in notes:
        if note not in said:
            click.echo(f"note: {note}", err=True)
        said.add(note)


def echo_written(*paths: str | Path | None) -> None:
    """Say of each file that it was written; None is passed over."""
    for path in paths:
        if path is not None:
            click.echo(f"written: {path}")
