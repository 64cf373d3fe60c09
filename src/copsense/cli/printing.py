"""What every command prints: JSON, a progress bar, and the files that were written."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click


@contextmanager
def progress_bar(
    total: int | None, what: str, unit: str = "posture"
) -> Iterator[Callable[[int], object]]:
    """A bar with rate and time left on standard error, where someone is there to see it."""
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit=unit, disable=None, leave=False) as bar:
        yield bar.update


def echo_json(value: Mapping[str, Any]) -> None:
    """Print JSON; infinities, which JSON lacks, become null."""
    click.echo(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _finite(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def echo_written(*paths: str | Path | None) -> None:
    """Say of each file that it was written; None is passed over."""
    for path in paths:
        if path is not None:
            click.echo(f"written: {path}")
