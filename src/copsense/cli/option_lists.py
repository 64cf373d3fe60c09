"""Lists of options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def with_options(options: Sequence[Callable[[Any], Any]], command: F) -> F:
    """A command with these options, shown in this order."""
    for option in reversed(options):
        command = option(command)
    return command
