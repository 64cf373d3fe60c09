"""``--criterion``: how the load is shared."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.option_lists import SHARING, F, with_options
from copsense.cli.stance_memory import remembered_stance
from copsense.cli.units import LENGTH
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.criterion import Criterion
    from copsense.robots import StanceFile


def criterion_options(command: F) -> F:
    """Which criteria share the load: any number of them."""
    return with_options(_options("Repeatable; default the first two."), command, SHARING)


def one_criterion_options(command: F) -> F:
    """Which criterion shares the load: one."""
    return with_options(_options("One; default minimum-torque."), command, SHARING)


def _options(how_many: str) -> list[Callable[[Any], Any]]:
    return [
        click.option(
            "--criterion",
            "criteria",
            multiple=True,
            metavar="NAME",
            help="How the load is shared: minimum-wrench, minimum-torque, limit-weighted-torque, "
            "inertia-weighted-torque, minimum-tangential, weighted-torque:hip=2,knee=1,rest=1, or "
            "of a robot on position servos "
            f"stiffness:hip=4000,ankle=1000,rest=2000 [Nm/rad], soles mx=2800,my=700. {how_many}",
        ),
        click.option(
            "--characteristic-length",
            type=LENGTH,
            default=1.0,
            show_default=True,
            metavar="LENGTH",
            help="Length L [m] that makes moments comparable with forces in minimum-wrench.",
        ),
    ]


def read_criterion(names: tuple[str, ...], characteristic_length: float) -> Criterion:
    """The one criterion named, or the stance file's, or the minimum torque.

    Raises:
        InvalidInputError: the file has several.
    """
    file = remembered_stance()
    if not names and (file is None or not file.criteria):
        names = ("minimum-torque",)
    found = read_criteria(names, characteristic_length)
    if len(found) > 1:
        raise InvalidInputError(
            f"the stance file has {len(found)} criteria ({', '.join(c.name for c in found)}), and "
            f"this command takes one. Name it: --criterion {found[0].name}, or leave the others "
            "out of the file."
        )
    return found[0]


def read_criteria(names: tuple[str, ...], characteristic_length: float) -> list[Criterion]:
    """The criteria named, or the paper's two."""
    return given_criteria(names, characteristic_length) or given_criteria(
        ("minimum-wrench", "minimum-torque"), characteristic_length
    )


def check_length_of(file: StanceFile) -> None:
    """Reject ``--characteristic-length`` beside the criteria of a stance file, which have theirs.

    Raises:
        InvalidInputError: it is given.
    """
    given = click.get_current_context().get_parameter_source("characteristic_length")
    if given is click.core.ParameterSource.COMMANDLINE:
        raise InvalidInputError(
            f"the criteria come from {file.path}, each with its own length, and "
            "--characteristic-length gives another. Name the criterion that it is for as well: "
            "--criterion minimum-wrench."
        )


def given_criteria(names: tuple[str, ...], characteristic_length: float) -> list[Criterion]:
    """The criteria named, or those of the stance file, or none: each command has its default.

    Raises:
        InvalidInputError: a characteristic length beside the file's criteria.
    """
    from copsense.criterion_text import criterion_from_text

    file = remembered_stance()
    if not names and file is not None and file.criteria:
        check_length_of(file)
        return list(file.criteria)
    return [criterion_from_text(name, characteristic_length) for name in dict.fromkeys(names)]
