"""Lists of options that several commands share, each a section of a command's help."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import click

F = TypeVar("F", bound=Callable[..., Any])


# Of the help, in this order; a command's own options come first.
POSTURE, SHARING, CONTACTS, DRIVES, LOADS, STANCE_FILE = SECTIONS = (
    "Posture",
    "Load sharing and limits",
    "Contacts and ground",
    "Joints and drives",
    "Loads",
    "Stance file",
)
_section_of: WeakKeyDictionary[click.Parameter, str] = WeakKeyDictionary()


class SectionedCommand(click.Command):
    """A command whose help lists its own options first, then those that others have, by section."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, section by section."""
        found: dict[str, list[tuple[str, str]]] = {"Options": [], **{name: [] for name in SECTIONS}}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None:
                found[_section_of.get(param, "Options")].append(record)
        for name, records in found.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)


def with_options(
    options: Sequence[Callable[[Any], Any]], command: F, section: str | None = None
) -> F:
    """A command with these options, shown in this order.

    Args:
        options: decorators of click.
        command: to be decorated.
        section: of the help, one of `SECTIONS`; of options that have none already.
    """
    before = set(getattr(command, "__click_params__", ()))
    for option in reversed(options):
        command = option(command)
    if section is not None:
        for param in set(getattr(command, "__click_params__", ())) - before:
            _section_of.setdefault(param, section)
    return command


def options_named(names: Iterable[str]) -> list[str]:
    """The options of the command that runs, as they are typed, by the names of their parameters."""
    typed = {param.name: param.opts[0] for param in click.get_current_context().command.params}
    return [typed[name] for name in names if name in typed]


def package_dirs_option(command: F) -> F:
    """The option --package-dir."""
    option = click.option(
        "--package-dir",
        "package_dirs",
        multiple=True,
        type=click.Path(file_okay=False),
        help="Folder in which package:// meshes are looked up. Repeatable.",
    )
    return with_options([option], command, CONTACTS)
