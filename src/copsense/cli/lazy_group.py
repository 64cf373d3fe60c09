"""LazyGroup: a group of commands, each imported when it runs, so that help is immediate."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import click

from copsense.errors import UnknownNameError


class Place(NamedTuple):
    """Where a command is defined, and its line in the group's help."""

    module: str
    name: str
    summary: str


class LazyGroup(click.Group):
    """A click group that knows its commands by place and imports one when it is asked for."""

    def __init__(self, *args: Any, places: Mapping[str, Place], **options: Any) -> None:
        """Remember where the commands are; the other arguments are those of `click.Group`."""
        super().__init__(*args, **options)
        self.places: dict[str, Place] = dict(places)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, in the order in which they were given."""
        return list(self.places)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported now; None where there is none."""
        place = self.places.get(cmd_name)
        if place is None:
            return None
        command: click.Command = getattr(importlib.import_module(place.module), place.name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the arguments name.

        Raises:
            UnknownNameError: there is none of that name; the message has the nearest ones.
        """
        name = str(args[0])
        if not ctx.resilient_parsing and name not in self.places and not name.startswith("-"):
            raise UnknownNameError(
                "command", name, self.places, "copsense --help says what each does."
            )
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands with their summaries, without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, place.summary) for name, place in self.places.items()])
