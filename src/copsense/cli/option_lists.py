"""Lists of options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def with_options(options: Sequence[Callable[[Any], Any]], command: F) -> F:
    """A command with these options, shown in this order."""
    for option in reversed(options):
        command = option(command)
    return command


def package_dirs_option(command: F) -> F:
    """The option --package-dir."""
    return click.option(
        "--package-dir",
        "package_dirs",
        multiple=True,
        type=click.Path(file_okay=False),
        help="Folder in which package:// meshes are looked up. Repeatable.",
    )(command)
