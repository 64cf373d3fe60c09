"""``--uncertainty``: how far the model may be off."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import click

from copsense.cli.option_lists import F

if TYPE_CHECKING:
    from copsense.uncertainty import Uncertainty


def uncertainty_option(command: F) -> F:
    """Add the option to a command."""
    option: Any = click.option(
        "--uncertainty",
        metavar="FILE",
        help="Say what errors of the model make of the answer: a file (.toml) of standard "
        "deviations, or 'default' for what a careful laboratory knows of its robot.",
    )
    decorated: F = option(command)
    return decorated


def read_uncertainty(text: str | None) -> Uncertainty | Literal["default"] | None:
    """What the option says; None where it is not given."""
    from copsense.uncertainty import Uncertainty

    if text is None:
        return None
    return "default" if text == "default" else Uncertainty.read(text)
