"""compare_log: a log beside every criterion at the recorded postures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float, Int

from copsense.arrays import check_type, finite_number, whole_number
from copsense.contact import Contact
from copsense.content import ShortRepr, freeze
from copsense.criterion import Criterion, minimum_torque, minimum_wrench
from copsense.errors import InvalidInputError
from copsense.logs.finding import Finding
from copsense.logs.ground_wrenches import ground_wrenches
from copsense.logs.log import Log
from copsense.logs.log_audit import (
    audit_com,
    audit_feet,
    audit_forces,
    audit_middle,
    audit_slope,
    check_encoders,
    check_joints,
)
from copsense.logs.log_comparison import MEASURED, LogComparison
from copsense.logs.log_motion import (
    LogMotion,
    Stand,
    joint_rows,
    put_on_base,
    smooth_motion,
    smoothing_window,
    stand_on_feet,
)
from copsense.logs.log_statics import LogStatics, load_shares, loaded_cops, log_statics
from copsense.logs.sway_fit import SlopeEstimate, Sway, find_sway, fit_sway
from copsense.robot import Robot
from copsense.robots import PRESETS, load_robot, load_stance
from copsense.stance import Stance
from copsense.statics import named_criteria

SKIPPED = 3.0  # s at the beginning that are left out of the slopes
POSTURES = 5000  # that are evaluated at most
_LEAST = 20  # rows from which slopes are fitted
_STILL = 1e-3  # m of travel under which nothing sways


def compare_log(
    log: Log,
    robot: str | Path | Robot | Stance,
    criteria: Sequence[Criterion] | None = None,
    *,
    contacts: Sequence[str | Contact] | None = None,
    base: Literal["feet", "recorded"] = "feet",
    skip: float = SKIPPED,
    postures: int = POSTURES,
    advance: Callable[[int], object] = lambda _: None,
) -> LogComparison:
    """What a log measured beside what every criterion says at its postures.

    The base stands on the first contact (``"feet"``), or is where the log has it: encoders know
    where one foot is from the other to a millimetre, while a base by motion capture is often tilted
    by a degree. Joints that the log has not are locked at zero.

    Args:
        log: what `read_log` returned.
        robot: a preset's name, a URDF, MJCF or SDF, a `Robot`, or a stance with the contacts.
        criteria: default `minimum_torque()` and `minimum_wrench(1.0)`.
        contacts: default those of the stance or preset, or the frames that the sensors serve.
        base: what puts the base in place.
        skip: the log's beginning that is left out of the slopes [s].
        postures: how many rows are evaluated at most, evenly chosen.
        advance: called with the number of postures done, for a progress bar.

    Raises:
        UnknownNameError: the robot lacks a joint, or the frame of a sensor.
        InvalidInputError: positions in degrees, a foot without a sensor, no row on which all feet
            are loaded, or no base recorded.
    """
    check_type(log, Log, "a log", "Give what copsense.logs.read_log returns.")
    skip = finite_number(skip, "the beginning of a log to skip [s]")
    postures = whole_number(postures, "the number of postures of a log", least=_LEAST)
    chosen = (minimum_torque(), minimum_wrench(1.0)) if criteria is None else tuple(criteria)
    named_criteria(chosen, "the comparison of a log", policies=False)
    aligned = align_log(log, robot, contacts=contacts, base=base, postures=postures)
    model, feet, motion, rows = aligned.robot, aligned.contacts, aligned.motion, aligned.rows
    findings, notes, wrenches = [*aligned.findings], [*aligned.notes], aligned.wrenches
    statics = log_statics(model, feet, chosen, motion, rows, advance)
    com = _com(model, motion.configurations[rows])
    placed = Stance(model, motion.configurations[rows[len(rows) // 2]], tuple(feet), check=False)
    travel, distance = _travel(placed, com)
    measured, times, window = wrenches[rows], log.times[rows], motion.window
    sway, slopes = _slopes(times, travel, distance, measured, statics, feet, skip, notes)
    findings += _audit_slopes(feet, slopes)
    findings += audit_com(com[:, :2], _total_cop(placed, measured))
    notes.append(
        f"joints smoothed by a Savitzky-Golay filter of {window:.3g} s (cubic); accelerations are "
        "its derivative of the velocity"
    )
    return LogComparison(
        log,
        model.name,
        model.weight,
        tuple(c.name for c in feet),
        model.torque_names,
        base,
        window,
        times,
        com,
        travel,
        distance,
        measured,
        aligned.torques,
        statics,
        sway,
        slopes,
        skip,
        tuple(findings),
        tuple(notes),
    )


@dataclass(frozen=True, eq=False, repr=False)
class AlignedLog(ShortRepr):
    """A log with its robot on its feet, and the rows on which everything needed was measured.

    Attributes:
        robot: without the joints that the log lacks.
        contacts: in order.
        motion: of every row of the log (N).
        rows: those that are used (M,).
        wrenches: of the ground on each contact at every row (N, nc, 6); NaN where not measured.
        torques: of the motors at the rows that are used (M, n) [Nm]; None where there are none.
        findings: what is missing or does not fit.
        notes: how it was done.
    """

    robot: Robot
    contacts: tuple[Contact, ...]
    motion: LogMotion
    rows: Int[np.ndarray, " M"]
    wrenches: Float[np.ndarray, "N nc 6"]
    torques: Float[np.ndarray, "M n"] | None
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        """Own the arrays."""
        freeze(self, "rows", "wrenches", "torques")


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
    findings = [*log.findings, *check_joints(log, model)]
    whole, model = model, model.keeping(log.joint_names)
    notes = [*log.notes, *_locked(whole, model, feet)]
    findings += check_encoders(log, model, feet)
    known = np.isfinite(log.positions).all(axis=1)
    if base == "recorded":
        if log.base is None:
            raise InvalidInputError(
                f"{log.source} has no base pose. Leave the base to the feet (base='feet')."
            )
        stand = partial(_recorded, model, log.base, log.base_frame)
        known &= np.isfinite(log.base).all(axis=1)
    elif base == "feet":
        stand = partial(_on_feet, model, feet)
    else:
        raise InvalidInputError(f"the base is {base!r}. Give 'feet' or 'recorded'.")
    motion, _ = _motion(log, model, stand, known)
    wrenches = ground_wrenches(log, model, feet, motion, base == "recorded")
    findings += audit_forces(log, model, feet, wrenches[:, :, 2])
    findings += audit_feet(log, model, feet, motion)
    rows = _compared(log, model, feet, motion, wrenches, postures, notes)
    torques = _torques(log, model, rows)
    return AlignedLog(
        model, tuple(feet), motion, rows, wrenches, torques, tuple(findings), tuple(notes)
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
    if isinstance(source, str) and (source in PRESETS or source.endswith(".toml")):
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
        for j in whole.model.supports[contact.on(whole).joint]
    }
    missing = [name for name in locked if name in legs]
    if missing:
        raise InvalidInputError(
            f"the log lacks {', '.join(missing)}, in a leg. Map every joint between the base and "
            "the contacts."
        )
    shown = ", ".join(locked[:8]) + (f" and {len(locked) - 8} more" if len(locked) > 8 else "")
    return [f"joints that the log has not, locked at zero: {shown}"]


def _motion(
    log: Log,
    robot: Robot,
    stand: Stand,
    known: Bool[np.ndarray, " N"],
) -> tuple[LogMotion, float]:
    """The motion, smoothed as its sway allows, and the filter's length [s]."""
    rows = joint_rows(log, robot)
    # A look at the sway, without smoothing, says how much smoothing it bears.
    every = max(1, len(rows) // 1000)
    com = _com(robot, stand(rows[::every].copy(), 1, every))
    frequency = math.nan
    if np.ptp(com[:, :2], axis=0).max() > _STILL and len(com) >= _LEAST:
        axis = int(np.argmax(np.ptp(com[:, :2], axis=0)))
        frequency = find_sway(log.times[::every], com[:, axis]).frequency
    samples = min(smoothing_window(frequency, log.step), max(5, (len(rows) - 3) // 2 * 2 + 1))
    motion = smooth_motion(robot, rows, samples, log.step, stand, known)
    return motion, motion.window


def _compared(
    log: Log,
    robot: Robot,
    contacts: Sequence[Contact],
    motion: LogMotion,
    wrenches: Float[np.ndarray, "N nc 6"],
    postures: int,
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
        every = -(-len(rows) // postures)
        notes.append(f"every {every}th of {len(rows)} rows was evaluated")
        rows = rows[::every]
    return rows


def _com(robot: Robot, q: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N 3"]:
    data = robot.model.createData()
    return np.array([pin.centerOfMass(robot.model, data, row) for row in q])


def _travel(stance: Stance, com: Float[np.ndarray, "M 3"]) -> tuple[np.ndarray, float | None]:
    """CoM along the line from the last to the first of two feet, and the line's length."""
    ground = com[:, :2]
    if len(stance.contacts) == 2:
        first, last = (p.translation[:2] for p in stance.placements)
        line = first - last
        length = float(np.linalg.norm(line))
        if length > 1e-3:
            return (ground - (first + last) / 2) @ (line / length), length
    centred = ground - ground.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    if direction[int(np.argmax(np.abs(direction)))] < 0:
        direction = -direction
    return np.asarray(centred @ direction), None


def _total_cop(stance: Stance, wrenches: Float[np.ndarray, "M nc 6"]) -> Float[np.ndarray, "M 2"]:
    """Total centre of pressure on the ground, z = 0; NaN where moments were not measured."""
    force, moment = np.zeros((len(wrenches), 3)), np.zeros((len(wrenches), 3))
    for k, place in enumerate(stance.placements):
        f = wrenches[:, k, :3] @ place.rotation.T
        force += f
        moment += wrenches[:, k, 3:] @ place.rotation.T + np.cross(place.translation, f)
    return np.column_stack([-moment[:, 1], moment[:, 0]]) / force[:, 2:]


def _slopes(
    times: np.ndarray,
    travel: np.ndarray,
    distance: float | None,
    measured: np.ndarray,
    statics: Sequence[LogStatics],
    contacts: Sequence[Contact],
    skip: float,
    notes: list[str],
) -> tuple[Sway | None, dict[str, dict[str, SlopeEstimate]]]:
    late = times >= skip
    if late.sum() < _LEAST:
        notes.append(f"fewer than {_LEAST} rows after {skip:g} s: no slopes")
        return None, {}
    if np.ptp(travel[late]) < _STILL:
        notes.append("the centre of mass moves less than 1 mm: no slopes")
        return None, {}
    sway = find_sway(times[late], travel[late])
    sources = {MEASURED: measured} | {s.name: s.wrenches for s in statics}
    slopes: dict[str, dict[str, SlopeEstimate]] = {}

    def fit(output: str, source: str, values: np.ndarray, scale: float) -> None:
        known = late & np.isfinite(values)
        if known.sum() >= _LEAST:
            found = fit_sway(sway, times[known], travel[known], values[known], scale)
            slopes.setdefault(output, {})[source] = found

    for source, wrenches in sources.items():
        if distance is not None:
            fit("load", source, load_shares(wrenches)[:, 0], distance)
    for k, contact in enumerate(contacts):
        for axis, letter in enumerate("xy"):
            for source, wrenches in sources.items():
                if contact.kind != "point":
                    values = loaded_cops(wrenches)[:, k, axis]
                    fit(f"CoP {letter} of {contact.name}", source, values, 1.0)
    return sway, slopes


def _audit_slopes(
    contacts: Sequence[Contact], slopes: dict[str, dict[str, SlopeEstimate]]
) -> list[Finding]:
    load = slopes.get("load", {})
    if MEASURED not in load:
        return []
    names, measured = [c.name for c in contacts], load[MEASURED]
    others = {name: s for name, s in load.items() if name != MEASURED}
    middles = {name: s.middle for name, s in others.items()}
    return [
        *audit_middle(names, measured.middle, middles),
        *audit_slope(names, measured, list(others.values())),
    ]


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
