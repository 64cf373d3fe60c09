"""The options that put the CoM and joints of a stance somewhere, or say what a command varies."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.option_lists import POSTURE, F, with_options
from copsense.cli.units import (
    LENGTH,
    read_coordinates,
    read_positions,
    read_quantity,
    read_range,
    split_assignment,
)
from copsense.errors import InvalidInputError

if TYPE_CHECKING:
    from copsense.robot import Robot
    from copsense.stance import Stance

_WHERE = {"x": "World x of the CoM", "y": "World y of the CoM", "z": "Height of the CoM"}
_FORM = (
    "JOINT=POSITION (degrees, or metres for a prismatic joint) to hold it, or "
    "JOINT=START:STOP:COUNT to sweep it"
)


_AT = click.option(
    "--at",
    multiple=True,
    metavar="COORDINATE=VALUE",
    help="A coordinate of the posture, instead of --com-x, --com-y, --com-z and --joint: com_x, "
    "com_y, com_z, base_x, base_y, base_z, roll, pitch, yaw, a joint, CONTACT:x, CONTACT:y or "
    "CONTACT:yaw (metres, degrees, or with the unit). What is not named keeps the stance's "
    "value: the base does not yield. Repeatable.",
)


def place_options(command: F, *, coordinates: bool = True) -> F:
    """Where the CoM and joints of a stance are put, contacts in place.

    Args:
        command: to be decorated.
        coordinates: whether ``--at`` says it too; of `push` it is the frame that is pushed.
    """
    options = [
        *(
            click.option(
                f"--com-{axis}",
                type=LENGTH,
                metavar="LENGTH",
                help=f"{what} to move to; default {'free' if axis == 'z' else 'as it stands'}.",
            )
            for axis, what in _WHERE.items()
        ),
        click.option(
            "--joint",
            "joints",
            multiple=True,
            metavar="JOINT=POSITION",
            help="Put a joint there, contacts in place: degrees, or metres for a prismatic joint. "
            "Repeatable.",
        ),
        *([_AT] if coordinates else []),
    ]
    return with_options(options, command, POSTURE)


def course_options(command: F) -> F:
    """The same where one of them is swept: a value holds, a range sweeps."""
    usual = {"z": "free"}
    options = [
        *(
            click.option(
                f"--com-{axis}",
                metavar="START:STOP:COUNT|LENGTH",
                help=f"{what} [m]: sweep it, or hold it there; default "
                f"{usual.get(axis, 'held over the middle of the contacts')}.",
            )
            for axis, what in _WHERE.items()
        ),
        click.option(
            "--joint",
            "joints",
            multiple=True,
            metavar="JOINT=START:STOP:COUNT|POSITION",
            help="Sweep a joint, or hold it there: degrees, or metres for a prismatic joint, or "
            "with units (0mm:200mm:3). Repeatable.",
        ),
        _AT,
    ]
    return with_options(options, command, POSTURE)


@dataclass(frozen=True)
class Course:
    """What `course_options` say.

    Attributes:
        swept: coordinate of the CoM or joint -> ``START:STOP:COUNT``.
        com: coordinate of the CoM -> where it is held [m].
        joints: ``JOINT=POSITION`` of the joints that are held.
    """

    swept: Mapping[str, str]
    com: Mapping[str, float]
    joints: tuple[str, ...]

    @property
    def holding(self) -> list[str]:
        """The options that hold something."""
        return [_option(name) for name in self.com] + ["--joint"] * bool(self.joints)

    @property
    def sweeping(self) -> list[str]:
        """What is swept, as it is typed."""
        return [
            f"{_option(name)} {text}" if name in _COM else f"--joint {name}={text}"
            for name, text in self.swept.items()
        ]

    @property
    def places(self) -> dict[str, Any]:
        """What is held, as `place_options` would give it."""
        return {**self.com, "joints": self.joints}

    def held(self, robot: Robot) -> dict[str, float]:
        """Coordinate of the CoM or joint -> where it is held [m, rad], as sweeps take it."""
        return {**self.com, **read_positions(self.joints, robot)}

    def range_of(self, name: str, robot: Robot) -> tuple[float, float, int]:
        """Start, stop and count of what is swept, in SI."""
        return read_range(self.swept[name], "m" if name in _COM else robot.joint_unit(name))


_COM = tuple(f"com_{axis}" for axis in _WHERE)


def _option(name: str) -> str:
    """The option that places a coordinate of the CoM."""
    return f"--{name.replace('_', '-')}"


def reject_varied(varied: Collection[str], options: Mapping[str, Any]) -> None:
    """Reject a place of a coordinate that the command varies itself: it would change nothing.

    Args:
        varied: coordinates of the command, such as ``com_y``, ``base_x`` or a joint.
        options: the command's, with those of `place_options`.
    """
    placed = {name: _option(name) for name in _COM if options[name] is not None}
    for option, texts in (("--joint", options["joints"]), ("--at", options["at"])):
        placed |= {text.partition("=")[0]: option for text in texts}
    for name, option in placed.items():
        # Of the CoM and the base the one decides the other.
        other = name.replace("com_", "base_") if name in _COM else name.replace("base_", "com_")
        for same in dict.fromkeys((name, other)):
            if same in varied:
                raise InvalidInputError(
                    f"{same} is varied, so {option} would hold nothing. Leave {option} out, or "
                    f"{same} out of what is varied."
                )


def read_course(
    com_x: str | None, com_y: str | None, com_z: str | None, joints: Sequence[str]
) -> Course:
    """What is swept and what is held.

    Raises:
        InvalidInputError: a value that is not understood, or a joint that is given twice.
    """
    swept: dict[str, str] = {}
    com: dict[str, float] = {}
    for name, text in zip(_COM, (com_x, com_y, com_z), strict=True):
        if text is None:
            continue
        if ":" in text:
            swept[name] = text
            continue
        try:
            com[name] = read_quantity(text, "m")
        except InvalidInputError:
            raise InvalidInputError(
                f"{_option(name)} {text!r} is not understood. Give START:STOP:COUNT to "
                "sweep it, such as -0.07:0.07:201, or a length to hold it, such as 0.02 or 20mm."
            ) from None
    held = []
    for text in joints:
        joint, value = split_assignment(text, _FORM)
        if ":" in value:
            if joint in swept:
                raise InvalidInputError(f"--joint names {joint} twice. Give it once.")
            swept[joint] = value
        else:
            held.append(text)
    return Course(swept, com, tuple(held))


def put_in_place(
    stance: Stance,
    com_x: float | None,
    com_y: float | None,
    com_z: float | None,
    joints: Sequence[str],
    at: Sequence[str],
) -> Stance:
    """The stance with CoM and joints where `place_options` say.

    Raises:
        InvalidInputError: a joint that is given twice, a position that is not understood, or
            ``--at`` beside the others.
        UnreachablePostureError: no posture has them there.
    """
    from copsense.analysis.asked import placed_stance

    positions, coordinates = read_positions(joints, stance.robot), read_coordinates(at, stance)
    return placed_stance(stance, (com_x, com_y, com_z), positions, coordinates)
