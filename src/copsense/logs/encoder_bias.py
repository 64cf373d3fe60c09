"""Encoder bias: a log's motion as it would be if an encoder read a constant too much.

Assumed of the encoders: each has a constant error of its own, independent of the others', normal,
with one standard deviation for all. A constant changes no joint velocity, but it changes where the
robot stands, how far its centre of mass goes, and what every criterion says there; averaging does
not remove it. Effects are linear: those of the joints add up as squares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from copsense.arrays import finite_number
from copsense.contact import Contact
from copsense.errors import InvalidInputError
from copsense.logs.aligned_log import AlignedLog
from copsense.logs.ground_wrenches import ground_wrenches
from copsense.logs.log import Log
from copsense.logs.log_motion import LogMotion, stand_on_feet
from copsense.robot import Robot

ROWS = 24  # at which the effect of a bias is evaluated
_STEP = 1e-3  # s, by which rows are moved to see how the base moves


def encoder_error(value: object) -> float:
    """A standard deviation of encoders, zero or more [rad].

    Raises:
        InvalidInputError: it is not one.
    """
    found = finite_number(value, "the encoders' constant error [rad]")
    if found < 0:
        raise InvalidInputError(
            f"the encoders' constant error is {found:g} rad. Give its standard deviation, zero or "
            "more."
        )
    return found


def interval_note(bias: float) -> str:
    """What intervals have in them, with encoders of a standard deviation [rad], or without."""
    if not bias:
        return (
            "intervals are of noise; constant errors of the encoders are not in them "
            "(encoders=, --encoders)"
        )
    return (
        f"intervals with a constant error of each encoder of {np.degrees(bias):.3g} deg (standard "
        "deviation, independent)"
    )


def some_rows(rows: Int[np.ndarray, " M"], most: int = ROWS) -> Int[np.ndarray, " K"]:
    """Places in `rows`, evenly chosen."""
    return np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).round().astype(int))


def biased_records(
    log: Log, aligned: AlignedLog, rows: Int[np.ndarray, " K"], bias: float
) -> Iterator[tuple[LogMotion, Float[np.ndarray, "K nc 6"]]]:
    """Some rows with one encoder after the other shifted: the motion, and the ground's wrenches.

    The base follows from the feet, unless it was recorded.

    Args:
        log: the log.
        aligned: what `align_log` made of it.
        rows: of the log.
        bias: of each encoder in turn [rad, or m]; 0 gives the rows as they are, once.
    """
    robot, feet, motion = aligned.robot, aligned.contacts, aligned.motion
    q, v, a = motion.configurations[rows], motion.velocities[rows], motion.accelerations[rows]
    known, model = np.ones(len(rows), dtype=bool), robot.model
    own = replace(
        log,
        times=log.times[rows],
        positions=log.positions[rows],
        velocities=None,
        torques=None,
        base=None,
        wrenches=tuple(replace(w, values=w.values[rows]) for w in log.wrenches),
    )
    for joint in range(6, model.nv) if bias else (6,):
        shift = np.zeros(model.nv)
        shift[joint] = bias
        moved = np.array([pin.integrate(model, row, shift) for row in q])
        if aligned.base == "feet":
            moved, v_there, a_there = _standing(robot, feet, moved, v, a)
        else:
            v_there, a_there = v, a
        there = LogMotion(moved, v_there, a_there, known, motion.window)
        yield there, ground_wrenches(own, robot, feet, there, aligned.base == "recorded")


def _standing(
    robot: Robot, contacts: Sequence[Contact], q: np.ndarray, v: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Configurations with the base on the feet, and its velocity and acceleration.

    With l+- the base's displacement from q(0) to q(+-h), in its axes: v = (l+ - l-) / 2h and
    dv/dt = (l+ + l-) / h^2.
    """
    model, h, size = robot.model, _STEP, len(q)
    steps = []
    for sign in (-1.0, 0.0, 1.0):
        along = sign * h * v + 0.5 * h**2 * a if sign else np.zeros_like(v)
        along[:, :6] = 0.0  # the base is put in place
        steps += [pin.integrate(model, row, step) for row, step in zip(q, along, strict=True)]
    placed = stand_on_feet(robot, contacts, np.array(steps))
    before, now, after = placed[:size], placed[size : 2 * size], placed[2 * size :]
    ahead, behind = (
        np.array([pin.difference(model, n, o)[:6] for n, o in zip(now, other, strict=True)])
        for other in (after, before)
    )
    v, a = v.copy(), a.copy()
    v[:, :6] = (ahead - behind) / (2 * h)
    a[:, :6] = (ahead + behind) / h**2
    return now, v, a
