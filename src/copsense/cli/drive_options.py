"""The options that say what holds a robot's joints, where its file does not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click

from copsense.cli.option_lists import F, with_options
from copsense.cli.units import read_quantity
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.drives import Coupling, Drives, Loop, Spring
    from copsense.robot import Robot

_SPRING = "JOINT=STIFFNESS[:REST], such as l_toe=40:5deg (Nm/rad, degrees) or slide=900 (N/m)"
_COUPLE = "JOINT=RATIO*OF[+OFFSET], such as r_yaw=-1*l_yaw+2deg"
_LOOP = "FRAME_A=FRAME_B[:KIND], such as l_rod_end=l_heel:ball"


def drive_options(command: F) -> F:
    """Motors, springs, couplings and loops, beside those of the robot's file."""
    options = [
        click.option(
            "--passive",
            multiple=True,
            metavar="JOINT",
            help="A joint without a motor. Repeatable.",
        ),
        click.option(
            "--motor",
            "motors",
            multiple=True,
            metavar="JOINT",
            help="A joint with a motor, though its file gives it none. Repeatable.",
        ),
        click.option(
            "--spring",
            "springs",
            multiple=True,
            metavar="JOINT=STIFFNESS[:REST]",
            help="A spring on a joint [Nm/rad, or N/m], without torque at its rest position "
            "(degrees, or metres). Repeatable.",
        ),
        click.option(
            "--couple",
            "couplings",
            multiple=True,
            metavar="JOINT=RATIO*OF[+OFFSET]",
            help="A joint that follows another and has no motor of its own. Repeatable.",
        ),
        click.option(
            "--loop",
            "loops",
            multiple=True,
            metavar="FRAME_A=FRAME_B[:KIND]",
            help="Two frames kept together: ball (default), pin (about z) or weld. Repeatable.",
        ),
    ]
    return with_options(options, command)


def read_drives(
    robot: Robot,
    passive: Iterable[str],
    motors: Iterable[str],
    springs: Iterable[str],
    couplings: Iterable[str],
    loops: Iterable[str],
) -> Drives:
    """The robot's drives with what the options of `drive_options` add."""
    from dataclasses import replace

    drives = robot.drives
    coupled = tuple(_read_coupling(text, robot) for text in couplings)
    followers = {coupling.joint for coupling in coupled}
    own = drives.motors
    drives = replace(
        drives,
        motors=None if own is None else tuple(j for j in own if j not in followers),
        springs={**drives.springs, **dict(_read_spring(text, robot) for text in springs)},
        couplings=(*drives.couplings, *coupled),
        loops=(*drives.loops, *(_read_loop(text, robot) for text in loops)),
    )
    if idle := tuple(passive):
        drives = drives.without_motors(idle, robot.dof_names)
    if driven := tuple(motors):
        drives = drives.with_motors(driven, robot.dof_names)
    return drives


def _read_spring(text: str, robot: Robot) -> tuple[str, Spring]:
    from copsense.drives import Spring

    joint, equals, value = text.rpartition("=")
    stiffness, _, rest = value.partition(":")
    if not (joint and equals):
        raise _not_understood("--spring", text, _SPRING)
    at = read_quantity(rest, robot.joint_unit(joint)) if rest else 0.0
    return joint, Spring(_number(stiffness, "--spring", text, _SPRING), at)


def _read_coupling(text: str, robot: Robot) -> Coupling:
    from copsense.drives import Coupling

    joint, equals, value = text.partition("=")
    factor, star, rest = value.partition("*")
    if not (joint and equals and star and rest):
        raise _not_understood("--couple", text, _COUPLE)
    of, sign, offset = rest, "", ""
    if rest not in robot.joint_names:  # names may hold a minus or plus themselves
        leaders = [j for j in robot.joint_names if rest.startswith((f"{j}+", f"{j}-"))]
        if leaders:
            of = max(leaders, key=len)
            sign, offset = rest[len(of)], rest[len(of) + 1 :]
    unit = robot.joint_unit(joint)
    robot.joint_unit(of)  # that it exists
    shift = read_quantity(sign.replace("+", "") + offset, unit) if offset else 0.0
    return Coupling(joint, of, _number(factor, "--couple", text, _COUPLE), shift)


def _read_loop(text: str, robot: Robot) -> Loop:
    from copsense.drives import LOOP_KINDS, Loop

    frame_a, equals, rest = text.partition("=")
    if not (frame_a and equals and rest):
        raise _not_understood("--loop", text, _LOOP)
    frame_b, colon, given = rest.rpartition(":")
    if not colon or rest in robot.frame_names:
        return Loop(frame_a, rest)
    kind = next((known for known in LOOP_KINDS if known == given), None)
    if kind is None:
        raise UnknownNameError("kind of loop", given, LOOP_KINDS)
    return Loop(frame_a, frame_b, kind)


def _number(number: str, option: str, text: str, form: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise _not_understood(option, text, form) from None


def _not_understood(option: str, text: str, form: str) -> InvalidInputError:
    return InvalidInputError(f"{option} {text!r} is not understood. Give {form}.")
