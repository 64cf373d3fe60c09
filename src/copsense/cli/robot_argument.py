"""The argument that names a robot, and what a shell completes it to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click
from click.shell_completion import CompletionItem


def robot_argument(name: str = "robot", **options: Any) -> Callable[[Any], Any]:
    """An argument for robots known by name, or for files; options as of `click.argument`."""
    return click.argument(name, shell_complete=_complete, **options)


def _complete(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The robots known by a name that begins so; files where there is none."""
    from copsense.robots import PRESETS

    # The file comes first: shells then take it for what to do when no name is left.
    return [
        CompletionItem(incomplete, type="file"),
        *(
            CompletionItem(name, help=preset.summary)
            for name, preset in PRESETS.items()
            if name.startswith(incomplete)
        ),
    ]
