"""The options that say what holds a robot's joints, where its file does not."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

from copsense.cli.load_options import read_frame
from copsense.cli.option_lists import DRIVES, F, with_options
from copsense.cli.units import Unit, read_numbers, read_quantity, split_assignment
from copsense.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from copsense.drives import Coupling, Drives, Loop, Spring, Transmission
    from copsense.robot import Robot

_SPRING = "JOINT=STIFFNESS[:REST], such as l_toe=40:5deg (Nm/rad, degrees) or slide=900 (N/m)"
_COUPLE = "JOINT=RATIO*OF[+OFFSET], such as r_yaw=-1*l_yaw+2deg"
_LOOP = (
    "FRAME_A=FRAME_B[:KIND[:X:Y:Z]], such as l_rod_end=l_heel:ball or "
    "l_rod=l_crank@0.1:0:0:pin:0:1:0"
)
_HELD = "JOINT=TORQUE, such as neck=0.3 (Nm)"
_TRANSMISSION = (
    "JOINT=RATIO*MOTOR[+RATIO*MOTOR...],JOINT=..., such as pitch=1*m1+1*m2,roll=1*m1-1*m2, and "
    "efforts beside it: m1=30,m2=30 (Nm)"
)
_TERM = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\*([^+\-*]+)")


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
            metavar="FRAME_A=FRAME_B[:KIND[:X:Y:Z]]",
            help="Two frames kept together: ball (default), pin (about z, or about X:Y:Z) or weld. "
            "FRAME@X:Y:Z is a point in a frame [m]. Repeatable.",
        ),
        click.option(
            "--held",
            multiple=True,
            metavar="JOINT=TORQUE",
            help="A torque that something else exerts on a joint, such as a brake or a hand "
            "[Nm, or N]. Repeatable.",
        ),
        click.option(
            "--transmission",
            "transmissions",
            multiple=True,
            metavar="JOINT=RATIO*MOTOR...,...",
            help="Motors that drive several joints together, by the torque of each joint: "
            "pitch=1*m1+1*m2,roll=1*m1-1*m2, and their efforts if they are known: ...,m1=30,m2=30 "
            "[Nm]. Repeatable.",
        ),
        click.option(
            "--lock",
            "locked",
            multiple=True,
            metavar="JOINT",
            help="A joint that is rigid, at zero. Repeatable.",
        ),
    ]
    return with_options(options, command, DRIVES)


def read_drives(
    robot: Robot,
    passive: Iterable[str],
    motors: Iterable[str],
    springs: Iterable[str],
    couplings: Iterable[str],
    loops: Iterable[str],
    held: Iterable[str] = (),
    transmissions: Iterable[str] = (),
) -> Drives:
    """The robot's drives with what the options of `drive_options` add."""
    from dataclasses import replace

    drives = robot.drives
    coupled = tuple(_read_coupling(text, robot) for text in couplings)
    geared = tuple(_read_transmission(text, robot) for text in transmissions)
    driven = {joint for each in geared for joint in each.joints}
    followers = {coupling.joint for coupling in coupled} | driven
    own = drives.motors
    drives = replace(
        drives,
        motors=None if own is None else tuple(j for j in own if j not in followers),
        springs={**drives.springs, **_once("--spring", (_read_spring(t, robot) for t in springs))},
        held={**drives.held, **_once("--held", (_read_held(t, robot) for t in held))},
        couplings=(*drives.couplings, *coupled),
        loops=(*drives.loops, *(_read_loop(text, robot) for text in loops)),
        transmissions=(*drives.transmissions, *geared),
    )
    if idle := tuple(passive):
        drives = drives.without_motors(idle, robot.dof_names)
    if more := tuple(motors):
        drives = drives.with_motors(more, robot.dof_names)
    return drives


def _once(option: str, pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Joint -> value, each joint once."""
    found: dict[str, Any] = {}
    for joint, value in pairs:
        if joint in found:
            raise InvalidInputError(f"{option} is given twice for {joint}. Give it once.")
        found[joint] = value
    return found


def _read_held(text: str, robot: Robot) -> tuple[str, float]:
    joint, torque = split_assignment(text, f"--held {_HELD}")
    unit: Unit = "Nm" if robot.joint_unit(joint) == "rad" else "N"
    (value,) = read_numbers(torque, f"--held {text!r}", _HELD, (unit,))
    return joint, value


def _read_transmission(text: str, robot: Robot) -> Transmission:
    """``JOINT=RATIO*MOTOR+...,...``: joint torques by motor torques, then efforts ``MOTOR=NM``."""
    import numpy as np

    from copsense.drives import Transmission

    rows: dict[str, dict[str, float]] = {}
    efforts: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not (name and equals and value) or name in rows or name in efforts:
            raise _not_understood("--transmission", text, _TRANSMISSION)
        if "*" not in value:
            efforts[name] = value
            continue
        robot.joint_unit(name)  # that it exists
        terms = _TERM.findall(value)
        if "".join(f"{ratio}*{motor}" for ratio, motor in terms) != value:
            raise _not_understood("--transmission", text, _TRANSMISSION)
        rows[name] = {}
        for ratio, motor in terms:
            rows[name][motor] = rows[name].get(motor, 0.0) + float(ratio)
    motors = tuple(dict.fromkeys(motor for row in rows.values() for motor in row))
    if not rows:
        raise _not_understood("--transmission", text, _TRANSMISSION)
    for name in efforts:
        if name not in motors:
            raise UnknownNameError("motor of the transmission", name, motors)
    said = f"--transmission {text!r}"
    limits = tuple(
        value
        for motor in motors
        for value in read_numbers(efforts.get(motor, "inf"), said, _TRANSMISSION, ("Nm",))
    )
    matrix = [[row.get(motor, 0.0) for motor in motors] for row in rows.values()]
    return Transmission(motors, tuple(rows), np.array(matrix), limits if efforts else None)


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
    a, offset_a = read_frame(frame_a, "--loop")
    kinds = "|".join(LOOP_KINDS)
    said = re.fullmatch(rf"(.+):({kinds})((?::[^:]+){{3}})?", rest)
    if said is None or rest in robot.frame_names:
        b, offset_b = read_frame(rest, "--loop")
        _, colon, given = rest.rpartition(":")
        if colon and b == rest and rest not in robot.frame_names:
            raise UnknownNameError("kind of loop", given, LOOP_KINDS)
        return Loop(a, b, "ball", offset_a, offset_b)
    b, offset_b = read_frame(said[1], "--loop")
    kind = next(each for each in LOOP_KINDS if each == said[2])
    if said[3] is None:
        return Loop(a, b, kind, offset_a, offset_b)
    if kind != "pin":
        raise InvalidInputError(
            f"--loop {text!r} gives an axis, and a {kind} has none. Leave it out, or give a pin."
        )
    x, y, z = read_numbers(said[3][1:], f"--loop {text!r}", _LOOP, (None,) * 3)
    return Loop(a, b, kind, offset_a, offset_b, (x, y, z))


def _number(number: str, option: str, text: str, form: str) -> float:
    try:
        return float(number)
    except ValueError:
        raise _not_understood(option, text, form) from None


def _not_understood(option: str, text: str, form: str) -> InvalidInputError:
    return InvalidInputError(f"{option} {text!r} is not understood. Give {form}.")
