"""``--criterion``: how the load is shared."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from copsense.cli.option_lists import F, with_options

if TYPE_CHECKING:
    from copsense.criterion import Criterion


def criterion_options(command: F) -> F:
    """Which criteria share the load."""
    options = [
        click.option(
            "--criterion",
            "criteria",
            multiple=True,
            metavar="NAME",
            help="How the load is shared: minimum-wrench, minimum-torque, limit-weighted-torque, "
            "inertia-weighted-torque or minimum-tangential. Repeatable; default the first two.",
        ),
        click.option(
            "--characteristic-length",
            type=float,
            default=1.0,
            show_default=True,
            metavar="M",
            help="Length L [m] that makes moments comparable with forces in minimum-wrench.",
        ),
    ]
    return with_options(options, command)


def read_criteria(names: tuple[str, ...], characteristic_length: float) -> list[Criterion]:
    """The criteria named, or the paper's two."""
    from copsense.criterion import criterion_named

    chosen = dict.fromkeys(names or ("minimum-wrench", "minimum-torque"))
    return [criterion_named(name, characteristic_length) for name in chosen]
