"""Controller: the options that say which one, how stiff, and how often it is asked."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from copsense.cli.option_lists import F, with_options
from copsense.cli.units import TIME, read_assignments
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.controllers import Controller, Gains
    from copsense.robot import Robot
    from copsense.stance import Stance


def controller_options(command: F) -> F:
    """Which controller balances the robot, and how stiff it is."""
    options = [
        click.option(
            "--controller",
            metavar="MODULE:NAME",
            help="Your controller instead: a class made with the stance, or a function observation "
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


def control_period_option(command: F) -> F:
    """How often the controller is asked."""
    option = click.option(
        "--control-period",
        type=TIME,
        default=1e-3,
        show_default=True,
        metavar="TIME",
        help="Time between two steps of the controller [s], a multiple of the physics' 1 ms.",
    )
    return with_options([option], command)


def read_own_controller(source: str, changes: tuple[str, ...], stance: Stance) -> Controller:
    """The user's controller, ``MODULE:NAME``, which has no gains to set."""
    from copsense.controllers import load_controller

    where = click.get_current_context().get_parameter_source("gains")
    if changes or where is ParameterSource.COMMANDLINE:
        raise InvalidInputError(
            "--gains and --gain belong to the built-in controller, and --controller names "
            "yours. Leave one of them out."
        )
    return load_controller(source, stance)


def read_gains(name: str, changes: tuple[str, ...], robot: Robot) -> Gains:
    """The set of gains named, with single ones changed."""
    from copsense.controllers import STIFF, public_gains

    gains = STIFF if name == "stiff" else public_gains(robot)
    values: dict[str, Any] = {}
    names = [f.name.replace("_", "-") for f in fields(gains) if f.name != "scaled_by_inertia"]
    for changed, value in read_assignments(changes, "NAME=VALUE, such as com-damping=14").items():
        if changed not in names:
            raise UnknownNameError("gain", changed, names)
        if value < 0:  # what is not a number is for the gains to reject
            raise InvalidInputError(
                f"the gain {changed} is {value:g}: it would push the robot over. Give a number "
                "that is not negative."
            )
        values[changed.replace("-", "_")] = (value,) * 3 if changed.startswith("com-") else value
    return replace(gains, **values)
