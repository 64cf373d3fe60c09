"""The stance file of a command: read once, asked for stance, limits and criteria."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.robots import StanceFile
    from copsense.stance import Stance

_KEY = "copsense.stance_file"


def remember_stance(
    context: click.Context, parameter: click.Parameter, value: str | None
) -> str | None:
    """Read ``--stance FILE`` before the other options are looked at."""
    if value is not None:
        remember_file(value)
    return value


def remember_robot(
    context: click.Context, parameter: click.Parameter, value: str | None
) -> str | None:
    """A ROBOT that is a stance file is read as ``--stance`` is, and named no more."""
    if value is None:
        return None
    from copsense.robots.stance_tables import is_stance_file

    if not is_stance_file(value):
        return value
    remember_file(value)
    return None


def remember_file(path: str | Path) -> None:
    """Read the stance file of the command that runs.

    Raises:
        InvalidInputError: it has one already.
    """
    from copsense.robots import StanceFile

    meta = click.get_current_context().meta
    if _KEY in meta:
        raise InvalidInputError(
            f"{meta[_KEY].path} and {path} both say which robot stands where. Give one of them."
        )
    meta[_KEY] = StanceFile.read(path)


def remembered_stance() -> StanceFile | None:
    """The file of the command that runs, or None."""
    context = click.get_current_context(silent=True)
    return None if context is None else context.meta.get(_KEY)


def written(
    stance: Stance,
    path: str | None,
    source: str | Path,
    overwrite: bool,
    package_dirs: Iterable[str | Path] = (),
    criteria: Sequence[Criterion] | None = None,
) -> Stance:
    """The stance, written to a file if one is asked for, with the command's limits and criteria.

    Args:
        stance: what to write.
        path: of the file; None for none.
        source: the robot's file, or a preset's name.
        overwrite: replace a file that is there.
        package_dirs: folders of the robot's meshes.
        criteria: instead of those that the command's options name.
    """
    if path is not None:
        from copsense.cli.criterion_options import given_criteria
        from copsense.cli.limit_options import read_limits
        from copsense.robots import save_stance

        given: dict[str, Any] = click.get_current_context().params
        if criteria is None and "criteria" in given:
            criteria = given_criteria(given["criteria"], given["characteristic_length"])
        save_stance(
            stance,
            path,
            robot=source,
            package_dirs=package_dirs,
            limits=read_limits(given.get("limits")),
            criteria=criteria or (),
            overwrite=overwrite,
        )
        click.echo(f"written: {path}", err=True)
    return stance
