"""Controller: the options of ``copsense balance`` that say which one, and how stiff."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from copsense.cli.option_lists import F, with_options
from copsense.cli.quantities import read_assignments
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.controllers import Controller, Gains
    from copsense.criterion import Criterion
    from copsense.limits import Limits
    from copsense.stance import Stance


def controller_options(command: F) -> F:
    """Which controller balances the robot, and how stiff it is."""
    options = [
        click.option(
            "--controller",
            metavar="MODULE:NAME",
            help="Your controller instead: a class made of the stance, or a function observation "
            "-> torques. A --criterion is then for the static prediction.",
        ),
        click.option(
            "--gain",
            multiple=True,
            metavar="NAME=VALUE",
            help="Change one gain of the set, for all axes or joints: com-stiffness [1/s^2], "
            "com-damping [1/s], momentum-damping [1/s], momentum-stiffness [1/s^2], "
            "posture-stiffness, posture-damping (stiff: times the joint's inertia; public: "
            "Nm/rad, Nm s/rad). Repeatable.",
        ),
        click.option(
            "--gains",
            type=click.Choice(["stiff", "public"]),
            default="stiff",
            show_default=True,
            help="Gains: stiff, or soft ones like those the authors published.",
        ),
    ]
    return with_options(options[::-1], command)


def read_controller(
    stance: Stance,
    own: str | None,
    criterion: Criterion,
    gains: str,
    changes: tuple[str, ...],
    limits: Limits | None,
) -> Controller:
    """The user's controller, or the balancing controller with the gains asked for."""
    from copsense.controllers import STIFF, BalancingController, load_controller, public_gains

    if own is not None:
        source = click.get_current_context().get_parameter_source("gains")
        if changes or source is ParameterSource.COMMANDLINE:
            raise InvalidInputError(
                "--gains and --gain belong to the built-in controller, and --controller names "
                "yours. Leave one of them out."
            )
        return load_controller(own, stance)
    chosen = _changed(STIFF if gains == "stiff" else public_gains(stance.robot), changes)
    return BalancingController(stance, criterion, chosen, limits=limits)


def _changed(gains: Gains, changes: tuple[str, ...]) -> Gains:
    values: dict[str, Any] = {}
    names = [f.name.replace("_", "-") for f in fields(gains) if f.name != "scaled_by_inertia"]
    for name, value in read_assignments(changes, "NAME=VALUE, such as com-damping=14").items():
        if name not in names:
            raise UnknownNameError("gain", name, names)
        values[name.replace("-", "_")] = (value,) * 3 if name.startswith("com-") else value
    return replace(gains, **values)
