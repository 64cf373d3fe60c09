"""align_log: a log's robot on its feet, and the rows on which everything needed was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from copsense.contact import Contact
from copsense.content import ShortRepr, freeze
from copsense.errors import InvalidInputError
from copsense.listing import first_few
from copsense.logs.finding import Finding
from copsense.logs.ground_wrenches import ground_wrenches
from copsense.logs.log import Log
from copsense.logs.log_audit import (
    audit_feet,
    audit_forces,
    check_clock,
    check_encoders,
    check_joints,
)
from copsense.logs.log_motion import (
    LogMotion,
    Stand,
    com_rows,
    joint_rows,
    put_on_base,
    smooth_motion,
    smoothing_window,
    stand_on_feet,
)
from copsense.logs.log_statics import loaded_cops
from copsense.logs.sway_fit import LEAST, STILL, find_sway
from copsense.posture_run import PostureRun
from copsense.robot import Robot
from copsense.robots import PRESETS, load_robot, load_stance
from copsense.robots.stance_tables import is_stance_file
from copsense.stance import Stance

POSTURES = 5000  # that are evaluated at most
_LOOK, _LOOKED = 0.05, 4000  # s from row to row of a look at the sway, and its rows
_OF_SWAY = 0.125  # of a sway's period, by which rows that are evaluated lie apart at most


@dataclass(frozen=True, eq=False, repr=False)
class AlignedLog(ShortRepr):
    """A log with its robot on its feet, and the rows on which everything needed was measured.

    Attributes:
        robot: without the joints that the log lacks.
        contacts: in order.
        base: ``"feet"`` or ``"recorded"``: what put the base in place.
        motion: of every row of the log (N).
        rows: those that are used (M,).
        wrenches: of the ground on each contact at every row (N, nc, 6); NaN where not measured.
        torques: of the motors at the rows that are used (M, n) [Nm]; None where there are none.
        findings: what is missing or does not fit.
        notes: how it was done.
    """

    robot: Robot
    contacts: tuple[Contact, ...]
    base: Literal["feet", "recorded"]
    motion: LogMotion
    rows: Int[np.ndarray, " M"]
    wrenches: Float[np.ndarray, "N nc 6"]
    torques: Float[np.ndarray, "M n"] | None
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "rows", "wrenches", "torques")

    def run(self, log: Log) -> PostureRun:
        """The postures of the rows that are used, with their motion and what was measured.

        Args:
            log: the one that was aligned.
        """
        rows, motion = self.rows, self.motion
        # The feet are where the joints put them, millimetres off one plane.
        middle = motion.configurations[rows[len(rows) // 2]]
        cops = loaded_cops(self.wrenches[rows])
        return PostureRun(
            Stance(self.robot, middle, self.contacts, check=False),
            "time",
            "s",
            log.times[rows],
            motion.configurations[rows],
            rows,
            cops if np.isfinite(cops).any() else None,
            motion.velocities[rows],
            motion.accelerations[rows],
            log.source,
        )


def align_log(
    log: Log,
    robot: str | Path | Robot | Stance,
    *,
    contacts: Sequence[str | Contact] | None = None,
    base: Literal["feet", "recorded"] = "feet",
    postures: int = POSTURES,
) -> AlignedLog:
    """Put a log's robot on its feet, and find the rows to use; as `compare_log` does.

    Raises:
        UnknownNameError: the robot lacks a joint, or the frame of a sensor.
        InvalidInputError: positions in degrees, a foot without a sensor, no row on which all feet
            are loaded, or no base recorded.
    """
    model, known_contacts = log_robot(robot)
    feet = _contacts(log, model, known_contacts, contacts)
    findings = [*log.findings, *check_clock(log), *check_joints(log, model)]
    whole, model = model, model.keeping(log.joint_names)
    notes = [*log.notes, *_locked(whole, model, feet)]
    findings += check_encoders(log, model, feet)
    known = np.isfinite(log.positions).all(axis=1)
    if base == "recorded":
        if log.base is None:
            raise InvalidInputError(
                f"{log.source} has no base pose. Leave the base to the feet (base='feet', --base "
                "feet)."
            )
        stand = partial(_recorded, model, log.base, log.base_frame)
        known &= np.isfinite(log.base).all(axis=1)
    elif base == "feet":
        stand = partial(_on_feet, model, feet)
    else:
        raise InvalidInputError(f"the base is {base!r}. Give 'feet' or 'recorded'.")
    motion, frequency = _motion(log, model, stand, known)
    wrenches = ground_wrenches(log, model, feet, motion, base == "recorded")
    findings += audit_forces(log, model, feet, wrenches[:, :, 2])
    findings += audit_feet(log, model, feet, motion)
    rows = _compared(log, model, feet, motion, wrenches, postures, frequency, notes)
    torques = _torques(log, model, rows)
    return AlignedLog(
        model, tuple(feet), base, motion, rows, wrenches, torques, tuple(findings), tuple(notes)
    )


def log_robot(
    source: str | Path | Robot | Stance, package_dirs: Sequence[str | Path] = ()
) -> tuple[Robot, tuple[Contact, ...]]:
    """The robot of a log, and its own contacts where it has some.

    Args:
        source: a preset's name, a URDF, MJCF or SDF, a stance file (.toml), a `Robot` or a stance.
        package_dirs: folders that hold the packages of ``package://`` meshes.

    Raises:
        CopsenseError: as `load_robot` and `load_stance`.
    """
    if is_stance_file(source) or (isinstance(source, str) and source in PRESETS):
        source = load_stance(source)
    if isinstance(source, Stance):
        return source.robot, tuple(source.contacts)
    return load_robot(source, package_dirs=package_dirs), ()


def _contacts(
    log: Log,
    robot: Robot,
    known: tuple[Contact, ...],
    contacts: Sequence[str | Contact] | None,
) -> tuple[Contact, ...]:
    """The contacts that are compared."""
    wanted: list[str | Contact] = list(contacts or ())
    if not wanted:
        wanted = list(known) or list(dict.fromkeys(w.contact for w in log.wrenches))
    if not wanted:
        raise InvalidInputError(
            f"{log.source} has no force sensor, and no contact was named. Map one under "
            "[[wrenches]], or give the contacts."
        )
    by_name = {c.frame: c for c in known} | {c.name: c for c in known}
    found = tuple(c if isinstance(c, Contact) else by_name.get(c, Contact(frame=c)) for c in wanted)
    for contact in found:
        robot.frame(contact.frame)
    return found


def _on_feet(
    robot: Robot, contacts: Sequence[Contact], q: Float[np.ndarray, "N nq"], _: int, every: int
) -> Float[np.ndarray, "N nq"]:
    return stand_on_feet(robot, contacts, q)


def _recorded(
    robot: Robot,
    base: np.ndarray,
    frame: str,
    q: Float[np.ndarray, "N nq"],
    window: int,
    every: int,
) -> Float[np.ndarray, "N nq"]:
    return put_on_base(robot, q, base[::every], frame, window)


def _locked(whole: Robot, model: Robot, contacts: Sequence[Contact]) -> list[str]:
    """What is said of joints that the log has not."""
    locked = [name for name in whole.joint_names if name not in model.joint_names]
    if not locked:
        return []
    legs = {
        str(whole.model.names[j])
        for contact in contacts
        for j in whole.limb(contact.on(whole).joint)
    }
    missing = [name for name in locked if name in legs]
    if missing:
        raise InvalidInputError(
            f"the log lacks {', '.join(missing)}, in a leg. Map every joint between the base and "
            "the contacts."
        )
    return [f"joints that the log has not, locked at zero: {first_few(locked, 8)}"]


def _motion(
    log: Log,
    robot: Robot,
    stand: Stand,
    known: Bool[np.ndarray, " N"],
) -> tuple[LogMotion, float]:
    """The motion, smoothed as its sway allows, and the sway's frequency [Hz]; NaN without."""
    rows = joint_rows(log, robot)
    # A look at the sway, without smoothing, says how much smoothing it bears: at the middle of a
    # long log, for rows too far apart show a sway that is slower than it is.
    every = max(1, min(len(rows) // 1000, int(_LOOK / log.step)))
    begin = max(0, (len(rows[::every]) - _LOOKED) // 2)
    middle = slice(begin, begin + _LOOKED)
    com = com_rows(robot, stand(rows[::every].copy(), 1, every)[middle])
    frequency = math.nan
    if np.ptp(com[:, :2], axis=0).max() > STILL and len(com) >= LEAST:
        axis = int(np.argmax(np.ptp(com[:, :2], axis=0)))
        frequency = find_sway(log.times[::every][middle], com[:, axis]).frequency
    samples = min(smoothing_window(frequency, log.step), max(5, (len(rows) - 3) // 2 * 2 + 1))
    motion = smooth_motion(robot, rows, samples, log.step, stand, known)
    return motion, frequency


def _compared(
    log: Log,
    robot: Robot,
    contacts: Sequence[Contact],
    motion: LogMotion,
    wrenches: Float[np.ndarray, "N nc 6"],
    postures: int,
    frequency: float,
    notes: list[str],
) -> Int[np.ndarray, " M"]:
    """Rows on which all feet are loaded and everything needed was measured.

    Raises:
        InvalidInputError: there is none.
    """
    normal = wrenches[:, :, 2]
    loaded = (np.nan_to_num(normal, nan=-1.0) > 0.01 * robot.weight).all(axis=1)
    rows = np.flatnonzero(motion.known & loaded)
    if len(rows) < 2:
        best = {
            c.name: int((normal[:, k] > 0.01 * robot.weight).sum()) for k, c in enumerate(contacts)
        }
        told = ", ".join(f"{name} at {count}" for name, count in best.items())
        raise InvalidInputError(
            f"no row of {log.source} has every foot on the ground and all joints measured; of "
            f"{len(log.times)} rows each foot is loaded: {told}. Name the contacts that stood, or "
            "check signs and sensors."
        )
    if len(rows) > postures:
        every, whole = -(-len(rows) // postures), len(rows)
        finest = every if math.isnan(frequency) else max(1, int(_OF_SWAY / frequency / log.step))
        if every > finest:
            every, rows = finest, rows[: postures * finest]
        notes.append(
            f"one in {every} of {len(rows)} rows was evaluated"
            + (
                f", the first of {whole}: rows farther apart would not show a sway of "
                f"{frequency:.3g} Hz. More are evaluated with postures= (--postures)"
                if len(rows) < whole
                else ""
            )
        )
        rows = rows[::every]
    return rows


def _torques(
    log: Log, robot: Robot, rows: Int[np.ndarray, " M"]
) -> Float[np.ndarray, "M n"] | None:
    """Measured torques in the order of the robot's motors, NaN where a motor has none."""
    if log.torques is None:
        return None
    found = np.full((len(rows), len(robot.torque_names)), np.nan)
    for k, name in enumerate(robot.torque_names):
        if name in log.joint_names:
            found[:, k] = log.torques[rows, log.joint_names.index(name)]
    return found
